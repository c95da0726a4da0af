//! Geodesic parallelism of the curvature isolines.

use std::sync::Arc;

use gp_solver::{Elements, ResidualBlock};
use numerics::{Lanes, Triple};
use pulp::Simd;

use super::alignment::{SCALE_FLOOR, padded, store_gradient};
use super::rows::{RowValues, SampleTerm, fill};
use crate::field::parallel_gradients;
use crate::grid::SampleGrid;
use crate::kernel::{FOURTH, Field, parallel, parallel_jet};
use crate::sampled::SampledSurface;
use crate::sweep::{LaneKernel, Scratch, load, store};

/// One row per sample, `w (ψ_u f_v − ψ_v f_u) / (√Δ p₀)` with `ψ = |∇_s f|²` and `f` one of the
/// curvatures (Pellis et al. 2021, Eq. 8, with exact fourth derivatives).
///
/// `p₀` is the root mean square of `|∇_s ψ| |∇_s f|` at the start: without it the rows of `K` are
/// five orders of magnitude larger than those of the alignment and bring the iteration to a halt.
#[derive(Clone, Debug)]
pub struct Parallel {
    field: Field,
    grid: Arc<SampleGrid>,
    elements: Elements,
    factors: Vec<f64>,
}

impl Parallel {
    /// As [`super::Alignment::new`], for the isolines of one of the curvatures.
    #[must_use]
    pub fn new(start: &SampledSurface, field: Field, weight: f64) -> Self {
        let SampledSurface { grid, x, samples, curvature } = start;
        let gradients = parallel_gradients(grid, field, x, samples);
        let square = gradients.iter().map(|g| g * g).sum::<f64>() / gradients.len() as f64;
        // ψ is |∇f|²: f, its gradient and ψ's gradient make 1/length^7 for H and 1/length^10 for K.
        let degree = match field {
            Field::Mean => 7,
            Field::Gauss => 10,
        };
        let scale = square.sqrt().max(SCALE_FLOOR * curvature.powi(degree));
        let factors = padded(grid, samples.iter().map(|s| weight / (s.delta().sqrt() * scale)));
        Self { field, grid: Arc::clone(grid), elements: grid.elements(), factors }
    }
}

struct Kernel<'a> {
    field: Field,
    factors: &'a [f64],
    values: RowValues<'a>,
    stride: usize,
}

impl LaneKernel<FOURTH> for Kernel<'_> {
    #[inline(always)]
    fn run<S: Simd>(&mut self, simd: S, at: usize, d: &[Triple<Lanes<S>>; FOURTH]) {
        let factor = load(simd, self.factors, at);
        if self.values.gradient.is_empty() {
            let jet = parallel_jet(self.field, d);
            let r = jet.psi_u * jet.f_v - jet.psi_v * jet.f_u;
            store(self.values.residual, at, r * factor);
        } else {
            let (r, gradient) = parallel(self.field, d);
            store(self.values.residual, at, r * factor);
            store_gradient(self.values.gradient, self.stride, at, factor, &gradient);
        }
    }
}

impl SampleTerm<FOURTH> for Parallel {
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
        grid.sweep(
            i,
            unrolled,
            scratch,
            &mut Kernel { field: self.field, factors, values, stride },
        );
    }
}

impl ResidualBlock for Parallel {
    fn name(&self) -> &str {
        match self.field {
            Field::Mean => "parallel_h",
            Field::Gauss => "parallel_k",
        }
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        fill(&self.grid, &self.elements, self, x, residuals, None);
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        fill(&self.grid, &self.elements, self, x, residuals, Some(jacobian));
    }
}
