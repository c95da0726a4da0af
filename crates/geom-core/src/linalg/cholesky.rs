//! Cholesky factors and the quadratic minima they give.

use super::{Matrix, axpy, dot};

/// Cholesky factor of a symmetric positive definite matrix, after scaling to a unit diagonal.
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
        let mut lower = Matrix::zeros(n, n);
        for i in 0..n {
            for j in 0..=i {
                let sum = matrix[(i, j)] * scale[i] * scale[j]
                    - dot(&lower.row(i)[..j], &lower.row(j)[..j]);
                if i == j {
                    // A NaN pivot fails the comparison as well.
                    if !(sum > rel_tol) {
                        return None;
                    }
                    lower[(i, i)] = sum.sqrt();
                } else {
                    lower[(i, j)] = sum / lower[(j, j)];
                }
            }
        }
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
/// use geom_core::linalg::{Matrix, minimize_quadratic};
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
