//! Quad meshes along the asymptotic lines of negatively curved surfaces (Shi et al. 2014, §3.1).
//!
//! On a negatively curved surface two asymptotic lines run through every point. They are told apart
//! by the sign of their geodesic torsion, so the two families never swap, and a net of them is the
//! grid of whole values of two functions that do not know of one another: each is constant along one
//! family, and goes over into plus or minus itself and a whole number around loops and flat points.
//! Such a function is the solution of a sparse least-squares problem with a few whole unknowns
//! ([`gp_solver::MixedQp`]), with two inequalities per triangle that keep its orientation. The
//! quads follow by exact walks; their inner valences are even: 4 but for flat points, where the
//! field of index `−m/2` has a vertex of valence `4 + 2 m`.
//!
//! # Example
//! ```
//! use quad_remesh::{Options, solve};
//! let at = |k: u32| 0.1 * (f64::from(k) - 10.0);
//! let points: Vec<_> = (0..441)
//!     .map(|k| (at(k / 21), at(k % 21)))
//!     .map(|(x, y)| geom_core::DVec3::new(x, y, 0.3 * (x * x - y * y)))
//!     .collect();
//! let faces: Vec<[u32; 4]> =
//!     (0..400).map(|k| 21 * (k / 20) + k % 20).map(|a| [a, a + 21, a + 22, a + 1]).collect();
//! let solution = solve(&points, &faces, &Options::default(), &mut ())?;
//! println!("{} quads", solution.metrics.faces);
//! assert_eq!(solution.metrics.odd_valence_vertices, 0);
//! # Ok::<(), quad_remesh::Error>(())
//! ```

mod cut;
mod error;
mod field;
mod foliation;
mod metrics;
mod net;
mod options;
mod parameters;
mod refine;
mod repair;
mod singular;
mod solve;
mod spline;
mod surface;
mod trace;
mod warning;
mod whole;

pub use error::Error;
pub use gp_solver::Status;
pub use metrics::Metrics;
pub use options::Options;
pub use solve::{Solution, solve, solve_surface};
pub use warning::Warning;
