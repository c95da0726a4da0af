//! The terms of a fairing as blocks of a [`gp_solver::Problem`], for problems of one's own.
//!
//! [`problem`](crate::problem) puts them together as [`solve`](crate::solve) minimises them, and
//! [`solve_with`](crate::solve_with) takes further ones.

mod family;
mod pinned;
mod pulled;
mod surface;

pub use family::FamilyBlock;
pub use pinned::PinnedLimits;
pub use pulled::PulledPoints;
pub use surface::SurfaceBlock;
