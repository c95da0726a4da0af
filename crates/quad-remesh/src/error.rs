//! What this crate refuses to work on.

use gp_solver::SolverError;

/// Why a surface has no net, or none was found.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum Error {
    /// No extent, too much of it, or too far away.
    #[error(transparent)]
    Size(#[from] geom_core::NormalizationError),
    /// A NaN or an infinity among the coordinates.
    #[error("vertex {vertex} is not finite; give every vertex three finite coordinates")]
    NotFinite { vertex: usize },
    /// A face names a vertex that is not there.
    #[error("a face names vertex {vertex}, but there are only {count}")]
    NoSuchVertex { vertex: usize, count: usize },
    /// No face with an area.
    #[error("the mesh has no face with an area; give it triangles or polygons")]
    NoFace,
    /// A Möbius strip or the like.
    #[error(
        "the surface has only one side (found at edge {from}–{to}); cut it along a mesh line first"
    )]
    OneSided { from: usize, to: usize },
    /// Curvatures are not determined.
    #[error(
        "the {triangles} triangles are too few to tell the curvature of the surface; give a finer mesh"
    )]
    TooCoarse { triangles: usize },
    /// Too little of the surface is negatively curved.
    #[error(
        "only {percent:.0} % of the surface has negative Gaussian curvature and {needed:.0} % are needed; asymptotic lines exist only there: trim the rest away"
    )]
    NotNegativelyCurved { percent: f64, needed: f64 },
    /// A closed loop of the field or the topology asks for what whole numbers cannot give.
    #[error(
        "the net's families do not close up around some loop of the surface; cut the mesh along a line that crosses the loop"
    )]
    DoesNotClose,
    /// The lines of the net would cross themselves.
    #[error(
        "no net without folds was found with edges of {edge_length:.4} (near ({x:.4}, {y:.4}, {z:.4}) first): set `edge_length` to {suggestion:.4} or less, or trim the surface there"
    )]
    Folds { edge_length: f64, x: f64, y: f64, z: f64, suggestion: f64 },
    /// No cell of the net lies inside.
    #[error(
        "no cell of a net with edges of {edge_length:.4} fits into the surface; set `edge_length` to {suggestion:.4} or less"
    )]
    NoCell { edge_length: f64, suggestion: f64 },
    /// A setting that makes no sense.
    #[error("`{name}` is {value}; it must be {need}")]
    BadOption { name: &'static str, value: f64, need: &'static str },
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// From the solver.
    #[error(transparent)]
    Solver(#[from] SolverError),
}
