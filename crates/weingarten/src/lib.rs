//! Optimises B-spline surfaces until their principal curvatures obey one relation.
//!
//! A Weingarten surface has a functional relation between its principal curvatures, or, which is
//! the same, its isolines of mean curvature `H` and Gaussian curvature `K` coincide:
//! `H_u K_v − H_v K_u = 0`. Its curvature diagram in the `(H, K)` plane is a curve, so it has far
//! fewer different curvature elements than a general surface, and panels can share molds
//! (Pellis et al. 2021).
//!
//! [`optimize`] finds such a surface near to a given one. Unknowns are the control points; the
//! derivatives of `H` and `K` are exact (third derivatives of the spline); steps are damped and
//! accepted only if they lower the energy. A relation of a given kind ([`Relation`]) can be asked
//! for instead. The published scheme with auxiliary variables is there to compare with
//! ([`Formulation::Lifted`]).
//!
//! ```
//! use weingarten::{WeingartenOptions, optimize};
//! let roof = fixtures::surfaces::Shape::Roof.surface(10, 8, 4, 4);
//! let options = WeingartenOptions { levels: vec![(10, 8), (14, 10)], ..Default::default() };
//! let result = optimize(&roof, &options)?;
//! assert!(result.after.diagram_area < 0.1 && result.before.diagram_area > 0.5);
//! assert!(result.after.deviation_mean_percent < 1.0);
//! # Ok::<(), weingarten::WeingartenError>(())
//! ```

mod axis;
mod blocks;
mod checkpoint;
mod curve;
mod error;
mod field;
mod grid;
mod kernel;
mod level;
mod lifted;
mod locus;
mod metrics;
mod optimize;
mod options;
mod rational;
mod relation;
mod sweep;
mod target;
mod tensor;
#[cfg(test)]
mod tests;

pub use checkpoint::Checkpoint;
pub use error::WeingartenError;
pub use gp_solver::Status;
pub use locus::RelationLocus;
pub use metrics::Metrics;
pub use optimize::{
    LevelReport, Optimized, Progress, WeingartenReport, optimize, optimize_observed,
};
pub use options::{Border, Formulation, Move, Weights, WeingartenOptions};
pub use relation::Relation;
