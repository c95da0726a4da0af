//! Small dense linear systems.

/// Solves `A X = B` in place by elimination with row pivoting: `a[i * n + j]`, `b[i * m + k]`.
/// Returns whether `A` is regular; `b` then holds `X`.
pub(crate) fn solve(a: &mut [f64], b: &mut [f64], n: usize) -> bool {
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

#[cfg(test)]
mod tests {
    #[test]
    fn solves_a_system_that_needs_pivoting() {
        let mut a = [0.0, 2.0, 1.0, 1.0, 0.0, 3.0, 2.0, 1.0, 0.0];
        let mut b = [7.0, 10.0, 4.0];
        assert!(super::solve(&mut a, &mut b, 3));
        for (got, want) in b.iter().zip([1.0, 2.0, 3.0]) {
            assert!((got - want).abs() < 1e-14);
        }
        assert!(!super::solve(&mut [1.0, 2.0, 2.0, 4.0], &mut [1.0, 1.0], 2));
    }
}
