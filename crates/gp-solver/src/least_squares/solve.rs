//! The iteration.

use std::ops::ControlFlow;
use std::time::Instant;

use super::system::{StepModel, System};
use crate::damping::DampingRule;
use crate::error::SolverError;
use crate::options::{Method, Options};
use crate::problem::Problem;
use crate::report::{IterationRecord, Report, Status};

/// Damping beyond which no step is worth trying.
const MAX_DAMPING: f64 = 1e16;
/// Damping that mends a singular matrix at the least.
const MENDING_DAMPING: f64 = 1e-16;
/// Least share of the predicted decrease a step must bring.
const MIN_GAIN: f64 = 1e-4;
/// Largest cosine between the residual and a column of the Jacobian at which a step that is short
/// only because it is damped may count as convergence.
const ALIGNED: f64 = 1e-2;
/// A step this short relative to the iterate, and hardly damped, says that the minimum is near.
const NEAR: f64 = 1e-7;
/// The first step may be this much longer than the start itself, in the scaled norm: longer ones
/// tend to land on plateaus from which nothing leads back.
const FIRST_STEP: f64 = 10.0;
/// Factorisations spent on finding the damping for a first step of that length.
const FIRST_STEP_TRIALS: usize = 15;

/// What an observer sees after each taken step (and once at the start).
#[derive(Clone, Copy, Debug)]
pub struct Iteration<'s> {
    /// Steps taken so far.
    pub iteration: usize,
    /// The iterate.
    pub x: &'s [f64],
    /// Its record.
    pub record: &'s IterationRecord,
    /// Damping the next step begins with.
    pub damping: f64,
    /// Scaling `D` the next step begins with, by position.
    pub scaling: &'s [f64],
}

impl Iteration<'_> {
    /// All that is needed to go on from here.
    #[must_use]
    pub fn checkpoint(&self) -> Checkpoint {
        Checkpoint {
            iteration: self.iteration,
            x: self.x.to_vec(),
            damping: self.damping,
            scaling: self.scaling.to_vec(),
        }
    }
}

/// A solve between two steps. Resumed with the same problem and options it goes on to the same
/// result, bit for bit, provided the blocks' lagged quantities are functions of the iterate.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Checkpoint {
    /// Steps taken.
    pub iteration: usize,
    /// The iterate.
    pub x: Vec<f64>,
    /// Damping of the next step.
    pub damping: f64,
    /// Scaling of the next step, by position.
    pub scaling: Vec<f64>,
}

/// Minimises a problem from `x`, which then holds the result.
///
/// # Errors
/// [`SolverError`] for what cannot be attempted; not converging is a [`Status`].
pub fn solve(
    problem: Problem<'_>,
    x: &mut [f64],
    options: &Options,
) -> Result<Report, SolverError> {
    solve_observed(problem, x, options, |_| ControlFlow::Continue(()))
}

