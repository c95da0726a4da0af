//! The shapes of molds, and what molds and panels cost.

pub(crate) mod prices;
pub(crate) mod shape;
