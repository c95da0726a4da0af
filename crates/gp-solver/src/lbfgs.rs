//! Limited-memory BFGS with a metric.

use std::collections::VecDeque;

use crate::clock::Instant;
use crate::error::{Quantity, SolverError};
use crate::line_search::{LineSearch, Outcome};
use crate::observer::{Observer, Progress};
use crate::report::{IterationRecord, Report, Status, Timings};
use crate::schedule::Stage;
use numerics::{axpy, dot};

/// A smooth function of many unknowns.
pub trait Objective {
    /// Value at `x`; fills the gradient. A value that is not finite makes the line search shorten
    /// its step.
    fn value_and_gradient(&mut self, x: &[f64], gradient: &mut [f64]) -> f64;
}

impl<F: FnMut(&[f64], &mut [f64]) -> f64> Objective for F {
    fn value_and_gradient(&mut self, x: &[f64], gradient: &mut [f64]) -> f64 {
        self(x, gradient)
    }
}

/// A symmetric positive definite metric `M` that stands in for the Hessian where the memory says
/// nothing: the search direction begins as `−M⁻¹ g`. It stays the same during a minimisation, which
/// makes one application per step enough; a new metric begins a new minimisation.
pub trait Metric {
    /// Replaces `gradient` by `M⁻¹ gradient`.
    fn apply_inverse(&mut self, gradient: &mut [f64]);
}

/// `M = I`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Euclidean;

impl Metric for Euclidean {
    fn apply_inverse(&mut self, _: &mut [f64]) {}
}

impl<F: FnMut(&mut [f64])> Metric for F {
    fn apply_inverse(&mut self, gradient: &mut [f64]) {
        self(gradient);
    }
}

/// Settings of [`lbfgs`].
#[derive(Clone, Debug, PartialEq)]
pub struct LbfgsOptions {
    /// Number of remembered steps.
    pub memory: usize,
    /// [`IterationLimit`](Status::IterationLimit) once the number of steps `≥ max_iterations`.
    pub max_iterations: usize,
    /// Converged if `‖g‖_M⁻¹ ≤ gradient_tol · ‖g₀‖_M⁻¹`, the norm at the start.
    pub gradient_tol: f64,
    /// Converged if the last [`window`](Self::window) steps together lowered the value by
    /// `≤ energy_tol · |E|`.
    pub energy_tol: f64,
    /// Steps over which the decrease is judged.
    pub window: usize,
    /// How a step length is found.
    pub line_search: LineSearch,
}

impl Default for LbfgsOptions {
    fn default() -> Self {
        Self {
            memory: 10,
            max_iterations: 1000,
            gradient_tol: 1e-8,
            energy_tol: 1e-12,
            window: 20,
            line_search: LineSearch::default(),
        }
    }
}

/// One remembered step.
struct Pair {
    s: Vec<f64>,
    y: Vec<f64>,
    /// `M⁻¹ y`, the difference of two gradients' images.
    image: Vec<f64>,
    /// `1 / (s·y)`.
    rho: f64,
}

