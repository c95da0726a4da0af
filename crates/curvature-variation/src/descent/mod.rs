//! Minimisation on one level: L-BFGS with several metrics, Gauss-Newton, linear conditions.

mod conditioned;
mod energy;
mod minimise;
mod newton;
mod projected;
mod rounds;

pub(crate) use conditioned::Conditioned;
pub(crate) use energy::LevelEnergy;
pub(crate) use minimise::{Plan, State, minimise};
