//! Minimisation on one level: L-BFGS with several metrics, Gauss-Newton, linear conditions.

use crate::constraints::{LinearRow, Pull};
use crate::element::Mixture;
use crate::evaluator::{SurfaceEnergy, Workspace};
use crate::freedom::Freedom;
use crate::functional::{Energy, ROOT_EPSILON};
use crate::metric::MetricAssembly;
use gp_solver::{LbfgsOptions, Metric, Progress, SolverError, Stage, Status, lbfgs};
use numerics::{dot, factor_semidefinite, solve_semidefinite};
use std::ops::ControlFlow;

/// How a level is minimised.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// L-BFGS whose metric is a Gauss-Newton Hessian, renewed every 40 steps; the first steps on a
    /// level are Gauss-Newton steps.
    #[default]
    LaggedGaussNewton,
    /// Damped Gauss-Newton steps.
    GaussNewton,
    /// L-BFGS with the H³ norm as metric (Renka and Neuberger 1995; Joshi 2008, sec. 7.2.1).
    Sobolev,
    /// Plain L-BFGS, as the thesis.
    Lbfgs,
}

/// Weight of the Sobolev norm next to a Gauss-Newton Hessian.
const DAMPING: f64 = 1e-3;
/// Steps between two factorisations.
const REFRESH: usize = 40;
/// A round with a Gauss-Newton metric ends once the gain that the metric foresees is this share of
/// the tolerance.
const SETTLED: f64 = 0.01;
/// Steps L-BFGS remembers.
const MEMORY: usize = 20;
/// Share of the energy that the barrier costs on an evenly parametrised surface.
const BARRIER: f64 = 1e-3;

/// State of the descent on one level.
pub(crate) struct Level<'a> {
    pub(crate) evaluator: &'a SurfaceEnergy,
    pub(crate) freedom: &'a Freedom,
    pub(crate) energy: &'a Energy,
    pub(crate) metric: Option<MetricAssembly>,
    /// Conditions that hold at the start already.
    pub(crate) rows: Vec<LinearRow>,
    pub(crate) pulls: Vec<Pull>,
    /// Whether the surface may be scaled.
    pub(crate) scale_free: bool,
    /// Coefficient of the barrier against colliding parameter lines.
    pub(crate) barrier: f64,
    pub(crate) y: Vec<f64>,
    pub(crate) x: Vec<f64>,
    pub(crate) work: Workspace,
}

/// What a descent did.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Descent {
    pub(crate) status: Status,
    pub(crate) iterations: usize,
    pub(crate) evaluations: usize,
    pub(crate) factorizations: usize,
    pub(crate) history: Vec<f64>,
    pub(crate) gradient_norm: f64,
}

/// A factored metric restricted to the directions that keep the linear conditions.
struct Projected<'a> {
    metric: Option<&'a MetricAssembly>,
    rows: &'a [Vec<f64>],
    // M⁻¹ Cᵀ, and the Cholesky factor of C M⁻¹ Cᵀ.
    images: Vec<Vec<f64>>,
    schur: Vec<Vec<f64>>,
}

impl<'a> Projected<'a> {
    fn new(metric: Option<&'a MetricAssembly>, rows: &'a [Vec<f64>]) -> Self {
        let images: Vec<Vec<f64>> = rows
            .iter()
            .map(|row| {
                let mut image = row.clone();
                if let Some(metric) = metric {
                    metric.solve_in_place(&mut image);
                }
                image
            })
            .collect();
        let n = rows.len();
        let mut schur = vec![vec![0.0; n]; n];
        for i in 0..n {
            for j in 0..=i {
                schur[i][j] = dot(&rows[i], &images[j]);
            }
        }
        // Conditions that follow from others leave a pivot of rounding errors; they are skipped.
        factor_semidefinite(&mut schur, 1e-12);
        Self { metric, rows, images, schur }
    }

    /// Moves `y` to the conditions by the shortest way in the metric.
    fn restore(&self, targets: &[f64], y: &mut [f64]) {
        let mut gap: Vec<f64> =
            self.rows.iter().zip(targets).map(|(row, t)| t - dot(row, y)).collect();
        solve_semidefinite(&self.schur, &mut gap);
        for (image, g) in self.images.iter().zip(&gap) {
            y.iter_mut().zip(image).for_each(|(y, i)| *y += g * i);
        }
    }
}

