//! The energy of one level as a function of its unknowns.

use crate::evaluator::{SurfaceEnergy, Workspace};
use crate::freedom::Freedom;
use crate::functional::Energy;
use crate::limits::Pull;
use gp_solver::{Objective, Problem};

/// Share of the energy that the barrier costs on an evenly parametrised surface.
const BARRIER: f64 = 1e-3;

/// Energy, pulls and further blocks of one level, by the unknowns `y`.
pub(crate) struct LevelEnergy<'a> {
    pub(crate) evaluator: &'a SurfaceEnergy,
    pub(crate) freedom: &'a Freedom,
    pub(crate) energy: &'a Energy,
    pub(crate) pulls: Vec<Pull>,
    /// Blocks of the caller's on the control points.
    pub(crate) extra: Option<Problem<'a>>,
    /// Whether the surface may be scaled.
    pub(crate) scale_free: bool,
    /// Coefficient of the barrier against colliding parameter lines.
    pub(super) barrier: f64,
    /// The area that the regularisation of [`crate::Functional::Sqrt`] is relative to.
    epsilon_area: f64,
    /// Control points.
    pub(super) x: Vec<f64>,
    full: Vec<f64>,
    pub(super) work: Workspace,
}

impl<'a> LevelEnergy<'a> {
    pub(crate) fn new(
        evaluator: &'a SurfaceEnergy,
        freedom: &'a Freedom,
        energy: &'a Energy,
        x: Vec<f64>,
    ) -> Self {
        Self {
            evaluator,
            freedom,
            energy,
            pulls: Vec::new(),
            extra: None,
            scale_free: false,
            barrier: 0.0,
            epsilon_area: f64::NAN,
            full: vec![0.0; x.len()],
            x,
            work: Workspace::default(),
        }
    }

    /// The control points.
    pub(crate) fn control_points(&mut self, y: &[f64]) -> &[f64] {
        self.freedom.expand(y, &mut self.x);
        &self.x
    }

    pub(crate) fn area(&mut self, y: &[f64]) -> f64 {
        self.freedom.expand(y, &mut self.x);
        self.evaluator.area(&self.x, &mut self.work)
    }

    /// Lets lagged quantities follow.
    pub(super) fn refresh(&mut self, y: &[f64]) {
        self.epsilon_area = self.area(y);
        if let Some(extra) = &mut self.extra {
            extra.refresh(&self.x);
        }
    }

    /// Value and gradient.
    pub(super) fn value(&mut self, y: &[f64], gradient: &mut [f64]) -> f64 {
        self.freedom.expand(y, &mut self.x);
        let mut coefficients = self.energy.coefficients();
        coefficients.plain.barrier = self.barrier;
        let value = self.evaluator.gradient_of(
            coefficients,
            &self.x,
            Some(self.epsilon_area),
            &mut self.work,
            &mut self.full,
        );
        let pulled: f64 = self.pulls.iter().map(|p| p.add_gradient(&self.x, &mut self.full)).sum();
        let mut total = value + pulled;
        if let Some(extra) = &self.extra {
            total += extra.add_gradient(&self.x, &mut self.full);
        }
        self.freedom.pull_back(&self.full, gradient);
        total
    }

    /// The energy with its pulls and further blocks, without the barrier.
    pub(crate) fn energy(&mut self, y: &[f64]) -> f64 {
        self.freedom.expand(y, &mut self.x);
        let pulled: f64 = self.pulls.iter().map(|p| p.energy(&self.x)).sum();
        let own = self.evaluator.energy(self.energy, &self.x, &mut self.work) + pulled;
        self.extra.as_ref().map_or(own, |extra| own + extra.energy(&self.x))
    }

    /// Scales the surface to unit area, if that is allowed.
    pub(super) fn renormalise(&mut self, y: &mut [f64]) {
        if self.scale_free {
            let scale = self.area(y).sqrt().recip();
            if scale.is_finite() && scale > 0.0 {
                y.iter_mut().for_each(|y| *y *= scale);
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
    pub(super) fn set_barrier(&mut self, y: &[f64]) {
        let scaled = self.energy.coefficients().scaled;
        if scaled.f3 != 0.0 || scaled.coupling != 0.0 {
            return;
        }
        let area = self.area(y);
        let energy = self.evaluator.energy(self.energy, &self.x, &mut self.work);
        let patches = self.evaluator.weighted_patches();
        self.barrier = BARRIER * energy.abs() * area / (patches * patches);
    }

    /// Gradient of the area by the unknowns.
    pub(super) fn area_gradient(&mut self, y: &[f64]) -> Vec<f64> {
        self.freedom.expand(y, &mut self.x);
        let mut full = vec![0.0; self.x.len()];
        self.evaluator.area_gradient(&self.x, &mut self.work, &mut full);
        let mut row = vec![0.0; self.freedom.len()];
        self.freedom.pull_back(&full, &mut row);
        row
    }
}

impl Objective for LevelEnergy<'_> {
    fn value_and_gradient(&mut self, y: &[f64], gradient: &mut [f64]) -> f64 {
        self.value(y, gradient)
    }
}
