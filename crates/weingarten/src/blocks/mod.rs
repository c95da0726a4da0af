//! The terms of the energy as residual blocks of the solver, for problems of one's own too.
//!
//! Unknowns are the coordinates of the control points, `3 (i n_v + j) + axis`, in units in which
//! the surface has mean absolute principal curvature 5 (a level's [`gp_solver::Stage`] tells its
//! unit). Every block multiplies its residuals by a weight.

mod alignment;
mod border;
mod net;
mod parallel;
mod regularity;
mod relation;
mod rows;

pub use crate::kernel::Field;
pub use crate::sampled::SampledSurface;
pub use alignment::Alignment;
#[cfg(test)]
pub(crate) use alignment::residual_scale;
pub(crate) use border::border_points;
pub use border::{BorderGlide, BorderSpacing};
pub use gp_solver::Closeness;
pub use net::{Fairness, Net, Shape};
pub use parallel::Parallel;
pub(crate) use regularity::Regularity;
pub use relation::RelationRows;
pub(crate) use relation::reference_rows;
