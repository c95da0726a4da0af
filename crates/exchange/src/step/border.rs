//! The four sides of a surface as curves, and which of them coincide or collapse.

use bspline::{BsplineCurve, BsplineSurface, KnotVector, SplineError};

/// A side of the parameter rectangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    UStart,
    UEnd,
    VStart,
    VEnd,
}

/// Border curves, indexed by [`Side`], and the directions in which the surface closes within a
/// distance.
pub(crate) struct Borders {
    sides: [BsplineCurve; 4],
    pub(crate) closed_u: bool,
    pub(crate) closed_v: bool,
}

impl Borders {
    pub(crate) fn of(surface: &BsplineSurface, close: f64) -> Result<Self, SplineError> {
        let ((u0, u1), (v0, v1)) = (surface.knots_u().domain(), surface.knots_v().domain());
        let sides = [
            surface.curve_at_u(u0)?,
            surface.curve_at_u(u1)?,
            surface.curve_at_v(v0)?,
            surface.curve_at_v(v1)?,
        ];
        let closed = |knots: &KnotVector, a: &BsplineCurve, b: &BsplineCurve| {
            knots.is_periodic() || (meet(a, b, close) && !is_near_point(a, close))
        };
        let closed_u = closed(surface.knots_u(), &sides[0], &sides[1]);
        let closed_v = closed(surface.knots_v(), &sides[2], &sides[3]);
        Ok(Self { sides, closed_u, closed_v })
    }

    pub(crate) fn side(&self, side: Side) -> &BsplineCurve {
        &self.sides[side as usize]
    }
}

/// Whether two sides are the same curve within a distance.
fn meet(a: &BsplineCurve, b: &BsplineCurve, close: f64) -> bool {
    let weight = |c: &BsplineCurve, k: usize| c.weights().map_or(1.0, |w| w[k]);
    let mut pairs = a.control_points().iter().zip(b.control_points()).enumerate();
    pairs.all(|(k, (p, q))| {
        p.distance(*q) <= close && (weight(a, k) / weight(b, k) - 1.0).abs() <= 1e-9
    })
}

/// Whether a curve is one point (a pole) within a distance.
pub(crate) fn is_near_point(curve: &BsplineCurve, close: f64) -> bool {
    let points = curve.control_points();
    points.iter().all(|p| p.distance(points[0]) <= close)
}
