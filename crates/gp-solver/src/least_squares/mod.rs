//! Nonlinear least squares: Levenberg-Marquardt, guided projection, Gauss-Newton.

mod finite;
mod gram;
mod inspect;
mod levenberg;
mod normal;
mod run;
mod system;
mod vectors;

pub use inspect::Triplets;
pub use run::{Run, Step, solve, solve_observed};
pub use system::{StepModel, System};
