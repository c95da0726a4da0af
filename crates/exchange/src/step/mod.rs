//! STEP (ISO 10303-21, application protocols 214 and 242): B-spline surfaces.

mod border;
mod face;
mod file;
mod parse;
mod read;
mod text;
mod write;

pub use read::read_step;
pub use write::write_step;