/// Minimises `objective` from `x`, which then holds the result (Nocedal and Wright 2006,
/// Algorithms 7.4 and 7.5, with `H₀ = γ M⁻¹`, `γ = s·y / (y·M⁻¹y)`). Norms of the gradient, for
/// the observer and in the report, are `√(gᵀ M⁻¹ g)`; the history tells each step's length as a
/// multiple of the search direction.
///
/// # Errors
/// [`SolverError::NotFinite`] if the value or gradient at the start is not finite.
pub fn lbfgs(
    objective: &mut (impl Objective + ?Sized),
    metric: &mut (impl Metric + ?Sized),
    x: &mut [f64],
    options: &LbfgsOptions,
    stage: &Stage,
    observer: &mut dyn Observer,
) -> Result<Report, SolverError> {
    let begin = Instant::now();
    let n = x.len();
    let mut gradient = vec![0.0; n];
    let mut energy = objective.value_and_gradient(x, &mut gradient);
    check_start(energy, &gradient)?;
    let mut evaluations = 1;
    let mut history: Vec<f64> = vec![energy];
    let mut records = Vec::new();
    let mut memory: VecDeque<Pair> = VecDeque::with_capacity(options.memory + 1);
    // M⁻¹ g at the iterate.
    let mut natural = gradient.clone();
    metric.apply_inverse(&mut natural);
    let mut direction = vec![0.0; n];
    let mut rest = vec![0.0; n];
    let mut gradient_norm = dot(&gradient, &natural).max(0.0).sqrt();
    let first_norm = gradient_norm;
    let mut step = 0.0;
    let mut trial = x.to_vec();
    let mut trial_gradient = vec![0.0; n];
    let mut trial_natural = vec![0.0; n];
    let status = loop {
        let iteration = history.len() - 1;
        records.push(IterationRecord {
            energy,
            terms: Vec::new(),
            decrease: if iteration == 0 { 0.0 } else { history[iteration - 1] - energy },
            damping: 0.0,
            step_norm: step,
            gradient_norm,
            factorizations: 0,
        });
        let progress = Progress {
            stage,
            iteration,
            max_iterations: options.max_iterations,
            energy,
            gradient_norm,
            x,
            system: None,
        };
        if observer.step(&progress).is_break() || observer.stop_requested() {
            break Status::Interrupted;
        }
        let flat = iteration >= options.window
            && history[iteration - options.window] - energy <= options.energy_tol * energy.abs();
        if gradient_norm <= options.gradient_tol * first_norm || gradient_norm == 0.0 || flat {
            break Status::Converged;
        }
        if iteration >= options.max_iterations {
            break Status::IterationLimit;
        }
        two_loop(&memory, &gradient, &natural, &mut rest, &mut direction);
        let mut slope = dot(&gradient, &direction);
        if !(slope < 0.0) {
            // Rounding can spoil the direction; the metric's own never is.
            memory.clear();
            two_loop(&memory, &gradient, &natural, &mut rest, &mut direction);
            slope = dot(&gradient, &direction);
            if !(slope < 0.0) {
                break Status::Stalled;
            }
        }
        let mut outcome = Outcome::NoProgress;
        for attempt in 0..2 {
            let first = if memory.is_empty() { first_step(energy, slope) } else { 1.0 };
            let mut evaluate = |t: f64| {
                for ((to, &from), &d) in trial.iter_mut().zip(x.iter()).zip(&direction) {
                    *to = from + t * d;
                }
                evaluations += 1;
                let value = objective.value_and_gradient(&trial, &mut trial_gradient);
                (value, dot(&trial_gradient, &direction))
            };
            outcome = options.line_search.search(energy, slope, first, &mut evaluate);
            if !matches!(outcome, Outcome::NoProgress) || attempt == 1 || memory.is_empty() {
                break;
            }
            memory.clear();
            two_loop(&memory, &gradient, &natural, &mut rest, &mut direction);
            slope = dot(&gradient, &direction);
        }
        let Outcome::Step { length, value } = outcome else { break Status::Stalled };
        let s: Vec<f64> = trial.iter().zip(x.iter()).map(|(a, b)| a - b).collect();
        let y: Vec<f64> = trial_gradient.iter().zip(&gradient).map(|(a, b)| a - b).collect();
        trial_natural.copy_from_slice(&trial_gradient);
        metric.apply_inverse(&mut trial_natural);
        let curvature = dot(&s, &y);
        if curvature > f64::EPSILON * dot(&y, &y).sqrt() * dot(&s, &s).sqrt() {
            if memory.len() == options.memory {
                memory.pop_front();
            }
            if options.memory > 0 {
                let image = trial_natural.iter().zip(&natural).map(|(a, b)| a - b).collect();
                memory.push_back(Pair { s, y, image, rho: 1.0 / curvature });
            }
        }
        x.copy_from_slice(&trial);
        gradient.copy_from_slice(&trial_gradient);
        energy = value;
        step = length;
        history.push(energy);
        std::mem::swap(&mut natural, &mut trial_natural);
        gradient_norm = dot(&gradient, &natural).max(0.0).sqrt();
        tracing::debug!(iteration = history.len() - 1, energy, step, gradient = gradient_norm);
    };
    Ok(Report {
        status,
        iterations: history.len() - 1,
        initial_energy: history[0],
        final_energy: energy,
        terms: Vec::new(),
        history: records,
        factorizations: 0,
        evaluations,
        gradient_norm,
        damping: 0.0,
        variables: n,
        rows: 0,
        timings: Timings { total: begin.elapsed(), ..Timings::default() },
    })
}

/// First trial length without memory: the value would fall by a tenth of its size if it were
/// linear, and never longer than the direction itself.
fn first_step(energy: f64, slope: f64) -> f64 {
    if energy == 0.0 { 1.0 } else { (0.2 * energy.abs() / -slope).min(1.0) }
}

/// `direction = −H g`, from `natural = M⁻¹ g`; `rest` is scratch space.
fn two_loop(
    memory: &VecDeque<Pair>,
    gradient: &[f64],
    natural: &[f64],
    rest: &mut [f64],
    direction: &mut [f64],
) {
    rest.copy_from_slice(gradient);
    direction.copy_from_slice(natural);
    let mut alpha = vec![0.0; memory.len()];
    for (pair, a) in memory.iter().zip(&mut alpha).rev() {
        *a = pair.rho * dot(&pair.s, rest);
        axpy(-*a, &pair.y, rest);
        axpy(-*a, &pair.image, direction);
    }
    if let Some(last) = memory.back() {
        let gamma = 1.0 / (last.rho * dot(&last.y, &last.image));
        if gamma.is_finite() && gamma > 0.0 {
            direction.iter_mut().for_each(|d| *d *= gamma);
        }
    }
    for (pair, a) in memory.iter().zip(&alpha) {
        let b = pair.rho * dot(&pair.y, direction);
        axpy(a - b, &pair.s, direction);
    }
    direction.iter_mut().for_each(|d| *d = -*d);
}

