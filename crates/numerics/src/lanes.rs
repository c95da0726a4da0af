//! Vectors of samples with ordinary operators, on whatever instruction set the machine has.

use crate::real::Real;
use pulp::Simd;
use std::ops::{Add, Mul, Neg, Sub};

/// Begins with a line of the cache.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Aligned<T>(pub T);

/// Makes the compiler align the vectors that the calling function keeps on the stack.
///
/// A vector in memory is no more aligned than a number, and those that do not fit into registers
/// follow the stack as it comes, unless a variable asks for more. Without, every second access may
/// touch two lines of the cache, which cost a fifth of the time or nothing, as luck would have it.
#[inline(always)]
pub fn align_frame() {
    std::hint::black_box(&Aligned(0_u64));
}

/// One SIMD register: a few samples' values side by side.
///
/// Every function here is inlined, so that it is compiled with the instruction set of the kernel
/// that calls it. The kernel itself must be reached through [`pulp::Arch::dispatch`] and be
/// `#[inline(always)]` all the way; a closure or an adaptor of an array in between that is not
/// inlined makes every operation a call.
///
/// # Example
/// ```
/// use numerics::{Lanes, Real};
/// use pulp::{Arch, Simd, WithSimd};
///
/// /// `Σ √(1 + x²)` over numbers whose count is a multiple of the lanes.
/// struct Lengths<'a>(&'a [f64]);
///
/// impl WithSimd for Lengths<'_> {
///     type Output = f64;
///     #[inline(always)]
///     fn with_simd<S: Simd>(self, simd: S) -> f64 {
///         let one = Lanes::splat(simd, 1.0);
///         let mut sum = Lanes::splat(simd, 0.0);
///         for &x in S::as_simd_f64s(self.0).0 {
///             let x = Lanes::new(simd, x);
///             sum = sum + x.fma(x, one).sqrt();
///         }
///         sum.sum()
///     }
/// }
///
/// let sum = Arch::new().dispatch(Lengths(&[0.75; 16]));
/// assert!((sum - 20.0).abs() < 1e-14);
/// ```
pub struct Lanes<S: Simd> {
    /// The token of the instruction set.
    pub simd: S,
    /// The register.
    pub value: S::f64s,
}

impl<S: Simd> Clone for Lanes<S> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Simd> Copy for Lanes<S> {}

impl<S: Simd> Lanes<S> {
    /// A register as it is.
    #[inline(always)]
    pub fn new(simd: S, value: S::f64s) -> Self {
        Self { simd, value }
    }

    /// The same number in all lanes.
    #[inline(always)]
    pub fn splat(simd: S, x: f64) -> Self {
        Self::new(simd, simd.splat_f64s(x))
    }

    /// `b − self · a` with the same `a` in all lanes.
    #[inline(always)]
    #[must_use]
    pub fn fnma(self, a: f64, b: Self) -> Self {
        self.fma_by(-a, b)
    }

    /// `self · a + b` with the same `a` in all lanes.
    #[inline(always)]
    #[must_use]
    pub fn fma_by(self, a: f64, b: Self) -> Self {
        self.fma(Self::splat(self.simd, a), b)
    }

    /// The absolute values.
    #[inline(always)]
    #[must_use]
    pub fn abs(self) -> Self {
        Self::new(self.simd, self.simd.abs_f64s(self.value))
    }

    /// The sum over the lanes.
    #[inline(always)]
    pub fn sum(self) -> f64 {
        self.simd.reduce_sum_f64s(self.value)
    }
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.add_f64s(self.value, other.value))
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.sub_f64s(self.value, other.value))
    }
}

impl<S: Simd> Mul for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self::new(self.simd, self.simd.mul_f64s(self.value, other.value))
    }
}

impl<S: Simd> Mul<f64> for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self::new(self.simd, self.simd.mul_f64s(self.value, self.simd.splat_f64s(factor)))
    }
}

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(self.simd, self.simd.neg_f64s(self.value))
    }
}

impl<S: Simd> Real for Lanes<S> {
    #[inline(always)]
    fn fma(self, b: Self, c: Self) -> Self {
        Self::new(self.simd, self.simd.mul_add_e_f64s(self.value, b.value, c.value))
    }

    #[inline(always)]
    fn recip(self) -> Self {
        Self::new(self.simd, self.simd.div_f64s(self.simd.splat_f64s(1.0), self.value))
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        Self::new(self.simd, self.simd.sqrt_f64s(self.value))
    }

    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }
}
