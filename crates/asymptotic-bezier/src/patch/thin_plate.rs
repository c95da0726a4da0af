//! The thin-plate energy of a bi-degree-n patch with its inner control points minimised out.
//!
//! For given boundary and second rows the inner points are linear in them and the least energy
//! is a quadratic form `qᵀ S q` per coordinate. `S` depends on the degree alone, so it is
//! computed once, and a patch costs a few small products.

use std::sync::OnceLock;

use crate::curve::bernstein::gram;
use numerics::{Cholesky, Matrix};

/// Highest surface degree.
pub const MAX_SURFACE_DEGREE: usize = 15;

/// Precomputed elimination for one degree.
#[derive(Debug)]
pub(crate) struct FillTable {
    /// Control points `(i, j)` of the outermost ring.
    pub(crate) border: Vec<(usize, usize)>,
    /// Control points of the second ring.
    pub(crate) second: Vec<(usize, usize)>,
    /// The others.
    pub(crate) inner: Vec<(usize, usize)>,
    /// `S` between second ring and second ring.
    pub(crate) second_second: Matrix,
    /// `S` between second ring and border.
    pub(crate) second_border: Matrix,
    /// `S` between border and border.
    pub(crate) border_border: Matrix,
    /// Inner points from `(border, second)`.
    pub(crate) recover: Matrix,
}

/// The table for surface degree `n`, 5 to 15.
pub(crate) fn fill_table(n: usize) -> &'static FillTable {
    static TABLES: [OnceLock<FillTable>; MAX_SURFACE_DEGREE + 1] =
        [const { OnceLock::new() }; MAX_SURFACE_DEGREE + 1];
    TABLES[n].get_or_init(|| build(n))
}

/// Matrix of the thin-plate energy `∫∫ R_uu² + 2 R_uv² + R_vv²` (Wang et al. 2019, Eq. 4.5)
/// between the control points `a` and `b`.
pub(crate) fn thin_plate_block(n: usize, a: &[(usize, usize)], b: &[(usize, usize)]) -> Matrix {
    let (g0, g1, g2) = (gram(n, 0), gram(n, 1), gram(n, 2));
    let mut out = Matrix::zeros(a.len(), b.len());
    for (r, &(i, j)) in a.iter().enumerate() {
        for (c, &(k, l)) in b.iter().enumerate() {
            out[(r, c)] =
                g2[(i, k)] * g0[(j, l)] + 2.0 * g1[(i, k)] * g1[(j, l)] + g0[(i, k)] * g2[(j, l)];
        }
    }
    out
}

fn build(n: usize) -> FillTable {
    let (mut border, mut second, mut inner) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..=n {
        for j in 0..=n {
            match i.min(j).min(n - i).min(n - j) {
                0 => border.push((i, j)),
                1 => second.push((i, j)),
                _ => inner.push((i, j)),
            }
        }
    }
    let ring: Vec<(usize, usize)> = border.iter().chain(&second).copied().collect();
    let coupling = thin_plate_block(n, &inner, &ring);
    let factor = Cholesky::new(&thin_plate_block(n, &inner, &inner), 0.0)
        .expect("the thin-plate energy is positive definite on inner points");
    let mut recover = factor.solve_matrix(&coupling);
    let mut schur = thin_plate_block(n, &ring, &ring);
    schur.add_scaled(-1.0, &coupling.transpose_product(&recover));
    let mut negative = Matrix::zeros(recover.rows(), recover.cols());
    negative.add_scaled(-1.0, &recover);
    recover = negative;
    let cut = |rows: std::ops::Range<usize>, cols: std::ops::Range<usize>| {
        let mut out = Matrix::zeros(rows.len(), cols.len());
        for (a, i) in rows.enumerate() {
            out.row_mut(a).copy_from_slice(&schur.row(i)[cols.clone()]);
        }
        out
    };
    let (b, all) = (border.len(), ring.len());
    FillTable {
        second_second: cut(b..all, b..all),
        second_border: cut(b..all, 0..b),
        border_border: cut(0..b, 0..b),
        border,
        second,
        inner,
        recover,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bilinear_border_is_completed_without_bending() {
        // x(u, v) = u v costs 2 ∫∫ x_uv² = 2 and nothing else.
        for (n, bound) in [(5, 1e-13), (7, 1e-12), (11, 1e-8)] {
            let table = fill_table(n);
            let value = |&(i, j): &(usize, usize)| (i * j) as f64 / (n * n) as f64;
            let border: Vec<f64> = table.border.iter().map(value).collect();
            let second: Vec<f64> = table.second.iter().map(value).collect();
            let ring: Vec<f64> = border.iter().chain(&second).copied().collect();
            for (got, want) in table.recover.apply(&ring).iter().zip(table.inner.iter().map(value))
            {
                assert!((got - want).abs() < bound, "bi-{n}: {}", (got - want).abs());
            }
            let energy = numerics::dot(&table.border_border.apply(&border), &border)
                + 2.0 * numerics::dot(&table.second_border.apply(&border), &second)
                + numerics::dot(&table.second_second.apply(&second), &second);
            assert!((energy - 2.0).abs() < 1e-9, "bi-{n}: {energy}");
        }
    }
}
