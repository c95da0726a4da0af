//! Minimisation by L-BFGS in rounds, with a new metric each round.

use std::ops::ControlFlow;

use crate::clock::Instant;
use crate::error::SolverError;
use crate::lbfgs::{LbfgsOptions, Metric, Objective, lbfgs};
use crate::least_squares::Step;
use crate::observer::{Observer, Progress};
use crate::report::{Report, Status};
use crate::schedule::Stage;

/// What is minimised in rounds: a function and a metric, both of which stay during a round and may
/// change between two (a factorised Hessian, a barrier, the scale of the unknowns).
pub trait Renewed {
    /// Begins a round at `x`, which it may move, and makes its metric; returns how many
    /// factorisations that took, or why there will be no round.
    ///
    /// # Errors
    /// Whatever makes it impossible to go on.
    fn renew(
        &mut self,
        x: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<Result<usize, Status>, SolverError>;

    /// Function and metric of the round.
    fn parts(&mut self) -> (&mut dyn Objective, &mut dyn Metric);
}

/// Settings of [`Rounds`].
#[derive(Clone, Debug, PartialEq)]
pub struct RoundOptions {
    /// How a round goes; its `max_iterations` are the steps of a round.
    pub lbfgs: LbfgsOptions,
    /// [`IterationLimit`](Status::IterationLimit) once the number of steps of all rounds is
    /// `≥ max_iterations`.
    pub max_iterations: usize,
    /// Converged once a round lowers the value by `≤ tolerance · |E|`.
    pub tolerance: f64,
    /// For metrics near the Hessian: converged once `½ ‖g‖²_M⁻¹ ≤ settled · |E|`, which is what the
    /// metric foresees there is left to gain.
    pub settled: Option<f64>,
}

/// A minimisation by L-BFGS in rounds, a new metric each round, until a round gains less than the
/// tolerance. Nothing but the iterate and the counts of the report passes from one round to the
/// next, so that a checkpoint between two rounds needs no memory of steps.
///
/// ```
/// use gp_solver::{LbfgsOptions, Metric, Objective, Observer, Renewed, RoundOptions, Rounds};
/// use gp_solver::{SolverError, Stage, Status};
/// // E = Σ (xᵢ² − i)², with the diagonal of its Hessian as the metric.
/// struct Value;
/// struct Parts { value: Value, diagonal: Diagonal }
/// struct Diagonal(Vec<f64>);
/// impl Objective for Value {
///     fn value_and_gradient(&mut self, x: &[f64], g: &mut [f64]) -> f64 {
///         let excess = |i: usize| x[i] * x[i] - (i + 1) as f64;
///         (0..x.len()).map(|i| { g[i] = 4.0 * excess(i) * x[i]; excess(i).powi(2) }).sum()
///     }
/// }
/// impl Metric for Diagonal {
///     fn apply_inverse(&mut self, g: &mut [f64]) {
///         g.iter_mut().zip(&self.0).for_each(|(g, d)| *g /= d);
///     }
/// }
/// impl Renewed for Parts {
///     fn renew(&mut self, x: &mut [f64], _: &mut dyn Observer)
///         -> Result<Result<usize, Status>, SolverError> {
///         self.diagonal.0 = x.iter().map(|x| 8.0 * x * x + 1e-3).collect();
///         Ok(Ok(1))
///     }
///     fn parts(&mut self) -> (&mut dyn Objective, &mut dyn Metric) {
///         (&mut self.value, &mut self.diagonal)
///     }
/// }
/// let lbfgs = LbfgsOptions { max_iterations: 5, ..LbfgsOptions::default() };
/// let options = RoundOptions { lbfgs, max_iterations: 100, tolerance: 1e-12, settled: None };
/// let mut rounds = Rounds::new(&options, 3);
/// let mut quartic = Parts { value: Value, diagonal: Diagonal(Vec::new()) };
/// let mut x = [3.0; 3];
/// let status = rounds.go_on(&mut quartic, &mut x, &Stage::only("quartic"), &mut ())?;
/// assert_eq!(status, Status::Converged);
/// assert!((x[2] - 3.0_f64.sqrt()).abs() < 1e-5);
/// # Ok::<(), SolverError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Rounds {
    options: RoundOptions,
    report: Report,
}

impl Rounds {
    /// Before the first round, of so many unknowns.
    #[must_use]
    pub fn new(options: &RoundOptions, variables: usize) -> Self {
        Self::after(options, Report::new(Status::IterationLimit, variables))
    }

