//! Where a model stands and how large it is, taken out before anything is computed.

use crate::enclosing_ball::Ball;
use glam::DVec3;

/// The grid a centre is rounded to, in parts of the size: two to this power.
const GRID: i32 = -20;
/// Sizes beyond these have no squares of squares.
const SIZES: [f64; 2] = [1e-60, 1e60];

/// A move and a scaling that bring a model to the origin and to a size between one and two.
///
/// Both are exact where a computer can be exact. The scale is a power of two. The centre is that of
/// the smallest [`Ball`] around the points, rounded to a grid of 2⁻²⁰ of the size, so that a model
/// far from the origin loses nothing when it is moved: its coordinates are coarser than the
/// difference. A model moved by multiples of that grid has the same centred coordinates to the last
/// bit; one scaled by a power of two as well.
///
/// ```
/// use geom_core::{DVec3, Normalization};
/// let model = [DVec3::new(500_000.25, 0.0, 3.0), DVec3::new(500_003.25, 4.0, 3.0)];
/// let normal = Normalization::of(&model)?;
/// assert!((normal.size() - 5.0).abs() < 1e-12);
/// let centred = model.map(|p| normal.apply(p));
/// assert!(centred[0].distance(DVec3::new(-0.375, -0.5, 0.0)) < 1e-5);
/// assert_eq!(centred.map(|p| normal.restore(p)), model);
/// # Ok::<(), geom_core::NormalizationError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Normalization {
    center: DVec3,
    /// A power of two.
    scale: f64,
    size: f64,
}

/// Why a model has no size one could work with.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NormalizationError {
    /// There are no points, or coordinates that are not finite.
    #[error("the model has no points, or coordinates that are not finite")]
    Empty,
    /// All points are the same.
    #[error("all points of the model are equal ({x}, {y}, {z}), so it has no shape")]
    Point {
        /// Where they are.
        x: f64,
        /// Where they are.
        y: f64,
        /// Where they are.
        z: f64,
    },
    /// Products of lengths would overflow or vanish.
    #[error(
        "the model is {size:e} units large, beyond what can be computed with; choose a unit in which it is between 1e-60 and 1e60"
    )]
    Size {
        /// Diameter of the smallest ball around it.
        size: f64,
    },
    /// The model is so far from the origin that rounding has eaten its shape.
    #[error(
        "the model is {size:e} units large and {distance:e} units from the origin, so that its coordinates have no more than {digits} digits left; move it nearer to the origin where it is made"
    )]
    TooFar {
        /// Diameter of the smallest ball around it.
        size: f64,
        /// Distance of its centre from the origin.
        distance: f64,
        /// Decimal digits of its shape.
        digits: usize,
    },
}

impl Normalization {
    /// The normalisation of a model given by its points: the vertices of a mesh, or a grid of points
    /// on a surface.
    ///
    /// # Errors
    /// [`NormalizationError`] for models without points or shape, too large, too small or too far
    /// away.
    pub fn of(points: &[DVec3]) -> Result<Self, NormalizationError> {
        // The ball squares; coordinates that cannot be squared are looked at before.
        let largest = points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        if points.iter().all(|p| p.is_finite()) && largest > SIZES[1] {
            return Err(NormalizationError::Size { size: largest });
        }
        let ball = Ball::around(points).ok_or(NormalizationError::Empty)?;
        let size = ball.diameter();
        let distance = ball.center.length();
        if size == 0.0 || size <= 64.0 * f64::EPSILON * distance {
            let DVec3 { x, y, z } = points[0];
            return Err(NormalizationError::Point { x, y, z });
        }
        if !(SIZES[0]..=SIZES[1]).contains(&size) {
            return Err(NormalizationError::Size { size });
        }
        let digits = (size / (f64::EPSILON * distance)).log10();
        if digits < 4.0 {
            let digits = digits.max(0.0) as usize;
            return Err(NormalizationError::TooFar { size, distance, digits });
        }
        // 2^k ≤ size < 2^(k+1), to the bit whatever the platform's logarithm does.
        let power = ((size.to_bits() >> 52 & 0x7ff) as i32) - 1023;
        let grid = 2.0_f64.powi(power + GRID);
        let center = (ball.center / grid).round() * grid;
        Ok(Self { center, scale: 2.0_f64.powi(-power), size })
    }

