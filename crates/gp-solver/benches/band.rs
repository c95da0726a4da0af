//! Band Cholesky factorisation and solve at the sizes of Pellis et al. 2021, Table 2.
#![allow(missing_docs, reason = "criterion writes the functions")]

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use gp_solver::BandCholesky;
use std::hint::black_box;

/// Diagonally dominant band matrix with pseudo-random entries.
fn matrix(cholesky: &BandCholesky) -> Vec<f64> {
    let (n, kd) = (cholesky.size(), cholesky.half_bandwidth());
    let mut values = vec![0.0; cholesky.values_len()];
    let mut state = 1_u64;
    for j in 0..n {
        values[cholesky.slot(j, j)] = 2.0 * kd as f64;
        for i in j + 1..n.min(j + kd + 1) {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            values[cholesky.slot(i, j)] = (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5;
        }
    }
    values
}

fn band(c: &mut Criterion) {
    let mut group = c.benchmark_group("band_cholesky");
    group.sample_size(20);
    for (row, n, kd) in
        [("1", 588, 182), ("2", 972, 230), ("3", 1875, 314), ("8c", 960, 206), ("10c", 1800, 194)]
    {
        let mut cholesky = BandCholesky::new(n, kd);
        let values = matrix(&cholesky);
        let shift = vec![0.0; n];
        group.bench_function(BenchmarkId::new("factor", row), |b| {
            b.iter(|| cholesky.factor(black_box(&values), &shift).expect("positive definite"));
        });
        let mut x = vec![1.0; n];
        group.bench_function(BenchmarkId::new("solve", row), |b| {
            b.iter(|| cholesky.solve_in_place(black_box(&mut x)));
        });
    }
    group.finish();
}

criterion_group!(benches, band);
criterion_main!(benches);
