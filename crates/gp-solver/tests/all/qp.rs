//! Quadratic programs against an interior-point solver that shares no code with ours.
#![cfg(feature = "sparse")]

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, SupportedConeT,
    ZeroConeT,
};
use gp_solver::{
    BoundedQp, DenseQp, InequalityQp, LinearEquation, MixedQp, QuadraticTerm, SparseQp, Status,
    SymmetricPattern,
};

/// Reproducible numbers in −1..1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        // SplitMix64.
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    fn vector(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| self.next()).collect()
    }
}

/// A program in the form both sides are given: `½ xᵀQx + cᵀx`, `a·x = b`, `a·x ≥ b`.
struct Program {
    hessian: Vec<Vec<f64>>,
    linear: Vec<f64>,
    equal: Vec<(Vec<f64>, f64)>,
    least: Vec<(Vec<f64>, f64)>,
}

impl Program {
    /// A convex program with a Hessian of full rank, or of half the rank plus a little.
    fn random(random: &mut Random, n: usize) -> Self {
        let roots: Vec<Vec<f64>> = (0..n).map(|_| random.vector(n)).collect();
        let hessian = (0..n)
            .map(|i| {
                let product = |j: usize| roots.iter().map(|r| r[i] * r[j]).sum::<f64>();
                (0..n).map(|j| product(j) + if i == j { 0.5 } else { 0.0 }).collect()
            })
            .collect();
        Self { hessian, linear: random.vector(n), equal: Vec::new(), least: Vec::new() }
    }

    /// The minimum by the other solver; `None` where it proves that there is none.
    fn by_interior_points(&self) -> Option<(Vec<f64>, f64)> {
        let n = self.linear.len();
        // Upper triangle, as that solver wants it.
        let upper = |i: usize, j: usize| if i <= j { self.hessian[i][j] } else { 0.0 };
        let rows: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| upper(i, j)).collect()).collect();
        let p = CscMatrix::from(&rows);
        // A x + s = b with s in the cones: zero, then nonnegative.
        let equal = self.equal.iter().map(|(a, b)| (a.clone(), *b));
        let least = self.least.iter().map(|(a, b)| (a.iter().map(|a| -a).collect(), -b));
        let (rows, right): (Vec<Vec<f64>>, Vec<f64>) = equal.chain(least).unzip();
        let a = if rows.is_empty() { CscMatrix::zeros((0, n)) } else { CscMatrix::from(&rows) };
        let cones: [SupportedConeT<f64>; 2] =
            [ZeroConeT(self.equal.len()), NonnegativeConeT(self.least.len())];
        let settings = DefaultSettings {
            verbose: false,
            tol_gap_abs: 1e-11,
            tol_gap_rel: 1e-11,
            tol_feas: 1e-11,
            ..DefaultSettings::default()
        };
        let mut solver = DefaultSolver::new(&p, &self.linear, &a, &right, &cones, settings)
            .expect("a well-formed program");
        solver.solve();
        match solver.solution.status {
            SolverStatus::Solved | SolverStatus::AlmostSolved => {
                Some((solver.solution.x.clone(), solver.solution.obj_val))
            }
            SolverStatus::PrimalInfeasible | SolverStatus::AlmostPrimalInfeasible => None,
            other => panic!("the interior-point solver ends with {other:?}"),
        }
    }

    fn term(&self) -> QuadraticTerm {
        QuadraticTerm {
            unknowns: (0..self.linear.len()).collect(),
            hessian: self.hessian.concat(),
            gradient: self.linear.clone(),
        }
    }

    fn equations(&self) -> impl Iterator<Item = LinearEquation> + '_ {
        self.equal.iter().map(|(a, b)| LinearEquation {
            entries: a.iter().copied().enumerate().filter(|(_, a)| *a != 0.0).collect(),
            value: *b,
        })
    }
}

fn agrees(ours: &gp_solver::QpSolution, theirs: Option<(Vec<f64>, f64)>, what: &str) {
    match theirs {
        None => assert_eq!(ours.status, Status::Infeasible, "{what}"),
        Some((x, objective)) => {
            assert_eq!(ours.status, Status::Converged, "{what}");
            let size = x.iter().fold(1.0_f64, |m, v| m.max(v.abs()));
            for (a, b) in ours.x.iter().zip(&x) {
                assert!((a - b).abs() < 1e-6 * size, "{what}: {a} {b}");
            }
            let scale = 1.0 + objective.abs();
            let error = (ours.objective - objective).abs();
            assert!(error < 1e-6 * scale, "{what}: {} {objective}", ours.objective);
        }
    }
}

