//! Gauss-Newton steps damped by the Sobolev norm.

use std::cell::RefCell;

use super::conditioned::Conditioned;
use gp_solver::{
    Attempt, DampedModel, DampingPolicy, Metric, Observer, SolverError, Status, Verdict,
    damped_step,
};
use numerics::dot;

/// Attempts of one step.
const ATTEMPTS: usize = 20;
/// Least share of the foreseen gain that a step must bring.
const LEAST_GAIN: f64 = 0.05;
/// Shares below and above which the model is poor and good, and what becomes of the damping then.
const POOR_GAIN: (f64, f64) = (0.25, 3.0);
const GOOD_GAIN: (f64, f64) = (0.75, 0.25);
/// What a refused step multiplies the damping by.
const REFUSED: f64 = 4.0;
/// Least damping.
const LEAST: f64 = 1e-9;

/// The observer of a step, asked by the loop and by the model.
#[derive(Clone, Copy)]
struct Shared<'s, 'o>(&'s RefCell<&'o mut dyn Observer>);

impl Observer for Shared<'_, '_> {
    fn stop_requested(&mut self) -> bool {
        self.0.borrow_mut().stop_requested()
    }
}

/// One Gauss-Newton step from `from`.
struct NewtonStep<'n, 'a, 's, 'o> {
    of: &'n mut Conditioned<'a>,
    observer: Shared<'s, 'o>,
    from: &'n [f64],
    energy: f64,
    gradient: Vec<f64>,
    rows: Vec<Vec<f64>>,
    trial: Vec<f64>,
    trial_gradient: Vec<f64>,
    value: f64,
    factorizations: usize,
    evaluations: usize,
    gradient_norm: f64,
    /// A matrix that nothing mends.
    fault: Option<SolverError>,
}

/// What became of a step.
pub(super) struct Outcome {
    /// Energy where it began, and where it leads if it is taken.
    pub(super) before: f64,
    pub(super) after: Result<f64, Status>,
    pub(super) gradient_norm: f64,
    pub(super) factorizations: usize,
    pub(super) evaluations: usize,
}

/// Makes a damped step from `y`, which then holds its end, and adjusts the damping.
pub(super) fn newton_step(
    of: &mut Conditioned<'_>,
    y: &mut [f64],
    damping: &mut f64,
    observer: &mut dyn Observer,
) -> Result<Outcome, SolverError> {
    of.energy.renormalise(y);
    of.energy.set_barrier(y);
    of.energy.refresh(y);
    let mut gradient = vec![0.0; y.len()];
    let energy = of.energy.value(y, &mut gradient);
    let rows = of.condition_rows(y);
    let from = y.to_vec();
    let shared = RefCell::new(observer);
    let mut step = NewtonStep {
        of,
        observer: Shared(&shared),
        from: &from,
        energy,
        gradient,
        rows,
        trial: from.clone(),
        trial_gradient: vec![0.0; y.len()],
        value: energy,
        factorizations: 0,
        evaluations: 1,
        gradient_norm: f64::NAN,
        fault: None,
    };
    let mut policy = GainRatio { tries: 0 };
    let mut dampings = [*damping];
    let taken = damped_step(&mut step, &mut policy, &mut dampings, &mut Shared(&shared))?;
    [*damping] = dampings;
    if let Some(fault) = step.fault {
        return Err(fault);
    }
    if taken.is_ok() {
        y.copy_from_slice(&step.trial);
    }
    Ok(Outcome {
        before: energy,
        after: taken.map(|_| step.value),
        gradient_norm: step.gradient_norm,
        factorizations: step.factorizations,
        evaluations: step.evaluations,
    })
}

impl DampedModel for NewtonStep<'_, '_, '_, '_> {
    fn attempt(&mut self, damping: &[f64]) -> Result<Attempt, SolverError> {
        self.of.keep(Vec::new(), false);
        match self.of.factor(self.from, true, damping[0], &mut self.observer) {
            Ok(Ok(made)) => self.factorizations += made,
            // The loop asks again before the next attempt and ends.
            Ok(Err(_)) => return Ok(Attempt { decrease: f64::NAN, ..Attempt::default() }),
            Err(fault @ SolverError::NotPositiveDefinite { .. }) => {
                self.fault = Some(fault.clone());
                return Err(fault);
            }
            Err(fault) => return Err(fault),
        }
        let mut step = self.gradient.clone();
        self.of.keep(self.rows.clone(), true);
        self.of.steering.apply_inverse(&mut step);
        // With a positive definite model of Hessian M the model's gain is gᵀM⁻¹g/2.
        let gain = 0.5 * dot(&self.gradient, &step);
        self.gradient_norm = (2.0 * gain).max(0.0).sqrt();
        for ((y, &y0), s) in self.trial.iter_mut().zip(self.from).zip(&step) {
            *y = y0 - s;
        }
        self.value = self.of.energy.value(&self.trial, &mut self.trial_gradient);
        self.evaluations += 1;
        Ok(Attempt {
            predicted: gain,
            decrease: self.energy - self.value,
            length: self.gradient_norm,
        })
    }
}

/// Damping by the ratio of the gain to the one foreseen.
struct GainRatio {
    tries: usize,
}

impl<M> DampingPolicy<M> for GainRatio {
    fn judge(&mut self, _: &mut M, attempt: &Attempt, damping: &mut [f64]) -> Verdict {
        let damping = &mut damping[0];
        let ratio = attempt.decrease / attempt.predicted;
        if attempt.decrease.is_finite() && attempt.decrease > 0.0 && ratio > LEAST_GAIN {
            let change = if ratio > GOOD_GAIN.0 {
                GOOD_GAIN.1
            } else if ratio > POOR_GAIN.0 {
                1.0
            } else {
                POOR_GAIN.1
            };
            *damping = (*damping * change).max(LEAST);
            return Verdict::Accept;
        }
        *damping *= REFUSED;
        self.tries += 1;
        if self.tries == ATTEMPTS { Verdict::End(Status::Stalled) } else { Verdict::Retry }
    }

    /// The matrix has been given all the damping there is.
    fn mend(&mut self, _: &mut M, _: &mut [f64]) -> Verdict {
        Verdict::End(Status::Stalled)
    }
}
