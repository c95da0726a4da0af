//! Catmull-Clark subdivision surfaces with exact limit evaluation.
//!
//! [`refine`] makes one step of subdivision with boundary (Biermann, Levin and Zorin 2000) and
//! semi-sharp crease rules (DeRose, Kass and Truong 1998). [`SubdivisionSurface`] evaluates the
//! limit surface with derivatives up to order three at any parameter of any quad, in the spirit of
//! Stam 1998 but by powers of the local refinement matrix instead of tabulated eigenvectors, which
//! works for every local connectivity. Around extraordinary vertices the surface can be blended
//! with a polynomial ([`Blend`]), which makes it C² with free curvature. All of it is linear in
//! the control points, and patches of one connectivity share their weights.
//!
//! ```
//! use geom_core::{DVec3, PolyMesh};
//! use subdiv_catmull_clark::{Blend, Creases, SubdivisionSurface, refine};
//!
//! let corners = (0..8).map(|k| {
//!     DVec3::new(f64::from(k & 1), f64::from(k >> 1 & 1), f64::from(k >> 2)) * 2.0 - 1.0
//! });
//! let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
//! let cube = PolyMesh::new(corners.collect(), &faces)?;
//! let fine = refine(&cube, &Creases::none())?;
//! let surface = SubdivisionSurface::new(&fine.mesh, &fine.creases, Blend::Smooth)?;
//! let jet = surface.evaluate(fine.mesh.positions(), &surface.patches()[0], 0.5, 0.5);
//! assert!(jet.d(1, 0).cross(jet.d(0, 1)).dot(jet.position()) > 0.0); // the normal points outwards
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod bezier;
mod blend;
mod characteristic;
mod classes;
mod crease;
mod error;
mod guide;
mod jet;
mod limit;
mod local;
mod refine;
mod regions;
mod surface;
mod wide;

pub use blend::{Blend, flat_step, septic_step};
pub use characteristic::{LimitMasks, limit_masks, subdominant_eigenvalue};
pub use crease::{CreaseError, CreaseList, Creases, INFINITE_SHARPNESS};
pub use error::SubdivisionError;
pub use jet::{JET_LEN, JET_ORDERS, Jet, JetWeights, cubic_basis, jet_product};
pub use limit::{LimitFrame, limit_frames};
pub use refine::{Refined, Stencils, refine};
pub use surface::{BasisId, GuideSector, Patch, SubdivisionSurface, refinements_needed};
