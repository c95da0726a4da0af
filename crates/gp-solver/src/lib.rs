//! Sparse nonlinear least squares and the other optimisers the methods of the workspace stand on.
//!
//! A [`Problem`] is a vector of unknowns and blocks: [`ResidualBlock`]s (rows that share their
//! unknowns come as [`Elements`]; [`Closeness`] is ready made), [`EnergyBlock`]s, and
//! [`QuadraticConstraints`] from coefficient triplets. [`solve`] minimises it by Levenberg-Marquardt or undamped guided projection
//! ([`Options`]); the [`Report`] names the energy of every term at every iteration. Patterns,
//! ordering and scatter are planned once per topology; the normal equations go to
//! [`BandCholesky`] or [`SparseCholesky`], whichever the structure makes cheaper. Results do not
//! depend on the number of threads, bit for bit.
//!
//! Besides: [`lbfgs`] with a [`Metric`], [`DenseQp`],
//! [`MinNormProjection`] onto constraints, and [`check_jacobian`] for a block of one's own.
//!
//! # Example
//! A circle through noisy points, each of which is one quadratic equation
//! `(p − a)² + (q − b)² = r²` in the unknowns `a, b, r`:
//! ```
//! use gp_solver::{Options, Problem, QuadraticBuilder, Status, solve};
//!
//! let mut circle = QuadraticBuilder::new("circle");
//! for k in 0..20 {
//!     let angle = 0.3 * f64::from(k);
//!     let noise = 1e-3 * (7.0 * angle).sin();
//!     let (p, q) = (2.0 + (3.0 + noise) * angle.cos(), 1.0 + (3.0 + noise) * angle.sin());
//!     let row = circle.equation(1.0);
//!     row.product(0, 0, 1.0).product(1, 1, 1.0).product(2, 2, -1.0);
//!     row.linear(0, -2.0 * p).linear(1, -2.0 * q).constant(p * p + q * q);
//! }
//! let mut problem = Problem::new(3);
//! problem.add(circle.build());
//! let mut x = [0.0, 0.0, 1.0];
//! let report = solve(problem, &mut x, &Options::default())?;
//! assert_eq!(report.status, Status::Converged);
//! assert!((x[0] - 2.0).abs() < 1e-3 && (x[1] - 1.0).abs() < 1e-3);
//! assert!((x[2].abs() - 3.0).abs() < 1e-3);
//! # Ok::<(), gp_solver::SolverError>(())
//! ```

mod block;
mod blocks;
mod check;
mod checkpoint;
mod clock;
mod damping;
mod elements;
mod error;
mod fields;
mod lbfgs;
mod least_squares;
mod line_search;
mod linear;
#[cfg(feature = "sparse")]
mod min_norm;
mod observer;
mod options;
mod problem;
mod qp;
mod quadratic;
mod report;
mod rows;
mod schedule;
mod trust_region;
mod variables;

pub use block::{EnergyBlock, ResidualBlock};
pub use blocks::{Closeness, DualBlock, ElementFunction, NumericBlock};
pub use check::{DerivativeCheck, check_gradient, check_jacobian};
pub use checkpoint::{Checkpoint, Fingerprint};
pub use damping::DampingRule;
pub use elements::Elements;
pub use error::{Quantity, SolverError};
pub use fields::{Counts, Field, Fields, List, ListItem, OptionValue};
pub use lbfgs::{Euclidean, LbfgsOptions, Metric, Objective, lbfgs};
pub use least_squares::{Run, Step, StepModel, System, Triplets, solve, solve_observed};
pub use line_search::LineSearch;
pub use linear::{BandCholesky, SymmetricPattern};
#[cfg(feature = "sparse")]
pub use linear::{MultifrontalCholesky, SparseCholesky};
#[cfg(feature = "sparse")]
pub use min_norm::{MinNormProjection, ProjectionOptions};
pub use observer::{Observer, Progress};
pub use options::{Factorization, Method, Options, Regularization};
pub use problem::{BlockId, Problem};
pub use qp::{DenseQp, QpSolution};
pub use quadratic::{Equation, QuadraticBuilder, QuadraticConstraints};
pub use report::{IterationRecord, Report, Status, Term, Timings};
pub use rows::Rows;
pub use schedule::{Extra, RunReport, Stage, StageReport};
pub use trust_region::{Accepted, Attempt, DampedModel, DampingPolicy, Verdict, damped_step};
pub use variables::{Group, Variables};
