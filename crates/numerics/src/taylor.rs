//! Values with their first and second derivatives in a few variables.

use std::ops::{Add, Div, Mul, Sub};

/// A function of `N` variables at one point, with first and second derivatives.
///
/// The Hessian is filled on both sides of the diagonal; for first derivatives alone
/// [`Dual`](crate::Dual) does with a fraction of the work.
///
/// # Example
/// ```
/// use numerics::Taylor;
/// let [x, y] = Taylor::variables([3.0, 4.0]);
/// let length = (x * x + y * y).sqrt();
/// assert_eq!(length.value, 5.0);
/// assert!((length.first[0] - 0.6).abs() < 1e-15);
/// assert!((length.second[0][0] - 16.0 / 125.0).abs() < 1e-15);
/// assert!((length.second[0][1] + 12.0 / 125.0).abs() < 1e-15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Taylor<const N: usize> {
    /// The value.
    pub value: f64,
    /// `first[i]` is the derivative by variable `i`.
    pub first: [f64; N],
    /// `second[i][j]` is the derivative by variables `i` and `j`.
    pub second: [[f64; N]; N],
}

impl<const N: usize> Taylor<N> {
    /// A constant: all derivatives are zero.
    #[inline]
    #[must_use]
    pub fn constant(value: f64) -> Self {
        Self { value, first: [0.0; N], second: [[0.0; N]; N] }
    }

    /// The variable number `index`.
    ///
    /// # Panics
    /// If there are not that many variables.
    #[inline]
    #[must_use]
    pub fn variable(value: f64, index: usize) -> Self {
        let mut made = Self::constant(value);
        made.first[index] = 1.0;
        made
    }

    /// All `N` variables at a point.
    #[inline]
    #[must_use]
    pub fn variables(at: [f64; N]) -> [Self; N] {
        std::array::from_fn(|i| Self::variable(at[i], i))
    }

    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = self;
        out.value = f(self.value, other.value);
        for i in 0..N {
            out.first[i] = f(self.first[i], other.first[i]);
            for j in 0..N {
                out.second[i][j] = f(self.second[i][j], other.second[i][j]);
            }
        }
        out
    }

    /// Composition with a function of one variable, given its value and two derivatives.
    fn then(self, value: f64, d1: f64, d2: f64) -> Self {
        let mut out = Self::constant(value);
        for i in 0..N {
            out.first[i] = d1 * self.first[i];
            for j in 0..N {
                out.second[i][j] = d1 * self.second[i][j] + d2 * self.first[i] * self.first[j];
            }
        }
        out
    }

    /// The square root.
    #[inline]
    #[must_use]
    pub fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.then(root, 0.5 / root, -0.25 / (root * self.value))
    }
}

impl<const N: usize> Add for Taylor<N> {
    type Output = Self;
    #[inline]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl<const N: usize> Sub for Taylor<N> {
    type Output = Self;
    #[inline]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl<const N: usize> Mul for Taylor<N> {
    type Output = Self;
    #[inline]
    fn mul(self, other: Self) -> Self {
        let mut out = Self::constant(self.value * other.value);
        for i in 0..N {
            out.first[i] = self.value * other.first[i] + self.first[i] * other.value;
            for j in 0..N {
                out.second[i][j] = self.value * other.second[i][j]
                    + self.first[i] * other.first[j]
                    + self.first[j] * other.first[i]
                    + self.second[i][j] * other.value;
            }
        }
        out
    }
}

impl<const N: usize> Div for Taylor<N> {
    type Output = Self;
    #[inline]
    fn div(self, other: Self) -> Self {
        let r = 1.0 / other.value;
        self * other.then(r, -r * r, 2.0 * r * r * r)
    }
}
