//! The four boundary curves of one patch.

use geom_core::DVec3;

use crate::curve::bezier::BezierCurve;

/// Boundary of one patch, curves directed as `r1..r4`.
#[derive(Clone, Debug, PartialEq)]
pub struct PatchBoundary {
    /// `r1(u) = R(u,0)`, `r2(v) = R(0,v)`, `r3(u) = R(u,1)`, `r4(v) = R(1,v)`.
    pub curves: [BezierCurve; 4],
    /// Which are straight.
    pub lines: [bool; 4],
    /// Parameters of their inflections.
    pub inflections: [Vec<f64>; 4],
    /// Across a straight curve, a cubic direction field the tangent planes must contain; without
    /// one they are free. Patches on both sides of a line share it, which makes the join G1.
    pub ribbons: [Option<[DVec3; 4]>; 4],
}
