//! The factorisations against one another and against dense elimination.

use gp_solver::{BandCholesky, SolverError, SparseCholesky, SymmetricPattern};
use proptest::prelude::*;

/// Solves by Gauss elimination with pivoting.
fn dense_solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        let p =
            (k..n).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).expect("rows remain");
        a.swap(k, p);
        b.swap(k, p);
        for i in k + 1..n {
            let f = a[i][k] / a[k][k];
            for j in k..n {
                a[i][j] -= f * a[k][j];
            }
            b[i] -= f * b[k];
        }
    }
    for k in (0..n).rev() {
        b[k] = (b[k] - (k + 1..n).map(|j| a[k][j] * b[j]).sum::<f64>()) / a[k][k];
    }
    b
}

/// Pseudo-random numbers in −½ … ½ from a seed.
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(2_685_821_657_736_338_717).wrapping_add(1);
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// A positive definite band matrix, dense.
fn band_matrix(n: usize, kd: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut next = noise(seed);
    let mut a = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in i.saturating_sub(kd)..i {
            a[i][j] = next();
            a[j][i] = a[i][j];
        }
    }
    for i in 0..n {
        a[i][i] = 0.1 + a[i].iter().map(|v| v.abs()).sum::<f64>();
    }
    a
}

fn band_values(cholesky: &BandCholesky, a: &[Vec<f64>]) -> Vec<f64> {
    let mut values = vec![0.0; cholesky.values_len()];
    for j in 0..a.len() {
        for i in j..a.len().min(j + cholesky.half_bandwidth() + 1) {
            values[cholesky.slot(i, j)] = a[i][j];
        }
    }
    values
}

fn sparse_values(pattern: &SymmetricPattern, a: &[Vec<f64>]) -> Vec<f64> {
    let starts = pattern.column_starts();
    (0..a.len())
        .flat_map(|j| {
            pattern.rows()[starts[j]..starts[j + 1]].iter().map(move |&i| a[i as usize][j])
        })
        .collect()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn band_and_sparse_agree_with_dense(n in 1_usize..90, wide in 0_usize..60, seed in 0_u64..1000) {
        let kd = wide.min(n - 1);
        let a = band_matrix(n, kd, seed);
        let mut next = noise(seed + 7);
        let b: Vec<f64> = (0..n).map(|_| next()).collect();
        let want = dense_solve(a.clone(), b.clone());
        let size = want.iter().fold(1e-3_f64, |m, v| m.max(v.abs()));

        let mut band = BandCholesky::new(n, kd);
        let values = band_values(&band, &a);
        // Shifted there and back: the shift must count.
        let lower: Vec<f64> = values.iter().enumerate().map(|(k, v)| {
            if (0..n).any(|j| band.slot(j, j) == k) { v - 0.25 } else { *v }
        }).collect();
        band.factor(&lower, &vec![0.25; n]).unwrap();
        let mut x = b.clone();
        band.solve_in_place(&mut x);
        for (x, want) in x.iter().zip(&want) {
            prop_assert!((x - want).abs() < 1e-12 * size.max(1.0) * n as f64);
        }

        let pattern = SymmetricPattern::new(n, (0..n).flat_map(|i| (i.saturating_sub(kd)..i).map(move |j| (j, i)))).unwrap();
        let values = sparse_values(&pattern, &a);
        let mut sparse = SparseCholesky::new(pattern).unwrap();
        sparse.factor(&values).unwrap();
        let mut x = b.clone();
        sparse.solve_in_place(&mut x);
        for (x, want) in x.iter().zip(&want) {
            prop_assert!((x - want).abs() < 1e-12 * size.max(1.0) * n as f64);
        }
        let mut image = vec![0.0; n];
        sparse.pattern().multiply(&values, &x, &mut image);
        for (i, b) in image.iter().zip(&b) {
            prop_assert!((i - b).abs() < 1e-11 * n as f64);
        }
    }

    #[test]
    fn a_bad_pivot_is_named_in_the_callers_numbers(n in 2_usize..120, wide in 0_usize..40, at in 0_usize..120) {
        let (kd, at) = (wide.min(n - 1), at % n);
        // Row `at` is decoupled from the rest and has a negative pivot: no other row can fail.
        let mut a = band_matrix(n, kd, 5);
        for k in 0..n {
            if k != at {
                a[k][k] += a[k][at].abs();
                a[k][at] = 0.0;
                a[at][k] = 0.0;
            }
        }
        a[at][at] = -1.0;
        let mut band = BandCholesky::new(n, kd);
        let values = band_values(&band, &a);
        let error = band.factor(&values, &vec![0.0; n]).unwrap_err();
        prop_assert_eq!(error, SolverError::NotPositiveDefinite { variable: at });
        let pattern = SymmetricPattern::new(n, (0..n).flat_map(|i| (i.saturating_sub(kd)..i).map(move |j| (j, i)))).unwrap();
        let values = sparse_values(&pattern, &a);
        let error = SparseCholesky::new(pattern).unwrap().factor(&values).unwrap_err();
        prop_assert_eq!(error, SolverError::NotPositiveDefinite { variable: at });
    }
}

