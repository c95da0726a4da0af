//! Minimises bending and curvature-variation energies of subdivision surfaces of any topology
//! (Joshi 2008).
//!
//! [`SurfaceEnergy`] integrates [`Functional`]s over a Catmull-Clark surface with exact gradients;
//! [`fair`] minimises a weighted sum of them, from a coarse control mesh to finer ones. The
//! densities are written in an orthonormal tangent frame without angles, so that they are smooth
//! wherever the surface is regular (umbilics are guarded, see [`Functional::Mvs`]).
//!
//! ```
//! use curvature_variation::{Constraints, Energy, FairOptions, fair};
//! use std::ops::ControlFlow;
//! use subdiv_catmull_clark::Creases;
//!
//! let mesh = fixtures::quad_graphs::torus(10, 8, 1.0, 0.5);
//! let options = FairOptions { energy: "bending".parse()?, levels: 0, ..FairOptions::default() };
//! let result = fair(&mesh, &Creases::none(), &Constraints::default(), &options, |_| {
//!     ControlFlow::Continue(())
//! })?;
//! // The Clifford torus has bending energy 8 π².
//! assert!((result.report.energy_final - 78.957).abs() < 0.5);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod analysis;
mod constraints;
mod density;
mod descent;
mod discrete;
mod element;
mod evaluator;
mod expression;
mod fair;
mod family;
mod freedom;
mod functional;
mod guide_block;
mod guides;
#[cfg(test)]
mod independent;
mod kernel;
mod metric;
mod rules;
mod samples;
mod splines;
mod symmetry;
mod umbilics;

pub use analysis::{SurfaceAnalysis, analyze, fitted_torus};
pub use constraints::Constraints;
pub use descent::Method;
pub use discrete::discrete_bending;
pub use evaluator::{EnergyTable, SurfaceEnergy, Workspace};
pub use expression::ExpressionError;
pub use fair::{
    FairError, FairOptions, FairProgress, FairReport, Fairing, LevelReport, SymmetryMode, fair,
};
pub use family::fair_in_family;
pub use functional::{Energy, Functional};
pub use rules::Quadrature;
pub use samples::SurfaceSamples;
pub use splines::{SplinePatchError, SplinePatches, spline_patches};
pub use umbilics::Umbilic;
