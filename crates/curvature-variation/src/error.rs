//! Why a surface cannot be faired.

use geom_core::{MeshError, NormalizationError};
use gp_solver::SolverError;
use subdiv_catmull_clark::SubdivisionError;

/// Why a surface cannot be faired. Ending early is not an error but a
/// [`Status`](gp_solver::Status) of the report.
///
/// # Example
/// ```
/// use curvature_variation::{Error, Input, Options, solve};
/// use geom_core::{DVec3, PolyMesh};
/// let corners = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
/// let tetrahedron = PolyMesh::new(corners, &[[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])?;
/// let error = solve(&tetrahedron.into(), &Options::default(), &mut ()).unwrap_err();
/// assert_eq!(error, Error::Triangles { faces: 4 });
/// # Ok::<(), geom_core::MeshError>(())
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum Error {
    /// A setting outside its range.
    #[error("`{name}` is {value}; it must be {need}")]
    BadOption { name: &'static str, value: f64, need: &'static str },
    /// A mesh of triangles has an extraordinary vertex everywhere.
    #[error(
        "all {faces} faces are triangles; turn the mesh into quads first, or start from a coarse quad mesh of the same topology"
    )]
    Triangles { faces: usize },
    /// A vertex without faces.
    #[error("vertex {vertex} belongs to no face; remove it")]
    IsolatedVertex { vertex: usize },
    /// Several surfaces at once.
    #[error("the mesh has {components} separate parts; fair each of them on its own")]
    Disconnected { components: usize },
    /// No unknown is left.
    #[error("all {vertices} vertices are fixed; free some of them")]
    NothingFree { vertices: usize },
    /// A constraint on a vertex that is not there.
    #[error("constraints name vertex {vertex}, but there are only {count}")]
    NoSuchVertex { vertex: usize, count: usize },
    /// Nothing keeps the size.
    #[error(
        "{energy} changes with the size of the surface, which is free: it would shrink to a point or grow for ever; fix some vertices or limit points, or use scale-invariant terms alone"
    )]
    ScaleFree { energy: String },
    /// A weight of a pulled limit point.
    #[error("vertex {vertex} is pulled with weight {weight}; give a number from 0 up")]
    Weight { vertex: u32, weight: f64 },
    /// An empty sum.
    #[error("the energy has no term with a weight other than zero")]
    NoEnergy,
    /// A start that has no curvature.
    #[error("the energy is not finite at the start; the control mesh has folds or collapsed faces")]
    Singular,
    /// Negative weights won.
    #[error(
        "{energy} has no minimum: it fell to {value:.1e} and the surface tore; raise the negative weights"
    )]
    Unbounded { energy: String, value: f64 },
    /// The Hessian is no longer finite.
    #[error(
        "{energy} has no minimum here: the surface tore while it was minimised; add bending or fix more vertices"
    )]
    Torn { energy: String },
    /// More vertices than memory.
    #[error(
        "`levels` is {levels}, which makes about {vertices} vertices; at most {limit} are supported"
    )]
    TooManyLevels { levels: usize, vertices: usize, limit: usize },
    /// A member of a family of another connectivity.
    #[error("mesh {member} of the family has other faces than the input; move its vertices only")]
    OtherFaces { member: usize },
    /// A family with constraints.
    #[error(
        "a family of meshes leaves no vertex to fix; drop the constraints, the creases and \
         `clamp_boundary`, or the family"
    )]
    HeldFamily,
    /// The mesh cannot be refined.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// The surface cannot be evaluated.
    #[error(transparent)]
    Subdivision(#[from] SubdivisionError),
    /// The mesh has no size, or stands too far away.
    #[error(transparent)]
    Normalization(#[from] NormalizationError),
    /// The solver refuses.
    #[error(transparent)]
    Solver(#[from] SolverError),
}
