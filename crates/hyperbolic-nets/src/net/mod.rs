//! Nets, their patches and what can be said of them.

mod boundary;
mod differences;
mod fabrication;
mod field;
mod hyperbolic_net;
mod join;
mod lelieuvre;
mod patch;
mod placed;
mod quad_net;
mod sample;
mod shape;

pub(crate) use hyperbolic_net::kinks;
pub(crate) use lelieuvre::signs;

pub use boundary::BoundaryPolygon;
pub use differences::{Combination, second_differences, third_differences};
pub use fabrication::{WireCut, distinct_shape_parameters, wire_cuts};
pub use field::AsymptoticField;
pub use hyperbolic_net::{HyperbolicNet, KINK_SAMPLES, KinkStatistics, distances, star_planarity};
pub use join::EdgeJoin;
pub use lelieuvre::{LelieuvreStart, shape_parameters};
pub use patch::{BilinearPatch, PatchJet, Quadric};
pub use placed::PlacedNet;
pub use quad_net::{Family, InnerEdge, NetEdge, QuadNet};
pub use sample::{SampledPatches, SurfaceSample};
pub use shape::{ShapeFit, Spread, best_log_factor, fit_shape_parameters};
