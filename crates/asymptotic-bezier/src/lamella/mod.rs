//! Straight strips for builders, one along each curve of a net.

pub(crate) mod layout;
pub(crate) mod profile;
pub(crate) mod strip;
