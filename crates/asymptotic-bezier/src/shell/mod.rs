//! Whole nets filled with patches that join with a common tangent plane, one by one or all at once.

pub(crate) mod gridshell;
pub(crate) mod joins;
pub(crate) mod joint;
pub(crate) mod joint_solve;
