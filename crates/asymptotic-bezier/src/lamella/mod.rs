//! Straight strips for builders, one along each curve of a net.

pub(crate) mod strip;
