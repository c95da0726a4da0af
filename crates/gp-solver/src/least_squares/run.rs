//! Nonlinear least squares one step at a time.

use std::ops::ControlFlow;

use super::levenberg::{ALIGNED, Levenberg, SystemModel};
use super::system::{StepModel, System};
use crate::checkpoint::Checkpoint;
use crate::clock::Instant;
use crate::error::SolverError;
use crate::observer::{Observer, Progress};
use crate::options::{Method, Options, Regularization};
use crate::problem::Problem;
use crate::report::{IterationRecord, Report, Status, Timings};
use crate::schedule::Stage;
use crate::trust_region;

/// A full step is not shortened below this share.
const SHORTEST: f64 = 1e-4;
/// By how much of it the energy may rise under a full or shortened step: rounding.
const ROUNDING: f64 = 1e-12;

/// Minimises a problem from `x`, which then holds the result.
///
/// # Errors
/// [`SolverError`] for what cannot be attempted; not converging is a [`Status`].
///
/// # Example
/// ```
/// use gp_solver::{Elements, NumericBlock, Options, Problem, solve};
/// // Where the cosine meets the diagonal.
/// let mut elements = Elements::new();
/// elements.push(&[0], 1);
/// let meet = NumericBlock::new("meet", elements, |_, x, rows| rows[0] = x[0].cos() - x[0]);
/// let mut problem = Problem::new(1);
/// problem.add(meet);
/// let mut x = [1.0];
/// let report = solve(problem, &mut x, &Options::default())?;
/// assert!(report.final_energy < 1e-20);
/// assert!((x[0] - 0.739_085_133_215_160_6).abs() < 1e-9);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
pub fn solve(
    problem: Problem<'_>,
    x: &mut [f64],
    options: &Options,
) -> Result<Report, SolverError> {
    solve_observed(problem, x, options, &mut ())
}

/// As [`solve`], watched by `observer`, which can stop it, resume it and keep its checkpoints.
///
/// # Errors
/// As [`solve`], and [`SolverError::ForeignCheckpoint`].
pub fn solve_observed(
    problem: Problem<'_>,
    x: &mut [f64],
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Report, SolverError> {
    options.check()?;
    let system = System::new(problem, options.factorization)?;
    let mut run = Run::new(system, x, options)?;
    if let Some(checkpoint) = observer.resume() {
        run.resume(&checkpoint)?;
    }
    let result = run.go_on(&Stage::only("solve"), observer);
    x.copy_from_slice(run.x());
    let status = result?;
    Ok(run.report(status))
}

/// What a step did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// A step was taken; there may be more.
    Taken,
    /// The run has ended; if a step was taken before that, the iterate is its result.
    Ended(Status),
}

/// A solve that its caller drives: [`step`](Self::step) after step, or all at once by
/// [`go_on`](Self::go_on). Between two steps weights, references and blocks may change
/// ([`system_mut`](Self::system_mut)) without a new plan.
///
/// ```
/// use gp_solver::{Closeness, Factorization, Options, Problem, Run, Step, System};
/// let mut problem = Problem::new(1);
/// let target = problem.add(Closeness::new("target", vec![1.0], vec![1.0]));
/// let system = System::new(problem, Factorization::Auto)?;
/// let mut run = Run::new(system, &[0.0], &Options::default())?;
/// while run.step(&mut ())? == Step::Taken {}
/// assert!((run.x()[0] - 1.0).abs() < 1e-9);
/// run.system_mut().set_reference(target, &[5.0])?;
/// while run.step(&mut ())? == Step::Taken {}
/// assert!((run.x()[0] - 5.0).abs() < 1e-9);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
pub struct Run<'a> {
    system: System<'a>,
    x: Vec<f64>,
    trial: Vec<f64>,
    options: Options,
    history: Vec<IterationRecord>,
    damping: f64,
    /// Steps taken before the checkpoint this run began with.
    iterations_before: usize,
    /// Whether no step has been taken yet.
    is_first: bool,
    /// Whether the system has changed since it was linearised.
    is_stale: bool,
    /// Whether the last step met a stop rule and nothing has changed since.
    is_settled: bool,
    gradient_norm: f64,
    factorizations_before: usize,
    timings_before: Timings,
    begin: Instant,
}