#[test]
fn dense_programs_have_the_same_minimum_or_none() {
    let mut infeasible = 0;
    for seed in 0..60 {
        let random = &mut Random(seed);
        let n = 2 + seed as usize % 9;
        let mut program = Program::random(random, n);
        for _ in 0..n / 3 {
            program.equal.push((random.vector(n), random.next()));
        }
        for _ in 0..2 * n {
            program.least.push((random.vector(n), random.next() - 0.4));
        }
        let mut qp = DenseQp::new(n, program.hessian.concat(), program.linear.clone());
        program.equal.iter().for_each(|(a, b)| _ = qp.equal(a, *b));
        program.least.iter().for_each(|(a, b)| _ = qp.at_least(a, *b));
        let theirs = program.by_interior_points();
        infeasible += usize::from(theirs.is_none());
        agrees(&qp.solve().expect("convex"), theirs, &format!("seed {seed}"));
    }
    assert!((5..55).contains(&infeasible), "{infeasible} of 60 programs are infeasible");
}

#[test]
fn bounded_programs_have_the_same_minimum_or_none() {
    for seed in 100..140 {
        let random = &mut Random(seed);
        // Some above the size at which the sparse factorisation takes over.
        let n = if seed % 8 == 0 { 90 } else { 3 + seed as usize % 11 };
        let mut program = Program::random(random, n);
        // Weak couplings, as the active set is made for.
        for i in 0..n {
            for j in 0..n {
                if i != j {
                    program.hessian[i][j] *= 0.5 / n as f64;
                }
            }
            program.hessian[i][i] += 1.0;
        }
        let unit = |i: usize, sign: f64| -> Vec<f64> {
            (0..n).map(|k| if k == i { sign } else { 0.0 }).collect()
        };
        let mut qp = BoundedQp::new(n);
        qp.term(&program.term());
        for i in 0..n {
            let (a, b) = (0.2 * random.next(), 0.2 * random.next());
            // Every tenth program has bounds that cross.
            let (low, high) =
                if seed % 10 == 9 && i == 0 { (0.3, 0.1) } else { (a.min(b), a.max(b)) };
            program.least.push((unit(i, 1.0), low));
            program.least.push((unit(i, -1.0), -high));
            qp.bounds(i, low, high);
        }
        let theirs = program.by_interior_points();
        agrees(&qp.solve().expect("finite"), theirs, &format!("seed {seed}"));
    }
}

#[test]
fn bounded_programs_with_equations_have_the_same_minimum_or_none() {
    for seed in 200..220 {
        let random = &mut Random(seed);
        let n = 4 + seed as usize % 8;
        let mut program = Program::random(random, n);
        let mut qp = BoundedQp::new(n);
        qp.term(&program.term());
        program.equal.push((random.vector(n), 0.3 * random.next()));
        if seed % 5 == 0 {
            // Contradicts the first.
            let (a, b) = program.equal[0].clone();
            program.equal.push((a.iter().map(|a| 2.0 * a).collect(), 2.0 * b + 1.0));
        }
        for i in 0..n {
            let unit = |sign: f64| -> Vec<f64> {
                (0..n).map(|k| if k == i { sign } else { 0.0 }).collect()
            };
            program.least.push((unit(1.0), -0.4));
            program.least.push((unit(-1.0), -0.4));
            qp.bounds(i, -0.4, 0.4);
        }
        program.equations().for_each(|e| _ = qp.equal(e));
        let theirs = program.by_interior_points();
        agrees(&qp.solve().expect("finite"), theirs, &format!("seed {seed}"));
    }
}

#[test]
fn sparse_programs_with_equations_have_the_same_minimum_or_none() {
    for seed in 300..330 {
        let random = &mut Random(seed);
        let n = 6 + seed as usize % 20;
        let mut program = Program::random(random, n);
        for k in 0..n / 3 {
            // Three unknowns each.
            let mut row = vec![0.0; n];
            (0..3).for_each(|j| row[(3 * k + j * 2) % n] += random.next() + 1.5);
            program.equal.push((row, random.next()));
        }
        if seed % 6 == 0 {
            let (a, b) = program.equal[0].clone();
            program.equal.push((a, b + 0.5));
        }
        let mut qp = SparseQp::new(n);
        qp.term(program.term());
        program.equations().for_each(|e| _ = qp.equal(e));
        let theirs = program.by_interior_points();
        let ours = qp.solve().expect("convex");
        agrees(&ours, theirs, &format!("seed {seed}"));
        if ours.status == Status::Converged {
            // Stationary: Q x + c = Σ u a.
            for i in 0..n {
                let image: f64 = (0..n).map(|j| program.hessian[i][j] * ours.x[j]).sum();
                let forces = program.equal.iter().zip(&ours.multipliers);
                let force: f64 = forces.map(|((a, _), u)| u * a[i]).sum();
                assert!((image + program.linear[i] - force).abs() < 1e-7, "seed {seed}");
            }
        }
    }
}

