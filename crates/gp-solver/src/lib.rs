//! Sparse nonlinear least squares and the other optimisers the methods of the workspace stand on.

mod error;
mod least_squares;
mod linear;
mod options;
mod problem;
mod quadratic;
mod report;

pub use error::SolverError;
pub use least_squares::{Iteration, StepModel, System, solve, solve_observed, solve_system};
pub use linear::{BandCholesky, SparseCholesky, SymmetricPattern};
pub use options::{Factorization, Method, Options};
pub use problem::{Elements, EnergyBlock, Problem, Quantity, ResidualBlock};
pub use quadratic::{QuadraticBuilder, QuadraticConstraints};
pub use report::{IterationRecord, Report, Status, Term, Timings};
