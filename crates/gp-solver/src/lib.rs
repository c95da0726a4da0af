//! Sparse nonlinear least squares and the other optimisers the methods of the workspace stand on.

mod check;
mod damping;
mod error;
mod lbfgs;
mod least_squares;
mod line_search;
mod linear;
mod min_norm;
mod options;
mod problem;
mod qp;
mod quadratic;
mod report;

pub use check::{DerivativeCheck, check_gradient, check_jacobian};
pub use damping::DampingRule;
pub use error::SolverError;
pub use lbfgs::{Euclidean, LbfgsIteration, LbfgsOptions, LbfgsReport, Metric, Objective, lbfgs};
pub use least_squares::{
    Checkpoint, Iteration, StepModel, System, resume_system, solve, solve_observed, solve_system,
};
pub use line_search::LineSearch;
pub use linear::{BandCholesky, SparseCholesky, SymmetricPattern};
pub use min_norm::{MinNormProjection, ProjectionOptions, ProjectionReport};
pub use options::{Factorization, Method, Options};
pub use problem::{Elements, EnergyBlock, Problem, Quantity, ResidualBlock};
pub use qp::{DenseQp, QpSolution, SparseEqualityQp};
pub use quadratic::{QuadraticBuilder, QuadraticConstraints};
pub use report::{IterationRecord, Report, Status, Term, Timings};
