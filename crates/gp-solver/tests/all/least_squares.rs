//! The solvers on problems with known answers.

use gp_solver::{
    Checkpoint, Closeness, Elements, EnergyBlock, Factorization, Observer, Options, Problem,
    Progress, QuadraticBuilder, ResidualBlock, Run, SolverError, Status, Step, System,
    check_gradient, check_jacobian, solve, solve_observed,
};
use std::ops::ControlFlow;

/// `r = (10 (y − x²), 1 − x)`.
struct Rosenbrock(Elements);

impl Rosenbrock {
    fn new() -> Self {
        let mut elements = Elements::new();
        elements.push(&[0, 1], 2);
        Self(elements)
    }
}

impl ResidualBlock for Rosenbrock {
    fn name(&self) -> &str {
        "rosenbrock"
    }
    fn elements(&self) -> &Elements {
        &self.0
    }
    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        r[0] = 10.0 * (x[1] - x[0] * x[0]);
        r[1] = 1.0 - x[0];
    }
    fn linearize(&self, x: &[f64], r: &mut [f64], j: &mut [f64]) {
        self.residuals(x, r);
        j.copy_from_slice(&[-20.0 * x[0], 10.0, -1.0, 0.0]);
    }
}

#[test]
fn rosenbrock_is_solved_by_either_factorization() {
    for factorization in [Factorization::Auto, Factorization::Band, Factorization::Sparse] {
        let mut problem = Problem::new(2);
        problem.add(Rosenbrock::new());
        let mut x = [-1.2, 1.0];
        let options = Options { factorization, ..Options::default() };
        let report = solve(problem, &mut x, &options).unwrap();
        assert_eq!(report.status, Status::Converged);
        assert!(report.final_energy < 1e-20, "{report:?}");
        assert!((x[0] - 1.0).abs() < 1e-9 && (x[1] - 1.0).abs() < 1e-9);
    }
}

#[test]
fn energy_never_rises_over_accepted_steps() {
    let mut problem = Problem::new(2);
    problem.add(Rosenbrock::new());
    let report = solve(problem, &mut [-1.2, 1.0], &Options::default()).unwrap();
    for pair in report.history.windows(2) {
        assert!(pair[1].energy <= pair[0].energy);
    }
}

#[test]
fn fixed_unknowns_leave_the_system() {
    let mut problem = Problem::new(2);
    problem.add(Rosenbrock::new());
    problem.variables_mut().fix_unknown(0);
    let mut x = [2.0, 0.0];
    let report = solve(problem, &mut x, &Options::default()).unwrap();
    assert_eq!(report.variables, 1);
    assert_eq!(x[0], 2.0);
    assert!((x[1] - 4.0).abs() < 1e-6, "{x:?}");
}

#[test]
fn observer_interrupts_and_leaves_the_iterate_it_was_shown() {
    let mut problem = Problem::new(2);
    problem.add(Rosenbrock::new());
    let mut x = [-1.2, 1.0];
    let mut shown = [0.0; 2];
    let report = solve_observed(problem, &mut x, &Options::default(), &mut |it: &Progress<'_>| {
        shown.copy_from_slice(it.x);
        if it.iteration == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })
    .unwrap();
    assert_eq!(report.status, Status::Interrupted);
    assert_eq!(report.iterations, 2);
    assert_eq!(x, shown);
}

/// The same sphere once as rows and once as an energy with a Gauss-Newton Hessian.
struct SphereEnergy(Elements);

impl EnergyBlock for SphereEnergy {
    fn name(&self) -> &str {
        "sphere"
    }
    fn elements(&self) -> &Elements {
        &self.0
    }
    fn energy(&self, x: &[f64]) -> f64 {
        0.5 * (x.iter().map(|v| v * v).sum::<f64>() - 1.0).powi(2)
    }
    fn quadratic_model(&self, x: &[f64], g: &mut [f64], h: &mut [f64]) -> f64 {
        let r = x.iter().map(|v| v * v).sum::<f64>() - 1.0;
        for i in 0..3 {
            g[i] = 2.0 * r * x[i];
            for j in 0..3 {
                h[3 * i + j] = 4.0 * x[i] * x[j];
            }
        }
        0.5 * r * r
    }
}

