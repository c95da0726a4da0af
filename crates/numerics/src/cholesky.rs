//! Cholesky factors and the quadratic minima they give.
//!
//! Two orders of arithmetic live here, because results that are compared bit by bit depend on
//! each: row by row with one inner product per entry ([`Cholesky`], [`cholesky`]), and column by
//! column with one subtraction after the other ([`factor_semidefinite`]), which needs no storage
//! but the matrix and forgives dependent rows.

use crate::matrix::Matrix;
use crate::vector::{axpy, dot};

/// The first row whose pivot is too small, negative or NaN.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the matrix is not positive definite at row {row}; add a shift or drop dependent unknowns")]
pub struct NotPositiveDefinite {
    /// Index of the row.
    pub row: usize,
}

/// The lower triangle `L` with `L Lᵀ = A + shift I`, where `A` is symmetric and `entry(i, j)`
/// gives its entries for `j ≤ i`; every pivot must be above `least`.
#[inline]
fn factor_rows(
    n: usize,
    entry: impl Fn(usize, usize) -> f64,
    shift: f64,
    least: f64,
) -> Result<Matrix, NotPositiveDefinite> {
    let mut lower = Matrix::zeros(n, n);
    for i in 0..n {
        for j in 0..=i {
            let sum = entry(i, j) - dot(&lower.row(i)[..j], &lower.row(j)[..j]);
            if i == j {
                let pivot = sum + shift;
                // A NaN pivot fails the comparison as well.
                if !(pivot > least) {
                    return Err(NotPositiveDefinite { row: i });
                }
                lower[(i, i)] = pivot.sqrt();
            } else {
                lower[(i, j)] = sum / lower[(j, j)];
            }
        }
    }
    Ok(lower)
}

/// Lower triangle `L` with `L Lᵀ = matrix + shift I`, unscaled; `matrix[i * n + j]` is symmetric
/// and only its lower triangle is read.
///
/// # Errors
/// [`NotPositiveDefinite`] names the first pivot that is not above `rel_tol` times the largest
/// `|matrix[i * n + i]|`.
///
/// # Panics
/// If the matrix is not `n × n`.
///
/// # Example
/// ```
/// let lower = numerics::cholesky(&[4.0, 2.0, 2.0, 10.0], 2, 0.0, 1e-13)?;
/// assert_eq!([lower[(0, 0)], lower[(1, 0)], lower[(1, 1)]], [2.0, 1.0, 3.0]);
/// # Ok::<(), numerics::NotPositiveDefinite>(())
/// ```
pub fn cholesky(
    matrix: &[f64],
    n: usize,
    shift: f64,
    rel_tol: f64,
) -> Result<Matrix, NotPositiveDefinite> {
    assert_eq!(matrix.len(), n * n, "a square matrix");
    let size = (0..n).map(|i| matrix[i * n + i].abs()).fold(0.0, f64::max);
    factor_rows(n, |i, j| matrix[i * n + j], shift, rel_tol * size)
}

/// Cholesky factor of a symmetric positive definite matrix, after scaling to a unit diagonal.
///
/// # Example
/// ```
/// use numerics::{Cholesky, Matrix};
/// let mut matrix = Matrix::identity(2);
/// matrix[(0, 1)] = 0.5;
/// matrix[(1, 0)] = 0.5;
/// let x = Cholesky::new(&matrix, 1e-14).expect("is definite").solve(&[2.0, 2.5]);
/// assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 2.0).abs() < 1e-15);
/// ```
#[derive(Clone, Debug)]
pub struct Cholesky {
    lower: Matrix,
    scale: Vec<f64>,
}