    /// Goes on from what `report` says has been done already: its steps count.
    #[must_use]
    pub fn after(options: &RoundOptions, report: Report) -> Self {
        Self { options: options.clone(), report }
    }

    /// What has been done so far.
    #[must_use]
    pub fn report(&self) -> &Report {
        &self.report
    }

    /// Gives the report back.
    #[must_use]
    pub fn into_report(self) -> Report {
        self.report
    }

    /// Makes one round from `x`, which then holds its result. `observer` is shown every step, not
    /// the start.
    ///
    /// # Errors
    /// [`SolverError::NotFinite`] at the start of the round, and those of [`Renewed::renew`].
    pub fn round(
        &mut self,
        of: &mut (impl Renewed + ?Sized),
        x: &mut [f64],
        stage: &Stage,
        observer: &mut dyn Observer,
    ) -> Result<Step, SolverError> {
        let begin = Instant::now();
        let done = self.report.iterations;
        let left = self.options.max_iterations.saturating_sub(done);
        if left == 0 {
            return Ok(Step::Ended(self.report.status));
        }
        match of.renew(x, observer)? {
            Ok(factorizations) => self.report.factorizations += factorizations,
            Err(status) => {
                self.report.status = status;
                return Ok(Step::Ended(status));
            }
        }
        let LbfgsOptions { max_iterations: steps, .. } = self.options.lbfgs;
        let lbfgs_options =
            LbfgsOptions { max_iterations: steps.min(left), ..self.options.lbfgs.clone() };
        let mut watch = Watch { observer, stage, done, options: &self.options, has_settled: false };
        let (objective, metric) = of.parts();
        let round = lbfgs(objective, metric, x, &lbfgs_options, stage, &mut watch)?;
        let has_settled = watch.has_settled;
        let gain = round.initial_energy - round.final_energy;
        self.take(round, begin);
        if has_settled {
            self.report.status = Status::Converged;
        } else if self.report.status != Status::Interrupted {
            if gain > self.options.tolerance * self.report.final_energy.abs() {
                if self.report.iterations < self.options.max_iterations {
                    return Ok(Step::Taken);
                }
            } else {
                self.report.status = Status::Converged;
            }
        }
        Ok(Step::Ended(self.report.status))
    }

    /// Rounds until one gains too little, the steps are used up or `observer` stops it.
    ///
    /// # Errors
    /// As [`round`](Self::round).
    pub fn go_on(
        &mut self,
        of: &mut (impl Renewed + ?Sized),
        x: &mut [f64],
        stage: &Stage,
        observer: &mut dyn Observer,
    ) -> Result<Status, SolverError> {
        loop {
            if let Step::Ended(status) = self.round(of, x, stage, observer)? {
                return Ok(status);
            }
        }
    }

    /// Adds a round to the report.
    fn take(&mut self, round: Report, begin: Instant) {
        let report = &mut self.report;
        if report.history.is_empty() {
            report.initial_energy = round.initial_energy;
        }
        // The start of a later round is the end of the one before, on another scale perhaps.
        let known = usize::from(!report.history.is_empty());
        report.history.extend(round.history.into_iter().skip(known));
        report.status = round.status;
        report.iterations += round.iterations;
        report.evaluations += round.evaluations;
        report.final_energy = round.final_energy;
        report.gradient_norm = round.gradient_norm;
        report.timings.total += begin.elapsed();
    }
}

/// Counts the steps of a round on, and ends it where there is nothing left to gain.
struct Watch<'w> {
    observer: &'w mut dyn Observer,
    stage: &'w Stage,
    done: usize,
    options: &'w RoundOptions,
    has_settled: bool,
}

impl Observer for Watch<'_> {
    fn step(&mut self, seen: &Progress<'_>) -> ControlFlow<()> {
        if seen.iteration == 0 {
            return ControlFlow::Continue(());
        }
        self.observer.step(&Progress {
            stage: self.stage,
            iteration: self.done + seen.iteration,
            max_iterations: self.options.max_iterations,
            ..*seen
        })?;
        let left = 0.5 * seen.gradient_norm * seen.gradient_norm;
        self.has_settled =
            self.options.settled.is_some_and(|share| left <= share * seen.energy.abs());
        if self.has_settled { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn stop_requested(&mut self) -> bool {
        self.observer.stop_requested()
    }
}
