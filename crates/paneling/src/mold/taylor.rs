//! Values with their first and second derivatives in a few variables.

/// A function of `N` variables at one point, with first and second derivatives.
#[derive(Clone, Copy)]
pub(crate) struct Taylor<const N: usize> {
    pub(crate) value: f64,
    pub(crate) first: [f64; N],
    pub(crate) second: [[f64; N]; N],
}

impl<const N: usize> Taylor<N> {
    #[inline]
    pub(crate) fn constant(value: f64) -> Self {
        Self { value, first: [0.0; N], second: [[0.0; N]; N] }
    }

    #[inline]
    pub(crate) fn variable(value: f64, index: usize) -> Self {
        let mut made = Self::constant(value);
        made.first[index] = 1.0;
        made
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

    #[inline]
    pub(crate) fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    #[inline]
    pub(crate) fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    #[inline]
    pub(crate) fn mul(self, other: Self) -> Self {
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

    #[inline]
    pub(crate) fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.then(root, 0.5 / root, -0.25 / (root * self.value))
    }

    #[inline]
    pub(crate) fn div(self, other: Self) -> Self {
        let r = 1.0 / other.value;
        self.mul(other.then(r, -r * r, 2.0 * r * r * r))
    }
}
