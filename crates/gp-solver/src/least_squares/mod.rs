//! Nonlinear least squares: Levenberg-Marquardt and guided projection.

mod gram;
mod normal;
mod solve;
mod system;

pub use solve::{Checkpoint, Iteration, resume_system, solve, solve_observed, solve_system};
pub use system::{StepModel, System};
