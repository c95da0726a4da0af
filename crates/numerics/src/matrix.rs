//! Dense row-major matrices of a few dozen rows.

use std::ops::{Index, IndexMut};

use crate::vector::{axpy, dot};

/// A dense row-major matrix.
///
/// # Example
/// ```
/// use numerics::Matrix;
/// let mut turn = Matrix::zeros(2, 2);
/// turn[(0, 1)] = -1.0;
/// turn[(1, 0)] = 1.0;
/// assert_eq!(turn.apply(&[2.0, 3.0]), [-3.0, 2.0]);
/// assert_eq!(turn.transpose_product(&turn), Matrix::identity(2));
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matrix {
    rows: usize,
    cols: usize,
    data: Vec<f64>,
}

impl Matrix {
    /// All zeros.
    #[must_use]
    pub fn zeros(rows: usize, cols: usize) -> Self {
        Self { rows, cols, data: vec![0.0; rows * cols] }
    }

    /// The identity.
    #[must_use]
    pub fn identity(n: usize) -> Self {
        let mut m = Self::zeros(n, n);
        for i in 0..n {
            m[(i, i)] = 1.0;
        }
        m
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Number of columns.
    #[must_use]
    pub fn cols(&self) -> usize {
        self.cols
    }

    /// Row `i`.
    #[must_use]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.data[i * self.cols..(i + 1) * self.cols]
    }

    /// Row `i`, to be written.
    pub fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.data[i * self.cols..(i + 1) * self.cols]
    }

    /// `self · other`.
    ///
    /// # Panics
    /// If the inner dimensions differ.
    #[must_use]
    pub fn product(&self, other: &Self) -> Self {
        assert_eq!(self.cols, other.rows, "inner dimensions agree");
        let mut out = Self::zeros(self.rows, other.cols);
        for i in 0..self.rows {
            let target = &mut out.data[i * other.cols..(i + 1) * other.cols];
            for (k, &a) in self.row(i).iter().enumerate() {
                if a != 0.0 {
                    axpy(a, other.row(k), target);
                }
            }
        }
        out
    }

    /// `selfᵀ · other`.
    ///
    /// # Panics
    /// If the numbers of rows differ.
    #[must_use]
    pub fn transpose_product(&self, other: &Self) -> Self {
        assert_eq!(self.rows, other.rows, "inner dimensions agree");
        let mut out = Self::zeros(self.cols, other.cols);
        for k in 0..self.rows {
            let right = other.row(k);
            for (i, &a) in self.row(k).iter().enumerate() {
                if a != 0.0 {
                    axpy(a, right, &mut out.data[i * other.cols..(i + 1) * other.cols]);
                }
            }
        }
        out
    }

    /// `self · x`.
    #[must_use]
    pub fn apply(&self, x: &[f64]) -> Vec<f64> {
        (0..self.rows).map(|i| dot(self.row(i), x)).collect()
    }

    /// `selfᵀ · x`.
    #[must_use]
    pub fn apply_transpose(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.cols];
        for (i, &xi) in x.iter().enumerate() {
            axpy(xi, self.row(i), &mut out);
        }
        out
    }

    /// Adds `scale · other`.
    pub fn add_scaled(&mut self, scale: f64, other: &Self) {
        axpy(scale, &other.data, &mut self.data);
    }
}

impl Index<(usize, usize)> for Matrix {
    type Output = f64;

    fn index(&self, (i, j): (usize, usize)) -> &f64 {
        &self.data[i * self.cols + j]
    }
}

impl IndexMut<(usize, usize)> for Matrix {
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut f64 {
        &mut self.data[i * self.cols + j]
    }
}