impl Metric for Projected<'_> {
    fn apply_inverse(&mut self, gradient: &mut [f64]) {
        if let Some(metric) = self.metric {
            metric.solve_in_place(gradient);
        }
        let mut multipliers: Vec<f64> = self.rows.iter().map(|row| dot(row, gradient)).collect();
        solve_semidefinite(&self.schur, &mut multipliers);
        for (image, m) in self.images.iter().zip(&multipliers) {
            gradient.iter_mut().zip(image).for_each(|(g, i)| *g -= m * i);
        }
    }
}

impl Level<'_> {
    fn area(&mut self) -> f64 {
        self.freedom.expand(&self.y, &mut self.x);
        self.evaluator.area(&self.x, &mut self.work)
    }

    fn value(&mut self, epsilon_area: f64, gradient: &mut [f64]) -> f64 {
        self.freedom.expand(&self.y, &mut self.x);
        let mut full = vec![0.0; self.x.len()];
        let mut coefficients = self.energy.coefficients();
        coefficients.plain.barrier = self.barrier;
        let value = self.evaluator.gradient_of(
            coefficients,
            &self.x,
            Some(epsilon_area),
            &mut self.work,
            &mut full,
        );
        let pulled: f64 = self.pulls.iter().map(|p| p.add_gradient(&self.x, &mut full)).sum();
        self.freedom.pull_back(&full, gradient);
        value + pulled
    }

    /// The energy with its pulls at the present unknowns.
    pub(crate) fn energy(&mut self) -> f64 {
        self.freedom.expand(&self.y, &mut self.x);
        let pulled: f64 = self.pulls.iter().map(|p| p.energy(&self.x)).sum();
        self.evaluator.energy(self.energy, &self.x, &mut self.work) + pulled
    }

    /// Scales the surface to unit area, if that is allowed.
    fn renormalise(&mut self) {
        if self.scale_free {
            let scale = self.area().sqrt().recip();
            if scale.is_finite() && scale > 0.0 {
                self.y.iter_mut().for_each(|y| *y *= scale);
            }
        }
    }

    /// Weighs the barrier `BARRIER |E| · mean of Ā/J`, with the area element `J` and its mean `Ā`.
    ///
    /// Energies of second order do not feel how the surface is parametrised, and their minimisers
    /// let rows of vertices run into one another between the quadrature points; so does the
    /// gradient of mean curvature, `F1`, next to clamped rows where the curvature would jump, and
    /// `∫√(F1² + F3²)`, for which a jump has a price but rows that gather there have none. With the
    /// square of `F3` the jumps of the splines' third derivatives hold the rows apart.
    fn set_barrier(&mut self) {
        let scaled = self.energy.coefficients().scaled;
        if scaled.f3 != 0.0 || scaled.coupling != 0.0 {
            return;
        }
        let area = self.area();
        let energy = self.evaluator.energy(self.energy, &self.x, &mut self.work);
        let patches = self.evaluator.weighted_patches();
        self.barrier = BARRIER * energy.abs() * area / (patches * patches);
    }

    /// The linear conditions, and the gradient of the area where the scale is free: a step along
    /// which it stays put loses nothing, because scaling does not change the energy.
    fn condition_rows(&mut self) -> Vec<Vec<f64>> {
        let mut rows: Vec<Vec<f64>> = self.rows.iter().map(|r| r.row.clone()).collect();
        if self.scale_free {
            self.freedom.expand(&self.y, &mut self.x);
            let mut full = vec![0.0; self.x.len()];
            self.evaluator.area_gradient(&self.x, &mut self.work, &mut full);
            let mut row = vec![0.0; self.freedom.len()];
            self.freedom.pull_back(&full, &mut row);
            rows.push(row);
        }
        rows
    }

    fn factor(&mut self, gauss_newton: bool, mut sobolev: f64) -> Result<usize, SolverError> {
        let area = self.area();
        let Some(metric) = &mut self.metric else { return Ok(0) };
        // The patches' gradients are not needed while the matrix is there.
        self.work = Workspace::default();
        let mut coefficients = self.energy.coefficients();
        coefficients.plain.root_epsilon = ROOT_EPSILON / area;
        coefficients.plain.barrier = self.barrier;
        let density = coefficients.plain.plus(area, &coefficients.scaled);
        for attempt in 1.. {
            let mixture = Mixture { density, gauss_newton, sobolev };
            match metric.factor(self.evaluator, self.freedom, &self.x, area, &mixture) {
                Ok(()) => return Ok(attempt),
                Err(SolverError::NotPositiveDefinite { .. }) if attempt < 12 => {
                    sobolev = 10.0 * sobolev.max(1e-6);
                }
                Err(error) => return Err(error),
            }
        }
        Ok(0)
    }

    /// Meets the linear conditions at the start.
    pub(crate) fn meet_conditions(&mut self) -> Result<(), SolverError> {
        if self.rows.is_empty() {
            return Ok(());
        }
        self.factor(false, 1.0)?;
        let rows: Vec<Vec<f64>> = self.rows.iter().map(|r| r.row.clone()).collect();
        let targets: Vec<f64> = self.rows.iter().map(|r| r.target).collect();
        Projected::new(self.metric.as_ref(), &rows).restore(&targets, &mut self.y);
        Ok(())
    }

    /// Minimises until the energy falls by less than `tolerance` of itself per round, or the
    /// iterations are used up.
    pub(crate) fn minimise(
        &mut self,
        method: Method,
        iterations: usize,
        newton_steps: usize,
        tolerance: f64,
        observer: &mut dyn FnMut(usize, f64) -> ControlFlow<()>,
    ) -> Result<Descent, SolverError> {
        let mut total = Descent {
            status: Status::IterationLimit,
            iterations: 0,
            evaluations: 0,
            factorizations: 0,
            history: Vec::new(),
            gradient_norm: f64::NAN,
        };
        match method {
            Method::LaggedGaussNewton => {
                self.newton(newton_steps.min(iterations), 1e-3, &mut total, observer)?;
            }
            Method::GaussNewton => {
                self.newton(iterations, 0.1 * tolerance, &mut total, observer)?;
                return Ok(total);
            }
            Method::Sobolev | Method::Lbfgs => {}
        }
        while total.iterations < iterations && total.status != Status::Interrupted {
            let left = iterations - total.iterations;
            self.renormalise();
            self.set_barrier();
            let (steps, memory) = match method {
                Method::LaggedGaussNewton | Method::GaussNewton => {
                    total.factorizations += self.factor(true, DAMPING)?;
                    (REFRESH, MEMORY)
                }
                Method::Sobolev => {
                    total.factorizations += self.factor(false, 1.0)?;
                    (REFRESH, MEMORY / 2)
                }
                // The thesis keeps ten steps and never stops for a new metric.
                Method::Lbfgs => (left, MEMORY / 2),
            };
            let (before, after, settled) =
                self.round(method, left.min(steps), memory, tolerance, &mut total, observer)?;
            if settled {
                break;
            }
            if total.status == Status::Stalled && before - after > tolerance * after.abs() {
                continue;
            }
            if !(before - after > tolerance * after.abs()) {
                if total.status != Status::Interrupted {
                    total.status = Status::Converged;
                }
                break;
            }
        }
        Ok(total)
    }

    /// One run of L-BFGS with a metric that stays; energies before and after, and whether there is
    /// nothing left to gain.
    fn round(
        &mut self,
        method: Method,
        steps: usize,
        memory: usize,
        tolerance: f64,
        total: &mut Descent,
        observer: &mut dyn FnMut(usize, f64) -> ControlFlow<()>,
    ) -> Result<(f64, f64, bool), SolverError> {
        let rows = self.condition_rows();
        let epsilon_area = self.area();
        let metric = self.metric.take();
        let mut projected =
            Projected::new(metric.as_ref().filter(|_| method != Method::Lbfgs), &rows);
        let options = LbfgsOptions {
            memory,
            max_iterations: steps,
            gradient_tol: 1e-10,
            energy_tol: 0.2 * tolerance,
            ..LbfgsOptions::default()
        };
        let mut y = std::mem::take(&mut self.y);
        let start = total.iterations;
        // With a Gauss-Newton metric half the squared norm of the gradient estimates what is left
        // to gain; without this test steps would go on down to the rounding errors.
        let newton_like = method == Method::LaggedGaussNewton;
        let mut settled = false;
        let report = {
            let mut objective = |at: &[f64], gradient: &mut [f64]| {
                self.y.clear();
                self.y.extend_from_slice(at);
                self.value(epsilon_area, gradient)
            };
            let stage = Stage::only("round");
            lbfgs(
                &mut objective,
                &mut projected,
                &mut y,
                &options,
                &stage,
                &mut |seen: &Progress<'_>| {
                    if seen.iteration == 0 {
                        return ControlFlow::Continue(());
                    }
                    observer(start + seen.iteration, seen.energy)?;
                    let left = 0.5 * seen.gradient_norm * seen.gradient_norm;
                    settled = newton_like && left <= SETTLED * tolerance * seen.energy.abs();
                    if settled { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
                },
            )
        };
        drop(projected);
        self.metric = metric;
        self.y = y;
        let report = report?;
        total.iterations += report.iterations;
        total.evaluations += report.evaluations;
        total.history.extend(report.history.iter().map(|h| h.energy));
        total.gradient_norm = report.gradient_norm;
        total.status = if settled { Status::Converged } else { report.status };
        Ok((report.initial_energy, report.final_energy, settled))
    }

    /// Gauss-Newton steps damped by the Sobolev norm, until a step gains less than `tolerance` of
    /// the energy.
    fn newton(
        &mut self,
        steps: usize,
        tolerance: f64,
        total: &mut Descent,
        observer: &mut dyn FnMut(usize, f64) -> ControlFlow<()>,
    ) -> Result<(), SolverError> {
        let n = self.freedom.len();
        let mut gradient = vec![0.0; n];
        let mut trial_gradient = vec![0.0; n];
        let mut damping = 10.0 * DAMPING;
        for _ in 0..steps {
            self.renormalise();
            self.set_barrier();
            let epsilon_area = self.area();
            let energy = self.value(epsilon_area, &mut gradient);
            total.history.push(energy);
            total.evaluations += 1;
            let rows = self.condition_rows();
            let from = self.y.clone();
            let mut accepted = None;
            for _ in 0..20 {
                total.factorizations += self.factor(true, damping)?;
                let mut step = gradient.clone();
                let metric = self.metric.take();
                let mut projected = Projected::new(metric.as_ref(), &rows);
                projected.apply_inverse(&mut step);
                drop(projected);
                self.metric = metric;
                // With a positive definite model of Hessian M the model's gain is gᵀM⁻¹g/2.
                let gain = 0.5 * dot(&gradient, &step);
                total.gradient_norm = (2.0 * gain).max(0.0).sqrt();
                for ((y, &y0), s) in self.y.iter_mut().zip(&from).zip(&step) {
                    *y = y0 - s;
                }
                let value = self.value(epsilon_area, &mut trial_gradient);
                total.evaluations += 1;
                let ratio = (energy - value) / gain;
                if value.is_finite() && value < energy && ratio > 0.05 {
                    damping = (damping
                        * if ratio > 0.75 {
                            0.25
                        } else if ratio > 0.25 {
                            1.0
                        } else {
                            3.0
                        })
                    .max(1e-9);
                    accepted = Some(value);
                    break;
                }
                self.y.copy_from_slice(&from);
                damping *= 4.0;
            }
            let Some(value) = accepted else {
                total.status = Status::Stalled;
                return Ok(());
            };
            total.iterations += 1;
            if observer(total.iterations, value).is_break() {
                total.status = Status::Interrupted;
                return Ok(());
            }
            if energy - value < tolerance * value.abs() {
                total.status = Status::Converged;
                return Ok(());
            }
        }
        total.status = Status::IterationLimit;
        Ok(())
    }
}
