//! Damped steps on a model of one's own, one after the other.

use crate::error::SolverError;
use crate::least_squares::Step;
use crate::observer::Observer;
use crate::report::Status;
use crate::trust_region::{Accepted, DampedModel, DampingPolicy, damped_step};

/// An energy that damped steps lower, from where it stands.
pub trait Descending: DampedModel {
    /// The energy where it stands.
    fn energy(&self) -> f64;

    /// Linearises there, or says why there will be no step. It may move a little first, as long as
    /// [`energy`](Self::energy) knows.
    ///
    /// # Errors
    /// Whatever makes it impossible to go on.
    fn linearize(&mut self, observer: &mut dyn Observer)
    -> Result<Result<(), Status>, SolverError>;

    /// Goes where the attempt leads that was accepted, as the policy may have changed it.
    fn take(&mut self);
}

/// When a [`DampedRun`] ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DampedOptions {
    /// [`IterationLimit`](Status::IterationLimit) after as many attempts, refused ones included.
    pub max_attempts: usize,
    /// Converged where the energy is `≤ exact`.
    pub exact: f64,
    /// Converged once a step lowers the energy by less than this share of it.
    pub stall: f64,
}

impl Default for DampedOptions {
    fn default() -> Self {
        Self { max_attempts: usize::MAX, exact: 0.0, stall: 1e-12 }
    }
}

/// Steps of a model that is neither rows nor blocks: a matrix-free system, one whose unknowns are
/// eliminated by hand, a Hessian of one's own. The model makes and judges single attempts, a
/// [`DampingPolicy`] sets the damping of each group of unknowns; when to linearise, to take a step
/// and to end is the same for all of them and stands here.
///
/// ```
/// use gp_solver::{Attempt, DampedModel, DampedOptions, DampedRun, DampingPolicy, Descending};
/// use gp_solver::{Observer, SolverError, Status, Step, Verdict};
/// // E = (x² − 2)², Gauss-Newton on its one residual.
/// struct Root { x: f64, trial: f64 }
/// fn energy(x: f64) -> f64 { (x * x - 2.0).powi(2) }
/// impl DampedModel for Root {
///     fn attempt(&mut self, damping: &[f64]) -> Result<Attempt, SolverError> {
///         let (r, j) = (self.x * self.x - 2.0, 2.0 * self.x);
///         self.trial = self.x - j * r / (j * j * (1.0 + damping[0]));
///         Ok(Attempt { decrease: energy(self.x) - energy(self.trial), ..Attempt::default() })
///     }
/// }
/// impl Descending for Root {
///     fn energy(&self) -> f64 { energy(self.x) }
///     fn linearize(&mut self, _: &mut dyn Observer) -> Result<Result<(), Status>, SolverError> {
///         Ok(Ok(()))
///     }
///     fn take(&mut self) { self.x = self.trial; }
/// }
/// struct Tenfold;
/// impl DampingPolicy<Root> for Tenfold {
///     fn judge(&mut self, _: &mut Root, attempt: &Attempt, damping: &mut [f64]) -> Verdict {
///         damping[0] *= if attempt.decrease > 0.0 { 0.1 } else { 10.0 };
///         if attempt.decrease > 0.0 { Verdict::Accept } else { Verdict::Retry }
///     }
///     fn mend(&mut self, _: &mut Root, _: &mut [f64]) -> Verdict { Verdict::End(Status::Stalled) }
/// }
/// let mut run = DampedRun::new(&[1e-3]);
/// let mut root = Root { x: 5.0, trial: 5.0 };
/// let options = DampedOptions { exact: 1e-24, ..DampedOptions::default() };
/// while run.step(&mut root, &mut Tenfold, &options, &mut ())? == Step::Taken {}
/// assert!((root.x - 2.0_f64.sqrt()).abs() < 1e-12);
/// # Ok::<(), SolverError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DampedRun {
    damping: Vec<f64>,
    attempts: usize,
    history: Vec<f64>,
}

impl DampedRun {
    /// Before the first step, with the damping of every group of unknowns.
    #[must_use]
    pub fn new(damping: &[f64]) -> Self {
        Self { damping: damping.to_vec(), attempts: 0, history: Vec::new() }
    }

    /// After a number of attempts, with the energies at the start and after every step.
    #[must_use]
    pub fn after(damping: Vec<f64>, attempts: usize, history: Vec<f64>) -> Self {
        Self { damping, attempts, history }
    }

    /// The damping of every group that the next step begins with.
    #[must_use]
    pub fn damping(&self) -> &[f64] {
        &self.damping
    }

    /// Attempts made, refused ones included.
    #[must_use]
    pub fn attempts(&self) -> usize {
        self.attempts
    }

