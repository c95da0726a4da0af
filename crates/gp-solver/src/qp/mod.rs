//! Convex quadratic programs: dense with any constraints, sparse with bounds, with equalities, with
//! inequalities, and with some unknowns that are whole numbers.

#[cfg(feature = "sparse")]
mod bounded;
mod dense;
mod form;
#[cfg(feature = "sparse")]
mod interior;
#[cfg(feature = "sparse")]
mod lattice;
#[cfg(feature = "sparse")]
mod mixed;
#[cfg(feature = "sparse")]
mod sparse;

#[cfg(feature = "sparse")]
pub use bounded::BoundedQp;
pub use dense::DenseQp;
pub use form::{LinearEquation, QuadraticForm, QuadraticTerm};
#[cfg(feature = "sparse")]
pub use interior::InequalityQp;
#[cfg(feature = "sparse")]
pub use lattice::LatticeQp;
#[cfg(feature = "sparse")]
pub use mixed::{Eliminated, MixedQp};
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
