//! The phases of a level: Gauss-Newton steps, then rounds of L-BFGS.

use std::cell::RefCell;
use std::time::Instant;

use super::conditioned::{Conditioned, Left};
use super::newton::{GainRatio, NewtonModel, Shared};
use super::rounds::{DAMPING, Descent, round_options};
use crate::options::Method;
use crate::status::status_of;
use gp_solver::{
    Checkpoint, DampedOptions, DampedRun, IterationRecord, Observer, Progress, Report, Rounds,
    SolverError, Stage, Status, Step,
};

/// The first damping of Gauss-Newton steps, which open a level.
const FIRST_DAMPING: f64 = 10.0 * DAMPING;
/// Relative gain of a Gauss-Newton step below which rounds follow.
const OPENING_TOLERANCE: f64 = 1e-3;
/// Share of the tolerance below which the gain of a step ends the method that makes no others.
const STEP_TOLERANCE: f64 = 0.1;

/// What a level is to do.
#[derive(Clone, Debug)]
pub(crate) struct Plan {
    pub(crate) method: Method,
    /// Steps at most.
    pub(crate) iterations: usize,
    /// Gauss-Newton steps that open the level, at most.
    pub(crate) newton_steps: usize,
    /// Converged once a round lowers the energy by this share of it at most.
    pub(crate) tolerance: f64,
}

impl Plan {
    /// Gauss-Newton steps of a method at most, and the relative gain that ends them.
    fn opening(&self) -> (usize, f64) {
        match self.method {
            Method::LaggedGaussNewton => {
                (self.newton_steps.min(self.iterations), OPENING_TOLERANCE)
            }
            Method::GaussNewton => (self.iterations, STEP_TOLERANCE * self.tolerance),
            Method::Sobolev | Method::Lbfgs => (0, 0.0),
        }
    }
}

/// What a level is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    Newton,
    Rounds,
    Done,
}

/// A level between two steps or rounds.
#[derive(Clone, Debug)]
pub(crate) struct State {
    /// The unknowns.
    pub(crate) y: Vec<f64>,
    /// What has been done.
    pub(crate) report: Report,
    phase: Phase,
    damping: f64,
}

impl State {
    /// At the start of a level.
    pub(crate) fn new(y: Vec<f64>) -> Self {
        let report = Report::new(Status::IterationLimit, y.len());
        Self { y, report, phase: Phase::Newton, damping: FIRST_DAMPING }
    }

    /// Adds the state to a checkpoint.
    pub(crate) fn save(&self, checkpoint: Checkpoint) -> Checkpoint {
        let Report { status, iterations, evaluations, factorizations, .. } = self.report;
        let counts = [iterations, evaluations, factorizations].map(|n| n as u64);
        let [steps, evaluations, factorizations] = counts;
        let state = [self.phase as u64, status as u64, steps, evaluations, factorizations];
        let checkpoint = checkpoint
            .with_numbers("y", &self.y)
            .with_numbers("damping", &[self.damping])
            .with_counts("state", &state)
            .with_numbers("gradient_norm", finite(&self.report.gradient_norm));
        Checkpoint { iteration: iterations, ..checkpoint }
    }

    /// The state a checkpoint was made from; `None` if it was made at the start of a level.
    pub(crate) fn resumed(
        checkpoint: &Checkpoint,
        unknowns: usize,
    ) -> Result<Option<Self>, SolverError> {
        if !checkpoint.numbers.contains_key("y") {
            return Ok(None);
        }
        let mut this = Self::new(checkpoint.numbers("y", unknowns)?.to_vec());
        this.damping = checkpoint.numbers("damping", 1)?[0];
        let damaged = || SolverError::ForeignCheckpoint {
            what: "a run of another size, or its state is damaged".to_owned(),
        };
        let &[phase, status, steps, evaluations, factorizations] = checkpoint.counts("state")?
        else {
            return Err(damaged());
        };
        this.phase = match phase {
            0 => Phase::Newton,
            1 => Phase::Rounds,
            2 => Phase::Done,
            _ => return Err(damaged()),
        };
        this.report.status = status_of(status).ok_or_else(damaged)?;
        this.report.iterations = steps as usize;
        this.report.evaluations = evaluations as usize;
        this.report.factorizations = factorizations as usize;
        this.report.gradient_norm = gradient_norm_of(checkpoint, "gradient_norm");
        Ok(Some(this))
    }

    /// Goes on from where a certificate has found something left to gain, which counts as a step.
    pub(crate) fn go_on(&mut self, left: Left, plan: &Plan) {
        let energy = left.before - left.gain;
        let record = IterationRecord { energy, decrease: left.gain, ..blank() };
        self.record(left.before, record);
        self.y = left.y;
        self.report.iterations += 1;
        self.report.factorizations += left.factorizations;
        self.report.status = Status::IterationLimit;
        let is_all = plan.method == Method::GaussNewton;
        self.phase = if is_all { Phase::Newton } else { Phase::Rounds };
    }

    /// Takes up a step in the report.
    fn record(&mut self, energy: f64, record: IterationRecord) {
        if self.report.history.is_empty() {
            self.report.history.push(IterationRecord { energy, ..blank() });
        }
        self.report.history.push(record);
    }
}

