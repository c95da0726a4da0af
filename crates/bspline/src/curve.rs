//! B-spline curves, polynomial and rational.

use crate::basis::MAX_DERIVATIVE;
use crate::error::SplineError;
use crate::knots::KnotVector;
use crate::rational;
use glam::{DVec3, DVec4};

/// A B-spline curve: one control point per basis function, all finite, weights positive (kept by
/// the constructors).
///
/// # Example
/// ```
/// use bspline::{BsplineCurve, Degree, KnotVector};
/// use geom_core::DVec3;
/// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 3)?;
/// let curve = BsplineCurve::new(knots, vec![DVec3::ZERO, DVec3::X, DVec3::Y], None)?;
/// assert_eq!(curve.point(0.5), DVec3::new(0.5, 0.25, 0.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BsplineCurve {
    knots: KnotVector,
    control_points: Vec<DVec3>,
    weights: Option<Vec<f64>>,
}

impl BsplineCurve {
    /// A curve; `weights`, if any, are one positive number per control point.
    ///
    /// # Errors
    /// [`SplineError`] says which count or number is at fault.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineCurve, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// // A quarter of the unit circle, exact by its weights.
    /// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 3)?;
    /// let points = vec![DVec3::X, DVec3::X + DVec3::Y, DVec3::Y];
    /// let arc = BsplineCurve::new(knots, points, Some(vec![1.0, 0.5_f64.sqrt(), 1.0]))?;
    /// assert!((arc.point(0.3).length() - 1.0).abs() < 1e-15);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn new(
        knots: KnotVector,
        control_points: Vec<DVec3>,
        weights: Option<Vec<f64>>,
    ) -> Result<Self, SplineError> {
        crate::error::check_control(knots.control_count(), &control_points, weights.as_deref())?;
        Ok(Self { knots, control_points, weights })
    }

    /// The knots.
    #[must_use]
    pub fn knots(&self) -> &KnotVector {
        &self.knots
    }

    /// The control points.
    #[must_use]
    pub fn control_points(&self) -> &[DVec3] {
        &self.control_points
    }

    /// The weights, if the curve is rational.
    #[must_use]
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// The point at parameter `t`.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineCurve, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// // A parabola as a Bézier curve: its middle is half way to the middle control point.
    /// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 3)?;
    /// let parabola = BsplineCurve::new(knots, vec![-DVec3::X, 2.0 * DVec3::Y, DVec3::X], None)?;
    /// assert_eq!(parabola.point(0.5), DVec3::Y);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn point(&self, t: f64) -> DVec3 {
        self.derivatives(t, 0)[0]
    }

    /// Point and derivatives up to `order`; entries above it are zero.
    ///
    /// # Panics
    /// If `order` exceeds [`MAX_DERIVATIVE`].
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineCurve, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 3)?; // (2 t − t², t²)
    /// let points = vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y];
    /// let parabola = BsplineCurve::new(knots, points, None)?;
    /// let [point, velocity, acceleration, ..] = parabola.derivatives(0.5, 2);
    /// assert_eq!(point, DVec3::new(0.75, 0.25, 0.0));
    /// assert_eq!(velocity, DVec3::new(1.0, 1.0, 0.0));
    /// assert_eq!(acceleration, DVec3::new(-2.0, 2.0, 0.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn derivatives(&self, t: f64, order: usize) -> [DVec3; MAX_DERIVATIVE + 1] {
        let basis = self.knots.basis(t, order);
        let mut sums = [DVec4::ZERO; MAX_DERIVATIVE + 1];
        for r in 0..self.knots.degree().order() {
            let i = self.knots.control_index(basis.span, r);
            let w = self.weights.as_ref().map_or(1.0, |w| w[i]);
            let point = (self.control_points[i] * w).extend(w);
            for k in 0..=order {
                sums[k] += basis.values[k][r] * point;
            }
        }
        match self.weights {
            None => sums.map(|s| s.truncate()),
            Some(_) => rational::curve(&sums, order),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Degree;
    use geom_core::assert_close;

    #[test]
    fn rational_quarter_circle_is_a_circle_with_exact_derivatives() {
        let knots = KnotVector::clamped_uniform(Degree::new(2).unwrap(), 3).unwrap();
        let points = vec![DVec3::X, DVec3::new(1.0, 1.0, 0.0), DVec3::Y];
        let weights = Some(vec![1.0, 0.5_f64.sqrt(), 1.0]);
        let circle = BsplineCurve::new(knots, points, weights).unwrap();
        for i in 0..=10 {
            let d = circle.derivatives(f64::from(i) / 10.0, 4);
            assert_close(d[0].length(), 1.0, 1e-15);
            // Derivatives of |c|^2 = 1 up to order four.
            assert_close(d[0].dot(d[1]), 0.0, 1e-14);
            assert_close(d[1].dot(d[1]) + d[0].dot(d[2]), 0.0, 1e-14);
            assert_close(3.0 * d[1].dot(d[2]) + d[0].dot(d[3]), 0.0, 1e-13);
            let fourth = 3.0 * d[2].dot(d[2]) + 4.0 * d[1].dot(d[3]) + d[0].dot(d[4]);
            assert_close(fourth, 0.0, 1e-12);
        }
    }

    #[test]
    fn faults_are_named() {
        let knots = || KnotVector::clamped_uniform(Degree::new(1).unwrap(), 2).unwrap();
        let message = |points: Vec<DVec3>, weights: Option<Vec<f64>>| {
            BsplineCurve::new(knots(), points, weights).unwrap_err().to_string()
        };
        assert_eq!(
            message(vec![DVec3::ZERO], None),
            "the knots need 2 control points, found 1; change the knots or the control points"
        );
        assert_eq!(
            message(vec![DVec3::ZERO, DVec3::NAN], None),
            "control point 1 is [NaN, NaN, NaN]; coordinates must be finite"
        );
        assert_eq!(
            message(vec![DVec3::ZERO; 2], Some(vec![1.0])),
            "2 control points have 1 weights; give one weight for each, or none"
        );
        assert_eq!(
            message(vec![DVec3::ZERO; 2], Some(vec![1.0, 0.0])),
            "weight 1 is 0; weights must be positive and finite"
        );
    }
}
