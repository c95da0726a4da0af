//! Normal equations against independent products, whatever the order and the factorisation.

use gp_solver::{
    Elements, Factorization, Options, Problem, QuadraticBuilder, QuadraticConstraints,
    ResidualBlock, Status, System, solve,
};
use proptest::prelude::*;

/// Rows with pseudo-random coefficients: `r = J x − b + x₀² c` for the first column of an element.
struct Random {
    elements: Elements,
    coefficients: Vec<f64>,
}

impl Random {
    /// Elements of random width and height over `n` unknowns, some with no rows or no columns,
    /// some rows repeated.
    fn new(n: usize, count: usize, seed: u64) -> Self {
        let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
        let mut next = move |bound: usize| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state % bound as u64) as usize
        };
        let mut elements = Elements::new();
        for _ in 0..count {
            let mut columns: Vec<usize> = (0..n).collect();
            for i in (1..n).rev() {
                columns.swap(i, next(i + 1));
            }
            columns.truncate(next(n.min(14) + 1));
            elements.push(&columns, next(7));
        }
        let coefficients = (0..elements.jacobian_len())
            .map(|k| ((k * k * 7919) % 1013) as f64 / 500.0 - 1.0)
            .collect();
        Self { elements, coefficients }
    }
}

impl ResidualBlock for Random {
    fn name(&self) -> &str {
        "random"
    }
    fn elements(&self) -> &Elements {
        &self.elements
    }
    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        let mut jacobian = vec![0.0; self.elements.jacobian_len()];
        self.linearize(x, r, &mut jacobian);
    }
    fn linearize(&self, x: &[f64], r: &mut [f64], j: &mut [f64]) {
        j.copy_from_slice(&self.coefficients);
        for e in 0..self.elements.len() {
            let columns = self.elements.columns(e);
            let begin = self.elements.jacobian_range(e).start;
            for (k, row) in self.elements.rows(e).enumerate() {
                let line = &mut j[begin + k * columns.len()..begin + (k + 1) * columns.len()];
                r[row] = columns.iter().zip(line.iter()).map(|(&c, a)| a * x[c]).sum::<f64>() - 1.0;
                if let (Some(&c), Some(a)) = (columns.first(), line.first_mut()) {
                    r[row] += 0.1 * x[c] * x[c];
                    *a += 0.2 * x[c];
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn normal_matrix_is_the_product_of_the_jacobian(
        n in 1_usize..100, count in 0_usize..40, seed in 0_u64..10_000, fixed in 0_usize..100,
    ) {
        let x: Vec<f64> = (0..n).map(|i| (i as f64).sin()).collect();
        for factorization in [Factorization::Band, Factorization::Sparse, Factorization::Auto] {
            let mut problem = Problem::new(n);
            problem.add(Random::new(n, count, seed));
            problem.add(Random::new(n, count / 2, seed + 1));
            if fixed < n {
                problem.variables_mut().fix_unknown(fixed);
            }
            if seed % 2 == 0 {
                problem.variables_mut().set_order((0..n).rev().collect());
            }
            let mut system = System::new(problem, factorization).unwrap();
            system.linearize(&x).unwrap();
            let jacobian = system.jacobian();
            let product = &jacobian.transpose_view().to_csc() * &jacobian;
            let size = system.variables();
            let mut dense = vec![0.0; size * size];
            for (i, j, value) in system.normal_triplets() {
                dense[i * size + j] = value;
                dense[j * size + i] = value;
            }
            let largest = dense.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
            for i in 0..size {
                for j in 0..size {
                    let want = product.get(i, j).copied().unwrap_or(0.0);
                    prop_assert!((dense[i * size + j] - want).abs() < 1e-12 * largest);
                }
            }
        }
    }

    #[test]
    fn steps_do_not_depend_on_order_or_factorization(
        n in 1_usize..90, count in 1_usize..30, seed in 0_u64..10_000, damping in 1e-3..1.0_f64,
    ) {
        let x: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
        let step = |factorization, order: Option<Vec<usize>>| {
            let mut problem = Problem::new(n);
            problem.add(Random::new(n, count, seed));
            if let Some(order) = order {
                problem.variables_mut().set_order(order);
            }
            let mut system = System::new(problem, factorization).unwrap();
            system.linearize(&x).unwrap();
            system.damped_step(damping).unwrap();
            let mut moved = x.clone();
            system.stepped_into(&x, &mut moved);
            moved
        };
        let want = step(Factorization::Band, None);
        let shuffled: Vec<usize> = (0..n).map(|k| (k * 7 + 3) % n).collect();
        let permutes = { let mut s = shuffled.clone(); s.sort_unstable(); s.windows(2).all(|w| w[0] < w[1]) };
        let orders = [None, Some((0..n).rev().collect()), permutes.then_some(shuffled)];
        for order in orders {
            for factorization in [Factorization::Auto, Factorization::Band, Factorization::Sparse] {
                for (a, b) in step(factorization, order.clone()).iter().zip(&want) {
                    prop_assert!((a - b).abs() < 1e-8 * (1.0 + b.abs()), "{a} {b}");
                }
            }
        }
    }
}

/// A closed chain of `n` points in the plane, with edges of length 1 and a smooth shape.
fn ring(n: usize) -> QuadraticConstraints {
    let mut rows = QuadraticBuilder::new("ring");
    for i in 0..n {
        let j = (i + 1) % n;
        let row = rows.equation(1.0).constant(-1.0);
        for k in 0..2 {
            let (a, b) = (2 * i + k, 2 * j + k);
            row.product(a, a, 1.0).product(b, b, 1.0).product(a, b, -2.0);
        }
    }
    rows.build()
}

#[test]
fn a_closed_chain_gets_a_folded_band() {
    let n = 400;
    let mut problem = Problem::new(2 * n);
    problem.add(ring(n));
    let system = System::new(problem, Factorization::Band).unwrap();
    assert_eq!(system.factorization(), "band");
    // Neighbours of the ring stand at most two points apart in the folded order.
    let mut position = vec![0; 2 * n];
    for (k, &i) in system.order().iter().enumerate() {
        position[i] = k;
    }
    let apart = (0..n).map(|i| position[2 * i].abs_diff(position[2 * ((i + 1) % n)])).max();
    assert!(apart.unwrap() <= 6, "{apart:?}");
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let n = 120;
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| {
            let mut problem = Problem::new(2 * n);
            problem.add(ring(n));
            problem.add(Random::new(2 * n, 60, 11));
            let mut x: Vec<f64> = (0..2 * n).map(|i| (0.1 * i as f64).sin() * 3.0).collect();
            let options = Options { max_iterations: 10, ..Options::default() };
            let report = solve(problem, &mut x, &options).unwrap();
            (x.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), report.final_energy.to_bits())
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(4));
}

#[test]
fn lifted_and_direct_forms_agree() {
    // The closed chain as rows written directly has the same minima: residuals all zero.
    let n = 60;
    let mut problem = Problem::new(2 * n);
    problem.add(ring(n));
    let radius = 0.5 / (std::f64::consts::PI / n as f64).sin();
    let mut x: Vec<f64> = (0..n)
        .flat_map(|i| {
            let angle = std::f64::consts::TAU * i as f64 / n as f64;
            [1.3 * radius * angle.cos(), 0.8 * radius * angle.sin()]
        })
        .collect();
    let report = solve(problem, &mut x, &Options::default()).unwrap();
    assert_eq!(report.status, Status::Converged);
    for i in 0..n {
        let j = (i + 1) % n;
        let length = (x[2 * i] - x[2 * j]).hypot(x[2 * i + 1] - x[2 * j + 1]);
        assert!((length - 1.0).abs() < 1e-9);
    }
}
