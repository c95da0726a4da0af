//! What is given: polygons over the unit square, and the panels they cut from a surface.

pub(crate) mod panels;
pub(crate) mod polygon;
pub(crate) mod tiling;
