//! The two methods.

pub(crate) mod joint;
mod polish;
pub(crate) mod published;
mod solved;
mod watch;

pub use joint::POLISH;
pub(crate) use solved::Solved;
pub(crate) use watch::Watch;
