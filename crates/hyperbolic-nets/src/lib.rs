//! Smooth skins of rational bilinear patches on asymptotic nets, and their Darboux transforms.
//!
//! A [`QuadNet`] sorts the edges of a quad mesh into two families; [`inspect`] says whether it
//! follows the asymptotic directions of its surface. [`solve`] makes it an exact [`HyperbolicNet`]
//! on any topology, or follows the method of Shi et al. 2014 ([`Method::Published`]).
//! [`solve_with`] takes further terms and equations, made of [`blocks`] or written by oneself. A
//! [`darboux`] transformation, given by a number `c` or by a cage, takes the net to a smooth
//! surface of Darboux cyclide patches.
//!
//! # Example
//! ```
//! use geom_core::PolyMesh;
//! use hyperbolic_nets::{Input, Options, QuadNet, solve};
//! let model = fixtures::asymptotic_nets::catenoid(20, 14).jittered(0.05, 1);
//! let net = QuadNet::new(&PolyMesh::new(model.positions, &model.quads)?)?;
//! let solution = solve(&Input::new(&net), &Options::default(), &mut ())?;
//! println!("{}: kinks to {:.1e}°", solution.report.status, solution.metrics.kink_max_deg);
//! assert!(solution.metrics.kink_max_deg < 1e-9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod blocks;
pub mod darboux;
mod error;
mod gates;
mod input;
mod methods;
mod metrics;
mod net;
mod options;
mod solve;
mod vectors;
mod warning;

pub use error::{Error, PatchError};
pub use gates::{GateReport, inspect};
pub use gp_solver::Status;
pub use input::Input;
pub use methods::POLISH;
pub use metrics::Metrics;
pub use net::{
    AsymptoticField, BilinearPatch, BoundaryPolygon, Combination, EdgeJoin, Family, HyperbolicNet,
    InnerEdge, KINK_SAMPLES, KinkStatistics, LelieuvreStart, NetEdge, PatchJet, PlacedNet, QuadNet,
    Quadric, SampledPatches, ShapeFit, Spread, SurfaceSample, WireCut, best_log_factor, distances,
    distinct_shape_parameters, fit_shape_parameters, second_differences, shape_parameters,
    star_planarity, third_differences, wire_cuts,
};
pub use options::{Boundary, FairnessOrder, Method, Options, StarPlanarity};
pub use solve::{Solution, problem, solve, solve_with};
pub use vectors::{NORMALS, POSITIONS, variables};
pub use warning::Warning;
