//! Who watches a run: sees every step, can stop it, keeps its checkpoints.

use std::ops::ControlFlow;

use crate::checkpoint::Checkpoint;
use crate::least_squares::System;
use crate::schedule::Stage;

/// A run after a step, and once at the start of every stage.
///
/// # Example
/// ```
/// use gp_solver::{Closeness, Options, Problem, Progress, Status, solve_observed};
/// use std::ops::ControlFlow;
/// let mut problem = Problem::new(1);
/// problem.add(Closeness::new("target", vec![4.0], vec![1.0]));
/// let mut seen = Vec::new();
/// let mut first_step_only = |progress: &Progress<'_>| {
///     seen.push((progress.iteration, progress.energy));
///     if progress.iteration < 1 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
/// };
/// let mut x = [0.0];
/// let report = solve_observed(problem, &mut x, &Options::default(), &mut first_step_only)?;
/// assert_eq!(report.status, Status::Interrupted);
/// assert_eq!((seen[0], seen.len()), ((0, 8.0), 2)); // the start, with E = 4² / 2, and one step
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
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
///
/// # Example
/// ```
/// use gp_solver::{Checkpoint, Closeness, Observer, Options, Problem, solve_observed};
///
/// /// Keeps the newest state, to go on from after a breakdown.
/// #[derive(Default)]
/// struct Keeper(Option<Checkpoint>);
///
/// impl Observer for Keeper {
///     fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
///         self.0 = Some(state());
///     }
///     fn resume(&mut self) -> Option<Checkpoint> {
///         self.0.clone()
///     }
/// }
///
/// let mut problem = Problem::new(1);
/// problem.add(Closeness::new("target", vec![4.0], vec![1.0]));
/// let (mut x, mut keeper) = ([0.0], Keeper::default());
/// solve_observed(problem, &mut x, &Options::default(), &mut keeper)?;
/// let state = keeper.0.expect("one after every step");
/// assert_eq!(state.numbers("x", 1)?, x);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
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