impl Cholesky {
    /// Factorises; `None` when a pivot of the scaled matrix falls to `rel_tol` or below.
    ///
    /// # Panics
    /// If the matrix is not square.
    #[must_use]
    pub fn new(matrix: &Matrix, rel_tol: f64) -> Option<Self> {
        let n = matrix.rows();
        assert_eq!(n, matrix.cols(), "a square matrix");
        let scale: Vec<f64> = (0..n).map(|i| matrix[(i, i)].max(0.0).sqrt().recip()).collect();
        if scale.iter().any(|s| !s.is_finite()) {
            return None;
        }
        let entry = |i, j| matrix[(i, j)] * scale[i] * scale[j];
        let lower = factor_rows(n, entry, 0.0, rel_tol).ok()?;
        Some(Self { lower, scale })
    }

    /// Solves `A x = b` in place.
    pub fn solve_in_place(&self, x: &mut [f64]) {
        let n = x.len();
        for i in 0..n {
            let sum = x[i] * self.scale[i] - dot(&self.lower.row(i)[..i], &x[..i]);
            x[i] = sum / self.lower[(i, i)];
        }
        for i in (0..n).rev() {
            x[i] /= self.lower[(i, i)];
            let xi = x[i];
            axpy(-xi, &self.lower.row(i)[..i], &mut x[..i]);
        }
        for (x, s) in x.iter_mut().zip(&self.scale) {
            *x *= s;
        }
    }

    /// `A⁻¹ b`.
    #[must_use]
    pub fn solve(&self, b: &[f64]) -> Vec<f64> {
        let mut x = b.to_vec();
        self.solve_in_place(&mut x);
        x
    }

    /// `A⁻¹ B`, column by column.
    #[must_use]
    pub fn solve_matrix(&self, b: &Matrix) -> Matrix {
        let mut out = Matrix::zeros(b.rows(), b.cols());
        let mut column = vec![0.0; b.rows()];
        for j in 0..b.cols() {
            for (i, c) in column.iter_mut().enumerate() {
                *c = b[(i, j)];
            }
            self.solve_in_place(&mut column);
            for (i, c) in column.iter().enumerate() {
                out[(i, j)] = *c;
            }
        }
        out
    }
}

/// Minimises `½ xᵀ H x + gᵀ x`; small shifts of the diagonal take over when `H` is singular to
/// rounding, which leaves the flat directions near zero.
///
/// # Example
/// ```
/// use numerics::{Matrix, minimize_quadratic};
/// let mut hessian = Matrix::identity(2);
/// hessian[(0, 1)] = 0.5;
/// hessian[(1, 0)] = 0.5;
/// let x = minimize_quadratic(&hessian, &[-1.5, -1.5]);
/// assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 1.0).abs() < 1e-15);
/// ```
#[must_use]
pub fn minimize_quadratic(hessian: &Matrix, gradient: &[f64]) -> Vec<f64> {
    let negative: Vec<f64> = gradient.iter().map(|g| -g).collect();
    if negative.is_empty() {
        return negative;
    }
    if let Some(factor) = Cholesky::new(hessian, 1e-14) {
        let mut x = factor.solve(&negative);
        // One step of refinement keeps ten digits at the conditions of bi-eleven patches.
        let residual: Vec<f64> =
            hessian.apply(&x).iter().zip(&negative).map(|(ax, b)| b - ax).collect();
        axpy(1.0, &factor.solve(&residual), &mut x);
        return x;
    }
    let mut shifted = hessian.clone();
    let largest = (0..hessian.rows()).map(|i| hessian[(i, i)]).fold(0.0, f64::max);
    for shift in [1e-13, 1e-11, 1e-9, 1e-6] {
        for i in 0..hessian.rows() {
            shifted[(i, i)] =
                hessian[(i, i)] * (1.0 + shift) + shift * largest.max(f64::MIN_POSITIVE);
        }
        if let Some(factor) = Cholesky::new(&shifted, 0.0) {
            let mut x = factor.solve(&negative);
            for _ in 0..4 {
                let residual: Vec<f64> =
                    hessian.apply(&x).iter().zip(&negative).map(|(ax, b)| b - ax).collect();
                axpy(1.0, &factor.solve(&residual), &mut x);
            }
            return x;
        }
    }
    vec![0.0; negative.len()]
}

