//! Small symmetric positive definite systems.

/// Solves `a x = b` in place by Cholesky; rows and columns whose pivot vanishes are left out
/// (their unknowns become zero). The lower triangle of `a` is read and overwritten.
pub(crate) fn solve_spd<const N: usize>(a: &mut [[f64; N]; N], b: &mut [f64; N]) {
    factor(a);
    solve_factored(a, b);
}

/// Cholesky factor in the lower triangle; a vanishing pivot becomes infinite, which makes its
/// unknown zero.
pub(crate) fn factor<const N: usize>(a: &mut [[f64; N]; N]) {
    for j in 0..N {
        let scale = a[j][j].abs();
        for k in 0..j {
            let l = a[j][k];
            a[j][j] -= l * l;
        }
        a[j][j] = if a[j][j] > 1e-14 * scale { a[j][j].sqrt() } else { f64::INFINITY };
        for i in j + 1..N {
            for k in 0..j {
                a[i][j] -= a[i][k] * a[j][k];
            }
            a[i][j] /= a[j][j];
        }
    }
}

/// Solves with the factor made by [`factor`].
pub(crate) fn solve_factored<const N: usize>(l: &[[f64; N]; N], b: &mut [f64; N]) {
    for i in 0..N {
        for k in 0..i {
            b[i] -= l[i][k] * b[k];
        }
        b[i] /= l[i][i];
    }
    for i in (0..N).rev() {
        for k in i + 1..N {
            b[i] -= l[k][i] * b[k];
        }
        b[i] /= l[i][i];
    }
}

/// Adds `row ⊗ row` to the lower triangle of `a` and `value · row` to `b`.
pub(crate) fn accumulate<const N: usize>(
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
    use geom_core::assert_close;

    #[test]
    fn regular_systems_are_solved_and_empty_unknowns_are_zero() {
        let mut a = [[4.0, 0.0, 0.0], [1.0, 3.0, 0.0], [0.0, 0.0, 0.0]];
        let mut b = [6.0, 7.0, 0.0];
        solve_spd(&mut a, &mut b);
        assert_close(b[0], 1.0, 1e-15);
        assert_close(b[1], 2.0, 1e-15);
        assert_close(b[2], 0.0, 0.0);
    }
}
