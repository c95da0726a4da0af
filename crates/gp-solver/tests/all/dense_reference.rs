//! Sparse paths against dense linear algebra by an independent library, on systems of every kind:
//! permuted, with repeated and empty rows, of deficient rank, badly scaled, singular.

use crate::problems::{mgh, quadratic};
use gp_solver::{
    Elements, Factorization, Options, Problem, QuadraticBuilder, ResidualBlock, SolverError,
    Status, System, solve,
};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

const FACTORIZATIONS: [Factorization; 3] =
    [Factorization::Auto, Factorization::Band, Factorization::Sparse];

/// `r = J x − b` in elements.
#[derive(Clone, Debug)]
struct Linear {
    elements: Elements,
    values: Vec<f64>,
    rhs: Vec<f64>,
}

impl Linear {
    fn new() -> Self {
        Self { elements: Elements::new(), values: Vec::new(), rhs: Vec::new() }
    }

    fn push(&mut self, columns: &[usize], rows: &[(Vec<f64>, f64)]) {
        self.elements.push(columns, rows.len());
        for (row, b) in rows {
            self.values.extend_from_slice(row);
            self.rhs.push(*b);
        }
    }

    /// The Jacobian over `n` unknowns.
    fn dense(&self, n: usize) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(self.rhs.len(), n);
        for e in 0..self.elements.len() {
            let columns = self.elements.columns(e);
            let values = &self.values[self.elements.jacobian_range(e)];
            for (k, row) in self.elements.rows(e).enumerate() {
                for (c, &column) in columns.iter().enumerate() {
                    out[(row, column)] = values[k * columns.len() + c];
                }
            }
        }
        out
    }

    /// The same rows with unknown `i` called `names[i]`.
    fn renamed(&self, names: &[usize]) -> Self {
        let mut out = Self::new();
        for e in 0..self.elements.len() {
            let columns: Vec<usize> = self.elements.columns(e).iter().map(|&c| names[c]).collect();
            out.elements.push(&columns, self.elements.rows(e).len());
        }
        (out.values, out.rhs) = (self.values.clone(), self.rhs.clone());
        out
    }
}

impl ResidualBlock for Linear {
    fn name(&self) -> &str {
        "linear"
    }
    fn elements(&self) -> &Elements {
        &self.elements
    }
    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        let x = DVector::from_column_slice(x);
        let image = self.dense(x.len()) * x;
        for (i, r) in r.iter_mut().enumerate() {
            *r = image[i] - self.rhs[i];
        }
    }
    fn linearize(&self, x: &[f64], r: &mut [f64], j: &mut [f64]) {
        self.residuals(x, r);
        j.copy_from_slice(&self.values);
    }
}

fn shuffled(n: usize) -> impl Strategy<Value = Vec<usize>> {
    Just((0..n).collect::<Vec<_>>()).prop_shuffle()
}

/// Elements over `n` unknowns, among them some without rows, some without columns, one twice;
/// unknowns that no element reads may remain.
fn linear(n: usize) -> impl Strategy<Value = Linear> {
    let element =
        (shuffled(n), 0..=n.min(9), 0_usize..5).prop_flat_map(|(order, width, height)| {
            let columns = order[..width].to_vec();
            let row = (prop::collection::vec(-1.0..1.0_f64, width), -1.0..1.0_f64);
            (Just(columns), prop::collection::vec(row, height))
        });
    prop::collection::vec(element, 0..20).prop_map(|elements| {
        let mut out = Linear::new();
        for (columns, rows) in &elements {
            out.push(columns, rows);
        }
        if let Some((columns, rows)) = elements.first() {
            out.push(columns, rows);
        }
        out
    })
}

/// `argmin |J s + r|² + Σ shift s²` by QR of the stacked matrix.
fn dense_step(j: &DMatrix<f64>, r: &DVector<f64>, shift: &[f64]) -> DVector<f64> {
    let (m, n) = j.shape();
    let mut stacked = DMatrix::zeros(m + n, n);
    stacked.view_mut((0, 0), (m, n)).copy_from(j);
    let mut rhs = DVector::zeros(m + n);
    rhs.rows_mut(0, m).copy_from(&-r);
    for i in 0..n {
        stacked[(m + i, i)] = shift[i].sqrt();
    }
    let qr = stacked.qr();
    let rhs = qr.q().transpose() * rhs;
    qr.r().solve_upper_triangular(&rhs).expect("the shift makes it regular")
}

