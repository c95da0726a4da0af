//! Rows that ask for a certain relation between the curvatures.

use std::sync::Arc;

use gp_solver::{Elements, ResidualBlock};
use numerics::{Lanes, Real, Triple};
use pulp::Simd;

use super::alignment::store_gradient;
use super::rows::{RowValues, SampleTerm, fill};
use crate::field::{Sample, samples};
use crate::grid::SampleGrid;
use crate::kernel::{SECOND, curvature, second};
use crate::relation::Relation;
use crate::sampled::SampledSurface;
use crate::sweep::{LaneKernel, Scratch, load, store};
use crate::target::{Spread, Target};

/// One row per sample, `w q (α H + β K + γ)`, with coefficients that follow from the [`Relation`] and,
/// where it is fitted, from the last iterate; or `w q (κ₁ − R κ₂)/√(1 + R²)` for a ratio of the
/// principal curvatures (Pellis et al. 2021, Sec. 3.2). Coefficients are scaled to the size of the
/// curvatures at the start, so that a residual of `w q` is a miss as large as they are. `q²` is the area
/// at the start that the sample stands for, in units of a quarter of the area per control point: half the
/// sum of squares is a quadrature of the squared miss, however many samples there are.
#[derive(Clone, Debug)]
pub struct RelationRows {
    grid: Arc<SampleGrid>,
    elements: Elements,
    target: Target,
    /// Rows of `α`, `β`, `γ` for each row of samples, padded; of `q` for a ratio.
    coefficients: Vec<f64>,
    /// `w q` of every sample.
    weights: Vec<f64>,
}

impl RelationRows {
    /// Rows for every sample; `None` for [`Relation::Free`] and curves of fewer than two points.
    /// The unknowns have `unit` lengths per length of the model, which the relation speaks of.
    #[must_use]
    pub fn new(
        start: &SampledSurface,
        relation: &Relation,
        unit: f64,
        weight: f64,
    ) -> Option<Self> {
        let spread = Spread::of(&start.samples, start.curvature);
        let target = Target::new(relation, unit, start.curvature, spread)?;
        Some(Self::of_target(start, target, weight))
    }

    pub(crate) fn of_target(start: &SampledSurface, target: Target, weight: f64) -> Self {
        let grid = &start.grid;
        let coefficients = vec![0.0; 3 * grid.u.len() * grid.stride()];
        let elements = grid.elements();
        let weights = row_weights(start, weight);
        let mut made = Self { grid: Arc::clone(grid), elements, target, coefficients, weights };
        made.set_coefficients(&start.samples);
        made
    }

    fn set_coefficients(&mut self, samples: &[Sample]) {
        let (m_v, stride) = (self.grid.v.len(), self.grid.stride());
        let rows = match self.target.ratio() {
            Some(_) => vec![[1.0; 3]; samples.len()],
            None => self.target.rows(samples),
        };
        for (k, (row, weight)) in rows.iter().zip(&self.weights).enumerate() {
            let s = self.grid.place(k);
            for (which, value) in row.iter().enumerate() {
                let slot = (3 * (s / m_v) + which) * stride + s % m_v;
                self.coefficients[slot] = weight * value;
            }
        }
    }
}

/// `w q` of every sample that counts.
fn row_weights(start: &SampledSurface, weight: f64) -> Vec<f64> {
    let areas = start.grid.shares().into_iter().zip(&start.samples);
    let areas: Vec<f64> = areas.map(|(share, s)| share * s.delta().sqrt()).collect();
    let all: f64 = areas.iter().sum();
    let rows = reference_rows(&start.grid) as f64;
    areas.iter().map(|area| weight * (rows * area / all).sqrt()).collect()
}

/// How many rows the rows of all samples weigh as much as: four per control point, the samples of the
/// alignment.
pub(crate) fn reference_rows(grid: &SampleGrid) -> usize {
    4 * grid.u.control * grid.v.control
}

