//! Convex quadratic programs: dense with any constraints, sparse with bounds, sparse with equalities.

#[cfg(feature = "sparse")]
mod bounded;
mod dense;
mod form;
#[cfg(feature = "sparse")]
mod sparse;

#[cfg(feature = "sparse")]
pub use bounded::BoundedQp;
pub use dense::DenseQp;
pub use form::{LinearEquation, QuadraticForm, QuadraticTerm};
#[cfg(feature = "sparse")]
pub use sparse::SparseQp;

use crate::report::Status;

/// Solution of a quadratic program.
#[derive(Clone, Debug, PartialEq)]
pub struct QpSolution {
    /// `Converged`, `Infeasible` or `IterationLimit`.
    pub status: Status,
    /// The minimiser (the last iterate if the program is infeasible).
    pub x: Vec<f64>,
    /// `½ xᵀQ x + cᵀx`.
    pub objective: f64,
    /// Multipliers: equalities first, then inequalities and bounds (`≥ 0`).
    pub multipliers: Vec<f64>,
    /// Largest violation of a constraint, in its own units.
    pub violation: f64,
    /// Active-set changes or multiplier steps.
    pub iterations: usize,
}
