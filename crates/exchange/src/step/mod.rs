//! STEP (ISO 10303-21, application protocols 203, 214 and 242): faces on surfaces.

mod border;
mod color;
mod curve;
mod face;
mod file;
mod parse;
mod placement;
mod read;
mod sew;
mod spline;
mod surface;
mod text;
mod tree;
mod units;
mod write;

pub use read::read_step;
pub use write::write_step;