/// A taken step.
struct Taken {
    model: StepModel,
    actual_decrease: f64,
    damping: f64,
    factorizations: usize,
    /// Whether the damping rather than the model ended the step.
    is_held_back: bool,
}

impl<'a> Run<'a> {
    /// Begins at `x`.
    ///
    /// # Errors
    /// [`SolverError`] for options, starts and values at the start that make no sense.
    pub fn new(mut system: System<'a>, x: &[f64], options: &Options) -> Result<Self, SolverError> {
        let begin = Instant::now();
        options.check()?;
        if let Some(variable) = x.iter().position(|v| !v.is_finite()) {
            return Err(SolverError::StartNotFinite { variable, value: x[variable] });
        }
        let (factorizations_before, timings_before) = (system.factorizations(), system.timings());
        system.refresh(x);
        system.keep_scaling(false);
        system.damp_by_blocks(!keeps_scaling(options));
        system.linearize(x)?;
        system.keep_scaling(keeps_scaling(options));
        let start = start_record(&system);
        Ok(Self {
            x: x.to_vec(),
            trial: x.to_vec(),
            gradient_norm: start.gradient_norm,
            history: vec![start],
            damping: options.initial_damping,
            iterations_before: 0,
            is_first: true,
            is_stale: false,
            is_settled: false,
            options: options.clone(),
            system,
            factorizations_before,
            timings_before,
            begin,
        })
    }

    /// Goes back to a checkpoint of the same problem and options: the run then ends with the same
    /// bytes as the one that was interrupted, provided the blocks' lagged quantities are functions
    /// of the iterate. Iterations count from the very start, history and timings from here.
    ///
    /// # Errors
    /// [`SolverError::ForeignCheckpoint`].
    ///
    /// # Example
    /// ```
    /// use gp_solver::{Checkpoint, Factorization, Options, Problem, QuadraticBuilder, Run, System};
    /// let run = || {
    ///     let mut root = QuadraticBuilder::new("root");
    ///     root.equation(1.0).product(0, 0, 1.0).constant(-2.0);
    ///     let mut problem = Problem::new(1);
    ///     problem.add(root.build());
    ///     Run::new(System::new(problem, Factorization::Auto)?, &[5.0], &Options::default())
    /// };
    /// let mut whole = run()?;
    /// whole.step(&mut ())?;
    /// let state = whole.save(Checkpoint::new("solve", 0, 0, 0));
    /// whole.step(&mut ())?;
    /// let mut resumed = run()?;
    /// resumed.resume(&state)?;
    /// resumed.step(&mut ())?;
    /// assert_eq!((resumed.x(), resumed.iterations()), (whole.x(), 2)); // to the bit
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    pub fn resume(&mut self, checkpoint: &Checkpoint) -> Result<(), SolverError> {
        let x = checkpoint.numbers("x", self.x.len())?;
        let scaling = checkpoint.numbers("scaling", self.system.variables())?;
        let damping = checkpoint.numbers("damping", 1)?[0];
        self.x.copy_from_slice(x);
        self.system.keep_scaling(false);
        self.system.refresh(&self.x);
        self.system.linearize(&self.x)?;
        self.system.set_scaling(scaling);
        self.system.keep_scaling(keeps_scaling(&self.options));
        self.damping = damping;
        self.iterations_before = checkpoint.iteration;
        self.is_first = checkpoint.iteration == 0;
        // After a Gauss-Newton step the checkpoint has the scaling of where the step began.
        self.is_stale = matches!(self.options.method, Method::GaussNewton { .. });
        self.is_settled = checkpoint.counts.contains_key("settled");
        self.history = vec![start_record(&self.system)];
        self.gradient_norm = self.history[0].gradient_norm;
        Ok(())
    }

    /// Adds the state to a checkpoint: `x`, `scaling`, `damping`, and `settled` if the last step met
    /// a stop rule.
    #[must_use]
    pub fn save(&self, checkpoint: Checkpoint) -> Checkpoint {
        let mut checkpoint = checkpoint
            .with_numbers("x", &self.x)
            .with_numbers("scaling", self.system.scaling())
            .with_numbers("damping", &[self.damping]);
        if self.is_settled {
            checkpoint = checkpoint.with_counts("settled", &[]);
        }
        Checkpoint { iteration: self.iterations(), ..checkpoint }
    }