    /// The energy at the start, once it has been linearised there, and after every step.
    #[must_use]
    pub fn history(&self) -> &[f64] {
        &self.history
    }

    /// Takes one step that lowers the energy, or says why there is none; an ending may come with
    /// the last step. An interrupted step changes nothing but what linearising moved.
    ///
    /// # Errors
    /// Those of the model.
    pub fn step<M: Descending + ?Sized>(
        &mut self,
        model: &mut M,
        policy: &mut (impl DampingPolicy<M> + ?Sized),
        options: &DampedOptions,
        observer: &mut dyn Observer,
    ) -> Result<Step, SolverError> {
        if model.energy() <= options.exact {
            return Ok(Step::Ended(Status::Converged));
        }
        if self.attempts >= options.max_attempts {
            return Ok(Step::Ended(Status::IterationLimit));
        }
        if let Err(status) = model.linearize(observer)? {
            return Ok(Step::Ended(status));
        }
        let before = model.energy();
        if self.history.is_empty() {
            self.history.push(before);
        }
        let mut damping = self.damping.clone();
        let attempts = match damped_step(model, policy, &mut damping, observer)? {
            Ok(Accepted { attempts, .. }) => attempts,
            Err(status) => return Ok(Step::Ended(status)),
        };
        model.take();
        self.damping = damping;
        self.attempts += attempts;
        let after = model.energy();
        self.history.push(after);
        if before - after < options.stall * before.abs() {
            return Ok(Step::Ended(Status::Converged));
        }
        Ok(Step::Taken)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trust_region::{Attempt, Verdict};

    /// `½ x²`, whose steps go a quarter of the way.
    struct Bowl {
        x: f64,
        is_stuck: bool,
    }

    impl DampedModel for Bowl {
        fn attempt(&mut self, _: &[f64]) -> Result<Attempt, SolverError> {
            let decrease = if self.is_stuck { -1.0 } else { 1.0 };
            Ok(Attempt { decrease, ..Attempt::default() })
        }
    }

    impl Descending for Bowl {
        fn energy(&self) -> f64 {
            0.5 * self.x * self.x
        }

        fn linearize(&mut self, _: &mut dyn Observer) -> Result<Result<(), Status>, SolverError> {
            Ok(Ok(()))
        }

        fn take(&mut self) {
            self.x *= 0.75;
        }
    }

    struct Any;

    impl DampingPolicy<Bowl> for Any {
        fn judge(&mut self, _: &mut Bowl, attempt: &Attempt, damping: &mut [f64]) -> Verdict {
            damping[0] *= 2.0;
            if attempt.decrease > 0.0 { Verdict::Accept } else { Verdict::End(Status::Stalled) }
        }

        fn mend(&mut self, _: &mut Bowl, _: &mut [f64]) -> Verdict {
            Verdict::End(Status::Stalled)
        }
    }

    /// Steps until it ends.
    fn ended(model: &mut Bowl, options: &DampedOptions) -> (DampedRun, Status) {
        let mut run = DampedRun::new(&[1.0]);
        loop {
            if let Step::Ended(status) = run.step(model, &mut Any, options, &mut ()).unwrap() {
                return (run, status);
            }
        }
    }

    #[test]
    fn every_stop_rule_ends_it_where_it_says() {
        let open = DampedOptions { max_attempts: 100, exact: 0.0, stall: 0.0 };
        let mut bowl = Bowl { x: 1.0, is_stuck: false };
        let (run, status) = ended(&mut bowl, &DampedOptions { max_attempts: 3, ..open });
        assert_eq!(
            (status, run.attempts(), run.damping()),
            (Status::IterationLimit, 3, &[8.0][..])
        );
        assert_eq!(run.history(), [0.5, 0.5 * 0.5625, 0.5 * 0.5625_f64.powi(2), bowl.energy()]);
        let (run, status) = ended(&mut bowl, &DampedOptions { exact: 0.01, ..open });
        assert_eq!(status, Status::Converged);
        assert!(bowl.energy() <= 0.01 && run.history()[run.history().len() - 2] > 0.01);
        // A step gains 1 − 0.75² = 0.4375 of the energy.
        let (run, status) = ended(&mut bowl, &DampedOptions { stall: 0.44, ..open });
        assert_eq!((status, run.attempts()), (Status::Converged, 1));
    }

    #[test]
    fn a_step_that_is_not_taken_changes_nothing() {
        let mut bowl = Bowl { x: 1.0, is_stuck: true };
        let (run, status) = ended(&mut bowl, &DampedOptions::default());
        assert_eq!((status, bowl.x, run.damping()), (Status::Stalled, 1.0, &[1.0][..]));
    }
}