fn close(got: &[f64], want: &[f64]) -> bool {
    let size = want.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
    got.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-8 * size)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn damped_steps_are_those_of_a_dense_qr(
        (block, order, x) in (1_usize..90).prop_flat_map(|n| {
            (linear(n), shuffled(n), prop::collection::vec(-1.0..1.0_f64, n))
        }),
        damping in 1e-3..1.0_f64,
        held in 0_usize..200,
    ) {
        let n = x.len();
        let mut jacobian = block.dense(n);
        if held < n {
            jacobian.column_mut(held).fill(0.0);
        }
        let residuals = block.dense(n) * DVector::from_column_slice(&x)
            - DVector::from_column_slice(&block.rhs);
        let shift: Vec<f64> = (0..n)
            .map(|i| jacobian.column(i).norm_squared())
            .map(|d| damping * if d == 0.0 { 1.0 } else { d })
            .collect();
        let want = dense_step(&jacobian, &residuals, &shift);
        for factorization in FACTORIZATIONS {
            for order in [None, Some(order.clone())] {
                let mut problem = Problem::new(n);
                problem.add(block.clone());
                if held < n {
                    problem.variables_mut().fix_unknown(held);
                }
                if let Some(order) = order {
                    problem.variables_mut().set_order(order);
                }
                let mut system = System::new(problem, factorization).unwrap();
                system.linearize(&x).unwrap();
                system.damped_step(damping).unwrap();
                let mut moved = x.clone();
                system.stepped_into(&x, &mut moved);
                let step: Vec<f64> = moved.iter().zip(&x).map(|(a, b)| a - b).collect();
                prop_assert!(close(&step, want.as_slice()), "{step:?} {want}");
            }
        }
    }

    #[test]
    fn renamed_unknowns_get_the_same_values(
        (block, names) in (1_usize..60).prop_flat_map(|n| (linear(n), shuffled(n))),
    ) {
        let n = names.len();
        let step = |block: &Linear, factorization| {
            let mut problem = Problem::new(n);
            problem.add(block.clone());
            let mut system = System::new(problem, factorization).unwrap();
            system.linearize(&vec![0.0; n]).unwrap();
            system.damped_step(1e-2).unwrap();
            let mut moved = vec![0.0; n];
            system.stepped_into(&vec![0.0; n], &mut moved);
            moved
        };
        let renamed = block.renamed(&names);
        for factorization in FACTORIZATIONS {
            let (here, there) = (step(&block, factorization), step(&renamed, factorization));
            let back: Vec<f64> = names.iter().map(|&k| there[k]).collect();
            prop_assert!(close(&back, &here));
        }
    }

    #[test]
    fn an_unread_unknown_is_named_unless_a_regulariser_holds_it(
        (n, unread) in (2_usize..100).prop_flat_map(|n| (Just(n), 0..n)),
        order in any::<bool>(),
        held in any::<bool>(),
    ) {
        // A chain that leaves one unknown out, its ends held to values.
        let rest: Vec<usize> = (0..n).filter(|&i| i != unread).collect();
        let mut block = Linear::new();
        block.push(&[rest[0]], &[(vec![1.0], 2.0)]);
        for pair in rest.windows(2) {
            block.push(pair, &[(vec![-1.0, 1.0], 0.5)]);
        }
        for factorization in FACTORIZATIONS {
            let mut problem = Problem::new(n);
            problem.add(block.clone());
            if order {
                problem.variables_mut().set_order((0..n).rev().collect());
            }
            // A fixed unknown leaves the system: names are the caller's all the same.
            if held {
                problem.variables_mut().fix_unknown(rest[0]);
            }
            let mut system = System::new(problem, factorization).unwrap();
            let x = vec![1.0; n];
            system.linearize(&x).unwrap();
            let error = system.projection_step(0.0).unwrap_err();
            prop_assert_eq!(error, SolverError::NotPositiveDefinite { variable: unread });
            system.projection_step(1e-3).unwrap();
            let mut moved = x.clone();
            system.stepped_into(&x, &mut moved);
            prop_assert_eq!(moved[unread], 1.0);
        }
    }

    #[test]
    fn rank_deficient_and_badly_scaled_rows_reach_the_projection(
        (n, left, right, rhs, scales) in (1_usize..8, 1_usize..8).prop_flat_map(|(n, rank)| (
            Just(n),
            prop::collection::vec(-1.0..1.0_f64, 12 * rank),
            prop::collection::vec(-1.0..1.0_f64, rank * n),
            prop::collection::vec(-1.0..1.0_f64, 12),
            prop::collection::vec(-6_i32..6, n),
        )),
    ) {
        let rank = right.len() / n;
        let plain = DMatrix::from_row_slice(12, rank, &left) * DMatrix::from_row_slice(rank, n, &right);
        // The size of the columns does not change what they span.
        let mut scaled = plain.clone();
        for (i, &k) in scales.iter().enumerate() {
            scaled.column_mut(i).scale_mut(10_f64.powi(k));
        }
        let b = DVector::from_column_slice(&rhs);
        // Not by the singular value decomposition of the library, whose left vectors were seen to
        // span something else for matrices of low rank.
        let qr = plain.col_piv_qr();
        let pivots: Vec<f64> = qr.r().diagonal().iter().map(|r| r.abs()).collect();
        let spans = pivots.iter().filter(|&&r| r > 1e-9 * pivots[0]);
        let q = qr.q().columns(0, spans.clone().count()).into_owned();
        // Nearly dependent columns are another matter: the minimum is then ill-determined.
        prop_assume!(spans.clone().all(|&r| r > 1e-3 * pivots[0]));
        let want = 0.5 * (&b - &q * (q.transpose() * &b)).norm_squared();
        let mut block = Linear::new();
        let rows: Vec<(Vec<f64>, f64)> =
            (0..12).map(|i| (scaled.row(i).iter().copied().collect(), b[i])).collect();
        block.push(&(0..n).collect::<Vec<_>>(), &rows);
        for factorization in FACTORIZATIONS {
            let mut problem = Problem::new(n);
            problem.add(block.clone());
            let mut x = vec![0.0; n];
            let options = Options { factorization, ..Options::default() };
            let report = solve(problem, &mut x, &options).unwrap();
            prop_assert_eq!(report.status, Status::Converged);
            let bound = 1e-8 * want + 1e-14;
            prop_assert!((report.final_energy - want).abs() < bound, "{} {want}", report.final_energy);
        }
    }
}

