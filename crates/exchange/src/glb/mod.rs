//! Binary glTF 2.0.

mod accessor;
mod prescan;
mod read;
mod write;

pub use read::read_glb;
pub use write::write_glb;
