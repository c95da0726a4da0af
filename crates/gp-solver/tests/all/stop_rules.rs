//! Every stop rule on a problem made for it, and what is left when a solve ends.

use gp_solver::{
    Checkpoint, Elements, Options, Problem, Progress, Report, ResidualBlock, Run, SolverError,
    Stage, Status, Step, System, solve, solve_observed,
};
use std::ops::ControlFlow;

/// Rows of one unknown as functions: value and derivative.
struct Rows<F> {
    elements: Elements,
    function: F,
}

fn rows<const N: usize, F: Fn(f64) -> [(f64, f64); N]>(function: F) -> Rows<F> {
    let mut elements = Elements::new();
    elements.push(&[0], N);
    Rows { elements, function }
}

impl<const N: usize, F: Fn(f64) -> [(f64, f64); N] + Send + Sync> ResidualBlock for Rows<F>
where
    Self: Send + Sync,
{
    fn name(&self) -> &str {
        "rows"
    }
    fn elements(&self) -> &Elements {
        &self.elements
    }
    fn residuals(&self, x: &[f64], r: &mut [f64]) {
        for (r, (value, _)) in r.iter_mut().zip((self.function)(x[0])) {
            *r = value;
        }
    }
    fn linearize(&self, x: &[f64], r: &mut [f64], j: &mut [f64]) {
        for ((r, j), (value, slope)) in r.iter_mut().zip(j).zip((self.function)(x[0])) {
            (*r, *j) = (value, slope);
        }
    }
}

/// No rule can be met, so that each test switches one on.
fn none() -> Options {
    Options { gradient_tol: 0.0, step_tol: 0.0, energy_tol: 0.0, ..Options::default() }
}

fn run(block: impl ResidualBlock, start: f64, options: &Options) -> (f64, Report) {
    let mut problem = Problem::new(1);
    problem.add(block);
    let mut x = [start];
    let report = solve(problem, &mut x, options).expect("the start can be evaluated");
    (x[0], report)
}

#[test]
fn the_gradient_rule_ends_a_problem_with_a_residual_that_stays() {
    let apart = rows(|x| [(x - 1.0, 1.0), (x * x + 1.0, 2.0 * x)]);
    let (_, report) = run(apart, 2.0, &Options { gradient_tol: 1e-4, ..none() });
    assert_eq!(report.status, Status::Converged);
    let last = report.history.last().unwrap();
    assert!(report.gradient_norm <= 1e-4 && last.gradient_norm > 1e-4, "{report:?}");
}

#[test]
fn the_step_rule_ends_a_problem_without_residual() {
    // The only rule that can: gradient and energy keep their size relative to the residual.
    let root = rows(|x| [(x * x - 2.0, 2.0 * x)]);
    let (x, report) = run(root, 3.0, &Options { step_tol: 1e-5, ..none() });
    assert_eq!(report.status, Status::Converged);
    let steps: Vec<f64> = report.history.iter().map(|h| h.step_norm).collect();
    let last = report.iterations;
    assert!(steps[last] <= 1e-5 * x && steps[last - 1] > 1e-5 * x, "{steps:?}");
    assert!(report.final_energy > 0.0 && (x * x - 2.0).abs() < 1e-9);
}

#[test]
fn the_energy_rule_ends_a_slow_descent() {
    // Damped strongly, every step gains little of what is left.
    let apart = rows(|x| [(x - 1.0, 1.0), (x + 1.0, 1.0)]);
    let (_, report) = run(apart, 0.5, &Options { energy_tol: 1e-5, ..none() });
    assert_eq!(report.status, Status::Converged);
    let change = |k: usize| report.history[k].decrease / report.history[k - 1].energy;
    let last = report.iterations;
    assert!(change(last) <= 1e-5 && change(last - 1) > 1e-5, "{report:?}");
}

#[test]
fn the_absolute_energy_rule_ends_below_its_bound() {
    let root = rows(|x| [(x * x - 2.0, 2.0 * x)]);
    let (_, report) = run(root, 3.0, &Options { abs_energy_tol: 1e-3, ..none() });
    assert_eq!(report.status, Status::Converged);
    let energies: Vec<f64> = report.history.iter().map(|h| h.energy).collect();
    let last = report.iterations;
    assert!(energies[last] <= 1e-3 && energies[last - 1] > 1e-3, "{energies:?}");
}

