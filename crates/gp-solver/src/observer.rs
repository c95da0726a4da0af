//! Who watches a run: sees every step, can stop it, keeps its checkpoints.

use std::ops::ControlFlow;

use crate::checkpoint::Checkpoint;
use crate::least_squares::System;
use crate::schedule::Stage;

/// A run after a step, and once at the start of every stage.
#[derive(Clone, Copy)]
pub struct Progress<'s> {
    /// The stage.
    pub stage: &'s Stage,
    /// Steps taken in this stage.
    pub iteration: usize,
    /// Steps this stage may take.
    pub max_iterations: usize,
    /// Energy of the iterate.
    pub energy: f64,
    /// Norm of the gradient there, in the scale of the method.
    pub gradient_norm: f64,
    /// The iterate, as the stage's variables say; empty for methods whose unknowns are no vector.
    pub x: &'s [f64],
    /// The linearised system the next step starts from, where there is one.
    pub system: Option<&'s System<'s>>,
}

impl Progress<'_> {
    /// The share of all steps that are done if every stage takes as many as this one may, in 0..=1.
    #[must_use]
    pub fn share(&self) -> f64 {
        let within = self.iteration as f64 / self.max_iterations.max(1) as f64;
        ((self.stage.number as f64 + within.min(1.0)) / self.stage.count.max(1) as f64).min(1.0)
    }
}

/// Watches a run. A closure `FnMut(&Progress) -> ControlFlow<()>` is an observer, `()` one that
/// lets everything pass.
pub trait Observer {
    /// Sees the start of every stage and every step; [`ControlFlow::Break`] stops the run, which
    /// keeps the iterate shown.
    fn step(&mut self, _progress: &Progress<'_>) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Asked between factorisations and inside long loops whether to stop at once.
    fn stop_requested(&mut self) -> bool {
        false
    }

    /// Offered the state after every step and at the end of every stage; `state` makes the
    /// checkpoint, so that one that is not kept costs nothing.
    fn checkpoint(&mut self, _state: &dyn Fn() -> Checkpoint) {}

    /// Where to go on from, asked once at the beginning.
    fn resume(&mut self) -> Option<Checkpoint> {
        None
    }
}

impl Observer for () {}

impl<F: FnMut(&Progress<'_>) -> ControlFlow<()>> Observer for F {
    fn step(&mut self, progress: &Progress<'_>) -> ControlFlow<()> {
        self(progress)
    }
}
