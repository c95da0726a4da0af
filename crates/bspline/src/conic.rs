//! Straight lines and arcs of ellipses as exact splines, and their angles.

use crate::curve::BsplineCurve;
use crate::error::SplineError;
use crate::knots::{Degree, KnotVector};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Angles that differ by less than this are the same, in radians.
const SAME_ANGLE: f64 = 1e-12;

/// An interval of angles cut into equal pieces of at most a right angle: the knot spans of a
/// rational quadratic arc, whose knots are angles.
///
/// Between the knots parameter and angle differ: with the middle `m` and half the length `a` of
/// the piece, angle `θ` stands at `m + a · tan((θ − m)/2) / tan(a/2)`, because a rational
/// quadratic arc is linear in the tangent of half the angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ArcSpans {
    start: f64,
    end: f64,
    count: usize,
}

impl ArcSpans {
    /// The interval from `start` to `end`, at most a full turn.
    ///
    /// # Panics
    /// If `end` is not above `start` or more than a full turn away.
    #[must_use]
    pub fn new(start: f64, end: f64) -> Self {
        let length = end - start;
        assert!(length > 0.0 && length <= TAU * (1.0 + SAME_ANGLE), "an angle of {length}");
        let count = ((length / FRAC_PI_2) * (1.0 - SAME_ANGLE)).ceil().max(1.0) as usize;
        Self { start, end, count }
    }

    /// Number of pieces.
    #[must_use]
    pub fn count(self) -> usize {
        self.count
    }

    /// Whether start and end are the same direction.
    #[must_use]
    pub fn is_full_turn(self) -> bool {
        (self.end - self.start - TAU).abs() <= SAME_ANGLE * TAU
    }

    /// The knots: angles, each inner one twice.
    pub(crate) fn knots(self) -> Result<KnotVector, SplineError> {
        let at = |k: usize| if k == self.count { self.end } else { self.knot(k) };
        let mut knots = vec![self.start; 3];
        (1..self.count).for_each(|k| knots.extend([at(k); 2]));
        knots.extend([self.end; 3]);
        Ok(KnotVector::new(Degree::new(2)?, knots)?)
    }

    fn knot(self, k: usize) -> f64 {
        self.start + (self.end - self.start) * k as f64 / self.count as f64
    }

    /// Cosine, sine and weight of each control point of the unit arc.
    pub(crate) fn control(self) -> Vec<[f64; 3]> {
        let half = 0.5 * (self.end - self.start) / self.count as f64;
        let weight = half.cos();
        let mut control = Vec::with_capacity(2 * self.count + 1);
        for k in 0..=2 * self.count {
            let angle = self.start + half * k as f64;
            let (sin, cos) = angle.sin_cos();
            control.push(match k % 2 {
                0 => [cos, sin, 1.0],
                _ => [cos / weight, sin / weight, weight],
            });
        }
        if self.is_full_turn() {
            control[2 * self.count] = control[0];
        }
        control
    }

    /// The parameter at which the arc has angle `angle`, see the type.
    #[must_use]
    pub fn parameter(self, angle: f64) -> f64 {
        let (middle, half) = self.piece(angle);
        middle + half * (0.5 * (angle - middle)).tan() / (0.5 * half).tan()
    }

    /// The angle of the arc at a parameter, see the type.
    #[must_use]
    pub fn angle(self, parameter: f64) -> f64 {
        let (middle, half) = self.piece(parameter);
        middle + 2.0 * ((parameter - middle) / half * (0.5 * half).tan()).atan()
    }

    /// Middle and half length of the piece around an angle.
    fn piece(self, angle: f64) -> (f64, f64) {
        let length = (self.end - self.start) / self.count as f64;
        let k = ((angle - self.start) / length).floor().clamp(0.0, (self.count - 1) as f64);
        (self.start + (k + 0.5) * length, 0.5 * length)
    }
}

impl BsplineCurve {
    /// The straight line from `a` to `b` over the parameters from `start` to `end`.
    ///
    /// # Errors
    /// [`SplineError`] if `end` is not above `start` or a number is not finite.
    pub fn segment(a: DVec3, b: DVec3, start: f64, end: f64) -> Result<Self, SplineError> {
        let knots = KnotVector::new(Degree::new(1)?, vec![start, start, end, end])?;
        Self::new(knots, vec![a, b], None)
    }

    /// The arc `center + cos θ · x + sin θ · y` for the angles of `spans`, exact as a rational
    /// quadratic curve over knots that are angles (Piegl and Tiller 1997, Sec. 7.5).
    ///
    /// # Errors
    /// [`SplineError`] if a number is not finite.
    ///
    /// # Example
    /// ```
    /// use bspline::{ArcSpans, BsplineCurve};
    /// use geom_core::DVec3;
    /// let half_turn = ArcSpans::new(0.0, std::f64::consts::PI);
    /// let arc = BsplineCurve::arc(DVec3::ZERO, DVec3::X, DVec3::Y, half_turn)?;
    /// let at = arc.point(half_turn.parameter(0.3));
    /// assert!(at.distance(DVec3::new(0.3_f64.cos(), 0.3_f64.sin(), 0.0)) < 1e-15);
    /// # Ok::<(), bspline::SplineError>(())
    /// ```
    pub fn arc(center: DVec3, x: DVec3, y: DVec3, spans: ArcSpans) -> Result<Self, SplineError> {
        let control = spans.control();
        let points = control.iter().map(|[c, s, _]| center + *c * x + *s * y).collect();
        Self::new(spans.knots()?, points, Some(control.iter().map(|c| c[2]).collect()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    #[test]
    fn angles_and_parameters_agree_on_any_arc() {
        for (start, end) in [(0.0, TAU), (-0.3, 1.1), (2.0, 2.0 + 1e-3), (1.0, 1.0 + FRAC_PI_2)] {
            let spans = ArcSpans::new(start, end);
            let arc = BsplineCurve::arc(DVec3::Z, 2.0 * DVec3::X, 3.0 * DVec3::Y, spans).unwrap();
            for k in 0..=40 {
                let angle = start + (end - start) * f64::from(k) / 40.0;
                let t = spans.parameter(angle);
                assert_close(spans.angle(t), angle, 1e-14 * (1.0 + angle.abs()));
                let wanted = DVec3::new(2.0 * angle.cos(), 3.0 * angle.sin(), 1.0);
                assert_close(arc.point(t).distance(wanted), 0.0, 4e-15);
            }
        }
        assert_eq!(ArcSpans::new(0.0, TAU).count(), 4);
        assert_eq!(ArcSpans::new(1.0, 1.0 + TAU).count(), 4);
        let ring =
            BsplineCurve::arc(DVec3::ZERO, DVec3::X, DVec3::Y, ArcSpans::new(1.0, 1.0 + TAU));
        let ring = ring.unwrap();
        assert_eq!(ring.control_points()[0], ring.control_points()[8]);
    }
}
