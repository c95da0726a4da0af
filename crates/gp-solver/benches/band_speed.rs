//! Shortest time of the band Cholesky factorisation at the sizes of Pellis et al. 2021, Table 2:
//! the least of many runs, which a busy machine disturbs less than a mean.
#![expect(clippy::print_stdout, reason = "a bench reports on the console")]

use gp_solver::BandCholesky;
use std::time::Instant;

fn main() {
    // Cargo adds `--bench` to the arguments of a bench.
    let runs = std::env::args().find_map(|a| a.parse().ok()).unwrap_or(200);
    println!("row   n     kd   factor ms  Gflop/s  solve ms");
    for (row, n, kd) in
        [("1", 588, 182), ("2", 972, 230), ("3", 1875, 314), ("8c", 960, 206), ("10c", 1800, 194)]
    {
        let mut cholesky = BandCholesky::new(n, kd);
        let mut values = vec![0.0; cholesky.values_len()];
        for j in 0..n {
            for i in j..n.min(j + kd + 1) {
                let noise = ((i * 7919 + j * 104_729) % 1000) as f64 / 1000.0 - 0.5;
                values[cholesky.slot(i, j)] = if i == j { kd as f64 } else { noise };
            }
        }
        let shift = vec![0.0; n];
        let (mut factor, mut solve) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..runs {
            let begin = Instant::now();
            let result = cholesky.factor(&values, &shift);
            factor = factor.min(begin.elapsed().as_secs_f64());
            assert!(result.is_ok(), "diagonally dominant");
            let mut x = vec![1.0; n];
            let begin = Instant::now();
            cholesky.solve_in_place(&mut x);
            solve = solve.min(begin.elapsed().as_secs_f64());
        }
        let flops = n as f64 * (kd * kd) as f64 / factor * 1e-9;
        println!("{row:4} {n:5} {kd:5} {:9.3} {flops:8.1} {:9.3}", 1e3 * factor, 1e3 * solve);
    }
}