/// A pivot that elimination leaves at this share of its entry is rounding.
pub const PIVOT_RATIO: f64 = 1e-14;

/// Cholesky factor in the lower triangle of the rows of `a`, in place. A pivot that elimination
/// leaves at `rel_tol` of its entry
/// ([`PIVOT_RATIO`] or more) or less becomes infinite, which makes its unknown zero: rows
/// that follow from others, or are empty, are skipped.
///
/// # Panics
/// If the rows are shorter than their number.
///
/// # Example
/// ```
/// use numerics::{PIVOT_RATIO, factor_semidefinite, solve_semidefinite};
/// let mut a = [[4.0, 0.0, 0.0], [1.0, 3.0, 0.0], [0.0, 0.0, 0.0]];
/// let mut b = [6.0, 7.0, 0.0];
/// factor_semidefinite(&mut a, PIVOT_RATIO);
/// solve_semidefinite(&a, &mut b);
/// assert!((b[0] - 1.0).abs() < 1e-15 && (b[1] - 2.0).abs() < 1e-15 && b[2] == 0.0);
/// ```
#[inline]
pub fn factor_semidefinite<R: AsRef<[f64]> + AsMut<[f64]>>(a: &mut [R], rel_tol: f64) {
    let n = a.len();
    for j in 0..n {
        let scale = a[j].as_ref()[j].abs();
        for k in 0..j {
            let l = a[j].as_ref()[k];
            a[j].as_mut()[j] -= l * l;
        }
        let pivot = a[j].as_ref()[j];
        let root = if pivot > rel_tol * scale { pivot.sqrt() } else { f64::INFINITY };
        a[j].as_mut()[j] = root;
        for i in j + 1..n {
            for k in 0..j {
                let product = a[i].as_ref()[k] * a[j].as_ref()[k];
                a[i].as_mut()[j] -= product;
            }
            a[i].as_mut()[j] /= root;
        }
    }
}

/// Solves in place with the factor made by [`factor_semidefinite`].
///
/// # Panics
/// If there are fewer unknowns than rows.
#[inline]
pub fn solve_semidefinite<R: AsRef<[f64]>>(factor: &[R], b: &mut [f64]) {
    let n = factor.len();
    for i in 0..n {
        let row = factor[i].as_ref();
        for k in 0..i {
            b[i] -= row[k] * b[k];
        }
        b[i] /= row[i];
    }
    for i in (0..n).rev() {
        for k in i + 1..n {
            b[i] -= factor[k].as_ref()[i] * b[k];
        }
        b[i] /= factor[i].as_ref()[i];
    }
}

/// Adds `row ⊗ row` to the lower triangle of `a` and `value · row` to `b`: one equation
/// `row · x = value` more in the normal equations `a x = b`.
#[inline]
pub fn add_normal_row<const N: usize>(
    a: &mut [[f64; N]; N],
    b: &mut [f64; N],
    row: &[f64; N],
    value: f64,
) {
    for i in 0..N {
        for j in 0..=i {
            a[i][j] += row[i] * row[j];
        }
        b[i] += value * row[i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hilbert(n: usize) -> Matrix {
        let mut m = Matrix::zeros(n, n);
        for i in 0..n {
            for j in 0..n {
                m[(i, j)] = 1.0 / (i + j + 1) as f64;
            }
        }
        m
    }

    #[test]
    fn cholesky_solves_a_hilbert_system() {
        let h = hilbert(5);
        let want = [1.0, -2.0, 3.0, 0.5, -1.5];
        let b = h.apply(&want);
        let got = Cholesky::new(&h, 1e-16).unwrap().solve(&b);
        for (g, w) in got.iter().zip(want) {
            assert!((g - w).abs() < 1e-9, "{g} against {w}");
        }
    }

    #[test]
    fn cholesky_refuses_an_indefinite_matrix() {
        let mut m = Matrix::identity(2);
        m[(0, 1)] = 2.0;
        m[(1, 0)] = 2.0;
        assert!(Cholesky::new(&m, 1e-14).is_none());
    }
}
