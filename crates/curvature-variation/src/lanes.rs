//! Vectors of samples with ordinary operators, on whatever instruction set the machine has.

use pulp::Simd;
use std::ops::{Add, Mul, Neg, Sub};

/// Begins with a line of the cache.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Aligned<T>(pub(crate) T);

/// Makes the compiler align the vectors that the calling function keeps on the stack.
///
/// A vector in memory is no more aligned than a number, and those that do not fit into registers
/// follow the stack as it comes, unless a variable asks for more. Without, every second access may
/// touch two lines of the cache, which cost a fifth of the time or nothing, as luck would have it.
#[inline(always)]
pub(crate) fn align_frame() {
    std::hint::black_box(&Aligned(0_u64));
}

/// A few samples' values side by side.
pub(crate) struct Lanes<S: Simd>(pub(crate) S, pub(crate) S::f64s);

impl<S: Simd> Clone for Lanes<S> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: Simd> Copy for Lanes<S> {}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub(crate) fn splat(simd: S, x: f64) -> Self {
        Self(simd, simd.splat_f64s(x))
    }

    /// `self · a + b`, rounded once where the machine can.
    #[inline(always)]
    pub(crate) fn fma(self, a: Self, b: Self) -> Self {
        Self(self.0, self.0.mul_add_e_f64s(self.1, a.1, b.1))
    }

    /// `b − self · a` with the same `a` in all lanes.
    #[inline(always)]
    pub(crate) fn fnma(self, a: f64, b: Self) -> Self {
        self.fma_by(-a, b)
    }

    /// `self · a + b` with the same `a` in all lanes.
    #[inline(always)]
    pub(crate) fn fma_by(self, a: f64, b: Self) -> Self {
        self.fma(Self::splat(self.0, a), b)
    }

    #[inline(always)]
    pub(crate) fn sqrt(self) -> Self {
        Self(self.0, self.0.sqrt_f64s(self.1))
    }

    #[inline(always)]
    pub(crate) fn abs(self) -> Self {
        Self(self.0, self.0.abs_f64s(self.1))
    }

    #[inline(always)]
    pub(crate) fn recip(self) -> Self {
        let one = self.0.splat_f64s(1.0);
        Self(self.0, self.0.div_f64s(one, self.1))
    }

    #[inline(always)]
    pub(crate) fn sum(self) -> f64 {
        self.0.reduce_sum_f64s(self.1)
    }
}

impl<S: Simd> Add for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(self.0, self.0.add_f64s(self.1, other.1))
    }
}

impl<S: Simd> Sub for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(self.0, self.0.sub_f64s(self.1, other.1))
    }
}

impl<S: Simd> Mul for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self(self.0, self.0.mul_f64s(self.1, other.1))
    }
}

impl<S: Simd> Mul<f64> for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self(self.0, self.0.mul_f64s(self.1, self.0.splat_f64s(factor)))
    }
}

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(self.0, self.0.neg_f64s(self.1))
    }
}

pub(crate) type Vec3<S> = [Lanes<S>; 3];

#[inline(always)]
pub(crate) fn dot<S: Simd>(a: &Vec3<S>, b: &Vec3<S>) -> Lanes<S> {
    a[0].fma(b[0], a[1].fma(b[1], a[2] * b[2]))
}

#[inline(always)]
pub(crate) fn cross<S: Simd>(a: &Vec3<S>, b: &Vec3<S>) -> Vec3<S> {
    [a[1].fma(b[2], -(a[2] * b[1])), a[2].fma(b[0], -(a[0] * b[2])), a[0].fma(b[1], -(a[1] * b[0]))]
}

#[inline(always)]
pub(crate) fn scaled<S: Simd>(a: &Vec3<S>, s: Lanes<S>) -> Vec3<S> {
    [a[0] * s, a[1] * s, a[2] * s]
}

/// `a s + b`.
#[inline(always)]
pub(crate) fn axpy<S: Simd>(a: &Vec3<S>, s: Lanes<S>, b: &Vec3<S>) -> Vec3<S> {
    [a[0].fma(s, b[0]), a[1].fma(s, b[1]), a[2].fma(s, b[2])]
}
