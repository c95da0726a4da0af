//! Surfaces of extrusion and revolution, exact.

use crate::conic::ArcSpans;
use crate::curve::BsplineCurve;
use crate::error::SplineError;
use crate::knots::{Degree, KnotVector};
use crate::surface::BsplineSurface;
use glam::DVec3;

/// A control point nearer to the axis than this share of the size of the profile lies on it.
const ON_AXIS: f64 = 1e-15;

/// A line in space with a direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    /// A point on it.
    pub origin: DVec3,
    /// Its direction, a unit vector.
    pub direction: DVec3,
}

impl BsplineSurface {
    /// `S(u, v) = C(u) + v · vector` for `v` from `start` to `end`.
    ///
    /// # Errors
    /// [`SplineError`] if `end` is not above `start` or a number is not finite.
    pub fn extrusion(
        curve: &BsplineCurve,
        vector: DVec3,
        start: f64,
        end: f64,
    ) -> Result<Self, SplineError> {
        let knots = KnotVector::new(Degree::new(1)?, vec![start, start, end, end])?;
        let ends = |p: &DVec3| [*p + start * vector, *p + end * vector];
        let points = curve.control_points().iter().flat_map(ends).collect();
        let weights = curve.weights().map(|w| w.iter().flat_map(|w| [*w, *w]).collect());
        Self::new(curve.knots().clone(), knots, points, weights)
    }

    /// `S(u, v)` is `profile(v)` turned about `axis` by the angle that stands at `u`; `u` runs over
    /// the angles of `spans`, which are its knots (see [`ArcSpans`]). A full turn closes to the
    /// last bit, and points on the axis stay one point.
    ///
    /// # Errors
    /// [`SplineError`] if a number is not finite.
    ///
    /// # Example
    /// ```
    /// use bspline::{ArcSpans, Axis, BsplineCurve, BsplineSurface};
    /// use geom_core::DVec3;
    /// let line = BsplineCurve::segment(DVec3::X, DVec3::new(1.0, 0.0, 2.0), 0.0, 2.0)?;
    /// let axis = Axis { origin: DVec3::ZERO, direction: DVec3::Z };
    /// let turn = ArcSpans::new(0.0, std::f64::consts::TAU);
    /// let cylinder = BsplineSurface::revolution(&line, axis, turn)?;
    /// assert!((cylinder.curvature_statistics().area - 4.0 * std::f64::consts::PI).abs() < 1e-12);
    /// # Ok::<(), bspline::SplineError>(())
    /// ```
    pub fn revolution(
        profile: &BsplineCurve,
        axis: Axis,
        spans: ArcSpans,
    ) -> Result<Self, SplineError> {
        let z = axis.direction;
        let split = |p: &DVec3| {
            let foot = axis.origin + z * (*p - axis.origin).dot(z);
            let scale = p.distance(axis.origin).max(p.length());
            let out = *p - foot;
            let out = if out.length() <= ON_AXIS * scale { DVec3::ZERO } else { out };
            (foot, out, z.cross(out))
        };
        let feet: Vec<(DVec3, DVec3, DVec3)> = profile.control_points().iter().map(split).collect();
        let control = spans.control();
        let point =
            |c: &[f64; 3], (foot, x, y): &(DVec3, DVec3, DVec3)| *foot + c[0] * *x + c[1] * *y;
        let points = control.iter().flat_map(|c| feet.iter().map(move |f| point(c, f))).collect();
        let weight = |j: usize| profile.weights().map_or(1.0, |w| w[j]);
        let weights =
            control.iter().flat_map(|c| (0..feet.len()).map(move |j| c[2] * weight(j))).collect();
        Self::new(spans.knots()?, profile.knots().clone(), points, Some(weights))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn a_turned_arc_is_a_sphere_with_sound_poles() {
        let meridian = ArcSpans::new(-0.5 * PI, 0.5 * PI);
        let center = DVec3::new(1.0, -2.0, 0.5);
        let arc = BsplineCurve::arc(center, 3.0 * DVec3::X, 3.0 * DVec3::Z, meridian).unwrap();
        let axis = Axis { origin: center, direction: DVec3::Z };
        let sphere = BsplineSurface::revolution(&arc, axis, ArcSpans::new(0.0, TAU)).unwrap();
        let last = sphere.n_v() - 1;
        for i in 0..sphere.n_u() {
            assert_eq!(sphere.control_point(i, 0), sphere.control_point(0, 0));
            assert_eq!(sphere.control_point(i, last), sphere.control_point(0, last));
        }
        for (u, v) in [(0.3, 0.2), (4.0, -1.0), (6.2, 1.3)] {
            let jet = sphere.jet(u, v, 2);
            assert_close(jet.position().distance(center), 3.0, 4e-15);
            assert_close(jet.mean_curvature().unwrap(), -1.0 / 3.0, 1e-13);
        }
        assert_close(sphere.curvature_statistics().area / (36.0 * PI), 1.0, 1e-10);
    }

    #[test]
    fn an_extruded_arc_is_a_cylinder() {
        let arc = BsplineCurve::arc(DVec3::ZERO, DVec3::X, DVec3::Y, ArcSpans::new(0.2, 1.7));
        let wall = BsplineSurface::extrusion(&arc.unwrap(), 2.0 * DVec3::Z, -1.0, 0.5).unwrap();
        assert_close(wall.curvature_statistics().area, 1.5 * 3.0, 1e-12);
        assert_close(wall.jet(0.9, 0.1, 2).gaussian_curvature().unwrap(), 0.0, 1e-14);
    }
}
