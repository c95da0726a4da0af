//! What a solve says about itself.

use std::fmt;
use std::time::Duration;

/// How a solve or a run ended. The iterate of a solve is usable in every case; a method may look at
/// its result and find it [`Failed`](Self::Failed).
///
/// # Example
/// ```
/// use gp_solver::Status;
/// assert_eq!(Status::IterationLimit.to_string(), "iteration_limit");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Status {
    /// A stop rule of [`Options`](crate::Options) was met.
    Converged,
    /// No further decrease was possible although no stop rule was met.
    Stalled,
    /// The allowed number of iterations was used up.
    IterationLimit,
    /// The observer asked to stop.
    Interrupted,
    /// The constraints contradict one another.
    Infeasible,
    /// Most of the result is right, and what is not is named.
    Partial,
    /// The result is no use: it folds, has spikes or is not finite somewhere between the samples it
    /// was made from.
    Failed,
}

impl Status {
    /// The name used in metrics: lower snake case.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Converged => "converged",
            Self::Stalled => "stalled",
            Self::IterationLimit => "iteration_limit",
            Self::Interrupted => "interrupted",
            Self::Infeasible => "infeasible",
            Self::Partial => "partial",
            Self::Failed => "failed",
        }
    }
}

/// Share of a result that must be right for it to be [`Partial`](Status::Partial) rather than
/// [`Failed`](Status::Failed).
const PARTIAL: f64 = 0.95;

impl Status {
    /// The status of a result of which this share is found to be wrong (folded, crossing itself, not
    /// finite) when it is looked at more closely: as it was if nothing is wrong or the run was
    /// interrupted, `Partial` if at least 95 % are right, else `Failed`.
    ///
    /// ```
    /// use gp_solver::Status;
    /// assert_eq!(Status::Converged.checked(0, 100), Status::Converged);
    /// assert_eq!(Status::Converged.checked(5, 100), Status::Partial);
    /// assert_eq!(Status::Stalled.checked(6, 100), Status::Failed);
    /// ```
    #[must_use]
    pub fn checked(self, wrong: usize, of: usize) -> Self {
        if wrong == 0 || self == Self::Interrupted {
            self
        } else if (of.saturating_sub(wrong)) as f64 >= PARTIAL * of as f64 {
            Self::Partial
        } else {
            Self::Failed
        }
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.as_str())
    }
}

/// The energy of one term.
#[derive(Clone, Debug, PartialEq)]
pub struct Term {
    /// Name of the block.
    pub name: String,
    /// Its energy, weights included.
    pub energy: f64,
}

/// One iteration as the history keeps it; entry 0 is the start.
#[derive(Clone, Debug, PartialEq)]
pub struct IterationRecord {
    /// Energy of the iterate.
    pub energy: f64,
    /// Energy of each term, in the order of the blocks.
    pub terms: Vec<f64>,
    /// By how much the step that led here lowered the energy. Where blocks have lagged quantities
    /// this is measured before they follow, so that it need not be the difference of `energy`.
    pub decrease: f64,
    /// Damping of the step that led here; 0 for the start.
    pub damping: f64,
    /// Euclidean length of the step that led here.
    pub step_norm: f64,
    /// Scaled gradient norm (see [`Options::gradient_tol`](crate::Options::gradient_tol)) where
    /// the step began.
    pub gradient_norm: f64,
    /// Factorisations this step took: one and the number of refused trials.
    pub factorizations: usize,
}

/// Wall-clock time per phase.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Timings {
    /// Planning: patterns, orderings, symbolic factorisation.
    pub plan: Duration,
    /// Residuals of trial steps.
    pub residuals: Duration,
    /// Refreshes, residuals and Jacobians of iterates.
    pub linearize: Duration,
    /// Normal matrix and gradient.
    pub normal: Duration,
    /// Numeric factorisation.
    pub factor: Duration,
    /// Triangular solves.
    pub solve: Duration,
    /// The whole solve, planning excluded.
    pub total: Duration,
}

/// What a solve did.
///
/// # Example
/// ```
/// use gp_solver::{Closeness, Options, Problem, solve};
/// let mut problem = Problem::new(1);
/// problem.add(Closeness::new("here", vec![0.0], vec![1.0]));
/// problem.add(Closeness::new("there", vec![4.0], vec![1.0]));
/// let report = solve(problem, &mut [0.0], &Options::default())?;
/// // The mean, 2, is as far from one as from the other.
/// assert_eq!((report.initial_energy, report.terms[1].name.as_str()), (8.0, "there"));
/// assert!((report.terms[1].energy - 2.0).abs() < 1e-6);
/// assert_eq!(report.history.len(), report.iterations + 1);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// How it ended.
    pub status: Status,
    /// Steps taken.
    pub iterations: usize,
    /// Energy of the start.
    pub initial_energy: f64,
    /// Energy of the result.
    pub final_energy: f64,
    /// Energy of every term at the end.
    pub terms: Vec<Term>,
    /// The start and every taken step.
    pub history: Vec<IterationRecord>,
    /// Matrix factorisations, refused trials included.
    pub factorizations: usize,
    /// Evaluations of value and gradient, for methods without factorisations.
    pub evaluations: usize,
    /// Scaled gradient norm at the last linearisation; `max |C|` of the result for projections onto
    /// constraints.
    pub gradient_norm: f64,
    /// Damping after the last step, to go on from.
    pub damping: f64,
    /// Unknowns that are not fixed.
    pub variables: usize,
    /// Rows of all residual blocks.
    pub rows: usize,
    /// Time per phase.
    pub timings: Timings,
}

impl Report {
    /// Of nothing done yet with so many unknowns, to add to.
    #[must_use]
    pub fn new(status: Status, variables: usize) -> Self {
        Self {
            status,
            iterations: 0,
            initial_energy: f64::NAN,
            final_energy: f64::NAN,
            terms: Vec::new(),
            history: Vec::new(),
            factorizations: 0,
            evaluations: 0,
            gradient_norm: f64::NAN,
            damping: 0.0,
            variables,
            rows: 0,
            timings: Timings::default(),
        }
    }

    /// Wall-clock milliseconds per taken step (the whole solve if none was taken).
    #[must_use]
    pub fn ms_per_iteration(&self) -> f64 {
        1e3 * self.timings.total.as_secs_f64() / self.iterations.max(1) as f64
    }
}
