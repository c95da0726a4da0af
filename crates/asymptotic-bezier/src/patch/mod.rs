//! The Bezier patch between four asymptotic curves: its tangent fields, its inner control points,
//! and what it is worth.

pub(crate) mod bounds;
pub(crate) mod extension;
pub(crate) mod family;
pub(crate) mod field;
pub(crate) mod intersect;
pub(crate) mod mask;
pub(crate) mod options;
pub(crate) mod plate_block;
pub(crate) mod solve;
pub(crate) mod surface;
pub(crate) mod thin_plate;
pub(crate) mod verify;
