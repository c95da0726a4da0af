//! Binary glTF 2.0.

mod write;

pub use write::write_glb;