/// Wishes that can be had are equations.
#[test]
fn wishes_that_can_be_had_are_had() {
    for seed in 400..420 {
        let random = &mut Random(seed);
        let n = 5 + seed as usize % 10;
        let mut program = Program::random(random, n);
        program.hessian.iter_mut().flatten().for_each(|h| *h *= 0.01);
        program.linear.iter_mut().for_each(|c| *c *= 0.01);
        let mut qp = SparseQp::new(n);
        qp.term(program.term());
        for _ in 0..2 {
            let (row, b) = (random.vector(n), random.next());
            qp.wish(QuadraticTerm {
                unknowns: (0..n).collect(),
                hessian: row.iter().flat_map(|a| row.iter().map(move |b| a * b)).collect(),
                gradient: row.iter().map(|a| -a * b).collect(),
            });
            program.equal.push((row, b));
        }
        let theirs = program.by_interior_points();
        agrees(&qp.solve().expect("convex"), theirs, &format!("seed {seed}"));
    }
}

#[test]
fn sparse_programs_with_inequalities_have_the_same_minimum_or_none() {
    let mut infeasible = 0;
    for seed in 300..360 {
        let random = &mut Random(seed);
        let n = 3 + seed as usize % 9;
        let mut program = Program::random(random, n);
        for _ in 0..3 * n {
            // Rows of three unknowns.
            let mut row = vec![0.0; n];
            for _ in 0..3 {
                row[(random.next().abs() * n as f64) as usize % n] = random.next();
            }
            program.least.push((row, random.next() - 0.4));
        }
        let all: Vec<u32> = (0..n as u32).collect();
        let pattern = SymmetricPattern::from_cliques(n, [all].iter());
        let lower = (0..n).flat_map(|j| (j..n).map(move |i| (i, j)));
        let values: Vec<f64> = lower.map(|(i, j)| program.hessian[i][j]).collect();
        let mut qp = InequalityQp::new(&pattern, &values, &program.linear);
        for (row, bound) in &program.least {
            let entries: Vec<(usize, f64)> =
                row.iter().copied().enumerate().filter(|(_, a)| *a != 0.0).collect();
            qp.at_least(&entries, *bound);
        }
        let theirs = program.by_interior_points();
        infeasible += usize::from(theirs.is_none());
        let ours = qp.solve().expect("convex");
        if theirs.is_none() {
            // The multipliers prove it.
            let z = &ours.multipliers;
            let bound: f64 = program.least.iter().zip(z).map(|((_, b), z)| b * z).sum();
            let pull = |i: usize| program.least.iter().zip(z).map(|((a, _), z)| a[i] * z).sum();
            let pull: f64 = (0..n).map(pull).map(f64::abs).sum();
            assert!(bound > 1e3 * pull && z.iter().all(|z| *z >= 0.0), "{bound} {pull}");
        }
        agrees(&ours, theirs, &format!("seed {seed}"));
    }
    assert!((5..55).contains(&infeasible), "{infeasible} of 60 programs are infeasible");
}

#[test]
fn real_unknowns_follow_the_whole_ones() {
    // Chains of differences with targets, and a step by a whole number in the middle.
    for seed in 400..420 {
        let random = &mut Random(seed);
        let n = 8;
        let groups: Vec<[u32; 2]> = (0..n as u32 - 1).map(|i| [i, i + 1]).collect();
        let mut mixed = MixedQp::new(n, 2, groups.iter()).expect("a pattern");
        let mut squares = Vec::new();
        for i in 0..n - 1 {
            let mut row = vec![(i, -1.0), (i + 1, 1.0)];
            if i == 3 {
                row.extend([(n, 1.0), (n + 1, -2.0)]);
            }
            squares.push((row, 2.0 * random.next(), 1.0 + random.next().abs()));
        }
        squares.push((vec![(7, 1.0), (n + 1, 0.5)], 3.0 * random.next(), 0.7));
        squares.push((vec![(2, 1.0), (n, 0.3)], 3.0 * random.next(), 0.5));
        squares.iter().for_each(|(row, t, w)| mixed.square(row, *t, *w));
        let eliminated = mixed.eliminate(Some(0)).expect("determined");
        let energy = |x: &[f64], k: &[f64]| -> f64 {
            let value = |i: usize| if i < n { x[i] } else { k[i - n] };
            let term = |(row, t, w): &(Vec<(usize, f64)>, f64, f64)| {
                let at: f64 = row.iter().map(|(i, a)| a * value(*i)).sum();
                0.5 * w * (at - t).powi(2)
            };
            squares.iter().map(term).sum()
        };
        let k = eliminated.lattice().minimize();
        let x = eliminated.reals(&k);
        assert!(x[0].abs() < 1e-12 && k.iter().all(|k| k.fract() == 0.0));
        let best = energy(&x, &k);
        // No real unknown and no pair of whole ones does better.
        for i in 1..n {
            for step in [1e-4, -1e-4] {
                let mut y = x.clone();
                y[i] += step;
                assert!(energy(&y, &k) > best);
            }
        }
        for (a, b) in (-3..=3).flat_map(|a| (-3..=3).map(move |b| (a, b))) {
            let other = [k[0] + f64::from(a), k[1] + f64::from(b)];
            assert!(energy(&eliminated.reals(&other), &other) > best - 1e-9);
        }
    }
}
