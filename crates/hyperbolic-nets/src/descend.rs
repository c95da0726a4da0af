//! Gauss-Newton steps with a line search on a planned system.

use gp_solver::{SolverError, Status, System, Term};
use std::ops::ControlFlow;

/// One taken step.
#[derive(Clone, Debug, PartialEq)]
pub struct StepRecord {
    /// Stage of the method's schedule the step belongs to.
    pub stage: usize,
    /// Energy before and after the step, with the weights of the stage and the feet of the start.
    pub energy: [f64; 2],
    /// Energy of every term before the step.
    pub terms: Vec<Term>,
    /// Share of the full step taken.
    pub length: f64,
}

/// How the normal equations are made regular.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Damping {
    /// A share of their diagonal.
    Diagonal(f64),
    /// A constant, the square of this.
    Constant(f64),
}

/// Steps of one stage.
pub(crate) struct Descent<'a> {
    pub(crate) stage: usize,
    pub(crate) steps: usize,
    /// Ends when a step lowers the energy by less than this share of it.
    pub(crate) energy_tol: f64,
    pub(crate) damping: Damping,
    pub(crate) observer: &'a mut dyn FnMut(&StepRecord) -> ControlFlow<()>,
}

impl Descent<'_> {
    /// Takes up to `steps` steps; refreshes the blocks before each. Returns whether the observer
    /// asked to stop (`Interrupted`), the energy settled (`Converged`), no shorter step lowered it
    /// (`Stalled`) or the steps were used up.
    pub(crate) fn run(
        &mut self,
        system: &mut System<'_>,
        x: &mut [f64],
        history: &mut Vec<StepRecord>,
    ) -> Result<Status, SolverError> {
        let mut full = x.to_vec();
        let mut trial = x.to_vec();
        for _ in 0..self.steps {
            system.refresh(x);
            let before = system.linearize(x)?;
            let terms = system.terms();
            match self.damping {
                Damping::Diagonal(share) => system.damped_step(share)?,
                Damping::Constant(epsilon) => system.projection_step(epsilon)?,
            };
            system.stepped_into(x, &mut full);
            let mut length = 1.0;
            let after = loop {
                for ((t, &a), &b) in trial.iter_mut().zip(x.iter()).zip(&full) {
                    *t = a + length * (b - a);
                }
                let energy = system.energy_at(&trial);
                if energy <= before * (1.0 + 1e-12) {
                    break energy;
                }
                length *= 0.5;
                if length < 1e-4 {
                    return Ok(Status::Stalled);
                }
            };
            x.copy_from_slice(&trial);
            let record = StepRecord { stage: self.stage, energy: [before, after], terms, length };
            tracing::debug!(stage = self.stage, before, after, length, terms = ?record.terms);
            let flow = (self.observer)(&record);
            history.push(record);
            if flow.is_break() {
                return Ok(Status::Interrupted);
            }
            if before - after <= self.energy_tol * before {
                return Ok(Status::Converged);
            }
        }
        Ok(Status::IterationLimit)
    }
}