#[test]
fn energy_blocks_equal_residual_blocks() {
    let start = [0.3, -0.4, 2.0];
    let mut elements = Elements::new();
    elements.push(&[0, 1, 2], 3);
    let mut by_energy = Problem::new(3);
    by_energy.add_energy(SphereEnergy(elements));
    let mut rows = QuadraticBuilder::new("sphere");
    let row = rows.equation(1.0).constant(-1.0);
    for i in 0..3 {
        row.product(i, i, 1.0);
    }
    let mut by_rows = Problem::new(3);
    by_rows.add(rows.build());
    let mut a = System::new(by_energy, Factorization::Auto).unwrap();
    let mut b = System::new(by_rows, Factorization::Auto).unwrap();
    assert!((a.linearize(&start).unwrap() - b.linearize(&start).unwrap()).abs() < 1e-14);
    for (x, y) in a.normal_triplets().iter().zip(b.normal_triplets()) {
        assert!((x.0, x.1) == (y.0, y.1) && (x.2 - y.2).abs() < 1e-14);
    }
    let (ma, mb) = (a.damped_step(1e-3).unwrap(), b.damped_step(1e-3).unwrap());
    assert!((ma.predicted_decrease - mb.predicted_decrease).abs() < 1e-12);
    for (x, y) in a.step().iter().zip(b.step()) {
        assert!((x - y).abs() < 1e-12);
    }
}

#[test]
fn guided_projection_meets_quadratic_constraints() {
    let mut rows = QuadraticBuilder::new("circle and line");
    rows.equation(1.0).product(0, 0, 1.0).product(1, 1, 1.0).constant(-25.0);
    rows.equation(1.0).linear(0, 1.0).linear(1, -7.0).constant(25.0);
    let mut problem = Problem::new(2);
    problem.add(rows.build());
    let mut x = [4.0, 3.0];
    let report = solve(problem, &mut x, &Options::guided_projection(1e-3)).unwrap();
    assert_eq!(report.status, Status::Converged);
    assert!((x[0] - 3.0).abs() < 1e-9 && (x[1] - 4.0).abs() < 1e-9, "{x:?}");
}

struct Faulty(Elements, f64, f64);

impl ResidualBlock for Faulty {
    fn name(&self) -> &str {
        "faulty"
    }
    fn elements(&self) -> &Elements {
        &self.0
    }
    fn residuals(&self, _: &[f64], r: &mut [f64]) {
        r.copy_from_slice(&[1.0, 2.0, self.1]);
    }
    fn linearize(&self, x: &[f64], r: &mut [f64], j: &mut [f64]) {
        self.residuals(x, r);
        j.fill(1.0);
        j[3] = self.2;
    }
}

#[test]
fn a_nan_is_caught_at_its_block_and_row() {
    let mut elements = Elements::new();
    elements.push(&[0, 1], 3);
    let mut problem = Problem::new(2);
    problem.add(Faulty(elements.clone(), f64::NAN, 1.0));
    let error = solve(problem, &mut [0.0; 2], &Options::default()).unwrap_err();
    assert!(error.to_string().starts_with("the residual of row 2 of block `faulty` is NaN"));
    let mut problem = Problem::new(2);
    problem.add(Faulty(elements, 1.0, f64::INFINITY));
    let error = solve(problem, &mut [0.0; 2], &Options::default()).unwrap_err();
    assert!(
        error
            .to_string()
            .starts_with("the derivative by unknown 1 of row 1 of block `faulty` is inf"),
        "{error}"
    );
}

