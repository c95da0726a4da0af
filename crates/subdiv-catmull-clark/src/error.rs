//! Why a control mesh cannot be evaluated.

/// Why a control mesh cannot be evaluated.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface};
/// let triangle = PolyMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], &[[0, 1, 2]])?;
/// let fault = SubdivisionSurface::new(&triangle, &Creases::none(), Blend::Smooth).unwrap_err();
/// assert_eq!(
///     fault.to_string(),
///     "face 0 has 3 corners; refine the mesh once to turn all faces into quads"
/// );
/// # Ok::<(), geom_core::MeshError>(())
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum SubdivisionError {
    /// A face that is not a quad.
    #[error("face {face} has {corners} corners; refine the mesh once to turn all faces into quads")]
    NotQuad { face: usize, corners: usize },
    /// An extraordinary vertex whose ring is not regular.
    #[error(
        "extraordinary vertex {vertex} has vertex {neighbour}, which is not regular, in its ring; refine the mesh once more"
    )]
    Crowded { vertex: usize, neighbour: usize },
    /// A vertex with two edges inside the surface.
    #[error("interior vertex {vertex} has only 2 edges; merge its two faces")]
    ValenceTwo { vertex: usize },
    /// The mesh around a face overlaps itself.
    #[error("the faces around face {face} overlap one another; refine the mesh once more")]
    Overlapping { face: usize },
}
