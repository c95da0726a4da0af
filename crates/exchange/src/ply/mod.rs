//! PLY, ASCII and binary: polygons, edges, normals, colours and numbers per vertex and face.

mod header;
mod read;
mod write;

pub use read::read_ply;
pub use write::write_ply;
