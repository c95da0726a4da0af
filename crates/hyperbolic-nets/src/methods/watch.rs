//! What an observer is shown and offered while a method runs.

use std::ops::ControlFlow;

use gp_solver::{Checkpoint, Observer, Progress, SolverError, Stage};

/// The name of the methods in checkpoints.
const METHOD: &str = "hnet";

/// The observer of a run, whose checkpoints get what the method keeps besides the solver's state.
pub(crate) struct Watch<'o> {
    observer: &'o mut dyn Observer,
    fingerprint: u64,
    /// Steps of the stages that are done.
    steps: usize,
    numbers: Vec<(&'static str, Vec<f64>)>,
}

impl<'o> Watch<'o> {
    pub(crate) fn new(observer: &'o mut dyn Observer, fingerprint: u64) -> Self {
        Self { observer, fingerprint, steps: 0, numbers: Vec::new() }
    }

    /// The checkpoint to go on from, checked to belong to this run, and steps before its stage.
    pub(crate) fn begin(&mut self) -> Result<Option<Checkpoint>, SolverError> {
        let Some(checkpoint) = self.observer.resume() else { return Ok(None) };
        checkpoint.check(METHOD, self.fingerprint)?;
        self.steps = checkpoint.counts("steps")?.first().map_or(0, |steps| *steps as usize);
        Ok(Some(checkpoint))
    }

    /// Steps of the stages that are done.
    pub(crate) fn steps(&self) -> usize {
        self.steps
    }

    /// A stage is done.
    pub(crate) fn add_steps(&mut self, steps: usize) {
        self.steps += steps;
    }

    /// Numbers that later checkpoints have besides those of the solver.
    pub(crate) fn keep(&mut self, name: &'static str, values: &[f64]) {
        self.numbers.retain(|(other, _)| *other != name);
        self.numbers.push((name, values.to_vec()));
    }

    /// Offers the state before a stage that has no checkpoints within.
    pub(crate) fn offer(&mut self, stage: &Stage, x: &[f64]) {
        let (fingerprint, number) = (self.fingerprint, stage.number);
        self.checkpoint(&|| Checkpoint::new(METHOD, fingerprint, number, 0).with_numbers("x", x));
    }
}

impl Observer for Watch<'_> {
    fn step(&mut self, progress: &Progress<'_>) -> ControlFlow<()> {
        self.observer.step(progress)
    }

    fn stop_requested(&mut self) -> bool {
        self.observer.stop_requested()
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        let (fingerprint, steps, numbers) = (self.fingerprint, self.steps, &self.numbers);
        self.observer.checkpoint(&|| {
            let mut state = state().with_counts("steps", &[steps as u64]);
            for (name, values) in numbers {
                state = state.with_numbers(name, values);
            }
            Checkpoint { method: METHOD.to_owned(), fingerprint, ..state }
        });
    }
}
