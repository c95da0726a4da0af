//! Smooth skins of rational bilinear patches on asymptotic nets, and their Darboux transforms.

mod asymptotic_field;
mod blocks;
mod boundary;
mod darboux;
mod descend;
mod error;
mod fabrication;
mod gates;
mod hyperbolic_net;
mod join;
mod joint;
mod lelieuvre;
mod measures;
mod net;
mod patch;
mod published;
mod quad_distance;
mod sample;
mod shape;
mod small;

pub use asymptotic_field::AsymptoticField;
pub use boundary::Boundary;
pub use darboux::{Branch, Cyclide, DarbouxError, DarbouxMap, ImageCircle};
pub use descend::StepRecord;
pub use error::{NetError, PatchError};
pub use fabrication::{WireCut, distinct_shape_parameters, wire_cuts};
pub use gates::{GateReport, NetWarning, inspect};
pub use hyperbolic_net::{HyperbolicNet, KINK_SAMPLES, KinkStatistics, distances, star_planarity};
pub use join::EdgeJoin;
pub use joint::{JointOptions, NetReport, solve_joint};
pub use measures::{NetMeasures, not_negatively_curved};
pub use net::{Family, InnerEdge, NetEdge, QuadNet};
pub use patch::{BilinearPatch, PatchJet, Quadric};
pub use published::{FairnessOrder, PublishedOptions, StarPlanarity, solve_published};
pub use sample::{SampledPatches, SurfaceSample};
pub use shape::{ShapeFit, Spread, best_log_factor, fit_shape_parameters};