#[test]
fn empty_systems_are_solved() {
    let mut band = BandCholesky::new(0, 0);
    band.factor(&[], &[]).unwrap();
    band.solve_in_place(&mut []);
    let mut sparse = SparseCholesky::new(SymmetricPattern::new(0, []).unwrap()).unwrap();
    sparse.factor(&[]).unwrap();
    sparse.solve_in_place(&mut []);
}

#[test]
fn a_nan_in_the_matrix_is_no_success() {
    let mut band = BandCholesky::new(2, 1);
    let mut values = vec![1.0; band.values_len()];
    values[band.slot(1, 1)] = f64::NAN;
    assert!(band.factor(&values, &[0.0; 2]).is_err());
    let pattern = SymmetricPattern::new(2, [(1, 0)]).unwrap();
    assert!(SparseCholesky::new(pattern).unwrap().factor(&[1.0, 0.5, f64::NAN]).is_err());
}

#[test]
fn factor_bits_do_not_depend_on_the_number_of_threads() {
    let a = band_matrix(500, 200, 3);
    let solve = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut band = BandCholesky::new(500, 200);
            let values = band_values(&band, &a);
            band.factor(&values, &[0.0; 500]).unwrap();
            let mut x: Vec<f64> = (0..500).map(f64::from).collect();
            band.solve_in_place(&mut x);
            x.iter().map(|v| v.to_bits()).collect::<Vec<_>>()
        })
    };
    let one = solve(1);
    assert_eq!(one, solve(2));
    assert_eq!(one, solve(4));
}

#[test]
fn entries_outside_the_matrix_are_refused() {
    let error = SymmetricPattern::new(2, [(2, 0)]).unwrap_err();
    assert_eq!(error.to_string(), "entry (2, 0) lies outside a square matrix of size 2");
}

#[test]
fn a_matrix_in_its_order_of_elimination_gives_the_same_solution() {
    // A grid large enough for supernodes, and one that is factored column by column.
    for side in [4, 40] {
        let n = side * side;
        let across = (0..n).filter(|i| i % side + 1 < side).map(|i| (i + 1, i));
        let entries = across.chain((0..n - side).map(|i| (i + side, i)));
        let pattern = SymmetricPattern::new(n, entries.clone()).unwrap();
        let order = SparseCholesky::elimination_order(&pattern).unwrap();
        let mut place = vec![n; n];
        order.iter().enumerate().for_each(|(k, &row)| place[row] = k);
        assert!(place.iter().all(|&k| k < n), "each row once");
        let placed = SymmetricPattern::new(n, entries.map(|(i, j)| (place[i], place[j]))).unwrap();
        let values = |pattern: &SymmetricPattern| -> Vec<f64> {
            let mut values = vec![-1.0; pattern.len()];
            pattern.column_starts()[..n].iter().for_each(|&k| values[k] = 4.1);
            values
        };
        let rhs: Vec<f64> = (0..n).map(|k| (0.7 * k as f64).cos()).collect();
        let mut want = rhs.clone();
        let mut cholesky = SparseCholesky::new(pattern.clone()).unwrap();
        cholesky.factor(&values(&pattern)).unwrap();
        cholesky.solve_in_place(&mut want);
        let mut got: Vec<f64> = order.iter().map(|&row| rhs[row]).collect();
        let mut cholesky = SparseCholesky::in_given_order(placed.clone()).unwrap();
        cholesky.factor(&values(&placed)).unwrap();
        cholesky.solve_in_place(&mut got);
        for row in 0..n {
            assert!((want[row] - got[place[row]]).abs() < 1e-13, "{side}: row {row}");
        }
        // A pivot that fails is named in the caller's numbers.
        let mut bad = values(&placed);
        bad[placed.column_starts()[n / 2]] = -1.0;
        let error = cholesky.factor(&bad).unwrap_err();
        assert_eq!(error, SolverError::NotPositiveDefinite { variable: n / 2 });
    }
}
