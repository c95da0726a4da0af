//! The loop inside a damped step: try, judge, change the damping, try again.
//!
//! Whatever is stepped on, a [`DampedModel`] makes the step for given dampings, one per group of
//! unknowns, and tells what came of it; a [`DampingPolicy`] judges it. The iterations around it
//! (when to linearise, when to end) are those of each method of the family.

use crate::error::SolverError;
use crate::observer::Observer;
use crate::report::Status;

/// A step that was tried.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Verdict {
    /// The step is taken.
    Accept,
    /// The step is taken as the policy has changed it since, with what it then brings: for example
    /// without the groups of unknowns that went astray, so that the others keep their step.
    AcceptChanged(Attempt),
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
pub(crate) struct Accepted {
    /// The step.
    pub(crate) attempt: Attempt,
    /// Attempts it took, this one included: each is one factorisation.
    pub(crate) attempts: usize,
}

/// Tries steps until one is accepted, or a status says why none is. Between two attempts the
/// observer is asked whether to stop.
///
/// # Errors
/// Those of the model.
pub(crate) fn damped_step<M: DampedModel + ?Sized>(
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
            Verdict::AcceptChanged(attempt) => return Ok(Ok(Accepted { attempt, attempts })),
            Verdict::End(status) => return Ok(Err(status)),
            Verdict::Retry => {}
        }
    }
    Ok(Err(Status::Stalled))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `½ Σ aᵢ xᵢ²` with one group per unknown, of which the last has a model with the wrong sign.
    struct Bowls {
        a: [f64; 3],
        x: [f64; 3],
        trial: [f64; 3],
    }

    impl Bowls {
        fn energy(&self, x: &[f64; 3]) -> f64 {
            (0..3).map(|i| 0.5 * self.a[i] * x[i] * x[i]).sum()
        }

        fn attempted(&self) -> Attempt {
            let decrease = self.energy(&self.x) - self.energy(&self.trial);
            Attempt { predicted: f64::NAN, decrease, length: f64::NAN }
        }
    }

    impl DampedModel for Bowls {
        fn attempt(&mut self, damping: &[f64]) -> Result<Attempt, SolverError> {
            for i in 0..3 {
                let step = self.a[i] * self.x[i] / (self.a[i] * (1.0 + damping[i]));
                self.trial[i] = if i == 2 { self.x[i] + step } else { self.x[i] - step };
            }
            Ok(self.attempted())
        }
    }

    /// Holds back every group whose own energy rose.
    struct HoldBack;

    impl DampingPolicy<Bowls> for HoldBack {
        fn judge(&mut self, model: &mut Bowls, _: &Attempt, damping: &mut [f64]) -> Verdict {
            for i in 0..3 {
                if model.trial[i].abs() > model.x[i].abs() {
                    model.trial[i] = model.x[i];
                    damping[i] *= 8.0;
                }
            }
            Verdict::AcceptChanged(model.attempted())
        }

        fn mend(&mut self, _: &mut Bowls, _: &mut [f64]) -> Verdict {
            Verdict::End(Status::Stalled)
        }
    }

    #[test]
    fn a_group_that_goes_astray_does_not_cost_the_others_their_step() {
        let mut model = Bowls { a: [1.0, 2.0, 0.5], x: [1.0, -1.0, 2.0], trial: [0.0; 3] };
        let mut damping = [1.0; 3];
        let accepted = damped_step(&mut model, &mut HoldBack, &mut damping, &mut ()).unwrap();
        let accepted = accepted.unwrap();
        assert_eq!(
            (model.trial, damping, accepted.attempts),
            ([0.5, -0.5, 2.0], [1.0, 1.0, 8.0], 1)
        );
        // ½ (1 + 2)(1 − ¼): what the step brings as it was changed.
        assert!((accepted.attempt.decrease - 1.125).abs() < 1e-15);
    }
}
