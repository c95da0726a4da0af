//! What runs several methods one after the other.
//!
//! [`nets`] turns any mesh of a negatively curved surface into quads a hyperbolic net can be made
//! from: it keeps them, takes their diagonals, or remeshes. Steps, formulas and files belong to
//! others.
//!
//! # Example
//! ```
//! use geom_core::DVec3;
//! use workflows::nets::{Did, InputEdges, prepare};
//! // A grid along the curvature lines of a saddle; its diagonals are asymptotic.
//! let at = |k: u32| f64::from(k) / 8.0 - 1.0;
//! let points: Vec<DVec3> = (0..289)
//!     .map(|k| (at(k / 17), at(k % 17)))
//!     .map(|(x, y)| DVec3::new(x, y, 0.3 * (x * x - y * y)))
//!     .collect();
//! let faces: Vec<[u32; 4]> =
//!     (0..256).map(|k| 17 * (k / 16) + k % 16).map(|a| [a, a + 17, a + 18, a + 1]).collect();
//! let options = quad_remesh::Options::default();
//! let prepared = prepare(&points, &faces, InputEdges::Auto, &options, &mut ())?;
//! assert_eq!(prepared.did, Did::Diagonals);
//! # Ok::<(), workflows::nets::Error>(())
//! ```

pub mod nets;
