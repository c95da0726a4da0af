//! STEP (ISO 10303-21, application protocols 214 and 242): B-spline surfaces.

mod border;
mod write;

pub use write::write_step;
