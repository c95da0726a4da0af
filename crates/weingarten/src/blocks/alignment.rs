//! Alignment of the isolines of mean and Gaussian curvature.

use std::sync::Arc;

use gp_solver::{Elements, ResidualBlock};
use numerics::{Lanes, Triple};
use pulp::Simd;

use super::rows::{RowValues, SampleTerm, fill};
use crate::field::{Sample, determinants_into};
use crate::grid::SampleGrid;
use crate::kernel::{THIRD, alignment, curvature_jet};
use crate::sampled::SampledSurface;
use crate::sweep::{LaneKernel, Scratch, load, store};

/// Least value of the residual scale `q₀` as a fraction of `κ⁵`, `κ` the mean absolute principal
/// curvature. On surfaces where `H` or `K` is constant the scale is all rounding, and dividing by
/// it would amplify that to a residual of size one.
pub(crate) const SCALE_FLOOR: f64 = 1e-8;

/// One row per sample, `w (H_u K_v − H_v K_u) / (√Δ q₀)` (Pellis et al. 2021, Eq. 5).
///
/// `J / √Δ` does not depend on the parametrisation, and `q₀`, the root mean square of
/// `|∇_s H| |∇_s K|` over the samples at the start, takes its unit away: the residual is of the
/// size of the sine of the angle between the isolines. `Δ` is that of the last iterate.
#[derive(Clone, Debug)]
pub struct Alignment {
    grid: Arc<SampleGrid>,
    elements: Elements,
    weight: f64,
    q0: f64,
    /// Weight over `√Δ q₀`, rows of samples padded to the stride of the grid.
    factors: Vec<f64>,
}

impl Alignment {
    /// Rows for every sample, scaled where the surface starts.
    #[must_use]
    pub fn new(start: &SampledSurface, weight: f64) -> Self {
        let grid = &start.grid;
        let q0 = residual_scale(&start.samples, start.curvature);
        let factors = padded(grid, start.samples.iter().map(|s| weight / (s.delta().sqrt() * q0)));
        Self { grid: Arc::clone(grid), elements: grid.elements(), weight, q0, factors }
    }
}

/// `q₀`: the root mean square of `|∇_s H| |∇_s K|`, at least [`SCALE_FLOOR`] times `curvature⁵`.
pub(crate) fn residual_scale(start: &[Sample], curvature: f64) -> f64 {
    let square = |s: &Sample| {
        let (h, k) = s.gradients();
        (h * k).max(0.0)
    };
    let mean = start.iter().map(square).sum::<f64>() / start.len() as f64;
    mean.sqrt().max(SCALE_FLOOR * curvature.powi(5))
}

/// One value per sample that counts to padded rows.
pub(crate) fn padded(grid: &SampleGrid, values: impl Iterator<Item = f64>) -> Vec<f64> {
    let (m_v, stride) = (grid.v.len(), grid.stride());
    let mut rows = vec![0.0; grid.u.len() * stride];
    for (k, value) in values.enumerate() {
        let s = grid.place(k);
        rows[s / m_v * stride + s % m_v] = value;
    }
    rows
}

struct Kernel<'a> {
    factors: &'a [f64],
    values: RowValues<'a>,
    stride: usize,
}

impl LaneKernel<THIRD> for Kernel<'_> {
    #[inline(always)]
    fn run<S: Simd>(&mut self, simd: S, at: usize, d: &[Triple<Lanes<S>>; THIRD]) {
        let factor = load(simd, self.factors, at);
        if self.values.gradient.is_empty() {
            let jet = curvature_jet(d);
            let r = jet.h_u * jet.k_v - jet.h_v * jet.k_u;
            store(self.values.residual, at, r * factor);
        } else {
            let (r, gradient) = alignment(d);
            store(self.values.residual, at, r * factor);
            store_gradient(self.values.gradient, self.stride, at, factor, &gradient);
        }
    }
}

/// Writes `factor · gradient` as one padded row of samples per vector and axis.
#[inline(always)]
pub(crate) fn store_gradient<S: Simd, const N: usize>(
    out: &mut [f64],
    stride: usize,
    at: usize,
    factor: Lanes<S>,
    gradient: &[Triple<Lanes<S>>; N],
) {
    for (rows, g) in out.chunks_exact_mut(3 * stride).zip(gradient) {
        let (x, rest) = rows.split_at_mut(stride);
        let (y, z) = rest.split_at_mut(stride);
        store(x, at, g.x * factor);
        store(y, at, g.y * factor);
        store(z, at, g.z * factor);
    }
}

impl SampleTerm<THIRD> for Alignment {
    fn row(
        &self,
        grid: &SampleGrid,
        i: usize,
        unrolled: &[f64],
        scratch: &mut Scratch,
        values: RowValues<'_>,
    ) {
        let stride = grid.stride();
        let factors = &self.factors[i * stride..(i + 1) * stride];
        grid.sweep(i, unrolled, scratch, &mut Kernel { factors, values, stride });
    }
}

impl ResidualBlock for Alignment {
    fn name(&self) -> &str {
        "alignment"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn refresh(&mut self, x: &[f64]) {
        determinants_into(&self.grid, x, &mut self.factors);
        for factor in &mut self.factors {
            // A zero here becomes an infinite residual, which the solver names.
            *factor = self.weight / (factor.sqrt() * self.q0);
        }
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        fill(&self.grid, &self.elements, self, x, residuals, None);
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        fill(&self.grid, &self.elements, self, x, residuals, Some(jacobian));
    }
}
