//! The shapes of molds, and what molds and panels cost.

pub(crate) mod height;
pub(crate) mod prices;
pub(crate) mod round;
pub(crate) mod shape;
