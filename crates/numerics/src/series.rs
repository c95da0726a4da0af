//! Power series in one variable, cut off after a few terms.

use std::ops::{Add, Mul, Neg, Sub};

/// The first `N` coefficients `c₀ + c₁ t + c₂ t² + …` of a function of one variable: the k-th
/// derivative at `t = 0` is `k! cₖ`.
///
/// # Example
/// ```
/// use numerics::Series;
/// // 1/(1 − t) = 1 + t + t² + …
/// assert_eq!(Series([1.0, -1.0, 0.0, 0.0]).recip(), Series([1.0; 4]));
/// // eᵗ e⁻ᵗ = 1.
/// let t = Series([0.0, 1.0, 0.0]);
/// assert_eq!(t.exp() * (-t).exp(), Series::constant(1.0));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Series<const N: usize>(pub [f64; N]);

impl<const N: usize> Series<N> {
    /// A constant.
    ///
    /// # Panics
    /// If there is not even one coefficient.
    #[must_use]
    pub fn constant(c: f64) -> Self {
        let mut out = [0.0; N];
        out[0] = c;
        Self(out)
    }

    /// `1 / self`; infinite or NaN if the constant term is zero.
    #[must_use]
    pub fn recip(self) -> Self {
        let mut out = Self::constant(1.0 / self.0[0]).0;
        for i in 1..N {
            let sum: f64 = (1..=i).map(|j| self.0[j] * out[i - j]).sum();
            out[i] = -sum * out[0];
        }
        Self(out)
    }

    /// `e^self`.
    #[must_use]
    pub fn exp(self) -> Self {
        let mut out = Self::constant(self.0[0].exp()).0;
        for i in 1..N {
            let sum: f64 = (1..=i).map(|j| j as f64 * self.0[j] * out[i - j]).sum();
            out[i] = sum / i as f64;
        }
        Self(out)
    }
}

impl<const N: usize> Add for Series<N> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl<const N: usize> Sub for Series<N> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] - other.0[i]))
    }
}

impl<const N: usize> Neg for Series<N> {
    type Output = Self;
    fn neg(self) -> Self {
        Self(self.0.map(|c| -c))
    }
}

impl<const N: usize> Mul for Series<N> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| (0..=i).map(|j| self.0[j] * other.0[i - j]).sum()))
    }
}

impl<const N: usize> Mul<f64> for Series<N> {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self(self.0.map(|c| factor * c))
    }
}
