//! The loop inside a damped step: try, judge, change the damping, try again.
//!
//! Whatever is stepped on, a [`DampedModel`] makes the step for given dampings, one per group of
//! unknowns, and tells what came of it; a [`DampingPolicy`] judges it. The iterations around it
//! (when to linearise, when to end) are those of each method of the family.

use crate::error::SolverError;
use crate::observer::Observer;
use crate::report::Status;

/// A step that was tried.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Attempt {
    /// Decrease of the energy the model foresees.
    pub predicted: f64,
    /// Decrease that the trial point brings; NaN or −∞ where it cannot be judged.
    pub decrease: f64,
    /// Length of the step in the model's own norm.
    pub length: f64,
}

/// Something that offers damped steps from where it is.
pub trait DampedModel {
    /// Makes the step for `damping`, one value per group of unknowns, and evaluates the energy where
    /// it leads, without going there.
    ///
    /// # Errors
    /// [`SolverError::NotPositiveDefinite`] calls for more damping; anything else ends the run.
    fn attempt(&mut self, damping: &[f64]) -> Result<Attempt, SolverError>;
}

/// What becomes of an attempt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The step is taken.
    Accept,
    /// Another one is tried with the damping as it is now.
    Retry,
    /// No step will do.
    End(Status),
}

/// How damping follows success and failure.
pub trait DampingPolicy<M: ?Sized> {
    /// Judges an attempt made with `damping` and sets the damping of the next one.
    fn judge(&mut self, model: &mut M, attempt: &Attempt, damping: &mut [f64]) -> Verdict;

    /// Raises the damping where the matrix was not positive definite.
    fn mend(&mut self, model: &mut M, damping: &mut [f64]) -> Verdict;
}

/// A step that was accepted.
#[derive(Clone, Debug, PartialEq)]
pub struct Accepted {
    /// The step.
    pub attempt: Attempt,
    /// Attempts it took, this one included: each is one factorisation.
    pub attempts: usize,
}

/// Tries steps until one is accepted, or a status says why none is. Between two attempts the
/// observer is asked whether to stop.
///
/// # Errors
/// Those of the model.
pub fn damped_step<M: DampedModel + ?Sized>(
    model: &mut M,
    policy: &mut (impl DampingPolicy<M> + ?Sized),
    damping: &mut [f64],
    observer: &mut dyn Observer,
) -> Result<Result<Accepted, Status>, SolverError> {
    for attempts in 1.. {
        if observer.stop_requested() {
            return Ok(Err(Status::Interrupted));
        }
        let (attempt, verdict) = match model.attempt(damping) {
            Ok(attempt) => {
                let verdict = policy.judge(model, &attempt, damping);
                (attempt, verdict)
            }
            Err(SolverError::NotPositiveDefinite { .. }) => {
                (Attempt::default(), policy.mend(model, damping))
            }
            Err(other) => return Err(other),
        };
        match verdict {
            Verdict::Accept => return Ok(Ok(Accepted { attempt, attempts })),
            Verdict::End(status) => return Ok(Err(status)),
            Verdict::Retry => {}
        }
    }
    Ok(Err(Status::Stalled))
}
