//! Which panels share a mold, and molds and poses brought near the design.

pub(crate) mod alternation;
pub(crate) mod clustering;
pub(crate) mod mold_step;
pub(crate) mod normal;
pub(crate) mod residuals;
pub(crate) mod retraction;
pub(crate) mod state;
pub(crate) mod torus_start;
