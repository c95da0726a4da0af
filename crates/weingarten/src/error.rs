//! Why an optimisation cannot be attempted.

use bspline::{FitError, KnotError, SplineError};
use geom_core::NormalizationError;
use gp_solver::SolverError;

/// What makes it impossible to attempt an optimisation. Not converging is a status, not an error.
///
/// # Example
/// ```
/// use weingarten::{Options, solve};
/// let roof = fixtures::surfaces::Shape::Roof.surface(8, 7, 4, 4);
/// let options = Options { closeness: -1.0, ..Options::default() };
/// let error = solve(&roof, &options, &mut ()).unwrap_err();
/// assert_eq!(error.to_string(), "`closeness` is -1; it must be zero or more");
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum Error {
    /// A pole, a cusp or a collapsed edge.
    #[error(
        "the surface is pinched at u = {u}, v = {v}: its tangents vanish or are parallel there; \
         cut the pole off or spread the control points that coincide"
    )]
    Singular { u: f64, v: f64 },
    /// No extent, too much of it, or too far away.
    #[error(transparent)]
    Size(#[from] NormalizationError),
    /// Not enough samples to see the surface.
    #[error("{found} samples in {direction} are too few; ask for at least {needed}")]
    TooFewSamples { direction: &'static str, found: usize, needed: usize },
    /// A trim without a sample in it.
    #[error("no sample lies within the trim of the surface; ask for more `samples`")]
    NothingInside,
    /// More samples or control points than could ever be wanted.
    #[error("{count} {what} are more than the {limit} that are supported; ask for fewer")]
    TooMany { what: &'static str, count: usize, limit: usize },
    /// A weight or coefficient that makes no sense.
    #[error("`{name}` is {value}; it must be {need}")]
    BadOption { name: &'static str, value: f64, need: &'static str },
    /// A relation that cannot be set up.
    #[error("the curve of `relation` has {found} control points; give at least 2")]
    ShortCurve { found: usize },
    /// A control point to move that is not there.
    #[error("control point ({i}, {j}) cannot be moved: the net has {n_u} x {n_v}, counted from 0")]
    NoSuchControlPoint { i: usize, j: usize, n_u: usize, n_v: usize },
    /// Border control that needs the border control points to lie on the border.
    #[error(
        "the knots in {direction} are not clamped, so border control points do not lie on the \
         border; refit with levels, or leave the border free"
    )]
    NotClamped { direction: &'static str },
    /// A start that cannot be compared with the surface.
    #[error(
        "the surface to start from has another domain, or is closed otherwise, than the surface; give a result made from this surface"
    )]
    OtherDomain,
    /// A combination that does not exist.
    #[error("{what} needs the reduced formulation; leave `formulation` at reduced")]
    NeedsReduced { what: &'static str },
    /// A level that cannot be fitted.
    #[error("level {level}: {source}")]
    Level { level: String, source: FitError },
    /// A level with too few control points.
    #[error("level {level}: {source}")]
    LevelKnots { level: String, source: KnotError },
    /// A surface that is no surface.
    #[error(transparent)]
    Spline(#[from] SplineError),
    /// From the solver.
    #[error(transparent)]
    Solver(#[from] SolverError),
}
