//! Dual numbers: a value with its partial derivatives.

use crate::number::Number;
use crate::real::{Real, Triple};
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// `value + Σ partials[k] εₖ` with `εₖ εₗ = 0`: carries `N` partial derivatives through a
/// computation, exact to rounding (forward-mode differentiation).
///
/// Over `f64` this is a [`Number`]; over [`Lanes`](crate::Lanes) it carries the derivatives of
/// many samples at once; over duals it carries second derivatives.
///
/// # Example
/// ```
/// use numerics::{Dual, Number, Real};
/// // ∂/∂x and ∂/∂y of x sin y at (2, 0).
/// let [x, y] = Dual::variables([2.0, 0.0]);
/// let f = x * y.sin();
/// assert_eq!((f.value, f.partials), (0.0, [0.0, 2.0]));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<const N: usize, T = f64> {
    /// The value.
    pub value: T,
    /// The derivative of the value by each of the `N` variables.
    pub partials: [T; N],
}

impl<const N: usize> Dual<N> {
    /// The variable number `index`: its derivative by itself is 1, by the others 0.
    ///
    /// # Panics
    /// If there are not that many variables.
    #[must_use]
    pub fn variable(value: f64, index: usize) -> Self {
        assert!(index < N, "variable {index} of {N}");
        let mut made = Self::from(value);
        made.partials[index] = 1.0;
        made
    }

    /// All `N` variables at a point.
    #[must_use]
    pub fn variables(at: [f64; N]) -> [Self; N] {
        std::array::from_fn(|k| Self::variable(at[k], k))
    }
}

impl<const N: usize, T: From<f64> + Copy> From<f64> for Dual<N, T> {
    /// A constant: all its derivatives are zero.
    fn from(value: f64) -> Self {
        Self { value: T::from(value), partials: [T::from(0.0); N] }
    }
}

// Loops over indices, not closures or adaptors of arrays: those are not always inlined, and then
// lanes lose the instruction set of the kernel around them.

impl<const N: usize, T: Real> Add for Dual<N, T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] = self.partials[k] + other.partials[k];
        }
        Self { value: self.value + other.value, partials }
    }
}

impl<const N: usize, T: Real> Sub for Dual<N, T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] = self.partials[k] - other.partials[k];
        }
        Self { value: self.value - other.value, partials }
    }
}

impl<const N: usize, T: Real> Mul for Dual<N, T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] = self.value.fma(other.partials[k], self.partials[k] * other.value);
        }
        Self { value: self.value * other.value, partials }
    }
}

impl<const N: usize, T: Real> Mul<f64> for Dual<N, T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] = self.partials[k] * factor;
        }
        Self { value: self.value * factor, partials }
    }
}

impl<const N: usize, T: Real> Neg for Dual<N, T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] = -self.partials[k];
        }
        Self { value: -self.value, partials }
    }
}

impl<const N: usize, T: Real> Real for Dual<N, T> {
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] =
                self.value.fma(b.partials[k], self.partials[k].fma(b.value, c.partials[k]));
        }
        Self { value: self.value.fma(b.value, c.value), partials }
    }

    #[inline(always)]
    fn recip(self) -> Self {
        let value = self.value.recip();
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] = -(self.partials[k] * value * value);
        }
        Self { value, partials }
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        self.through(value, value.recip() * 0.5)
    }

    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        Self { value: self.value.constant(value), partials: [self.value.constant(0.0); N] }
    }

    #[inline(always)]
    fn chain(self, slope: Self) -> Self {
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] = self.value.chain(slope.partials[k]) + self.partials[k].chain(slope.value);
        }
        Self { value: self.value.chain(slope.value), partials }
    }
}

impl<const N: usize, T: Real> Dual<N, T> {
    /// A function with this value and slope at `self.value`.
    #[inline(always)]
    fn through(self, value: T, slope: T) -> Self {
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] = self.partials[k].chain(slope);
        }
        Self { value, partials }
    }
}

impl<T: Real> Triple<T> {
    /// The vector `self + ε direction`, whose images carry the derivative in that direction.
    #[inline(always)]
    pub fn towards(self, direction: Self) -> Triple<Dual<1, T>> {
        Triple {
            x: Dual { value: self.x, partials: [direction.x] },
            y: Dual { value: self.y, partials: [direction.y] },
            z: Dual { value: self.z, partials: [direction.z] },
        }
    }
}

impl<T: Real> Triple<Dual<1, T>> {
    /// The derivative part.
    #[inline(always)]
    pub fn slope(self) -> Triple<T> {
        Triple { x: self.x.partials[0], y: self.y.partials[0], z: self.z.partials[0] }
    }
}

impl<const N: usize, T: Number> Div for Dual<N, T> {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] = (self.partials[k] - value * other.partials[k]) / other.value;
        }
        Self { value, partials }
    }
}

impl<const N: usize, T: Number> Div<f64> for Dual<N, T> {
    type Output = Self;
    #[inline]
    fn div(self, divisor: f64) -> Self {
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] = self.partials[k] / divisor;
        }
        Self { value: self.value / divisor, partials }
    }
}

impl<const N: usize, T: Number> Add<f64> for Dual<N, T> {
    type Output = Self;
    #[inline]
    fn add(self, other: f64) -> Self {
        Self { value: self.value + other, ..self }
    }
}

