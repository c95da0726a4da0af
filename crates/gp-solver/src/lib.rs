//! Sparse nonlinear least squares and the other optimisers the methods of the workspace stand on.

mod problem;

pub use problem::{Elements, EnergyBlock, ResidualBlock};
