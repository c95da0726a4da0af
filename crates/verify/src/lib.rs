//! Recomputes what a run claims from the files it wrote.
//!
//! Nothing here is shared with the code that made the claim: surfaces come as degrees, knots,
//! control points and weights, meshes as points and faces, and are evaluated by de Boor's
//! algorithm, plain subdivision and Gauss quadrature of this crate's own. [`TABLE`] lists which
//! claims of which command can be checked, and how exactly; all others are said not to be checkable
//! from files.
//!
//! # Example
//! ```
//! use glam::DVec3;
//! use serde_json::json;
//! use verify::{Content, Spline, Verdict, check};
//! // A claim about the plane z = 0 over the unit square.
//! let corners = [DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::X + DVec3::Y];
//! let surfaces = vec![Spline::bezier(1, &corners)?];
//! let file = Content { surfaces, ..Content::default() };
//! let metrics = json!({"control_points": 4, "samples_u": 2, "samples_v": 2,
//!     "mean_curvature_max": 0.5, "variables": 12});
//! let findings = check("weingarten", &metrics, &file, None);
//! let of = |key: &str| findings.iter().find(|f| f.key == key).unwrap().verdict;
//! assert_eq!(of("control_points"), Verdict::Same);
//! assert_eq!(of("mean_curvature_max"), Verdict::Differs);
//! assert_eq!(of("variables"), Verdict::NotCheckable);
//! # Ok::<(), verify::SplineError>(())
//! ```

mod analyze;
mod asymptotic;
mod ball;
mod catmull_clark;
mod claims;
mod content;
mod convert;
mod darboux;
mod edges;
mod fair;
mod fit;
mod hnet;
mod mold;
mod panel;
mod quadrature;
mod recompute;
mod remesh;
mod shape;
mod spline;
mod table;
mod weingarten;

pub use catmull_clark::Subdivision;
pub use claims::{Claims, Finding, Values, Verdict};
pub use content::{Content, Mesh, PanelRow};
pub use mold::Mold;
pub use quadrature::{gauss, piecewise};
pub use recompute::check;
pub use shape::{Shape, Slopes, angle_deg};
pub use spline::{Jet, NearestGrid, ORDER, Ready, Spline, SplineError};
pub use table::{Accuracy, Row, Scale, TABLE, markdown, row_of};
