//! The terms of the energy as residual blocks of the solver.

mod alignment;
mod border;
mod net;
mod parallel;
mod relation;
mod rows;

pub(crate) use alignment::Alignment;
#[cfg(test)]
pub(crate) use alignment::residual_scale;
pub(crate) use border::{BorderGlide, border_points};
pub(crate) use net::{Fairness, Net, Shape};
pub(crate) use parallel::Parallel;
pub(crate) use relation::RelationRows;
