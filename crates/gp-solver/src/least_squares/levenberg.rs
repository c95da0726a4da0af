//! Levenberg-Marquardt's judgement of steps.

use super::system::{StepModel, System};
use crate::damping::DampingRule;
use crate::error::SolverError;
use crate::options::Options;
use crate::report::Status;
use crate::trust_region::{Attempt, DampedModel, DampingPolicy, Verdict};

/// Largest cosine between the residual and a column of the Jacobian at which a step that is short
/// only because it is damped may count as convergence.
pub(super) const ALIGNED: f64 = 1e-2;
/// Damping beyond which no step is worth trying.
const MAX_DAMPING: f64 = 1e16;
/// Damping that mends a singular matrix at the least.
const MENDING_DAMPING: f64 = 1e-16;
/// Least share of the predicted decrease a step must bring.
const MIN_GAIN: f64 = 1e-4;
/// A step this short relative to the iterate, and hardly damped, says that the minimum is near.
const NEAR: f64 = 1e-7;
/// The first step may be this much longer than the start itself, in the scaled norm: longer ones
/// tend to land on plateaus from which nothing leads back.
const FIRST_STEP: f64 = 10.0;
/// Factorisations spent on finding the damping for a first step of that length.
const FIRST_STEP_TRIALS: usize = 15;

/// A linearised system and where it stands, with one damping for all unknowns.
pub(super) struct SystemModel<'m, 'a> {
    system: &'m mut System<'a>,
    x: &'m [f64],
    trial: &'m mut [f64],
    step: StepModel,
    /// A step longer than this, in the scaled norm, is not evaluated.
    longest: f64,
}

impl<'m, 'a> SystemModel<'m, 'a> {
    pub(super) fn new(system: &'m mut System<'a>, x: &'m [f64], trial: &'m mut [f64]) -> Self {
        let step = StepModel { predicted_decrease: 0.0, scaled_norm: 0.0 };
        Self { system, x, trial, step, longest: f64::INFINITY }
    }

    /// The last step.
    pub(super) fn step(&self) -> StepModel {
        self.step
    }
}

impl DampedModel for SystemModel<'_, '_> {
    fn attempt(&mut self, damping: &[f64]) -> Result<Attempt, SolverError> {
        self.step = self.system.damped_step(damping[0])?;
        let StepModel { predicted_decrease: predicted, scaled_norm: length } = self.step;
        if length > self.longest {
            return Ok(Attempt { predicted, decrease: f64::NAN, length });
        }
        self.system.stepped_into(self.x, self.trial);
        let decrease = self.system.energy() - self.system.energy_at(self.trial);
        Ok(Attempt { predicted, decrease, length })
    }
}

/// Levenberg-Marquardt's policy for one step.
pub(super) struct Levenberg {
    rule: DampingRule,
    energy: f64,
    energy_tol: f64,
    /// Limit of the length of a first step; infinite for others.
    longest: f64,
    attempts: usize,
    /// Whether an attempt has shown that the minimum is near.
    is_near: bool,
    used: f64,
    size: f64,
}

impl Levenberg {
    /// For the step from `x`, where the scaled gradient norm is `gradient_norm`.
    pub(super) fn new(options: &Options, is_first: bool, gradient_norm: f64) -> Self {
        Self {
            rule: options.damping_rule,
            energy: f64::NAN,
            energy_tol: options.energy_tol,
            longest: if is_first && options.damping_rule == DampingRule::StepLength {
                FIRST_STEP
            } else {
                f64::INFINITY
            },
            attempts: 0,
            is_near: gradient_norm <= ALIGNED,
            used: f64::NAN,
            size: f64::NAN,
        }
    }

    /// Tells the model how long a step is worth evaluating.
    pub(super) fn begin(mut self, model: &mut SystemModel<'_, '_>) -> Self {
        self.energy = model.system.energy();
        self.size = model.system.scaled_norm(model.x);
        self.longest *= self.size;
        if !(self.longest > 0.0) {
            self.longest = f64::INFINITY;
        }
        model.longest = 1.1 * self.longest;
        self
    }

    /// The damping the last attempt was made with.
    pub(super) fn used(&self) -> f64 {
        self.used
    }

    /// Counts an attempt; the last one of a first step is evaluated however long it is.
    fn count(&mut self, model: &mut SystemModel<'_, '_>) {
        self.attempts += 1;
        if self.attempts + 1 >= FIRST_STEP_TRIALS {
            model.longest = f64::INFINITY;
        }
    }

    fn stalled(damping: &mut f64) -> Verdict {
        *damping = MAX_DAMPING;
        Verdict::End(Status::Stalled)
    }
}

impl DampingPolicy<SystemModel<'_, '_>> for Levenberg {
    fn judge(
        &mut self,
        model: &mut SystemModel<'_, '_>,
        attempt: &Attempt,
        damping: &mut [f64],
    ) -> Verdict {
        let damping = &mut damping[0];
        self.used = *damping;
        let is_too_long = attempt.length > model.longest;
        self.count(model);
        if is_too_long {
            let wanted = model.system.damping_for_radius(*damping, self.longest);
            *damping = wanted.max(1.1 * *damping);
            return Verdict::Retry;
        }
        let (step, decrease) = (model.step, attempt.decrease);
        let gain = decrease / attempt.predicted;
        if decrease >= 0.0 && gain >= MIN_GAIN {
            *damping = self.rule.after_success(model.system, *damping, step, gain);
            *damping = damping.max(self.rule.least_damping());
            return Verdict::Accept;
        }
        // So short a step cannot change the iterate: this is as low as it gets.
        let short = attempt.length <= f64::EPSILON * self.size;
        self.is_near |= !step.is_held_back(self.used) && attempt.length <= NEAR * self.size;
        let small = self.energy_tol * self.energy;
        let flat = attempt.predicted <= small && decrease.abs() <= small;
        if (short || flat) && self.is_near {
            return Verdict::End(Status::Converged);
        }
        if short {
            return Verdict::End(Status::Stalled);
        }
        *damping = self.rule.after_refusal(model.system, *damping, step, decrease);
        tracing::trace!(damping = *damping, decrease, "step refused");
        if *damping > MAX_DAMPING { Self::stalled(damping) } else { Verdict::Retry }
    }

    /// Damping mends an indefinite or singular matrix, like any bad step.
    fn mend(&mut self, model: &mut SystemModel<'_, '_>, damping: &mut [f64]) -> Verdict {
        self.count(model);
        let damping = &mut damping[0];
        *damping = (10.0 * *damping).max(MENDING_DAMPING);
        if *damping > MAX_DAMPING { Self::stalled(damping) } else { Verdict::Retry }
    }
}
