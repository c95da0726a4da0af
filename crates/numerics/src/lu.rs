//! Small square linear systems by elimination with row pivoting.
//!
//! Three orders of arithmetic, one per shape of the data: a triangle and back substitution
//! ([`lu_solve`]), full elimination of fixed-size systems whose right-hand sides lie column by
//! column ([`gauss_jordan`]), and the same on augmented rows scaled to a unit pivot first
//! ([`gauss_jordan_rows`]). Weights of surfaces come out of the last two bit by bit as they always
//! did, so none replaces another.

/// Solves `A X = B` in place by elimination with row pivoting: `a[i * n + j]`, `b[i * m + k]`.
/// Returns whether `A` is regular; `b` then holds `X`.
///
/// # Example
/// ```
/// let mut b = [2.0, 3.0];
/// assert!(numerics::lu_solve(&mut [0.0, 1.0, 1.0, 0.0], &mut b, 2));
/// assert_eq!(b, [3.0, 2.0]);
/// ```
#[must_use = "the right-hand side holds no solution if the matrix is singular"]
pub fn lu_solve(a: &mut [f64], b: &mut [f64], n: usize) -> bool {
    let m = b.len() / n;
    for k in 0..n {
        let size = |i: usize| a[i * n + k].abs();
        let pivot = (k..n).max_by(|&x, &y| size(x).total_cmp(&size(y))).unwrap_or(k);
        if !(size(pivot) > 0.0) {
            return false;
        }
        for j in 0..n {
            a.swap(k * n + j, pivot * n + j);
        }
        for j in 0..m {
            b.swap(k * m + j, pivot * m + j);
        }
        for i in k + 1..n {
            let factor = a[i * n + k] / a[k * n + k];
            if factor != 0.0 {
                for j in k..n {
                    a[i * n + j] -= factor * a[k * n + j];
                }
                for j in 0..m {
                    b[i * m + j] -= factor * b[k * m + j];
                }
            }
        }
    }
    for i in (0..n).rev() {
        for j in 0..m {
            let tail: f64 = (i + 1..n).map(|k| a[i * n + k] * b[k * m + j]).sum();
            b[i * m + j] = (b[i * m + j] - tail) / a[i * n + i];
        }
    }
    true
}

/// Solves `system · x = column` for every column, in place, by Gauss-Jordan elimination; a
/// singular system gives infinite or NaN entries.
///
/// # Example
/// ```
/// let mut columns = [[5.0, 3.0], [2.0, 1.0]];
/// numerics::gauss_jordan(&mut [[2.0, 1.0], [1.0, 1.0]], &mut columns);
/// assert_eq!(columns, [[2.0, 1.0], [1.0, 0.0]]);
/// ```
pub fn gauss_jordan<const N: usize>(system: &mut [[f64; N]; N], columns: &mut [[f64; N]]) {
    for k in 0..N {
        let mut pivot = k;
        for i in k + 1..N {
            if system[i][k].abs() > system[pivot][k].abs() {
                pivot = i;
            }
        }
        system.swap(k, pivot);
        columns.iter_mut().for_each(|c| c.swap(k, pivot));
        for i in 0..N {
            if i != k && system[i][k] != 0.0 {
                let factor = system[i][k] / system[k][k];
                for j in k..N {
                    system[i][j] -= factor * system[k][j];
                }
                columns.iter_mut().for_each(|c| c[i] -= factor * c[k]);
            }
        }
    }
    for k in 0..N {
        columns.iter_mut().for_each(|c| c[k] /= system[k][k]);
    }
}

/// Solves `N` equations in place by Gauss-Jordan elimination with every pivot row scaled to a unit
/// pivot: row `i` is the coefficients of equation `i` and then its `W − N` right-hand sides, which
/// the solutions replace. A singular system gives infinite or NaN entries.
pub fn gauss_jordan_rows<const N: usize, const W: usize>(rows: &mut [[f64; W]; N]) {
    for k in 0..N {
        let mut pivot = k;
        for i in k + 1..N {
            if rows[i][k].abs() > rows[pivot][k].abs() {
                pivot = i;
            }
        }
        rows.swap(k, pivot);
        let scale = 1.0 / rows[k][k];
        rows[k].iter_mut().for_each(|x| *x *= scale);
        let row = rows[k];
        for (i, other) in rows.iter_mut().enumerate() {
            if i != k {
                let factor = other[k];
                other.iter_mut().zip(&row).for_each(|(x, r)| *x -= factor * r);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn solves_a_system_that_needs_pivoting() {
        let mut a = [0.0, 2.0, 1.0, 1.0, 0.0, 3.0, 2.0, 1.0, 0.0];
        let mut b = [7.0, 10.0, 4.0];
        assert!(super::lu_solve(&mut a, &mut b, 3));
        for (got, want) in b.iter().zip([1.0, 2.0, 3.0]) {
            assert!((got - want).abs() < 1e-14);
        }
        assert!(!super::lu_solve(&mut [1.0, 2.0, 2.0, 4.0], &mut [1.0, 1.0], 2));
    }
}
