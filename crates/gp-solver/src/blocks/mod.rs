//! Blocks that any problem can use.

mod closeness;
mod dual;
mod numeric;

pub use closeness::Closeness;
pub use dual::{DualBlock, ElementFunction};
pub use numeric::NumericBlock;
