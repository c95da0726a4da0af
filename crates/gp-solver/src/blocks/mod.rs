//! Blocks that any problem can use.

mod closeness;
mod numeric;

pub use closeness::Closeness;
pub use numeric::NumericBlock;
