//! The seams between panels: kinks and gaps measured, and lowered by moving all molds and poses at
//! once.

pub(crate) mod general;
pub(crate) mod measure;
pub(crate) mod step;
pub(crate) mod system;
pub(crate) mod unknowns;
