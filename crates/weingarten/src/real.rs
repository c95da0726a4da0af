//! The numbers the kernels run on: plain `f64`, a SIMD register of them, and dual numbers over either.

use std::ops::{Add, Mul, Neg, Sub};

use pulp::Simd;

/// What a kernel needs of a number. One body then serves single samples, SIMD lanes of samples,
/// and directional derivatives of both.
pub(crate) trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self>
{
    /// `self · b + c`, fused where the processor fuses.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// `self` times a constant.
    fn scale(self, factor: f64) -> Self;
    /// `1 / self`.
    fn recip(self) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// A constant of the same kind.
    fn constant(self, value: f64) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        // Not `f64::mul_add`: without the instruction that is a slow library call.
        self * b + c
    }
    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        self * factor
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
}

/// One SIMD register of samples.
#[derive(Clone, Copy)]
pub(crate) struct Lanes<S: Simd> {
    simd: S,
    pub(crate) value: S::f64s,
}

impl<S: Simd> Lanes<S> {
    #[inline(always)]
    pub(crate) fn new(simd: S, value: S::f64s) -> Self {
        Self { simd, value }
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

impl<S: Simd> Neg for Lanes<S> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(self.simd, self.simd.neg_f64s(self.value))
    }
}

impl<S: Simd> Real for Lanes<S> {
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self::new(self.simd, self.simd.mul_add_e_f64s(self.value, b.value, c.value))
    }
    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        Self::new(self.simd, self.simd.mul_f64s(self.value, self.simd.splat_f64s(factor)))
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
        Self::new(self.simd, self.simd.splat_f64s(value))
    }
}

/// `value + slope ε` with `ε² = 0`: carries one directional derivative through a computation.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Dual<T> {
    pub(crate) value: T,
    pub(crate) slope: T,
}

impl<T: Real> Add for Dual<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self { value: self.value + other.value, slope: self.slope + other.slope }
    }
}

impl<T: Real> Sub for Dual<T> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self { value: self.value - other.value, slope: self.slope - other.slope }
    }
}

impl<T: Real> Mul for Dual<T> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Self {
            value: self.value * other.value,
            slope: self.value.mul_add(other.slope, self.slope * other.value),
        }
    }
}

impl<T: Real> Neg for Dual<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self { value: -self.value, slope: -self.slope }
    }
}

impl<T: Real> Real for Dual<T> {
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Self {
            value: self.value.mul_add(b.value, c.value),
            slope: self.value.mul_add(b.slope, self.slope.mul_add(b.value, c.slope)),
        }
    }
    #[inline(always)]
    fn scale(self, factor: f64) -> Self {
        Self { value: self.value.scale(factor), slope: self.slope.scale(factor) }
    }
    #[inline(always)]
    fn recip(self) -> Self {
        let value = self.value.recip();
        Self { value, slope: -(self.slope * value * value) }
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        Self { value, slope: self.slope * value.recip().scale(0.5) }
    }
    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        Self { value: self.value.constant(value), slope: self.value.constant(0.0) }
    }
}

/// A vector of space over any [`Real`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Triple<T> {
    pub(crate) x: T,
    pub(crate) y: T,
    pub(crate) z: T,
}

impl<T: Real> Triple<T> {
    #[inline(always)]
    pub(crate) fn dot(self, b: Self) -> T {
        self.x.mul_add(b.x, self.y.mul_add(b.y, self.z * b.z))
    }
    #[inline(always)]
    pub(crate) fn cross(self, b: Self) -> Self {
        Self {
            x: self.y * b.z - self.z * b.y,
            y: self.z * b.x - self.x * b.z,
            z: self.x * b.y - self.y * b.x,
        }
    }
    #[inline(always)]
    pub(crate) fn scale(self, factor: T) -> Self {
        Self { x: self.x * factor, y: self.y * factor, z: self.z * factor }
    }
    /// `self + factor · b`.
    #[inline(always)]
    pub(crate) fn plus(self, factor: T, b: Self) -> Self {
        Self {
            x: factor.mul_add(b.x, self.x),
            y: factor.mul_add(b.y, self.y),
            z: factor.mul_add(b.z, self.z),
        }
    }
    #[inline(always)]
    pub(crate) fn zero(self) -> Self {
        let zero = self.x.constant(0.0);
        Self { x: zero, y: zero, z: zero }
    }
}

impl<T: Real> Add for Triple<T> {
    type Output = Self;
    #[inline(always)]
    fn add(self, b: Self) -> Self {
        Self { x: self.x + b.x, y: self.y + b.y, z: self.z + b.z }
    }
}

/// The vector `value + ε slope`.
#[inline(always)]
pub(crate) fn dual<T: Real>(value: Triple<T>, slope: Triple<T>) -> Triple<Dual<T>> {
    Triple {
        x: Dual { value: value.x, slope: slope.x },
        y: Dual { value: value.y, slope: slope.y },
        z: Dual { value: value.z, slope: slope.z },
    }
}

/// The derivative part of a dual vector.
#[inline(always)]
pub(crate) fn slope<T: Real>(v: Triple<Dual<T>>) -> Triple<T> {
    Triple { x: v.x.slope, y: v.y.slope, z: v.z.slope }
}
