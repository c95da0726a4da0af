//! Linear systems of any rank: one solution and the null space.
//!
//! Keeps its reflectors to apply `Q` later, which the factorisations of [`crate::least_squares`]
//! and [`crate::householder`] have no use for.

use crate::matrix::Matrix;
use crate::vector::{axpy, dot, norm};

/// All solutions of `C x = b`: one of least length and an orthonormal basis of the null space.
#[derive(Clone, Debug)]
pub struct AffineSpace {
    /// The solution of least length (in scaled columns).
    pub particular: Vec<f64>,
    /// Columns that span the null space.
    pub null: Matrix,
    /// Largest `|C x − b|` of the particular solution.
    pub residual: f64,
}

/// Solves `C x = b` by Householder QR of the column-scaled `Cᵀ` with pivoting on the rows of `C`.
///
/// Columns are scaled by `scale` (unknown `x = scale · y`) before the rank is decided by
/// `rel_tol` against the largest pivot.
///
/// # Panics
/// If `b` or `scale` has the wrong length.
///
/// # Example
/// ```
/// use numerics::{Matrix, affine_space};
/// let mut plane = Matrix::zeros(1, 3);
/// plane.row_mut(0).copy_from_slice(&[1.0, 1.0, 1.0]);
/// let space = affine_space(&plane, &[3.0], &[1.0; 3], 1e-12);
/// assert_eq!(space.null.cols(), 2);
/// assert!(space.particular.iter().all(|x| (x - 1.0).abs() < 1e-14));
/// ```
#[must_use]
pub fn affine_space(c: &Matrix, b: &[f64], scale: &[f64], rel_tol: f64) -> AffineSpace {
    let (m, n) = (c.rows(), c.cols());
    assert!(b.len() == m && scale.len() == n, "one right side per row, one scale per column");
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