#[test]
fn malformed_blocks_are_named() {
    let mut elements = Elements::new();
    elements.push(&[0, 2], 3);
    let mut problem = Problem::new(2);
    problem.add(Faulty(elements, 0.0, 0.0));
    let error = solve(problem, &mut [0.0; 2], &Options::default()).unwrap_err();
    assert!(matches!(error, SolverError::ColumnOutOfRange { column: 2, unknowns: 2, .. }));
    let mut elements = Elements::new();
    elements.push(&[1, 1], 3);
    let mut problem = Problem::new(2);
    problem.add(Faulty(elements, 0.0, 0.0));
    let error = solve(problem, &mut [0.0; 2], &Options::default()).unwrap_err();
    assert!(matches!(error, SolverError::RepeatedColumn { column: 1, .. }));
}

#[test]
fn a_resumed_solve_ends_in_the_same_bits() {
    let options = Options::default();
    let mut problem = Problem::new(2);
    problem.add(Rosenbrock::new());
    let mut whole = [-1.2, 1.0];
    let mut watch = Keeper { keep: 5, kept: None, resume: None };
    let report = solve_observed(problem, &mut whole, &options, &mut watch).unwrap();
    let mut problem = Problem::new(2);
    problem.add(Rosenbrock::new());
    let mut x = [0.0; 2];
    let mut again = Keeper { keep: usize::MAX, kept: None, resume: watch.kept.clone() };
    let resumed = solve_observed(problem, &mut x, &options, &mut again).unwrap();
    assert_eq!(x.map(f64::to_bits), whole.map(f64::to_bits));
    assert_eq!(resumed.iterations, report.iterations);
    assert_eq!(resumed.final_energy.to_bits(), report.final_energy.to_bits());
    let other = watch.kept.unwrap().with_numbers("x", &[0.0; 3]);
    let mut problem = Problem::new(2);
    problem.add(Rosenbrock::new());
    let mut foreign = Keeper { keep: usize::MAX, kept: None, resume: Some(other) };
    let error = solve_observed(problem, &mut x, &options, &mut foreign).unwrap_err();
    assert!(error.to_string().starts_with("the checkpoint belongs to a run of another size"));
}

/// Keeps the checkpoint after one of the steps, or goes on from one.
struct Keeper {
    keep: usize,
    kept: Option<Checkpoint>,
    resume: Option<Checkpoint>,
}

impl Observer for Keeper {
    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        let state = state();
        if state.iteration == self.keep {
            self.kept = Some(state);
        }
    }

    fn resume(&mut self) -> Option<Checkpoint> {
        self.resume.take()
    }
}

#[test]
fn blocks_change_between_steps_without_a_new_plan() {
    let wish = |name: &str, at: f64| Closeness::new(name, vec![at; 3], vec![1.0; 3]);
    let mut problem = Problem::new(3);
    let (a, b) = (problem.add(wish("a", 1.0)), problem.add(wish("b", 3.0)));
    let system = System::new(problem, Factorization::Auto).unwrap();
    let mut run = Run::new(system, &[0.0; 3], &Options::default()).unwrap();
    let settle = |run: &mut Run<'_>| {
        run.set_damping(1e-12);
        while run.step(&mut ()).unwrap() == Step::Taken {}
        run.x()[0]
    };
    let is = |got: f64, want: f64| assert!((got - want).abs() < 1e-9, "{got} {want}");
    is(settle(&mut run), 2.0);
    run.system_mut().set_weight(b, 3.0).unwrap(); // (1 + 9·3) / 10
    is(settle(&mut run), 2.8);
    run.system_mut().set_reference(a, &[11.0; 3]).unwrap();
    is(settle(&mut run), 3.8);
    run.system_mut().replace(b, wish("c", 5.0)).unwrap();
    is(settle(&mut run), (11.0 + 9.0 * 5.0) / 10.0);
    run.system_mut().remove(a).unwrap();
    is(settle(&mut run), 5.0);
    let c = run.system_mut().add(wish("d", 8.0)).unwrap();
    is(settle(&mut run), (9.0 * 5.0 + 8.0) / 10.0);
    assert_eq!(run.report(Status::Converged).terms.len(), 2);
    // A row that couples what nothing coupled before is planned for.
    let mut rows = QuadraticBuilder::new("equal");
    rows.equation(1e4).linear(0, 1.0).linear(2, -1.0);
    run.system_mut().set_reference(c, &[8.0, 8.0, 20.0]).unwrap();
    run.system_mut().add(rows.build()).unwrap();
    settle(&mut run);
    // Soft rows leave 1 / 1e4² of what pulls them apart.
    assert!((run.x()[0] - run.x()[2]).abs() < 1e-6, "{:?}", run.x());
    is(run.x()[0] + run.x()[2], 2.0 * 5.3 + 1.2);
    let gone = run.system_mut().remove(a).unwrap_err();
    assert_eq!(gone, SolverError::NoSuchBlock { block: 0 });
    let other = run.system_mut().replace(b, Closeness::new("e", vec![0.0], vec![1.0]));
    assert!(matches!(other, Err(SolverError::OtherElements { .. })));
    assert!(matches!(
        run.system_mut().set_reference(c, &[1.0]),
        Err(SolverError::NoReference { .. })
    ));
}