impl<const N: usize, T: Number> Sub<f64> for Dual<N, T> {
    type Output = Self;
    #[inline]
    fn sub(self, other: f64) -> Self {
        Self { value: self.value - other, ..self }
    }
}

impl<const N: usize, T: Number> Add<Dual<N, T>> for f64 {
    type Output = Dual<N, T>;
    #[inline]
    fn add(self, other: Dual<N, T>) -> Dual<N, T> {
        other + self
    }
}

impl<const N: usize, T: Number> Sub<Dual<N, T>> for f64 {
    type Output = Dual<N, T>;
    #[inline]
    fn sub(self, other: Dual<N, T>) -> Dual<N, T> {
        Dual::from(self) - other
    }
}

impl<const N: usize, T: Number> Mul<Dual<N, T>> for f64 {
    type Output = Dual<N, T>;
    #[inline]
    fn mul(self, other: Dual<N, T>) -> Dual<N, T> {
        other * self
    }
}

impl<const N: usize, T: Number> Div<Dual<N, T>> for f64 {
    type Output = Dual<N, T>;
    #[inline]
    fn div(self, other: Dual<N, T>) -> Dual<N, T> {
        Dual::from(self) / other
    }
}

impl<const N: usize, T: Real> AddAssign for Dual<N, T> {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const N: usize, T: Real> SubAssign for Dual<N, T> {
    #[inline]
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl<const N: usize, T: Number> Sum for Dual<N, T> {
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::from(0.0), |sum, x| sum + x)
    }
}

impl<const N: usize, T: Number> Number for Dual<N, T> {
    #[inline]
    fn value(self) -> f64 {
        self.value.value()
    }

    #[inline]
    fn sin(self) -> Self {
        self.through(self.value.sin(), self.value.cos())
    }

    #[inline]
    fn cos(self) -> Self {
        self.through(self.value.cos(), -self.value.sin())
    }

    #[inline]
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.through(value, value)
    }

    #[inline]
    fn ln(self) -> Self {
        self.through(self.value.ln(), self.value.recip())
    }

    #[inline]
    fn atan(self) -> Self {
        self.through(self.value.atan(), (self.value * self.value + 1.0).recip())
    }

    #[inline]
    fn atan2(self, x: Self) -> Self {
        let square = self.value * self.value + x.value * x.value;
        let (along, across) = (x.value / square, self.value / square);
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] = self.partials[k].chain(along) - x.partials[k].chain(across);
        }
        Self { value: self.value.atan2(x.value), partials }
    }

    #[inline]
    fn abs(self) -> Self {
        self.through(self.value.abs(), T::from(self.value().signum()))
    }

    #[inline]
    fn powi(self, n: i32) -> Self {
        if n == 0 {
            return Self::from(1.0);
        }
        self.through(self.value.powi(n), self.value.powi(n - 1) * f64::from(n))
    }

    #[inline]
    fn powf(self, exponent: Self) -> Self {
        let value = self.value.powf(exponent.value);
        let by_base = exponent.value * self.value.powf(exponent.value - 1.0);
        let by_exponent = value * self.value.ln();
        let mut partials = self.partials;
        for k in 0..N {
            partials[k] = self.partials[k].chain(by_base) + exponent.partials[k].chain(by_exponent);
        }
        Self { value, partials }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assert_close;

    #[test]
    fn lengths_at_zero_have_finite_derivatives() {
        // √(x² + y²) at the origin: both squares have derivative zero, the root an infinite one.
        let [x, y] = Dual::variables([0.0, 0.0]);
        assert_eq!((x * x + y * y).sqrt(), Dual::from(0.0));
        // At the second level too.
        let z: Dual<1, Dual<1>> = Dual::from(0.0);
        assert_eq!(z.sqrt(), Dual::from(0.0));
    }

    #[test]
    fn absolute_value_takes_the_right_derivative_at_zero() {
        let x = Dual::<1>::variable(0.0, 0);
        assert_eq!(x.abs().partials, [1.0]);
        assert_eq!((-x).abs().partials, [-1.0 * -1.0]);
    }

    #[test]
    fn powers_of_zero_have_finite_derivatives() {
        let x = Dual::<1>::variable(0.0, 0);
        assert_eq!(x.powi(0), Dual::from(1.0));
        assert_eq!(x.powi(1), x);
        assert_eq!(x.powi(3).partials, [0.0]);
        assert_eq!(x.powf(Dual::from(2.0)).partials, [0.0]);
    }

    #[test]
    fn duals_of_duals_hold_second_derivatives() {
        // f(x, y) = exp(x) / y: mixed derivative −exp(x) / y².
        let x = Dual { value: Dual { value: 0.3, partials: [1.0] }, partials: [Dual::from(0.0)] };
        let y = Dual { value: Dual { value: 1.7, partials: [0.0] }, partials: [Dual::from(1.0)] };
        let f: Dual<1, Dual<1>> = x.exp() / y;
        assert_close(f.value(), 0.3_f64.exp() / 1.7, 1e-15);
        assert_close(f.partials[0].partials[0], -0.3_f64.exp() / (1.7 * 1.7), 1e-15);
    }

    #[test]
    #[should_panic(expected = "variable 2 of 2")]
    fn a_variable_that_is_not_there_is_refused() {
        let _ = Dual::<2>::variable(1.0, 2);
    }
}