    /// Diameter of the smallest ball around the model, in its own units.
    #[must_use]
    pub fn size(&self) -> f64 {
        self.size
    }

    /// The point that goes to the origin.
    #[must_use]
    pub fn center(&self) -> DVec3 {
        self.center
    }

    /// Normalised lengths per length of the model: a power of two.
    #[must_use]
    pub fn scale(&self) -> f64 {
        self.scale
    }

    /// A point of the model in normalised coordinates.
    #[must_use]
    pub fn apply(&self, point: DVec3) -> DVec3 {
        (point - self.center) * self.scale
    }

    /// A point in normalised coordinates back in those of the model.
    #[must_use]
    pub fn restore(&self, point: DVec3) -> DVec3 {
        point / self.scale + self.center
    }

    /// As [`restore`](Self::restore), for a point that was `given` before: one that nothing has moved
    /// comes back to the last bit.
    #[must_use]
    pub fn restore_given(&self, point: DVec3, given: DVec3) -> DVec3 {
        if point == self.apply(given) { given } else { self.restore(point) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn model() -> Vec<DVec3> {
        let part = |k: usize, step: f64| ((k as f64 * step).fract() * 1024.0).round() / 1024.0;
        (1..60)
            .map(|k| 7.0 * DVec3::new(part(k, 0.618_034), part(k, 0.754_878), part(k, 0.569_84)))
            .collect()
    }

    #[test]
    fn a_model_moved_by_the_grid_has_the_same_centred_coordinates() {
        let model = model();
        let here = Normalization::of(&model).unwrap();
        for far in [1e3, 5e5, 1e7] {
            let by = DVec3::new(far, -0.5 * far, 0.25 * far);
            let moved: Vec<_> = model.iter().map(|&p| p + by).collect();
            let there = Normalization::of(&moved).unwrap();
            for (&p, &q) in model.iter().zip(&moved) {
                assert_eq!(here.apply(p), there.apply(q));
                assert_eq!(there.restore(there.apply(q)), q);
            }
        }
    }

    #[test]
    fn powers_of_two_change_nothing_but_the_scale() {
        let model = model();
        let here = Normalization::of(&model).unwrap();
        for power in [-40, -3, 5, 60] {
            let factor = 2.0_f64.powi(power);
            let scaled: Vec<_> = model.iter().map(|&p| p * factor).collect();
            let there = Normalization::of(&scaled).unwrap();
            assert_eq!(there.size(), here.size() * factor);
            assert!(model.iter().zip(&scaled).all(|(&p, &q)| here.apply(p) == there.apply(q)));
        }
    }

    #[test]
    fn the_size_is_between_one_and_two() {
        for size in [1e-9, 0.9999, 1.0, 3.7, 2.0_f64.powi(30)] {
            let normal = Normalization::of(&[DVec3::ZERO, DVec3::new(size, 0.0, 0.0)]).unwrap();
            let scaled = normal.size() * normal.scale();
            assert!((1.0..2.0).contains(&scaled), "{size}: {scaled}");
        }
    }

    #[test]
    fn what_has_no_size_is_refused_and_says_why() {
        let of = |points: &[DVec3]| Normalization::of(points).unwrap_err().to_string();
        assert!(of(&[]).contains("no points"));
        assert!(of(&[DVec3::INFINITY]).contains("not finite"));
        assert!(of(&[DVec3::new(1.0, 2.0, 3.0); 4]).contains("equal (1, 2, 3)"));
        assert!(of(&[DVec3::ZERO, DVec3::splat(1e150)]).contains("between 1e-60 and 1e60"));
        assert!(of(&[DVec3::ZERO, DVec3::splat(1e-100)]).contains("1e-60"));
        let far = DVec3::splat(1e12);
        assert!(of(&[far, far + DVec3::X * 0.5]).contains("digits left"));
    }
}