#[test]
fn a_block_may_refuse_where_a_step_leads() {
    /// `x − 3` that must not pass 1.
    struct Fenced(Elements);
    impl ResidualBlock for Fenced {
        fn name(&self) -> &str {
            "fenced"
        }
        fn elements(&self) -> &Elements {
            &self.0
        }
        fn admits(&self, x: &[f64]) -> bool {
            x[0] <= 1.0
        }
        fn residuals(&self, x: &[f64], r: &mut [f64]) {
            r[0] = x[0] - 3.0;
        }
        fn linearize(&self, x: &[f64], r: &mut [f64], j: &mut [f64]) {
            self.residuals(x, r);
            j[0] = 1.0;
        }
    }
    let mut elements = Elements::new();
    elements.push(&[0], 1);
    let mut problem = Problem::new(1);
    problem.add(Fenced(elements));
    let mut x = [0.0];
    let report = solve(problem, &mut x, &Options::default()).unwrap();
    assert_eq!(report.status, Status::Stalled);
    assert!(x[0] <= 1.0 && x[0] > 0.999, "{x:?}");
}

#[test]
fn a_wrong_jacobian_is_found_at_its_entry() {
    struct Wrong(Rosenbrock);
    impl ResidualBlock for Wrong {
        fn name(&self) -> &str {
            "wrong"
        }
        fn elements(&self) -> &Elements {
            self.0.elements()
        }
        fn residuals(&self, x: &[f64], r: &mut [f64]) {
            self.0.residuals(x, r);
        }
        fn linearize(&self, x: &[f64], r: &mut [f64], j: &mut [f64]) {
            self.0.linearize(x, r, j);
            j[0] *= -1.0;
        }
    }
    let x = [0.7, -0.3];
    assert!(check_jacobian(&Rosenbrock::new(), &x).unwrap().unwrap().error < 1e-9);
    let worst = check_jacobian(&Wrong(Rosenbrock::new()), &x).unwrap().unwrap();
    assert_eq!((worst.row, worst.unknown), (0, 0));
    assert!(worst.error > 0.5);
    let mut elements = Elements::new();
    elements.push(&[0, 1, 2], 3);
    let sphere = SphereEnergy(elements);
    assert!(check_gradient(&sphere, &[0.3, -0.4, 2.0]).unwrap().unwrap().error < 1e-8);
}

