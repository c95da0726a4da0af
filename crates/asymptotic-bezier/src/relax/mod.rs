//! Bad data made good: tangents and curvatures moved as little as needed.

pub(crate) mod model;
pub(crate) mod relaxed;
