//! Minimises bending and curvature-variation energies of subdivision surfaces of any topology
//! (Joshi 2008).
//!
//! [`solve`] minimises a weighted sum of [`Functional`]s over a Catmull-Clark surface, from a coarse
//! control mesh to finer ones; [`SurfaceEnergy`] integrates them with exact gradients. The densities
//! are written in an orthonormal tangent frame without angles, so that they are smooth wherever the
//! surface is regular (umbilics are guarded, see [`Functional::Mvs`]). The terms are public as
//! [`blocks`], and [`solve_with`] takes further ones.
//!
//! ```
//! use curvature_variation::{Input, Options, solve};
//!
//! let torus = Input::from(fixtures::quad_graphs::torus(10, 8, 1.0, 0.5));
//! let options = Options { energy: "bending".parse()?, levels: 0, ..Options::default() };
//! let solution = solve(&torus, &options, &mut ())?;
//! // The Clifford torus has bending energy 8 π².
//! assert!((solution.metrics.energy_final - 78.957).abs() < 0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod analysis;
pub mod blocks;
mod cad;
mod chart;
mod chart_net;
mod checkpoint;
mod constraints;
mod density;
mod descent;
mod discrete;
mod element;
mod error;
mod evaluator;
mod expression;
mod family;
mod freedom;
mod functional;
mod grounds;
mod guide_block;
mod guides;
#[cfg(test)]
mod independent;
mod input;
mod kernel;
mod level;
mod limits;
mod metric;
mod metrics;
mod options;
mod placed;
mod replay;
mod rules;
mod samples;
mod schedule;
mod solution;
mod solve;
mod splines;
mod status;
mod straightened;
mod surface_matrix;
mod symmetry;
mod torus;
mod umbilics;
mod variables;
mod written;

pub use analysis::{SurfaceAnalysis, analyze};
pub use cad::{LimitPatchError, LimitPatches, limit_patches};
pub use constraints::Constraints;
pub use discrete::discrete_bending;
pub use error::Error;
pub use evaluator::{EnergyTable, SurfaceEnergy, Workspace};
pub use expression::ExpressionError;
pub use family::SHARES;
pub use functional::{Energy, Functional};
pub use input::Input;
pub use level::LevelNumbers;
pub use metrics::{Metrics, Warning};
pub use options::{BlendKind, Method, Options, Rings, Symmetry};
pub use rules::Quadrature;
pub use samples::SurfaceSamples;
pub use solution::Solution;
pub use solve::{problem, solve, solve_with};
pub use splines::{SplinePatchError, SplinePatches, spline_patches};
pub use torus::fitted_torus;
pub use umbilics::Umbilic;
pub use variables::{CONTROL_POINTS, variables};
