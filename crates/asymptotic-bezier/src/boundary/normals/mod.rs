//! The boundary curves of a net made from polynomial normals by Lelieuvre's formula.

pub(crate) mod blocks;
pub(crate) mod curve;
pub(crate) mod curves;
pub(crate) mod net;
