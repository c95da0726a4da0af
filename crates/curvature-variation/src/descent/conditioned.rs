//! A level's energy with its metric and its linear conditions.

use super::energy::LevelEnergy;
use super::projected::Projected;
use crate::element::Mixture;
use crate::functional::ROOT_EPSILON;
use crate::limits::LinearRow;
use crate::metric::MetricAssembly;
use gp_solver::{Metric, Observer, SolverError, Status};
use numerics::dot;

/// How often a matrix that is not positive definite is given more of the Sobolev norm.
const MENDINGS: usize = 12;

/// Weights of the Sobolev norm where nothing is to be steered, only judged: hardly any first, then so
/// much that the energy follows its model over the length of the step.
const CERTIFYING: [f64; 4] = [1e-6, 1e-4, 1e-2, 1.0];
/// Parts of the step that are tried.
const SHARES: [f64; 4] = [1.0, 0.3, 0.1, 0.03];

/// What is left to gain, and where.
pub(crate) struct Left {
    /// The energy now.
    pub(crate) before: f64,
    pub(crate) gain: f64,
    /// How many it took to tell.
    pub(crate) factorizations: usize,
    /// The unknowns that bring it.
    pub(crate) y: Vec<f64>,
}

/// What a step stands on.
pub(crate) struct Conditioned<'a> {
    pub(crate) energy: LevelEnergy<'a>,
    pub(super) steering: Steering,
    /// Conditions that hold at the start already.
    conditions: Vec<LinearRow>,
}

/// The metric of a round or step on the directions that keep the conditions.
pub(super) struct Steering {
    metric: Option<MetricAssembly>,
    /// Whether steps are in the metric; plain L-BFGS needs it for the conditions at most.
    is_metric: bool,
    projected: Projected,
}

impl Steering {
    /// Replaces a vector by its image under the inverse of the metric.
    fn solve(&self, vector: &mut [f64]) {
        if let Some(metric) = self.metric.as_ref().filter(|_| self.is_metric) {
            metric.solve_in_place(vector);
        }
    }
}

impl Metric for Steering {
    fn apply_inverse(&mut self, gradient: &mut [f64]) {
        self.solve(gradient);
        self.projected.keep(gradient);
    }
}

impl<'a> Conditioned<'a> {
    pub(crate) fn new(
        energy: LevelEnergy<'a>,
        metric: Option<MetricAssembly>,
        conditions: Vec<LinearRow>,
    ) -> Self {
        let steering = Steering { metric, is_metric: true, projected: Projected::default() };
        Self { energy, steering, conditions }
    }

    /// The linear conditions, and the gradient of the area where the scale is free: a step along
    /// which it stays put loses nothing, because scaling does not change the energy.
    pub(super) fn condition_rows(&mut self, y: &[f64]) -> Vec<Vec<f64>> {
        let mut rows: Vec<Vec<f64>> = self.conditions.iter().map(|r| r.row.clone()).collect();
        if self.energy.scale_free {
            rows.push(self.energy.area_gradient(y));
        }
        rows
    }

    /// Makes `rows` the conditions that steps keep; `is_metric` says whether the steps are in the
    /// metric factored last.
    pub(super) fn keep(&mut self, rows: Vec<Vec<f64>>, is_metric: bool) {
        self.steering.is_metric = is_metric;
        let projected = Projected::new(rows, |vector| self.steering.solve(vector));
        self.steering.projected = projected;
    }

