//! Polylines in place of curves, for models hold no others.

use bspline::BsplineCurve;
use geom_core::DVec3;

/// Pieces of a polyline per knot span, if the curve is not one itself.
pub(crate) const PIECES: usize = 16;

/// Whether a curve is the polyline of its control points.
pub(crate) fn is_polyline(curve: &BsplineCurve) -> bool {
    curve.knots().degree().get() == 1 && curve.weights().is_none()
}

/// How many points [`points_on`] has.
pub(crate) fn points_of(curve: &BsplineCurve) -> usize {
    if is_polyline(curve) {
        return curve.control_points().len();
    }
    PIECES * (curve.knots().breaks().len() - 1) + 1
}

/// The points of a polyline, or points at equal steps of every knot span.
pub(crate) fn points_on(curve: &BsplineCurve) -> Vec<DVec3> {
    if is_polyline(curve) && !curve.knots().is_periodic() {
        return curve.control_points().to_vec();
    }
    let breaks = curve.knots().breaks();
    let mut points = Vec::with_capacity(points_of(curve));
    for pair in breaks.windows(2) {
        let at = |k: usize| pair[0] + (pair[1] - pair[0]) * k as f64 / PIECES as f64;
        points.extend((0..PIECES).map(|k| curve.point(at(k))));
    }
    points.extend(breaks.last().map(|t| curve.point(*t)));
    points
}