/// Minimises `of` by `plan` from `state`, which then holds the result; the report has the status.
/// Checkpoints are offered after every Gauss-Newton step and between rounds.
///
/// # Errors
/// [`SolverError::NotPositiveDefinite`] where nothing mends the metric, and
/// [`SolverError::NotFinite`].
pub(crate) fn minimise(
    of: &mut Conditioned<'_>,
    plan: &Plan,
    state: &mut State,
    stage: &Stage,
    observer: &mut dyn Observer,
) -> Result<(), SolverError> {
    let begin = Instant::now();
    if state.phase == Phase::Newton {
        newton(of, plan, state, stage, observer)?;
    }
    if state.phase == Phase::Rounds && state.report.status != Status::Interrupted {
        let options = round_options(plan.method, plan.iterations, plan.tolerance);
        let variables = state.y.len();
        let done = std::mem::replace(&mut state.report, Report::new(Status::Stalled, variables));
        let mut rounds = Rounds::after(&options, done);
        let mut descent = Descent { of, method: plan.method };
        loop {
            let step = rounds.round(&mut descent, &mut state.y, stage, observer)?;
            state.report = rounds.report().clone();
            let status = match step {
                Step::Taken => None,
                Step::Ended(status) => Some(status),
            };
            if status == Some(Status::Converged) {
                state.phase = Phase::Done;
            }
            if status != Some(Status::Interrupted) {
                observer.checkpoint(&|| state.save(Checkpoint::new("", 0, stage.number, 0)));
            }
            if status.is_some() {
                break;
            }
        }
    }
    state.report.timings.total = begin.elapsed();
    Ok(())
}

/// Damped Gauss-Newton steps until one gains less than the tolerance.
fn newton(
    of: &mut Conditioned<'_>,
    plan: &Plan,
    state: &mut State,
    stage: &Stage,
    observer: &mut dyn Observer,
) -> Result<(), SolverError> {
    let (steps, tolerance) = plan.opening();
    let is_all = plan.method == Method::GaussNewton;
    let after = if is_all { Phase::Done } else { Phase::Rounds };
    // An energy may be negative; only the gain tells.
    let options =
        DampedOptions { exact: f64::NEG_INFINITY, stall: tolerance, ..Default::default() };
    let observer = RefCell::new(observer);
    let mut run = DampedRun::new(&[state.damping]);
    while state.report.iterations < steps {
        let known = run.history().len().max(1);
        let mut model = NewtonModel::new(of, &mut state.y, Shared(&observer));
        let mut policy = GainRatio::default();
        let ended = match run.step(&mut model, &mut policy, &options, &mut Shared(&observer))? {
            Step::Taken => None,
            Step::Ended(status) => Some(status),
        };
        let NewtonModel { before, factorizations, evaluations, gradient_norm, fault, .. } = model;
        if let Some(fault) = fault {
            return Err(fault);
        }
        state.report.evaluations += evaluations;
        state.report.factorizations += factorizations;
        if factorizations > 0 {
            state.report.gradient_norm = gradient_norm;
        }
        if run.history().len() == known {
            let status = ended.unwrap_or(Status::Stalled);
            state.report.status = status;
            if status != Status::Interrupted {
                state.phase = after;
            }
            return Ok(());
        }
        let energy = run.history()[known];
        let damping = std::mem::replace(&mut state.damping, run.damping()[0]);
        state.report.iterations += 1;
        let record = IterationRecord {
            energy,
            decrease: before - energy,
            damping,
            gradient_norm,
            factorizations,
            ..blank()
        };
        state.record(before, record);
        state.report.damping = state.damping;
        state.report.status = Status::IterationLimit;
        if ended.is_some() {
            (state.report.status, state.phase) = (Status::Converged, after);
        }
        let mut observer = observer.borrow_mut();
        observer.checkpoint(&|| state.save(Checkpoint::new("", 0, stage.number, 0)));
        let progress = Progress {
            stage,
            iteration: state.report.iterations,
            max_iterations: plan.iterations,
            energy,
            gradient_norm,
            x: &state.y,
            system: None,
        };
        if observer.step(&progress).is_break() {
            state.report.status = Status::Interrupted;
            return Ok(());
        }
        if ended.is_some() {
            return Ok(());
        }
    }
    // Steps that are used up may be given more of them later.
    if !is_all {
        state.phase = Phase::Rounds;
    }
    Ok(())
}

fn blank() -> IterationRecord {
    IterationRecord {
        energy: f64::NAN,
        terms: Vec::new(),
        decrease: 0.0,
        damping: 0.0,
        step_norm: 0.0,
        gradient_norm: 0.0,
        factorizations: 0,
    }
}

/// A number that may be missing.
fn finite(value: &f64) -> &[f64] {
    if value.is_finite() { std::slice::from_ref(value) } else { &[] }
}

fn gradient_norm_of(checkpoint: &Checkpoint, name: &str) -> f64 {
    checkpoint.numbers.get(name).and_then(|v| v.first().copied()).unwrap_or(f64::NAN)
}