    /// The iterate.
    #[must_use]
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// Moves the iterate; the next step starts from there.
    ///
    /// # Panics
    /// If the lengths differ.
    ///
    /// # Example
    /// ```
    /// use gp_solver::{Factorization, Options, Problem, QuadraticBuilder, Run, Stage, System};
    /// // Both roots of x² = 4, one after the other.
    /// let mut root = QuadraticBuilder::new("root");
    /// root.equation(1.0).product(0, 0, 1.0).constant(-4.0);
    /// let mut problem = Problem::new(1);
    /// problem.add(root.build());
    /// let system = System::new(problem, Factorization::Auto)?;
    /// let mut run = Run::new(system, &[1.0], &Options::default())?;
    /// run.go_on(&Stage::only("positive"), &mut ())?;
    /// assert!((run.x()[0] - 2.0).abs() < 1e-9);
    /// run.set_x(&[-1.0]);
    /// run.go_on(&Stage::only("negative"), &mut ())?;
    /// assert!((run.x()[0] + 2.0).abs() < 1e-9);
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    pub fn set_x(&mut self, x: &[f64]) {
        self.x.copy_from_slice(x);
        self.is_stale = true;
        self.is_settled = false;
    }

    /// Steps taken, those before a checkpoint included.
    #[must_use]
    pub fn iterations(&self) -> usize {
        self.iterations_before + self.history.len() - 1
    }

    /// The start and every step.
    #[must_use]
    pub fn history(&self) -> &[IterationRecord] {
        &self.history
    }

    /// The damping the next step begins with.
    #[must_use]
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// Sets the damping the next step begins with.
    pub fn set_damping(&mut self, damping: f64) {
        self.damping = damping;
    }

    /// The settings, to change stop rules between steps.
    pub fn options_mut(&mut self) -> &mut Options {
        &mut self.options
    }

