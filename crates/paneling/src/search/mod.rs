//! From panels to molds: one attempt for a given number of molds, many to find the cheapest within
//! bounds.

pub(crate) mod attempt;
pub(crate) mod bounds;
pub(crate) mod cheapening;
pub(crate) mod course;
pub(crate) mod mending;
pub(crate) mod plan;
pub(crate) mod rehoming;
pub(crate) mod saved;
pub(crate) mod site;
pub(crate) mod strain;
