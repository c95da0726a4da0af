//! What a workshop needs: tables, surfaces, meshes and flat outlines.

pub(crate) mod outline;
pub(crate) mod workshop;
