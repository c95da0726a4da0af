//! Optimises B-spline surfaces until their principal curvatures obey one relation.
//!
//! A Weingarten surface has a functional relation between its principal curvatures, or, which is
//! the same, its isolines of mean curvature `H` and Gaussian curvature `K` coincide:
//! `H_u K_v − H_v K_u = 0`. Its curvature diagram in the `(H, K)` plane is a curve, so it has far
//! fewer different curvature elements than a general surface, and panels can share molds
//! (Pellis et al. 2021).
//!
//! [`solve`] finds such a surface near to a given one. Unknowns are the control points; the
//! derivatives of `H` and `K` are exact (third derivatives of the spline); steps are damped and
//! accepted only if they lower the energy. A relation of a given kind ([`Relation`]) can be asked
//! for instead. [`solve_with`] takes further terms, made of [`blocks`] or written by oneself. The
//! published scheme with auxiliary variables is there to compare with
//! ([`Formulation::Lifted`]).
//!
//! ```
//! use gp_solver::Counts;
//! use weingarten::{Options, solve};
//! let roof = fixtures::surfaces::Shape::Roof.surface(10, 8, 4, 4);
//! let levels = vec![Counts { u: 10, v: 8 }, Counts { u: 14, v: 10 }];
//! let options = Options { levels: levels.into(), ..Default::default() };
//! let solution = solve(&roof, &options, &mut ())?;
//! assert!(solution.before.diagram_area > 0.5 && solution.metrics.diagram_area < 0.1);
//! assert!(solution.metrics.deviation_mean_percent < 1.0);
//! # Ok::<(), weingarten::Error>(())
//! ```

mod area;
mod axis;
mod best;
pub mod blocks;
mod corners;
mod curve;
mod error;
mod field;
mod fitted;
mod grid;
mod input;
mod kernel;
mod kind;
mod level;
mod lifted;
mod locus;
mod metrics;
mod miss;
mod nested;
mod options;
mod prepare;
mod rational;
mod relation;
mod sampled;
mod schedule;
mod solve;
mod stall;
mod suited;
mod sweep;
mod target;
mod tensor;
#[cfg(test)]
mod tests;
mod variables;

pub use corners::HeldCorner;
pub use error::Error;
pub use fitted::fitted_curve;
pub use gp_solver::Status;
pub use input::Input;
pub use locus::RelationLocus;
pub use metrics::Metrics;
pub use miss::RelationMiss;
pub use options::{Border, Formulation, Move, Options};
pub use relation::Relation;
pub use solve::{Solution, problem, solve, solve_with};
pub use suited::suited_levels;
pub use variables::{CONTROL_POINTS, variables};
