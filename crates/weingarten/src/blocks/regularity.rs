//! What keeps a surface from folding or tearing between its samples.

use std::sync::Arc;

use glam::DVec3;
use gp_solver::{Elements, ResidualBlock};
use numerics::{Lanes, Triple};
use pulp::Simd;

use super::alignment::padded;
use super::rows::{RowValues, SampleTerm, fill};
use crate::area::CheckGrid;
use crate::field::{Sample, samples};
use crate::grid::SampleGrid;
use crate::kernel::FIRST;
use crate::sweep::{LaneKernel, Scratch, store};

/// An area element counts as too small below this share of the start's.
const SMALL: f64 = 0.4;
/// An area element counts as too large above this multiple of the start's.
const LARGE: f64 = 4.0;

/// Barrier rows on the area element `a = |s_u × s_v|`, `w (a_min/a − 1)` where `a < a_min` and
/// `w (a/a_max − 1)` where `a > a_max`, and nothing between. `a_min` is 0.4 of the start's area element,
/// or of the median if that is less; `a_max` four times as much as the start's, or as the median if that
/// is more. Steps to surfaces that are torn or folded on the check grid are not admitted.
#[derive(Clone, Debug)]
pub(crate) struct Regularity {
    grid: Arc<SampleGrid>,
    elements: Elements,
    check: Arc<CheckGrid>,
    /// Weight, least and largest area element of every sample, rows of samples padded.
    weights: Vec<f64>,
    least: Vec<f64>,
    most: Vec<f64>,
}

impl Regularity {
    /// Rows of the samples of `grid`, compared with the surface of control points `reference`; all of
    /// them together weigh as much as `rows` rows of `weight`.
    pub(crate) fn new(
        grid: Arc<SampleGrid>,
        check: Arc<CheckGrid>,
        reference: &[f64],
        rows: usize,
        weight: f64,
    ) -> Self {
        let areas: Vec<f64> =
            samples(&grid, reference).iter().map(|s: &Sample| s.delta().sqrt()).collect();
        let mut sorted = areas.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted[sorted.len() / 2];
        let shares = grid.shares();
        let weight_of = |share: &f64| weight * (rows as f64 * share).sqrt();
        let weights = padded(&grid, shares.iter().map(weight_of));
        let least = padded(&grid, areas.iter().map(|a| SMALL * a.min(median)));
        let most = padded(&grid, areas.iter().map(|a| LARGE * a.max(median)));
        let elements = grid.elements();
        Self { grid, elements, check, weights, least, most }
    }
}

struct Tangents<'a> {
    out: &'a mut [f64],
    stride: usize,
}

impl LaneKernel<FIRST> for Tangents<'_> {
    #[inline(always)]
    fn run<S: Simd>(&mut self, _: S, at: usize, d: &[Triple<Lanes<S>>; FIRST]) {
        let rows = [d[1].x, d[1].y, d[1].z, d[2].x, d[2].y, d[2].z];
        for (row, value) in self.out.chunks_exact_mut(self.stride).zip(rows) {
            store(row, at, value);
        }
    }
}

impl SampleTerm<FIRST> for Regularity {
    fn row(
        &self,
        grid: &SampleGrid,
        i: usize,
        unrolled: &[f64],
        scratch: &mut Scratch,
        values: RowValues<'_>,
    ) {
        let stride = grid.stride();
        let mut tangents = std::mem::take(&mut scratch.spare);
        tangents.resize(6 * stride, 0.0);
        grid.sweep(i, unrolled, scratch, &mut Tangents { out: &mut tangents, stride });
        values.gradient.fill(0.0);
        for j in 0..grid.v.len() {
            let vector = |row: usize| {
                DVec3::new(
                    tangents[row * stride + j],
                    tangents[(row + 1) * stride + j],
                    tangents[(row + 2) * stride + j],
                )
            };
            let (s_u, s_v) = (vector(0), vector(3));
            let normal = s_u.cross(s_v);
            let area = normal.length();
            let slot = i * stride + j;
            let (weight, least, most) = (self.weights[slot], self.least[slot], self.most[slot]);
            let (residual, slope) = if area < least {
                (weight * (least / area - 1.0), -weight * least / (area * area))
            } else if area > most {
                (weight * (area / most - 1.0), weight / most)
            } else {
                (0.0, 0.0)
            };
            values.residual[j] = residual;
            if slope != 0.0 && !values.gradient.is_empty() {
                let unit = normal * (slope / area);
                let (by_u, by_v) = (s_v.cross(unit), unit.cross(s_u));
                for axis in 0..3 {
                    values.gradient[(3 + axis) * stride + j] = by_u[axis];
                    values.gradient[(6 + axis) * stride + j] = by_v[axis];
                }
            }
        }
        scratch.spare = tangents;
    }
}

impl ResidualBlock for Regularity {
    fn name(&self) -> &str {
        "regularity"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn admits(&self, x: &[f64]) -> bool {
        self.check.is_whole(x)
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        fill(&self.grid, &self.elements, self, x, residuals, None);
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        fill(&self.grid, &self.elements, self, x, residuals, Some(jacobian));
    }
}
