//! Scalars to write formulas on once: plain numbers or numbers with derivatives.

use crate::real::Real;
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Sub, SubAssign};

/// A scalar: `f64`, or [`Dual`](crate::Dual), which carries derivatives along.
///
/// A formula written over any `Number` gives values and, on duals, derivatives that are exact to
/// rounding. Operators take another number or an `f64` on the right; branches look at
/// [`value`](Number::value).
///
/// # Example
/// The length of an edge and its derivatives by the six coordinates of its ends:
/// ```
/// use numerics::{Dual, Number};
///
/// fn length<T: Number>(ends: &[T]) -> T {
///     (0..3).map(|c| (ends[3 + c] - ends[c]).powi(2)).sum::<T>().sqrt()
/// }
///
/// let ends = [0.0, 0.0, 0.0, 2.0, 3.0, 6.0];
/// assert_eq!(length(&ends), 7.0);
/// let dual = length(&Dual::variables(ends));
/// assert_eq!(dual.value, 7.0);
/// for c in 0..3 {
///     assert!((dual.partials[3 + c] - ends[3 + c] / 7.0).abs() < 1e-15);
///     assert_eq!(dual.partials[c], -dual.partials[3 + c]);
/// }
/// ```
pub trait Number:
    Real
    + PartialEq
    + From<f64>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Div<Output = Self>
    + Div<f64, Output = Self>
    + AddAssign
    + SubAssign
    + Sum
{
    /// The number without its derivatives.
    fn value(self) -> f64;

    /// The sine of an angle in radians.
    #[must_use]
    fn sin(self) -> Self;

    /// The cosine of an angle in radians.
    #[must_use]
    fn cos(self) -> Self;

    /// `eˣ`.
    #[must_use]
    fn exp(self) -> Self;

    /// The natural logarithm.
    #[must_use]
    fn ln(self) -> Self;

    /// The arc tangent, in `(−π/2, π/2)`.
    #[must_use]
    fn atan(self) -> Self;

    /// The angle of the vector `(x, self)` to the x-axis, in `(−π, π]`.
    #[must_use]
    fn atan2(self, x: Self) -> Self;

    /// The absolute value; its slope is the sign, +1 at `+0`.
    #[must_use]
    fn abs(self) -> Self;

    /// A whole power.
    #[must_use]
    fn powi(self, n: i32) -> Self;

    /// Any power of a positive number.
    #[must_use]
    fn powf(self, exponent: Self) -> Self;
}

impl Number for f64 {
    #[inline]
    fn value(self) -> f64 {
        self
    }

    #[inline]
    fn sin(self) -> Self {
        f64::sin(self)
    }

    #[inline]
    fn cos(self) -> Self {
        f64::cos(self)
    }

    #[inline]
    fn exp(self) -> Self {
        f64::exp(self)
    }

    #[inline]
    fn ln(self) -> Self {
        f64::ln(self)
    }

    #[inline]
    fn atan(self) -> Self {
        f64::atan(self)
    }

    #[inline]
    fn atan2(self, x: Self) -> Self {
        f64::atan2(self, x)
    }

    #[inline]
    fn abs(self) -> Self {
        f64::abs(self)
    }

    #[inline]
    fn powi(self, n: i32) -> Self {
        f64::powi(self, n)
    }

    #[inline]
    fn powf(self, exponent: Self) -> Self {
        f64::powf(self, exponent)
    }
}
