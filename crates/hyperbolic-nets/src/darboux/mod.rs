//! Darboux transformations of hyperbolic nets, given by a number `c` or by a cage.
//!
//! [`solve`] transforms a finished net. A [`DarbouxMap`] takes points, lines, planes and patches;
//! [`fit_cage`] finds the one that moves the corners of a box; a [`TransformedNet`] is the image of
//! a net.

mod cage;
mod error;
mod map;
mod options;
mod placed;
mod solve;
mod transformed;

pub use cage::{CageFit, Freedom, cage_corners, fit_cage};
pub use error::{CageFault, Error};
pub use map::{Branch, Cyclide, DarbouxMap, ImageCircle};
pub use options::{Corner, Options};
pub use solve::{Metrics, Solution, Warning, solve, solve_placed};
pub use transformed::{CAGE_EDGES, TransformedNet, cage_face_lines, image_of_segment};
