//! The terms of the methods, each a block of residual rows for any [`gp_solver::Problem`].
//!
//! Unknowns are in the groups [`crate::POSITIONS`] and [`crate::NORMALS`], three components per
//! vertex. A block adds half the sum of its squared rows to the energy, times the square of its
//! weight in the problem. All are called from the thread that steps.

mod combinations;
mod equations;
mod frame_points;
mod proximity;
mod quad_distances;
mod targets;
#[cfg(test)]
mod tests;

pub(crate) use targets::closest_on_polyline;

pub use combinations::Combinations;
pub use equations::{edge_equations, star_equations};
pub use frame_points::FramePoints;
pub use proximity::{Proximity, ProximityWeights};
pub use quad_distances::{Mix, QuadDistances};
pub use targets::{Target, Targets};
