//! The quadratic ones among the Moré-Garbow-Hillstrom problems through `QuadraticConstraints`,
//! beside the same problems as one dense block.

use crate::problems::mgh::{self, Mgh};
use crate::problems::quadratic;
use gp_solver::{Options, Problem, ResidualBlock, solve};

/// A point away from the start, the same in every run.
fn point(m: &Mgh, k: usize) -> Vec<f64> {
    let wave = |i: usize| ((3 * i + 7 * k + 1) as f64).sin();
    m.problem.start.iter().enumerate().map(|(i, x)| x + 0.3 * (1.0 + x.abs()) * wave(i)).collect()
}

#[test]
fn exactly_the_quadratic_problems_are_taken() {
    for m in mgh::all() {
        let (start, there) = (m.start(1.0), point(&m, 5));
        let at = |t: f64| {
            let x: Vec<f64> = start.iter().zip(&there).map(|(a, b)| a + t * (b - a)).collect();
            let mut r = vec![0.0; m.problem.rows];
            m.problem.residuals(&x, &mut r);
            r
        };
        // The third difference along a line vanishes for quadratic functions only.
        let [a, b, c, d] = [0.0, 1.0, 2.0, 3.0].map(at);
        let size = a.iter().chain(&d).fold(0.0_f64, |m, v| m.max(v.abs()));
        let third =
            (0..a.len()).fold(0.0_f64, |m, i| m.max((d[i] - 3.0 * c[i] + 3.0 * b[i] - a[i]).abs()));
        let is_quadratic = third < 1e-14 * size;
        assert_eq!(
            quadratic::by_name(&m.problem.name).is_some(),
            is_quadratic,
            "{}: {third:e} of {size:e}",
            m.problem.name
        );
    }
}

#[test]
fn residuals_and_derivatives_are_those_of_the_dense_block() {
    let mut taken = Vec::new();
    for m in mgh::all() {
        let Some(rows) = quadratic::by_name(&m.problem.name) else { continue };
        taken.push(m.number);
        let (n, count) = (m.problem.start.len(), m.problem.rows);
        assert_eq!(rows.len(), count, "{}", m.problem.name);
        for k in 0..3 {
            let x = point(&m, k);
            let (mut want, mut dense) = (vec![0.0; count], vec![0.0; count * n]);
            m.problem.linearize(&x, &mut want, &mut dense);
            let elements = rows.elements();
            let (mut got, mut values) = (vec![0.0; count], vec![0.0; elements.jacobian_len()]);
            rows.linearize(&x, &mut got, &mut values);
            let mut sparse = vec![0.0; count * n];
            for e in 0..elements.len() {
                for (&c, &v) in elements.columns(e).iter().zip(&values[elements.jacobian_range(e)])
                {
                    sparse[e * n + c] = v;
                }
            }
            let close = |got: &[f64], want: &[f64]| {
                let size = want.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
                got.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-13 * size)
            };
            assert!(close(&got, &want) && close(&sparse, &dense), "{}", m.problem.name);
        }
    }
    taken.dedup();
    assert_eq!(taken, [1, 4, 13, 14, 16, 20, 21, 22, 23, 25, 30, 32, 33, 34, 32, 33, 34]);
}

#[test]
fn minima_are_those_of_the_dense_block() {
    let mut failures = Vec::new();
    for m in mgh::all() {
        for factor in [1.0, 10.0, 100.0] {
            let Some(rows) = quadratic::by_name(&m.problem.name) else { continue };
            let mut x = m.start(factor);
            let mut problem = Problem::new(x.len());
            problem.add(rows);
            let report = solve(problem, &mut x, &Options::default()).unwrap();
            let sum = 2.0 * report.final_energy;
            let mut dense = m.start(factor);
            let dense = 2.0 * m.problem.solve(&mut dense).unwrap().final_energy;
            let close = |a: f64, b: f64| (a - b).abs() <= if b > 1e-16 { 1e-8 * b } else { 1e-8 };
            if !m.is_known_minimum(sum) || !close(sum, dense) {
                failures.push(format!("{} {factor} x0: {sum:e}, dense {dense:e}", m.problem.name));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
