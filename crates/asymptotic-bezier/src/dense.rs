//! Small dense linear algebra for the tens of unknowns of one patch: Cholesky, rank-revealing QR.
//!
//! Row-major, serial, no blocking: at these sizes a call into a large library costs more than
//! the arithmetic.

use std::ops::{Index, IndexMut};

/// A dense row-major matrix.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Matrix {
    rows: usize,
    cols: usize,
    data: Vec<f64>,
}

impl Matrix {
    /// All zeros.
    pub(crate) fn zeros(rows: usize, cols: usize) -> Self {
        Self { rows, cols, data: vec![0.0; rows * cols] }
    }

    /// The identity.
    pub(crate) fn identity(n: usize) -> Self {
        let mut m = Self::zeros(n, n);
        for i in 0..n {
            m[(i, i)] = 1.0;
        }
        m
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    pub(crate) fn cols(&self) -> usize {
        self.cols
    }

    pub(crate) fn row(&self, i: usize) -> &[f64] {
        &self.data[i * self.cols..(i + 1) * self.cols]
    }

    pub(crate) fn row_mut(&mut self, i: usize) -> &mut [f64] {
        &mut self.data[i * self.cols..(i + 1) * self.cols]
    }

    /// `self · other`.
    pub(crate) fn product(&self, other: &Self) -> Self {
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
    pub(crate) fn transpose_product(&self, other: &Self) -> Self {
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
    pub(crate) fn apply(&self, x: &[f64]) -> Vec<f64> {
        (0..self.rows).map(|i| dot(self.row(i), x)).collect()
    }

    /// `selfᵀ · x`.
    pub(crate) fn apply_transpose(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.cols];
        for (i, &xi) in x.iter().enumerate() {
            axpy(xi, self.row(i), &mut out);
        }
        out
    }

    /// Adds `scale · other`.
    pub(crate) fn add_scaled(&mut self, scale: f64, other: &Self) {
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

/// Inner product.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Euclidean length.
pub(crate) fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// `y += a x`.
pub(crate) fn axpy(a: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}

/// Cholesky factor of a symmetric positive definite matrix, after scaling to a unit diagonal.
#[derive(Clone, Debug)]
pub(crate) struct Cholesky {
    lower: Matrix,
    scale: Vec<f64>,
}

impl Cholesky {
    /// Factorises; `None` when a pivot of the scaled matrix falls to `rel_tol` or below.
    pub(crate) fn new(matrix: &Matrix, rel_tol: f64) -> Option<Self> {
        let n = matrix.rows();
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
    pub(crate) fn solve_in_place(&self, x: &mut [f64]) {
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
    pub(crate) fn solve(&self, b: &[f64]) -> Vec<f64> {
        let mut x = b.to_vec();
        self.solve_in_place(&mut x);
        x
    }

    /// `A⁻¹ B`, column by column.
    pub(crate) fn solve_matrix(&self, b: &Matrix) -> Matrix {
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

    /// `L⁻ᵀ y` of the factor `A = L Lᵀ`: turns `|y|²` into `xᵀ A x`.
    pub(crate) fn back_substitute(&self, y: &[f64]) -> Vec<f64> {
        let mut x = y.to_vec();
        for i in (0..x.len()).rev() {
            x[i] /= self.lower[(i, i)];
            let xi = x[i];
            axpy(-xi, &self.lower.row(i)[..i], &mut x[..i]);
        }
        x.iter().zip(&self.scale).map(|(x, s)| x * s).collect()
    }

    /// `L⁻¹ b` of the factor `A = L Lᵀ`.
    pub(crate) fn forward_substitute(&self, b: &[f64]) -> Vec<f64> {
        let mut x = b.to_vec();
        for i in 0..x.len() {
            let sum = x[i] * self.scale[i] - dot(&self.lower.row(i)[..i], &x[..i]);
            x[i] = sum / self.lower[(i, i)];
        }
        x
    }
}

/// Minimises `½ xᵀ H x + gᵀ x`; small shifts of the diagonal take over when `H` is singular to
/// rounding, which leaves the flat directions near zero.
pub(crate) fn minimize_quadratic(hessian: &Matrix, gradient: &[f64]) -> Vec<f64> {
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

/// All solutions of `C x = b`: one of least length and an orthonormal basis of the null space.
#[derive(Clone, Debug)]
pub(crate) struct AffineSpace {
    /// The solution of least length (in scaled columns).
    pub(crate) particular: Vec<f64>,
    /// Columns that span the null space.
    pub(crate) null: Matrix,
    /// Largest `|C x − b|` of the particular solution.
    pub(crate) residual: f64,
}

/// Solves `C x = b` by Householder QR of the column-scaled `Cᵀ` with pivoting on the rows of `C`.
///
/// Columns are scaled by `scale` (unknown `x = scale · y`) before the rank is decided by
/// `rel_tol` against the largest pivot.
pub(crate) fn affine_space(c: &Matrix, b: &[f64], scale: &[f64], rel_tol: f64) -> AffineSpace {
    let (m, n) = (c.rows(), c.cols());
    // Work on A = (C diag(scale))ᵀ stored by columns: column j is row j of C.
    let mut columns: Vec<Vec<f64>> =
        (0..m).map(|i| c.row(i).iter().zip(scale).map(|(c, s)| c * s).collect()).collect();
    let mut order: Vec<usize> = (0..m).collect();
    let mut reflectors: Vec<Vec<f64>> = Vec::new();
    let mut first_pivot = 0.0_f64;
    for k in 0..m.min(n) {
        let (best, size) = (k..m)
            .map(|j| (j, norm(&columns[j][k..])))
            .fold((k, -1.0), |best, item| if item.1 > best.1 { item } else { best });
        if k == 0 {
            first_pivot = size;
        }
        if !(size > rel_tol * first_pivot) || size == 0.0 {
            break;
        }
        columns.swap(k, best);
        order.swap(k, best);
        let mut v = columns[k][k..].to_vec();
        let alpha = if v[0] > 0.0 { -size } else { size };
        v[0] -= alpha;
        let vv = dot(&v, &v);
        if vv > 0.0 {
            for column in columns.iter_mut().skip(k) {
                let w = -2.0 * dot(&v, &column[k..]) / vv;
                axpy(w, &v, &mut column[k..]);
            }
        }
        reflectors.push(v);
    }
    let rank = reflectors.len();
    // R (rank × m) holds C scaled: row order[j] of C = Q R[:, j]. Solve Rᵀ z = b for the first
    // `rank` pivoted rows, then x = Q z.
    let mut z = vec![0.0; n];
    for j in 0..rank {
        let sum = b[order[j]] - dot(&columns[j][..j], &z[..j]);
        z[j] = sum / columns[j][j];
    }
    let apply_q = |x: &mut [f64]| {
        for (k, v) in reflectors.iter().enumerate().rev() {
            let vv = dot(v, v);
            if vv > 0.0 {
                let w = -2.0 * dot(v, &x[k..]) / vv;
                axpy(w, v, &mut x[k..]);
            }
        }
    };
    apply_q(&mut z);
    let mut null = Matrix::zeros(n, n - rank);
    let mut e = vec![0.0; n];
    for j in rank..n {
        e.fill(0.0);
        e[j] = 1.0;
        apply_q(&mut e);
        for i in 0..n {
            null[(i, j - rank)] = e[i] * scale[i];
        }
    }
    let particular: Vec<f64> = z.iter().zip(scale).map(|(z, s)| z * s).collect();
    let residual =
        c.apply(&particular).iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    AffineSpace { particular, null, residual }
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

    #[test]
    fn affine_space_of_a_redundant_system_has_the_right_dimension() {
        let mut c = Matrix::zeros(3, 4);
        c.row_mut(0).copy_from_slice(&[1.0, 2.0, 0.0, 1.0]);
        c.row_mut(1).copy_from_slice(&[0.0, 1.0, 1.0, 0.0]);
        // Row 2 = row 0 + 2 row 1.
        c.row_mut(2).copy_from_slice(&[1.0, 4.0, 2.0, 1.0]);
        let b = [3.0, 1.0, 5.0];
        let space = affine_space(&c, &b, &[1.0; 4], 1e-12);
        assert_eq!(space.null.cols(), 2);
        assert!(space.residual < 1e-14);
        let image = c.product(&space.null);
        for i in 0..3 {
            assert!(norm(image.row(i)) < 1e-14);
        }
        let inconsistent = affine_space(&c, &[3.0, 1.0, 6.0], &[1.0; 4], 1e-12);
        assert!(inconsistent.residual > 0.1);
    }
}