/// As [`solve`], calling `observer` at the start and after every taken step; it can stop the solve,
/// which leaves the iterate it was shown.
///
/// # Errors
/// As [`solve`].
pub fn solve_observed(
    problem: Problem<'_>,
    x: &mut [f64],
    options: &Options,
    observer: impl FnMut(&Iteration<'_>) -> ControlFlow<()>,
) -> Result<Report, SolverError> {
    options.check()?;
    let mut system = System::new(problem, options.factorization)?;
    solve_system(&mut system, x, options, observer)
}

/// As [`solve_observed`] on a planned system, which can be solved again from elsewhere.
///
/// # Errors
/// As [`solve`].
pub fn solve_system(
    system: &mut System<'_>,
    x: &mut [f64],
    options: &Options,
    observer: impl FnMut(&Iteration<'_>) -> ControlFlow<()>,
) -> Result<Report, SolverError> {
    run(system, x, options, observer, None)
}

/// Goes on from a checkpoint; `x` receives the result. The iterations of the report and of the
/// stop rule count from the very start, its history and timings from here.
///
/// # Errors
/// As [`solve`], and [`SolverError::CheckpointMismatch`] if the checkpoint is of another problem.
pub fn resume_system(
    system: &mut System<'_>,
    checkpoint: &Checkpoint,
    x: &mut [f64],
    options: &Options,
    observer: impl FnMut(&Iteration<'_>) -> ControlFlow<()>,
) -> Result<Report, SolverError> {
    let fits = |what, expected, found| match expected == found {
        true => Ok(()),
        false => Err(SolverError::CheckpointMismatch { what, expected, found }),
    };
    fits("the number of unknowns", x.len(), checkpoint.x.len())?;
    fits("the number of free unknowns", system.variables(), checkpoint.scaling.len())?;
    x.copy_from_slice(&checkpoint.x);
    run(system, x, options, observer, Some(checkpoint))
}

fn run(
    system: &mut System<'_>,
    x: &mut [f64],
    options: &Options,
    observer: impl FnMut(&Iteration<'_>) -> ControlFlow<()>,
    checkpoint: Option<&Checkpoint>,
) -> Result<Report, SolverError> {
    options.check()?;
    if let Some(variable) = x.iter().position(|v| !v.is_finite()) {
        return Err(SolverError::StartNotFinite { variable, value: x[variable] });
    }
    let begin = Instant::now();
    let before = (system.factorizations(), system.timings());
    let mut run = Run::new(system, x, options, observer, checkpoint)?;
    let status = run.iterate();
    let Run { history, gradient_norm, damping, system, iterations_before, .. } = run;
    system.keep_scaling(false);
    let status = status?;
    let mut timings = system.timings();
    timings.residuals -= before.1.residuals;
    timings.linearize -= before.1.linearize;
    timings.normal -= before.1.normal;
    timings.factor -= before.1.factor;
    timings.solve -= before.1.solve;
    timings.total = begin.elapsed();
    let last = &history[history.len() - 1];
    let terms = system
        .problem()
        .block_names()
        .zip(&last.terms)
        .map(|(name, &energy)| crate::report::Term { name: name.to_owned(), energy })
        .collect();
    Ok(Report {
        status,
        iterations: iterations_before + history.len() - 1,
        initial_energy: history[0].energy,
        final_energy: last.energy,
        terms,
        factorizations: system.factorizations() - before.0,
        gradient_norm,
        damping,
        variables: system.variables(),
        rows: system.rows(),
        timings,
        history,
    })
}

/// A solve under way.
struct Run<'s, 'a, F> {
    system: &'s mut System<'a>,
    x: &'s mut [f64],
    options: &'s Options,
    observer: F,
    trial: Vec<f64>,
    history: Vec<IterationRecord>,
    damping: f64,
    /// Steps taken before the checkpoint this run began with.
    iterations_before: usize,
    /// Whether no step has been taken yet.
    is_first: bool,
    gradient_norm: f64,
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

impl<'s, 'a, F: FnMut(&Iteration<'_>) -> ControlFlow<()>> Run<'s, 'a, F> {
    fn new(
        system: &'s mut System<'a>,
        x: &'s mut [f64],
        options: &'s Options,
        observer: F,
        checkpoint: Option<&Checkpoint>,
    ) -> Result<Self, SolverError> {
        system.refresh(x);
        system.keep_scaling(false);
        system.linearize(x)?;
        system.keep_scaling(options.damping_rule == DampingRule::StepLength);
        if let Some(checkpoint) = checkpoint {
            system.set_scaling(&checkpoint.scaling);
        }
        let iterations_before = checkpoint.map_or(0, |c| c.iteration);
        let start = IterationRecord {
            energy: system.energy(),
            decrease: 0.0,
            terms: system.term_energies().to_vec(),
            damping: 0.0,
            step_norm: 0.0,
            gradient_norm: system.scaled_gradient_norm(),
            factorizations: 0,
        };
        Ok(Self {
            trial: x.to_vec(),
            gradient_norm: start.gradient_norm,
            history: vec![start],
            damping: checkpoint.map_or(options.initial_damping, |c| c.damping),
            is_first: iterations_before == 0,
            iterations_before,
            system,
            x,
            options,
            observer,
        })
    }

    fn iterate(&mut self) -> Result<Status, SolverError> {
        if self.observe().is_break() {
            return Ok(Status::Interrupted);
        }
        loop {
            if self.gradient_norm <= self.options.gradient_tol
                || self.system.energy() <= self.options.abs_energy_tol
            {
                return Ok(Status::Converged);
            }
            if self.iterations_before + self.history.len() > self.options.max_iterations {
                return Ok(Status::IterationLimit);
            }
            let taken = match self.options.method {
                Method::LevenbergMarquardt => self.damped_step()?,
                Method::GuidedProjection { epsilon } => self.projection_step(epsilon)?,
            };
            let taken = match taken {
                Ok(taken) => taken,
                Err(status) => return Ok(status),
            };
            let energy_before = self.system.energy();
            let small_step = taken.model.scaled_norm
                <= self.options.step_tol * self.system.scaled_norm(&self.trial);
            let small_change = taken.model.predicted_decrease.abs()
                <= self.options.energy_tol * energy_before
                && taken.actual_decrease.abs() <= self.options.energy_tol * energy_before;
            let evidence = !taken.is_held_back || self.gradient_norm <= ALIGNED;
            self.take(&taken)?;
            if self.observe().is_break() {
                return Ok(Status::Interrupted);
            }
            if (small_step || small_change) && evidence {
                return Ok(Status::Converged);
            }
        }
    }

    /// Levenberg-Marquardt: changes the damping by the rule until a step lowers the energy.
    fn damped_step(&mut self) -> Result<Result<Taken, Status>, SolverError> {
        let (energy, rule) = (self.system.energy(), self.options.damping_rule);
        let mut factorizations = 0;
        let mut is_near = self.gradient_norm <= ALIGNED;
        loop {
            factorizations += 1;
            let damping = self.damping;
            let model = match self.system.damped_step(damping) {
                Ok(model) => model,
                // Damping mends an indefinite or singular matrix, like any bad step.
                Err(SolverError::NotPositiveDefinite { .. }) => {
                    self.damping = (10.0 * damping).max(MENDING_DAMPING);
                    if self.damping > MAX_DAMPING {
                        return Ok(Err(self.stalled()));
                    }
                    continue;
                }
                Err(other) => return Err(other),
            };
            if self.is_first
                && rule == DampingRule::StepLength
                && factorizations < FIRST_STEP_TRIALS
            {
                let longest = FIRST_STEP * self.system.scaled_norm(self.x);
                if longest > 0.0 && model.scaled_norm > 1.1 * longest {
                    let wanted = self.system.damping_for_radius(damping, longest);
                    self.damping = wanted.max(1.1 * damping);
                    continue;
                }
            }
            self.system.stepped_into(self.x, &mut self.trial);
            let decrease = energy - self.system.energy_at(&self.trial);
            let gain = decrease / model.predicted_decrease;
            let is_held_back = model.is_held_back(damping);
            if decrease >= 0.0 && gain >= MIN_GAIN {
                self.damping = rule.after_success(self.system, damping, model, gain);
                self.damping = self.damping.max(rule.least_damping());
                return Ok(Ok(Taken {
                    model,
                    actual_decrease: decrease,
                    damping,
                    factorizations,
                    is_held_back,
                }));
            }
            // So short a step cannot change the iterate: this is as low as it gets.
            let size = self.system.scaled_norm(self.x);
            let short = model.scaled_norm <= f64::EPSILON * size;
            is_near |= !is_held_back && model.scaled_norm <= NEAR * size;
            let flat = model.predicted_decrease <= self.options.energy_tol * energy
                && decrease.abs() <= self.options.energy_tol * energy;
            if (short || flat) && is_near {
                return Ok(Err(Status::Converged));
            }
            if short {
                return Ok(Err(Status::Stalled));
            }
            self.damping = rule.after_refusal(self.system, damping, model, decrease);
            tracing::trace!(damping, decrease, "step refused");
            if self.damping > MAX_DAMPING {
                return Ok(Err(self.stalled()));
            }
        }
    }

    fn stalled(&mut self) -> Status {
        self.damping = MAX_DAMPING;
        Status::Stalled
    }

    /// Guided projection: the step is taken whatever it does.
    fn projection_step(&mut self, epsilon: f64) -> Result<Result<Taken, Status>, SolverError> {
        let model = self.system.projection_step(epsilon)?;
        self.system.stepped_into(self.x, &mut self.trial);
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

    /// Moves to the trial point, refreshes and linearises there.
    fn take(&mut self, taken: &Taken) -> Result<(), SolverError> {
        let step_norm = self.system.step().iter().map(|s| s * s).sum::<f64>().sqrt();
        self.x.copy_from_slice(&self.trial);
        self.is_first = false;
        self.system.refresh(self.x);
        let energy = self.system.linearize(self.x)?;
        let record = IterationRecord {
            energy,
            decrease: taken.actual_decrease,
            terms: self.system.term_energies().to_vec(),
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

    fn observe(&mut self) -> ControlFlow<()> {
        (self.observer)(&Iteration {
            iteration: self.iterations_before + self.history.len() - 1,
            x: self.x,
            record: &self.history[self.history.len() - 1],
            damping: self.damping,
            scaling: self.system.scaling(),
        })
    }
}
