//! Gauss-Newton steps damped by the Sobolev norm.

use std::cell::RefCell;

use super::conditioned::Conditioned;
use gp_solver::{
    Attempt, DampedModel, DampingPolicy, Descending, Metric, Observer, SolverError, Status, Verdict,
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

/// The observer of a run, asked by the solver's loop and by the model.
#[derive(Clone, Copy)]
pub(super) struct Shared<'s, 'o>(pub(super) &'s RefCell<&'o mut dyn Observer>);

impl Observer for Shared<'_, '_> {
    fn stop_requested(&mut self) -> bool {
        self.0.borrow_mut().stop_requested()
    }
}

/// A level at `y`, for one Gauss-Newton step.
pub(super) struct NewtonModel<'n, 'a, 's, 'o> {
    of: &'n mut Conditioned<'a>,
    observer: Shared<'s, 'o>,
    y: &'n mut [f64],
    energy: f64,
    /// The energy where the step begins.
    pub(super) before: f64,
    gradient: Vec<f64>,
    rows: Vec<Vec<f64>>,
    trial: Vec<f64>,
    trial_gradient: Vec<f64>,
    value: f64,
    /// Counts of the step.
    pub(super) factorizations: usize,
    pub(super) evaluations: usize,
    /// `√(gᵀM⁻¹g)` of the last attempt.
    pub(super) gradient_norm: f64,
    /// A matrix that nothing mends.
    pub(super) fault: Option<SolverError>,
}

impl<'n, 'a, 's, 'o> NewtonModel<'n, 'a, 's, 'o> {
    pub(super) fn new(
        of: &'n mut Conditioned<'a>,
        y: &'n mut [f64],
        observer: Shared<'s, 'o>,
    ) -> Self {
        let [gradient, trial, trial_gradient] = std::array::from_fn(|_| vec![0.0; y.len()]);
        Self {
            gradient,
            trial,
            trial_gradient,
            of,
            observer,
            y,
            energy: f64::NAN,
            before: f64::NAN,
            rows: Vec::new(),
            value: f64::NAN,
            factorizations: 0,
            evaluations: 0,
            gradient_norm: f64::NAN,
            fault: None,
        }
    }
}

impl Descending for NewtonModel<'_, '_, '_, '_> {
    fn energy(&self) -> f64 {
        self.energy
    }

    fn linearize(&mut self, _: &mut dyn Observer) -> Result<Result<(), Status>, SolverError> {
        self.of.energy.renormalise(self.y);
        self.of.energy.set_barrier(self.y);
        self.of.energy.refresh(self.y);
        self.energy = self.of.energy.value(self.y, &mut self.gradient);
        self.before = self.energy;
        self.rows = self.of.condition_rows(self.y);
        (self.factorizations, self.evaluations) = (0, 1);
        self.gradient_norm = f64::NAN;
        Ok(Ok(()))
    }

    fn take(&mut self) {
        self.y.copy_from_slice(&self.trial);
        self.energy = self.value;
    }
}

impl DampedModel for NewtonModel<'_, '_, '_, '_> {
    fn attempt(&mut self, damping: &[f64]) -> Result<Attempt, SolverError> {
        self.of.keep(Vec::new(), false);
        match self.of.factor(self.y, true, damping[0], &mut self.observer) {
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
        for ((y, &y0), s) in self.trial.iter_mut().zip(&*self.y).zip(&step) {
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
#[derive(Default)]
pub(super) struct GainRatio {
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
