//! What is refused, and why.

use geom_core::{MeshError, PolyMesh};

/// The most edges at a vertex whose surroundings are evaluated; tested against refinement up to
/// here.
pub const MAX_VALENCE: usize = 200;

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
    /// More edges at a vertex than [`MAX_VALENCE`].
    #[error(
        "vertex {vertex} has {valence} edges and the surface is evaluated to {MAX_VALENCE}: nearer to such a vertex than the width of a sector nothing is resolved; remesh around it"
    )]
    Valence { vertex: usize, valence: usize },
    /// A face with more corners than [`MAX_VALENCE`]: its centre becomes a vertex of that valence.
    #[error(
        "face {face} has {corners} corners, which refinement turns into a vertex with as many edges, and the surface is evaluated to {MAX_VALENCE}; cut the face into quads"
    )]
    Corners { face: usize, corners: usize },
    /// Every new point next to a face depends on all its corners.
    #[error(
        "face {face} has {corners} corners; one refinement would need {weights} weights, and {most} are the limit; cut the face into quads"
    )]
    TooManyWeights { face: usize, corners: usize, weights: usize, most: usize },
    /// The result would not be a mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The mesh around a face overlaps itself.
    #[error("the faces around face {face} overlap one another; refine the mesh once more")]
    Overlapping { face: usize },
}

/// Refuses vertices with more edges, and faces with more corners, than [`MAX_VALENCE`].
///
/// # Errors
/// [`SubdivisionError::Corners`] or [`SubdivisionError::Valence`] for the first one.
pub fn check_valences(mesh: &PolyMesh) -> Result<(), SubdivisionError> {
    if let Some(f) = mesh.faces().find(|&f| mesh.face_degree(f) > MAX_VALENCE) {
        let corners = mesh.face_degree(f);
        return Err(SubdivisionError::Corners { face: f.index(), corners });
    }
    // Counted in one sweep: walking around a vertex of a thousand edges takes a thousand steps.
    let mut edges = vec![0_usize; mesh.vertex_count()];
    for h in mesh.edges() {
        edges[mesh.origin(h).index()] += 1;
        edges[mesh.target(h).index()] += 1;
    }
    match edges.iter().position(|&valence| valence > MAX_VALENCE) {
        Some(vertex) => Err(SubdivisionError::Valence { vertex, valence: edges[vertex] }),
        None => Ok(()),
    }
}
