//! What this crate refuses to work on.

use gp_solver::SolverError;

/// Why a rational bilinear patch was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum PatchError {
    /// A NaN or an infinity among the corners.
    #[error("corner {corner} is ({x}, {y}, {z}); corners must be finite")]
    CornerNotFinite { corner: usize, x: f64, y: f64, z: f64 },
    /// A weight that is zero, negative, infinite or NaN.
    #[error(
        "weight {corner} is {weight}; weights must be positive and finite, or the patch leaves its control quad"
    )]
    WeightNotPositive { corner: usize, weight: f64 },
    /// No tangent plane: the two rulings through the point are parallel.
    #[error(
        "the patch has no tangent plane at ({u}, {v}); its edges meet at an angle of 0 or 180 degrees there"
    )]
    Singular { u: f64, v: f64 },
}

/// Why a mesh is not a net this crate can work on, or a solve cannot be attempted. Not converging is
/// a status, not an error.
///
/// # Example
/// ```
/// use geom_core::{DVec3, PolyMesh};
/// use hyperbolic_nets::{Error, QuadNet};
/// let mesh = PolyMesh::new(vec![DVec3::ZERO, DVec3::X, DVec3::Y], &[[0, 1, 2]])?;
/// let error = QuadNet::new(&mesh).unwrap_err();
/// assert_eq!(error, Error::NotQuad { face: 0, corners: 3 });
/// assert!(error.to_string().starts_with("face 0 has 3 corners; a net needs quads"));
/// # Ok::<(), geom_core::MeshError>(())
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum Error {
    /// No extent, too much of it, or too far away.
    #[error(transparent)]
    Size(#[from] geom_core::NormalizationError),
    /// A face that is not a quad.
    #[error(
        "face {face} has {corners} corners; a net needs quads along the asymptotic directions: remesh the surface to such quads first"
    )]
    NotQuad { face: usize, corners: usize },
    /// Interior vertices with an odd number of faces, where no tangent plane can be crossed
    /// alternately (Shi et al. 2014, §2.3).
    #[error(
        "{} interior vertices have odd valence (first: vertex {} with valence {}); faces around a vertex lie alternately above and below its tangent plane, so give them even valence (flat points have 6) by remeshing there",
        .vertices.len(), .vertices[0], .valence
    )]
    OddValence { vertices: Vec<usize>, valence: usize },
    /// The two families of asymptotic curves swap along a loop of faces.
    #[error(
        "the two edge families meet each other across edge {from}–{to}: around some loop of faces they swap, which asymptotic curves never do; remesh, or cut the mesh along a line that crosses the loop"
    )]
    FamiliesSwap { from: usize, to: usize },
    /// A vertex with a star that spans no plane.
    #[error(
        "the faces around vertex {vertex} span no tangent plane (zero area); move it apart from its neighbours or drop its faces"
    )]
    NoTangentPlane { vertex: usize },
    /// An edge without length.
    #[error("edge {from}–{to} has no length; merge its ends")]
    ZeroEdge { from: usize, to: usize },
    /// The twist of the edges says that edges follow curvature lines, not asymptotic lines.
    #[error(
        "{wrong} of {edges} edges twist against their family (a net along curvature lines has about half): use the diagonals of this mesh as edges, or remesh along the asymptotic directions"
    )]
    CurvatureAligned { wrong: usize, edges: usize },
    /// Too little of the surface is negatively curved.
    #[error(
        "only {percent:.0} % of the surface has negative Gaussian curvature and {needed:.0} % are needed; ruled patches join smoothly only where it is negative: trim the rest away, or model it with a Darboux transform of another net"
    )]
    NotNegativelyCurved { percent: f64, needed: f64 },
    /// Edges too far from the asymptotic directions.
    #[error(
        "edges run {mean_deg:.1} degrees off the asymptotic directions in the mean and at most {limit_deg:.0} are allowed; remesh along the asymptotic directions"
    )]
    Misaligned { mean_deg: f64, limit_deg: f64 },
    /// Arrays of a net whose lengths do not match its mesh.
    #[error("{what}: {found} values for {needed}; give one for each")]
    WrongCount { what: &'static str, found: usize, needed: usize },
    /// A shape parameter that is zero, negative, infinite or NaN.
    #[error("face {face} has shape parameter {value}; shape parameters are positive")]
    BadShapeParameter { face: usize, value: f64 },
    /// A setting that makes no sense.
    #[error("`{name}` is {value}; it must be {need}")]
    BadOption { name: &'static str, value: f64, need: &'static str },
    /// A weight that the method asked for does not have.
    #[error(
        "`{name}` is a weight of the {method} method; leave it out or set `method` to {method}"
    )]
    OtherMethod { name: &'static str, method: &'static str },
    /// A linear system that has no solution.
    #[error(
        "the linear system of {what} could not be solved ({source}); look for faces that touch nothing else, and clean the mesh"
    )]
    Linear { what: &'static str, source: SolverError },
    /// From the solver.
    #[error(transparent)]
    Solver(#[from] SolverError),
}
