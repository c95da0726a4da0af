//! The boundary curves of a net or of one patch, solved from tangents and curvatures at the corners
//! or from normals.

pub(crate) mod curve_energy;
pub(crate) mod four_curves;
pub(crate) mod inflection;
pub(crate) mod normals;
pub(crate) mod options;
pub(crate) mod quad;
pub(crate) mod quartic;
pub(crate) mod solve;
pub(crate) mod solved;
pub(crate) mod torsion_energy;