#[test]
fn the_iteration_limit_counts_taken_steps() {
    let root = || rows(|x| [(x * x - 2.0, 2.0 * x)]);
    for limit in [0, 1, 3] {
        let (_, report) = run(root(), 30.0, &Options { max_iterations: limit, ..none() });
        assert_eq!((report.status, report.iterations), (Status::IterationLimit, limit));
    }
}

#[test]
fn a_solve_that_cannot_descend_has_stalled() {
    // A derivative of the wrong sign: every step leads uphill.
    let uphill = rows(|x| [(1.0 + x, -1.0)]);
    let (x, report) = run(uphill, 0.5, &Options::default());
    assert_eq!((report.status, report.iterations, x), (Status::Stalled, 0, 0.5));
    // Nothing but the start can be evaluated.
    let island = rows(|x| [(if x == 0.5 { 1.0 } else { f64::NAN }, 1.0)]);
    let (x, report) = run(island, 0.5, &Options::default());
    assert_eq!((report.status, report.iterations, x), (Status::Stalled, 0, 0.5));
    let island = rows(|x| [(if x == 0.5 { 1.0 } else { f64::INFINITY }, 1.0)]);
    let (x, report) = run(island, 0.5, &Options::guided_projection(1e-3));
    assert_eq!((report.status, report.iterations, x), (Status::Stalled, 0, 0.5));
}

#[test]
fn steps_into_forbidden_regions_are_shortened() {
    // The logarithm has no value left of zero, where a full step from 5 lands.
    let log = rows(|x| [(x.ln(), 1.0 / x)]);
    let (x, report) = run(log, 5.0, &Options::default());
    assert_eq!(report.status, Status::Converged);
    assert!((x - 1.0).abs() < 1e-12, "{x}");
}

#[test]
fn an_infinite_row_at_the_start_is_named() {
    let pole = rows(|x| [(x, 1.0), (1.0 / x, -1.0 / (x * x))]);
    let mut problem = Problem::new(1);
    problem.add(pole);
    let error = solve(problem, &mut [0.0], &Options::default()).unwrap_err();
    assert!(matches!(&error, SolverError::NotFinite { row: 1, .. }), "{error}");
    assert!(error.to_string().starts_with("the residual of row 1 of block `rows` is inf"));
}

#[test]
fn an_interrupted_iterate_can_be_used_and_continued() {
    let root = || rows(|x| [(x * x - 2.0, 2.0 * x), (x - 1.0, 1.0)]);
    let (whole, full) = run(root(), 30.0, &Options::default());
    for stop in 0..full.iterations {
        let mut problem = Problem::new(1);
        problem.add(root());
        let mut x = [30.0];
        let report = solve_observed(problem, &mut x, &Options::default(), &mut |it: &Progress<
            '_,
        >| {
            if it.iteration == stop { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        })
        .unwrap();
        assert_eq!((report.status, report.iterations), (Status::Interrupted, stop));
        // The iterate belongs to the energy reported, and is no worse than any before it.
        let energy = 0.5 * ((x[0] * x[0] - 2.0).powi(2) + (x[0] - 1.0).powi(2));
        assert!((energy - report.final_energy).abs() <= 1e-15 * energy);
        assert!(report.history.iter().all(|h| h.energy >= report.final_energy));
        let mut problem = Problem::new(1);
        problem.add(root());
        let system = System::new(problem, gp_solver::Factorization::Auto).unwrap();
        let mut run = Run::new(system, &x, &Options::default()).unwrap();
        // The state that another run saves there.
        let state = Checkpoint::new("solve", 0, 0, stop);
        let state = match stop {
            0 => run.save(state),
            _ => {
                let mut problem = Problem::new(1);
                problem.add(root());
                let system = System::new(problem, gp_solver::Factorization::Auto).unwrap();
                let mut other = Run::new(system, &[30.0], &Options::default()).unwrap();
                (0..stop).for_each(|_| assert_eq!(other.step(&mut ()), Ok(Step::Taken)));
                other.save(state)
            }
        };
        run.resume(&state).unwrap();
        let status = run.go_on(&Stage::only("rest"), &mut ()).unwrap();
        let (resumed, x) = (run.report(status), run.x().to_vec());
        assert_eq!((resumed.status, x[0].to_bits()), (full.status, whole.to_bits()));
    }
}
