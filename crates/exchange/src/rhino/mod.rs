//! Rhino's `.3dm`: chunks of openNURBS with tables of layers and objects in them.

mod brep_read;
mod brep_write;
mod budget;
mod chunks;
mod codes;
mod cursor;
mod curve_read;
mod lost;
mod mesh_read;
mod mesh_write;
mod read;
mod spline_write;
mod surface_read;
mod write;

pub use read::read_3dm;
pub use write::write_3dm;
