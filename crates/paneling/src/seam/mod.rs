//! The seams between panels: kinks and gaps measured, and lowered by moving all molds and poses at
//! once.

pub(crate) mod measure;
pub(crate) mod step;
pub(crate) mod system;