/// `α H + β K + γ`.
struct Affine<'a> {
    coefficients: [&'a [f64]; 3],
    values: RowValues<'a>,
    stride: usize,
}

impl LaneKernel<SECOND> for Affine<'_> {
    #[inline(always)]
    fn run<S: Simd>(&mut self, simd: S, at: usize, d: &[Triple<Lanes<S>>; SECOND]) {
        let [alpha, beta, gamma] = self.coefficients;
        let (alpha, beta) = (load(simd, alpha, at), load(simd, beta, at));
        let gamma = load(simd, gamma, at);
        let c = curvature(&second(d));
        store(self.values.residual, at, alpha.fma(c.h, beta.fma(c.k, gamma)));
        if !self.values.gradient.is_empty() {
            put(self.values.gradient, self.stride, at, &c, alpha, beta);
        }
    }
}

/// `w (cos θ κ₁ − sin θ κ₂)` with `κ₁,₂ = H ± √(H² − K + δ²)`.
struct Ratio<'a> {
    row: [f64; 2],
    smoothing: f64,
    weights: &'a [f64],
    values: RowValues<'a>,
    stride: usize,
}

impl LaneKernel<SECOND> for Ratio<'_> {
    #[inline(always)]
    fn run<S: Simd>(&mut self, simd: S, at: usize, d: &[Triple<Lanes<S>>; SECOND]) {
        let c = curvature(&second(d));
        let smoothing = c.h.constant(self.smoothing);
        let root = (c.h.fma(c.h, smoothing * smoothing) - c.k).sqrt();
        let weight = load(simd, self.weights, at);
        let [cosine, sine] = self.row;
        let (minus, plus) = (weight * (cosine - sine), weight * (cosine + sine));
        store(self.values.residual, at, c.h * minus + root * plus);
        if !self.values.gradient.is_empty() {
            let by_root = root.recip() * plus;
            let alpha = by_root.fma(c.h, minus);
            put(self.values.gradient, self.stride, at, &c, alpha, -by_root * 0.5);
        }
    }
}

/// Writes `α ∇H + β ∇K`.
#[inline(always)]
fn put<S: Simd>(
    out: &mut [f64],
    stride: usize,
    at: usize,
    c: &crate::kernel::Curvature<Lanes<S>>,
    alpha: Lanes<S>,
    beta: Lanes<S>,
) {
    let zero = c.h.constant(0.0);
    let mut gradient = [Triple::splat(zero); SECOND];
    for (i, slot) in gradient[1..].iter_mut().enumerate() {
        *slot = c.grad_h[i].scale(alpha).plus(beta, c.grad_k[i]);
    }
    store_gradient(out, stride, at, zero.constant(1.0), &gradient);
}

impl SampleTerm<SECOND> for RelationRows {
    fn row(
        &self,
        grid: &SampleGrid,
        i: usize,
        unrolled: &[f64],
        scratch: &mut Scratch,
        values: RowValues<'_>,
    ) {
        let stride = grid.stride();
        let rows = &self.coefficients[3 * i * stride..3 * (i + 1) * stride];
        if let Some((row, smoothing)) = self.target.ratio() {
            let weights = &rows[..stride];
            grid.sweep(
                i,
                unrolled,
                scratch,
                &mut Ratio { row, smoothing, weights, values, stride },
            );
        } else {
            let coefficients = std::array::from_fn(|k| &rows[k * stride..(k + 1) * stride]);
            grid.sweep(i, unrolled, scratch, &mut Affine { coefficients, values, stride });
        }
    }
}

impl ResidualBlock for RelationRows {
    fn name(&self) -> &str {
        "relation"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn refresh(&mut self, x: &[f64]) {
        if self.target.follows() {
            let now = samples(&self.grid, x);
            self.set_coefficients(&now);
        }
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        fill(&self.grid, &self.elements, self, x, residuals, None);
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        fill(&self.grid, &self.elements, self, x, residuals, Some(jacobian));
    }
}
