//! Quadratic constraints as sparse Jacobian triplets, and a regularised least-squares step by
//! Cholesky: everything else in this crate follows from there.
//!
//! The circle through noisy points, each of which is one equation `(p − a)² + (q − b)² = r²` in the
//! unknowns `a, b, r`, given by its coefficients:
//! ```
//! use gp_solver::{Factorization, Options, Problem, QuadraticConstraints, System, solve};
//!
//! let (mut quadratic, mut linear, mut constants) = (Vec::new(), Vec::new(), Vec::new());
//! for e in 0..20 {
//!     let angle = 0.3 * e as f64;
//!     let radius = 3.0 + 1e-3 * (7.0 * angle).sin();
//!     let (p, q) = (2.0 + radius * angle.cos(), 1.0 + radius * angle.sin());
//!     quadratic.extend([(e, 0, 0, 2.0), (e, 1, 1, 2.0), (e, 2, 2, -2.0)]);
//!     linear.extend([(e, 0, -2.0 * p), (e, 1, -2.0 * q)]);
//!     constants.push(p * p + q * q);
//! }
//! let circle = QuadraticConstraints::from_triplets("circle", &quadratic, &linear, &constants);
//!
//! // One step: (JᵀJ + ε² I) s = −Jᵀr, planned once and then repeated as often as wanted.
//! let mut x = [0.0, 0.0, 1.0];
//! let mut problem = Problem::new(3);
//! problem.add(circle.clone());
//! let mut system = System::new(problem, Factorization::Auto)?;
//! let before = system.linearize(&x)?;
//! system.projection_step(1e-3)?;
//! let mut stepped = [0.0; 3];
//! system.stepped_into(&x, &mut stepped);
//! assert!(system.energy_at(&stepped) < before);
//!
//! // Steps until nothing is left to gain.
//! let mut problem = Problem::new(3);
//! problem.add(circle);
//! solve(problem, &mut x, &Options::default())?;
//! assert!((x[0] - 2.0).abs() < 1e-3 && (x[1] - 1.0).abs() < 1e-3);
//! assert!((x[2].abs() - 3.0).abs() < 1e-3);
//! # Ok::<(), gp_solver::SolverError>(())
//! ```
//!
//! - **Variables** have names ([`Variables`]); **blocks** turn them into energy: rows of one's own
//!   ([`ResidualBlock`]), by dual numbers ([`DualBlock`]) or differences ([`NumericBlock`]),
//!   energies with their own model ([`EnergyBlock`]). Both make a [`Problem`].
//! - [`System`] is a planned problem: pattern, order, scatter and symbolic factorisation once.
//!   Blocks are weighed, replaced and given new references without a new plan.
//! - [`Run`] steps once at a time by Levenberg-Marquardt, guided projection or Gauss-Newton
//!   ([`Options`]); [`solve`] does it to the end. An [`Observer`] sees every step, can stop it and
//!   keeps its [`Checkpoint`]; a [`Report`] tells the energy of every term at every iteration.
//! - The same family on other models: [`DampedRun`] (damping per group, matrix-free or eliminated
//!   models), [`lbfgs`], and [`Rounds`] of it with a new metric each.
//! - Results do not depend on the number of threads, bit for bit.
//!
//! Without the default feature `sparse` there is the band factorisation only, and no faer.

mod block;
mod blocks;
mod check;
mod checkpoint;
mod clock;
mod damped_run;
mod damping;
mod elements;
mod error;
mod evaluate;
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
mod rounds;
mod rows;
mod schedule;
mod trust_region;
mod variables;

pub use block::{EnergyBlock, ResidualBlock};
pub use blocks::{Closeness, DualBlock, ElementFunction, NumericBlock};
pub use check::{DerivativeCheck, check_gradient, check_jacobian};
pub use checkpoint::{Checkpoint, Fingerprint};
pub use damped_run::{DampedOptions, DampedRun, Descending};
pub use damping::DampingRule;
pub use elements::Elements;
pub use error::{Quantity, SolverError};
pub use evaluate::ElementVisitor;
pub use fields::{Counts, Field, Fields, List, ListItem, OptionValue};
pub use lbfgs::{Euclidean, LbfgsOptions, Metric, Objective, lbfgs};
pub use least_squares::{Run, Step, StepModel, System, Triplets, solve, solve_observed};
pub use line_search::LineSearch;
pub use linear::{
    BandCholesky, CgOptions, CgReport, ConjugateGradients, Factorization, LinearOperator,
    Preconditioner, SymmetricPattern,
};
#[cfg(feature = "sparse")]
pub use linear::{MultifrontalCholesky, SparseCholesky, SparseMetric, solve_rows};
#[cfg(feature = "sparse")]
pub use min_norm::{MinNormProjection, ProjectionOptions};
pub use observer::{Observer, Progress};
pub use options::{Method, Options, Regularization};
pub use problem::{BlockId, Problem};
#[cfg(feature = "sparse")]
pub use qp::{BoundedQp, Eliminated, InequalityQp, LatticeQp, MixedQp, SparseQp};
pub use qp::{DenseQp, LinearEquation, QpSolution, QuadraticForm, QuadraticTerm};
pub use quadratic::{Equation, QuadraticBuilder, QuadraticConstraints};
pub use report::{IterationRecord, Report, Status, Term, Timings};
pub use rounds::{Renewed, RoundOptions, Rounds};
pub use rows::Rows;
pub use schedule::{Extra, RunReport, Stage, StageReport};
pub use trust_region::{Attempt, DampedModel, DampingPolicy, Verdict};
pub use variables::{Group, Variables};
