//! What is given: corners with tangents and curvatures, nets of curves made from them, from meshes
//! and from polylines, and the tangent planes at the vertices of a net.

pub(crate) mod corners;
pub(crate) mod net;
pub(crate) mod polylines;
pub(crate) mod vertex;