fn check_start(energy: f64, gradient: &[f64]) -> Result<(), SolverError> {
    let fault = |row: usize, quantity: Quantity, value: f64| {
        Err(SolverError::NotFinite { block: "objective".to_owned(), row, quantity, value })
    };
    if !energy.is_finite() {
        return fault(0, Quantity::Energy, energy);
    }
    match gradient.iter().position(|g| !g.is_finite()) {
        Some(row) => fault(row, Quantity::Gradient, gradient[row]),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ops::ControlFlow;

    /// Extended Rosenbrock function of `n` unknowns.
    fn rosenbrock(x: &[f64], g: &mut [f64]) -> f64 {
        let mut value = 0.0;
        for i in (0..x.len()).step_by(2) {
            let (a, b) = (1.0 - x[i], x[i + 1] - x[i] * x[i]);
            value += a * a + 100.0 * b * b;
            g[i] = -2.0 * a - 400.0 * x[i] * b;
            g[i + 1] = 200.0 * b;
        }
        value
    }

    fn minimise(
        objective: &mut dyn Objective,
        metric: &mut dyn Metric,
        x: &mut [f64],
        options: &LbfgsOptions,
    ) -> Report {
        lbfgs(objective, metric, x, options, &Stage::only("test"), &mut ()).unwrap()
    }

    #[test]
    fn rosenbrock_of_100_unknowns_is_solved_by_both_line_searches() {
        for line_search in [LineSearch::StrongWolfe { sigma: 0.9 }, LineSearch::Armijo] {
            let mut x: Vec<f64> = (0..100).map(|i| if i % 2 == 0 { -1.2 } else { 1.0 }).collect();
            let options = LbfgsOptions { line_search, ..LbfgsOptions::default() };
            let report = minimise(&mut rosenbrock, &mut Euclidean, &mut x, &options);
            assert_eq!(report.status, Status::Converged, "{line_search:?}");
            assert!(x.iter().all(|v| (v - 1.0).abs() < 1e-6), "{line_search:?} {report:?}");
            assert!(report.evaluations < 150, "{line_search:?} {}", report.evaluations);
        }
    }

    #[test]
    fn exact_metric_of_a_quadratic_converges_at_once() {
        let weights: Vec<f64> = (0..50).map(|i| 10_f64.powf(0.2 * f64::from(i))).collect();
        let mut quadratic = |x: &[f64], g: &mut [f64]| {
            for i in 0..50 {
                g[i] = weights[i] * (x[i] - 1.0);
            }
            (0..50).map(|i| 0.5 * weights[i] * (x[i] - 1.0).powi(2)).sum()
        };
        let mut metric = |g: &mut [f64]| g.iter_mut().zip(&weights).for_each(|(g, w)| *g /= w);
        let mut x = vec![0.0; 50];
        let report = minimise(&mut quadratic, &mut metric, &mut x, &LbfgsOptions::default());
        assert_eq!(report.status, Status::Converged);
        assert!(report.iterations <= 3, "{report:?}");
    }

    #[test]
    fn value_never_rises_and_stop_rules_are_reached() {
        let mut x = vec![-1.2, 1.0];
        let few = LbfgsOptions { max_iterations: 3, ..LbfgsOptions::default() };
        let report = minimise(&mut rosenbrock, &mut Euclidean, &mut x, &few);
        assert_eq!(report.status, Status::IterationLimit);
        assert!(report.history.windows(2).all(|w| w[1].energy <= w[0].energy));
        let mut stop = |it: &Progress<'_>| {
            if it.iteration == 2 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let mut x = vec![-1.2, 1.0];
        let all = LbfgsOptions::default();
        let stage = Stage::only("test");
        let report =
            lbfgs(&mut rosenbrock, &mut Euclidean, &mut x, &all, &stage, &mut stop).unwrap();
        assert_eq!((report.status, report.iterations), (Status::Interrupted, 2));
        let mut wrong = |_: &[f64], g: &mut [f64]| {
            g[0] = 1.0;
            0.0
        };
        // The gradient lies: no step can lower the value.
        let report = minimise(&mut wrong, &mut Euclidean, &mut [0.0], &all);
        assert_eq!(report.status, Status::Stalled);
    }
}
