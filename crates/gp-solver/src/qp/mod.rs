//! Convex quadratic programs.

mod dense;

pub use dense::DenseQp;

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
