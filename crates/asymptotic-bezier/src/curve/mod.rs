//! Bezier curves: polynomials in Bernstein form, and the curvature and torsion of a curve.

pub(crate) mod bernstein;
pub(crate) mod bezier;