#[test]
fn an_undetermined_pair_is_named() {
    // Unknowns 2 and 5 occur as a sum only: one of their pivots is exactly zero.
    for factorization in FACTORIZATIONS {
        let mut block = Linear::new();
        for i in [0, 1, 3, 4, 6] {
            block.push(&[i], &[(vec![2.0], 1.0)]);
        }
        block.push(&[5, 2], &[(vec![1.0, 1.0], 3.0)]);
        let mut problem = Problem::new(7);
        problem.add(block);
        let mut system = System::new(problem, factorization).unwrap();
        system.linearize(&[0.0; 7]).unwrap();
        let error = system.projection_step(0.0).unwrap_err();
        assert!(matches!(error, SolverError::NotPositiveDefinite { variable: 2 | 5 }), "{error}");
        assert!(error.to_string().contains("add a regulariser"), "{error}");
    }
}

#[test]
fn problems_of_one_unknown_and_of_none_that_moves() {
    let parabola = |root: f64| {
        let mut rows = QuadraticBuilder::new("parabola");
        rows.equation(1.0).product(0, 0, 1.0).constant(-root * root);
        rows.build()
    };
    for (root, bound) in [(3.0, 1e-12), (0.0, 1e-6)] {
        let mut problem = Problem::new(1);
        problem.add(parabola(root));
        let mut x = [1.0];
        let report = solve(problem, &mut x, &Options::default()).unwrap();
        assert!(report.final_energy < 1e-20 && (x[0] - root).abs() < bound, "{root} {x:?}");
    }
    let mut problem = Problem::new(1);
    problem.add(parabola(3.0));
    problem.variables_mut().fix_unknown(0);
    let mut x = [1.0];
    let report = solve(problem, &mut x, &Options::default()).unwrap();
    assert_eq!((report.status, report.iterations, report.variables), (Status::Converged, 0, 0));
    assert_eq!((report.final_energy, x), (32.0, [1.0]));
}

#[test]
fn sparse_problems_take_the_steps_of_the_dense_block() {
    type Fill = fn(&mut QuadraticBuilder, usize);
    let families: [(&str, Fill, &[f64]); 3] = [
        ("Extended Rosenbrock 10", quadratic::rosenbrock, &[-1.2, 1.0]),
        ("Extended Powell singular 12", quadratic::powell_singular, &[3.0, -1.0, 0.0, 1.0]),
        ("Broyden tridiagonal 10", quadratic::broyden_tridiagonal, &[-1.0]),
    ];
    let options = Options { max_iterations: 15, ..Options::default() };
    for (name, fill, start) in families {
        let sparse = |n: usize, factorization, order: Option<Vec<usize>>| {
            let mut rows = QuadraticBuilder::new(name);
            fill(&mut rows, n);
            let mut problem = Problem::new(n);
            problem.add(rows.build());
            if let Some(order) = order {
                problem.variables_mut().set_order(order);
            }
            let mut x: Vec<f64> = start.iter().copied().cycle().take(n).collect();
            let options = Options { factorization, ..options.clone() };
            let report = solve(problem, &mut x, &options).unwrap();
            (x, report)
        };
        let m = mgh::all().into_iter().find(|m| m.problem.name == name).unwrap();
        let n = m.problem.start.len();
        let mut want = m.start(1.0);
        m.problem.solve_with(&mut want, &options).unwrap();
        for factorization in FACTORIZATIONS {
            for order in [None, Some((0..n).rev().collect())] {
                let (x, _) = sparse(n, factorization, order);
                assert!(close(&x, &want), "{name}: {x:?} {want:?}");
            }
            // Repeated many times over, every copy does the same; the order is one that scatters.
            let copies = 40;
            let scatter = (0..copies * n).map(|k| (k % copies) * n + k / copies).collect();
            let (big, report) = sparse(copies * n, factorization, Some(scatter));
            assert!(report.final_energy.is_finite());
            if name != "Broyden tridiagonal 10" {
                for copy in big.chunks(n) {
                    assert!(close(copy, &want), "{name}: {copy:?} {want:?}");
                }
            }
        }
    }
}