    /// Factors the metric at `y`, with more of the Sobolev norm until it is positive definite;
    /// returns how many factorisations that took, or that it was stopped.
    pub(super) fn factor(
        &mut self,
        y: &[f64],
        gauss_newton: bool,
        mut sobolev: f64,
        observer: &mut dyn Observer,
    ) -> Result<Result<usize, Status>, SolverError> {
        let area = self.energy.area(y);
        let Some(metric) = &mut self.steering.metric else { return Ok(Ok(0)) };
        // The patches' gradients are not needed while the matrix is there.
        self.energy.work = Default::default();
        let mut coefficients = self.energy.energy.coefficients();
        coefficients.plain.root_epsilon = ROOT_EPSILON / area;
        coefficients.plain.barrier = self.energy.barrier;
        let density = coefficients.plain.plus(area, &coefficients.scaled);
        let LevelEnergy { evaluator, freedom, x, .. } = &self.energy;
        let extra = self.energy.extra.as_ref().filter(|_| gauss_newton);
        let stop = &mut || observer.stop_requested();
        for attempt in 1.. {
            let mixture = Mixture { density, gauss_newton, sobolev };
            match metric.factor(evaluator, freedom, x, area, &mixture, extra, stop) {
                Ok(true) => return Ok(Ok(attempt)),
                Ok(false) => return Ok(Err(Status::Interrupted)),
                Err(SolverError::NotPositiveDefinite { .. }) if attempt < MENDINGS => {
                    sobolev = 10.0 * sobolev.max(1e-6);
                }
                Err(error) => return Err(error),
            }
        }
        Ok(Ok(0))
    }

    /// What is left to gain from `y`: what Gauss-Newton steps with more and more damping foresee,
    /// `½ gᵀM⁻¹g` with the gradient on the conditions, or what a part of such a step really brings,
    /// whichever is less. Where the matrix is all but singular a step with hardly any damping foresees
    /// anything and brings nothing, and one with more tells. Steps are tried until one brings more
    /// than the tolerance of the energy or foresees less. None if it was stopped, or without a matrix.
    pub(crate) fn left(
        &mut self,
        y: &[f64],
        tolerance: f64,
        observer: &mut dyn Observer,
    ) -> Result<Option<Left>, SolverError> {
        if self.steering.metric.is_none() {
            return Ok(None);
        }
        self.energy.refresh(y);
        let mut gradient = vec![0.0; y.len()];
        let before = self.energy.value(y, &mut gradient);
        let enough = tolerance * before.abs();
        let rows = self.condition_rows(y);
        let mut left = Left { before, gain: 0.0, factorizations: 0, y: y.to_vec() };
        let mut unused = vec![0.0; y.len()];
        for damping in CERTIFYING {
            self.keep(Vec::new(), false);
            let Ok(factorizations) = self.factor(y, true, damping, observer)? else {
                return Ok(None);
            };
            left.factorizations += factorizations;
            self.energy.refresh(y);
            self.keep(rows.clone(), true);
            let mut step = gradient.clone();
            self.steering.apply_inverse(&mut step);
            let foreseen = 0.5 * dot(&gradient, &step);
            for share in SHARES {
                let trial: Vec<f64> = y.iter().zip(&step).map(|(y, s)| y - share * s).collect();
                let gain = (before - self.energy.value(&trial, &mut unused)).min(foreseen);
                // A step that leads where the energy is no number brings nothing.
                if gain > left.gain {
                    (left.gain, left.y) = (gain, trial);
                }
            }
            // More damping foresees less.
            if foreseen <= enough || left.gain > enough {
                break;
            }
        }
        Ok(Some(left))
    }

    /// Gives the level a matrix where its method needs none.
    pub(crate) fn with_metric(
        &mut self,
        make: impl FnOnce(&LevelEnergy<'a>) -> Result<MetricAssembly, SolverError>,
    ) -> Result<(), SolverError> {
        if self.steering.metric.is_none() {
            self.steering.metric = Some(make(&self.energy)?);
        }
        Ok(())
    }

    /// Meets the linear conditions at the start.
    pub(crate) fn meet_conditions(
        &mut self,
        y: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<(), SolverError> {
        if self.conditions.is_empty() || self.factor(y, false, 1.0, observer)?.is_err() {
            return Ok(());
        }
        let targets: Vec<f64> = self.conditions.iter().map(|r| r.target).collect();
        let rows = self.conditions.iter().map(|r| r.row.clone()).collect();
        self.keep(rows, true);
        self.steering.projected.restore(&targets, y);
        Ok(())
    }
}