    /// The planned problem.
    #[must_use]
    pub fn system(&self) -> &System<'a> {
        &self.system
    }

    /// The planned problem, to change weights, references and blocks; the next step linearises
    /// it anew.
    pub fn system_mut(&mut self) -> &mut System<'a> {
        self.is_stale = true;
        self.is_settled = false;
        &mut self.system
    }

    /// Gives the planned problem and the iterate back.
    ///
    /// # Example
    /// ```
    /// use gp_solver::{Closeness, Factorization, Options, Problem, Run, Stage, System};
    /// let mut problem = Problem::new(1);
    /// let target = problem.add(Closeness::new("target", vec![4.0], vec![1.0]));
    /// let system = System::new(problem, Factorization::Auto)?;
    /// let mut run = Run::new(system, &[0.0], &Options::default())?;
    /// run.go_on(&Stage::only("first"), &mut ())?;
    /// // The problem again, for another round with a block more.
    /// let (mut system, x) = run.into_parts();
    /// system.add(Closeness::new("there", vec![8.0], vec![1.0]))?;
    /// let mut run = Run::new(system, &x, &Options::default())?;
    /// run.go_on(&Stage::only("second"), &mut ())?;
    /// assert!((run.x()[0] - 6.0).abs() < 1e-6);
    /// assert_eq!(run.system().problem().weight(target)?, 1.0);
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    #[must_use]
    pub fn into_parts(mut self) -> (System<'a>, Vec<f64>) {
        self.system.keep_scaling(false);
        self.system.damp_by_blocks(false);
        (self.system, self.x)
    }

    /// What has been done so far, under the status given.
    #[must_use]
    pub fn report(&self, status: Status) -> Report {
        let (now, before) = (self.system.timings(), &self.timings_before);
        let timings = Timings {
            residuals: now.residuals - before.residuals,
            linearize: now.linearize - before.linearize,
            normal: now.normal - before.normal,
            factor: now.factor - before.factor,
            solve: now.solve - before.solve,
            total: self.begin.elapsed(),
            ..now
        };
        Report {
            status,
            iterations: self.iterations(),
            initial_energy: self.history[0].energy,
            final_energy: self.history[self.history.len() - 1].energy,
            terms: self.system.terms(),
            factorizations: self.system.factorizations() - self.factorizations_before,
            evaluations: 0,
            gradient_norm: self.gradient_norm,
            damping: self.damping,
            variables: self.system.variables(),
            rows: self.system.rows(),
            timings,
            history: self.history.clone(),
        }
    }

    /// Steps until a stop rule is met, the steps are used up or `observer` stops it; shows it the
    /// start and every step.
    ///
    /// # Errors
    /// [`SolverError`] if blocks are not finite where a step leads.
    pub fn go_on(
        &mut self,
        stage: &Stage,
        observer: &mut dyn Observer,
    ) -> Result<Status, SolverError> {
        if self.show(stage, observer).is_break() {
            return Ok(Status::Interrupted);
        }
        loop {
            let taken = self.history.len();
            let step = self.step(observer)?;
            if self.history.len() > taken && self.show(stage, observer).is_break() {
                return Ok(Status::Interrupted);
            }
            if let Step::Ended(status) = step {
                return Ok(status);
            }
        }
    }

    fn show(&self, stage: &Stage, observer: &mut dyn Observer) -> ControlFlow<()> {
        let state = || self.save(Checkpoint::new("solve", 0, stage.number, self.iterations()));
        observer.checkpoint(&state);
        observer.step(&Progress {
            stage,
            iteration: self.iterations(),
            max_iterations: self.options.max_iterations,
            energy: self.history[self.history.len() - 1].energy,
            gradient_norm: self.gradient_norm,
            x: &self.x,
            system: Some(&self.system),
        })
    }

    /// Takes one step, or says why none is taken. `observer` is asked between factorisations
    /// whether to stop.
    ///
    /// # Errors
    /// [`SolverError`] if blocks are not finite where the step leads.
    pub fn step(&mut self, observer: &mut dyn Observer) -> Result<Step, SolverError> {
        // Only a resumed run can have settled before it has taken a step.
        if std::mem::take(&mut self.is_settled) && self.history.len() == 1 {
            return Ok(Step::Ended(Status::Converged));
        }
        if self.is_stale {
            self.system.refresh(&self.x);
            self.system.linearize(&self.x)?;
            self.gradient_norm = self.system.scaled_gradient_norm();
            self.is_stale = false;
        }
        if self.gradient_norm <= self.options.gradient_tol
            || self.system.energy() <= self.options.abs_energy_tol
        {
            return Ok(Step::Ended(Status::Converged));
        }
        if self.iterations() >= self.options.max_iterations {
            return Ok(Step::Ended(Status::IterationLimit));
        }
        let taken = match self.options.method {
            Method::LevenbergMarquardt => self.damped_step(observer)?,
            _ if observer.stop_requested() => Err(Status::Interrupted),
            Method::GuidedProjection { epsilon } => self.projection_step(epsilon)?,
            Method::GaussNewton { regularization } => self.shortened_step(regularization)?,
        };
        let taken = match taken {
            Ok(taken) => taken,
            Err(status) => return Ok(Step::Ended(status)),
        };
        let energy_before = self.system.energy();
        let small_step =
            taken.model.scaled_norm <= self.options.step_tol * self.system.scaled_norm(&self.trial);
        let small_change = self.is_small_change(&taken, energy_before);
        let evidence = !taken.is_held_back || self.gradient_norm <= ALIGNED;
        self.take(&taken)?;
        self.is_settled = (small_step || small_change) && evidence;
        Ok(if self.is_settled { Step::Ended(Status::Converged) } else { Step::Taken })
    }

    fn is_small_change(&self, taken: &Taken, energy: f64) -> bool {
        let small = self.options.energy_tol * energy;
        match self.options.method {
            // The prediction of a shortened step says nothing about its length.
            Method::GaussNewton { .. } => taken.actual_decrease.abs() <= small,
            _ => {
                taken.model.predicted_decrease.abs() <= small
                    && taken.actual_decrease.abs() <= small
            }
        }
    }

    /// Levenberg-Marquardt: changes the damping by the rule until a step lowers the energy.
    fn damped_step(
        &mut self,
        observer: &mut dyn Observer,
    ) -> Result<Result<Taken, Status>, SolverError> {
        let mut model = SystemModel::new(&mut self.system, &self.x, &mut self.trial);
        let mut policy =
            Levenberg::new(&self.options, self.is_first, self.gradient_norm).begin(&mut model);
        let damping = std::slice::from_mut(&mut self.damping);
        let result = trust_region::damped_step(&mut model, &mut policy, damping, observer)?;
        let step = model.step();
        Ok(result.map(|accepted| Taken {
            model: step,
            actual_decrease: accepted.attempt.decrease,
            damping: policy.used(),
            factorizations: accepted.attempts,
            is_held_back: step.is_held_back(policy.used()),
        }))
    }

    /// Guided projection: the step is taken whatever it does.
    fn projection_step(&mut self, epsilon: f64) -> Result<Result<Taken, Status>, SolverError> {
        let model = self.system.projection_step(epsilon)?;
        self.system.stepped_into(&self.x, &mut self.trial);
        if !self.trial.iter().all(|v| v.is_finite()) {
            return Ok(Err(Status::Stalled));
        }
        let actual_decrease = self.system.energy() - self.system.energy_at(&self.trial);
        if !actual_decrease.is_finite() {
            return Ok(Err(Status::Stalled));
        }
        Ok(Ok(Taken {
            model,
            actual_decrease,
            damping: epsilon,
            factorizations: 1,
            is_held_back: false,
        }))
    }

    /// Gauss-Newton: the step is halved until the energy does not rise.
    fn shortened_step(
        &mut self,
        regularization: Regularization,
    ) -> Result<Result<Taken, Status>, SolverError> {
        let (model, damping) = match regularization {
            Regularization::Diagonal(share) => (self.system.damped_step(share)?, share),
            Regularization::Constant(epsilon) => (self.system.projection_step(epsilon)?, epsilon),
        };
        let energy = self.system.energy();
        let mut full = vec![0.0; self.x.len()];
        self.system.stepped_into(&self.x, &mut full);
        let mut length = 1.0;
        while length >= SHORTEST {
            for ((t, &a), &b) in self.trial.iter_mut().zip(&self.x).zip(&full) {
                *t = a + length * (b - a);
            }
            let after = self.system.energy_at(&self.trial);
            if after <= energy * (1.0 + ROUNDING) {
                let actual_decrease = energy - after;
                let factorizations = 1;
                let is_held_back = false;
                return Ok(Ok(Taken {
                    model,
                    actual_decrease,
                    damping,
                    factorizations,
                    is_held_back,
                }));
            }
            length *= 0.5;
        }
        Ok(Err(Status::Stalled))
    }

    /// Moves to the trial point, refreshes and linearises there; after a Gauss-Newton step only
    /// when another one follows, since stages of few steps would pay for one linearisation too many.
    fn take(&mut self, taken: &Taken) -> Result<(), SolverError> {
        let step_norm = self.system.step().iter().map(|s| s * s).sum::<f64>().sqrt();
        self.x.copy_from_slice(&self.trial);
        self.is_first = false;
        let energy = if matches!(self.options.method, Method::GaussNewton { .. }) {
            self.is_stale = true;
            self.system.energy() - taken.actual_decrease
        } else {
            self.system.refresh(&self.x);
            self.system.linearize(&self.x)?
        };
        let record = IterationRecord {
            energy,
            decrease: taken.actual_decrease,
            terms: self.system.term_energies(),
            damping: taken.damping,
            step_norm,
            gradient_norm: self.gradient_norm,
            factorizations: taken.factorizations,
        };
        self.gradient_norm = self.system.scaled_gradient_norm();
        tracing::debug!(
            iteration = self.history.len(),
            energy,
            terms = ?record.terms,
            step = step_norm,
            damping = taken.damping,
            gradient = self.gradient_norm,
        );
        self.history.push(record);
        Ok(())
    }
}

/// Whether the scaling is the largest diagonal so far; the share of Gauss-Newton is one of the
/// diagonal as it is.
fn keeps_scaling(options: &Options) -> bool {
    !matches!(options.method, Method::GaussNewton { .. }) && options.damping_rule.keeps_scaling()
}

fn start_record(system: &System<'_>) -> IterationRecord {
    IterationRecord {
        energy: system.energy(),
        decrease: 0.0,
        terms: system.term_energies(),
        damping: 0.0,
        step_norm: 0.0,
        gradient_norm: system.scaled_gradient_norm(),
        factorizations: 0,
    }
}