#[test]
fn every_status_is_reached() {
    let run = |options: &Options, x: &mut [f64; 2]| {
        let mut problem = Problem::new(2);
        problem.add(Rosenbrock::new());
        solve(problem, x, options).unwrap()
    };
    let few = Options { max_iterations: 3, ..Options::default() };
    let report = run(&few, &mut [-1.2, 1.0]);
    assert_eq!((report.status, report.iterations), (Status::IterationLimit, 3));
    let none = Options { max_iterations: 0, ..Options::default() };
    assert_eq!(run(&none, &mut [-1.2, 1.0]).status, Status::IterationLimit);
    // Gradient, step, energy and absolute energy rules, each alone.
    let off = Options { gradient_tol: 0.0, step_tol: 0.0, energy_tol: 0.0, ..Options::default() };
    for options in [
        Options { gradient_tol: 1e-3, ..off.clone() },
        Options { step_tol: 1e-3, ..off.clone() },
        Options { energy_tol: 1e-3, ..off.clone() },
        Options { abs_energy_tol: 1e-6, ..off },
    ] {
        assert_eq!(run(&options, &mut [-1.2, 1.0]).status, Status::Converged);
    }
    // A start at the minimum.
    let report = run(&Options::default(), &mut [1.0, 1.0]);
    assert_eq!((report.status, report.iterations), (Status::Converged, 0));
    // A Jacobian of the wrong sign: every step leads uphill.
    struct Uphill(Elements);
    impl ResidualBlock for Uphill {
        fn name(&self) -> &str {
            "uphill"
        }
        fn elements(&self) -> &Elements {
            &self.0
        }
        fn residuals(&self, x: &[f64], r: &mut [f64]) {
            r[0] = 1.0 + x[0] + x[0].abs();
        }
        fn linearize(&self, x: &[f64], r: &mut [f64], j: &mut [f64]) {
            self.residuals(x, r);
            j[0] = -1.0;
        }
    }
    let mut elements = Elements::new();
    elements.push(&[0], 1);
    let mut problem = Problem::new(1);
    problem.add(Uphill(elements));
    let report = solve(problem, &mut [0.5], &Options::default()).unwrap();
    assert_ne!(report.status, Status::IterationLimit);
    assert_eq!(report.iterations, 0);
}

#[test]
fn bad_options_and_starts_are_refused_by_name() {
    let solve_with = |options: &Options, x: &mut [f64]| {
        let mut problem = Problem::new(2);
        problem.add(Rosenbrock::new());
        solve(problem, x, options).unwrap_err().to_string()
    };
    let options = Options { initial_damping: f64::NAN, ..Options::default() };
    let message = solve_with(&options, &mut [0.0; 2]);
    assert_eq!(message, "option initial_damping is NaN; it must be positive and finite");
    let message = solve_with(&Options::default(), &mut [0.0, f64::NAN]);
    assert_eq!(message, "unknown 1 starts at NaN; give a finite start");
    let message = solve_with(&Options::default(), &mut [0.0; 3]);
    assert!(message.starts_with("the vector of unknowns has 3 values, expected 2"));
    let mut problem = Problem::new(2);
    problem.variables_mut().set_order(vec![0, 0]);
    let error = solve(problem, &mut [0.0; 2], &Options::default()).unwrap_err();
    assert!(error.to_string().starts_with("the ordering is no permutation: entry 1 is 0"));
}

#[test]
fn empty_and_rank_deficient_problems_are_solved() {
    let report = solve(Problem::new(0), &mut [], &Options::default()).unwrap();
    assert_eq!(report.status, Status::Converged);
    let report = solve(Problem::new(3), &mut [1.0, 2.0, 3.0], &Options::default()).unwrap();
    assert_eq!((report.status, report.final_energy), (Status::Converged, 0.0));
    // Two unknowns that only occur as a sum, one that occurs nowhere, scales 16 orders apart.
    let mut rows = QuadraticBuilder::new("sum");
    rows.equation(1e8).linear(0, 1.0).linear(1, 1.0).constant(-2.0);
    rows.equation(1e-8).linear(3, 1.0).constant(-5.0);
    let mut problem = Problem::new(4);
    problem.add(rows.build());
    let mut x = [0.0, 0.0, 7.0, 0.0];
    let report = solve(problem, &mut x, &Options::default()).unwrap();
    assert_eq!(report.status, Status::Converged);
    assert!((x[0] + x[1] - 2.0).abs() < 1e-9 && x[2] == 7.0, "{x:?}");
}
