//! What a kernel needs of a number, and vectors of space over such numbers.

use std::ops::{Add, Mul, Neg, Sub};

/// What a kernel needs of a number. One body then serves single samples (`f64`), SIMD lanes of
/// samples ([`Lanes`](crate::Lanes)), and derivatives of both ([`Dual`](crate::Dual)).
///
/// There is no way from an `f64` to lanes without a token of the instruction set, so constants
/// are made from a number at hand, by [`Real::constant`].
///
/// # Example
/// ```
/// use numerics::{Dual, Real};
/// fn length<T: Real>(x: T, y: T) -> T {
///     x.fma(x, y * y).sqrt()
/// }
/// assert_eq!(length(3.0, 4.0), 5.0);
/// let x = Dual { value: 3.0, partials: [1.0] };
/// let y = Dual { value: 4.0, partials: [0.0] };
/// assert!((length(x, y).partials[0] - 0.6).abs() < 1e-15);
/// ```
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Neg<Output = Self>
{
    /// `self · b + c`, rounded once where a kernel runs on a machine that can.
    fn fma(self, b: Self, c: Self) -> Self;

    /// `1 / self`.
    #[must_use]
    fn recip(self) -> Self;

    /// The square root.
    #[must_use]
    fn sqrt(self) -> Self;

    /// A constant of the same kind.
    #[must_use]
    fn constant(self, value: f64) -> Self;

    /// The derivative `self` of an inner function times the `slope` of the outer one.
    ///
    /// For scalars, and dual numbers over them, a derivative of zero stays zero where the slope is
    /// infinite, as that of a root at zero; lanes just multiply.
    #[inline(always)]
    #[must_use]
    fn chain(self, slope: Self) -> Self {
        self * slope
    }
}

impl Real for f64 {
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        // Not `f64::mul_add`: without the instruction that is a slow library call.
        self * b + c
    }

    #[inline(always)]
    fn recip(self) -> Self {
        1.0 / self
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn chain(self, slope: Self) -> Self {
        if self == 0.0 { 0.0 } else { self * slope }
    }
}

/// A vector of space over any [`Real`].
///
/// # Example
/// ```
/// use numerics::Triple;
/// let (x, y) = (Triple { x: 1.0, y: 0.0, z: 0.0 }, Triple { x: 0.0, y: 2.0, z: 0.0 });
/// assert_eq!(x.cross(y), Triple { x: 0.0, y: 0.0, z: 2.0 });
/// assert_eq!(x.plus(0.5, y).dot(y), 2.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the coordinates have no other names")]
pub struct Triple<T> {
    pub x: T,
    pub y: T,
    pub z: T,
}

impl<T: Real> Triple<T> {
    /// The vector `(value, value, value)`.
    #[inline(always)]
    pub fn splat(value: T) -> Self {
        Self { x: value, y: value, z: value }
    }

    /// The coordinates in order.
    #[inline(always)]
    pub fn to_array(self) -> [T; 3] {
        [self.x, self.y, self.z]
    }

    /// The scalar product.
    #[inline(always)]
    pub fn dot(self, b: Self) -> T {
        self.x.fma(b.x, self.y.fma(b.y, self.z * b.z))
    }

    /// The vector product, every product rounded by itself: exactly zero for equal vectors.
    #[inline(always)]
    #[must_use]
    pub fn cross(self, b: Self) -> Self {
        Self {
            x: self.y * b.z - self.z * b.y,
            y: self.z * b.x - self.x * b.z,
            z: self.x * b.y - self.y * b.x,
        }
    }

    /// The vector product by [`Real::fma`], three operations fewer than [`cross`](Self::cross);
    /// results of kernels written on either depend on the last bits, so both are kept.
    #[inline(always)]
    #[must_use]
    pub fn cross_fused(self, b: Self) -> Self {
        Self {
            x: self.y.fma(b.z, -(self.z * b.y)),
            y: self.z.fma(b.x, -(self.x * b.z)),
            z: self.x.fma(b.y, -(self.y * b.x)),
        }
    }

    /// `factor · self`.
    #[inline(always)]
    #[must_use]
    pub fn scale(self, factor: T) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }

    /// `self + factor · b`.
    #[inline(always)]
    #[must_use]
    pub fn plus(self, factor: T, b: Self) -> Self {
        Self { x: factor.fma(b.x, self.x), y: factor.fma(b.y, self.y), z: factor.fma(b.z, self.z) }
    }

    /// The zero vector of the same kind.
    #[inline(always)]
    #[must_use]
    pub fn zero(self) -> Self {
        Self::splat(self.x.constant(0.0))
    }
}

impl<T: Real> Add for Triple<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self { x: self.x + b.x, y: self.y + b.y, z: self.z + b.z }
    }
}
