//! Smooth skins of rational bilinear patches on asymptotic nets, and their Darboux transforms.
//!
//! A [`QuadNet`] sorts the edges of a quad mesh into two families; [`inspect`] says whether it
//! follows the asymptotic directions of its surface. [`solve_joint`] then makes it an exact
//! [`HyperbolicNet`] on any topology, [`solve_published`] is the method of Shi et al. 2014. A
//! [`DarbouxMap`], given by a number `c` or by a cage ([`fit_cage`]), takes the net to a smooth
//! surface of Darboux cyclide patches ([`TransformedNet`]).
//!
//! # Example
//! ```
//! use geom_core::{DVec3, PolyMesh, TriMesh};
//! use hyperbolic_nets::{JointOptions, QuadNet, solve_joint};
//! use std::ops::ControlFlow;
//! // Sixteen quads near the rulings of z = xy.
//! let at = |k: u32| f64::from(k) / 4.0 - 0.5;
//! let points = (0..25).map(|k| (at(k / 5), at(k % 5)));
//! let points = points.map(|(x, y)| DVec3::new(x, y, x * y + 0.01 * (9.0 * x).sin())).collect();
//! let corner = |k: u32| [k, k + 5, k + 6, k + 1];
//! let quads: Vec<[u32; 4]> = (0..19).filter(|k| k % 5 < 4).map(corner).collect();
//! let mesh = PolyMesh::new(points, &quads)?;
//! let (net, surface) = (QuadNet::new(&mesh)?, TriMesh::from_poly_mesh(&mesh));
//! let go_on = |_: &_| ControlFlow::Continue(());
//! let (skin, _) = solve_joint(&net, &surface, &JointOptions::default(), go_on)?;
//! assert!(skin.kink_statistics().max < 1e-11); // radians
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod asymptotic_field;
mod blocks;
mod boundary;
mod cage;
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
mod transformed;

pub use asymptotic_field::AsymptoticField;
pub use boundary::{Boundary, BoundaryPolygon};
pub use cage::{CageFit, Freedom, cage_corners, fit_cage};
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
pub use transformed::{CAGE_EDGES, TransformedNet, cage_face_lines, image_of_segment};
