//! Position, metric and curvatures with their derivatives at every sample of a grid.

use glam::DVec3;
use numerics::{Lanes, Triple};
use pulp::Simd;
use rayon::prelude::*;

use crate::grid::SampleGrid;
use crate::kernel::{CurvatureJet, FIRST, FOURTH, Field, THIRD, curvature_jet, parallel_jet};
use crate::sweep::{LaneKernel, Scratch, store};

/// What the surface is like at one sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sample {
    pub(crate) point: DVec3,
    pub(crate) e: f64,
    pub(crate) f: f64,
    pub(crate) g: f64,
    pub(crate) jet: CurvatureJet<f64>,
}

impl Sample {
    /// Of curvatures alone: a place whose point, metric and slopes nobody asks for.
    pub(crate) fn of_curvatures(h: f64, k: f64) -> Self {
        let jet = CurvatureJet { h, k, h_u: 0.0, h_v: 0.0, k_u: 0.0, k_v: 0.0 };
        Self { point: DVec3::ZERO, e: 1.0, f: 0.0, g: 1.0, jet }
    }

    /// Determinant of the first fundamental form.
    pub(crate) fn delta(&self) -> f64 {
        self.e * self.g - self.f * self.f
    }

    /// `H_u K_v − H_v K_u`.
    pub(crate) fn jacobian(&self) -> f64 {
        self.jet.h_u * self.jet.k_v - self.jet.h_v * self.jet.k_u
    }

    /// Squared intrinsic gradients of `H` and `K`.
    pub(crate) fn gradients(&self) -> (f64, f64) {
        let norm = |a: f64, b: f64| {
            (self.g * a * a - 2.0 * self.f * a * b + self.e * b * b) / self.delta()
        };
        (norm(self.jet.h_u, self.jet.h_v), norm(self.jet.k_u, self.jet.k_v))
    }

    /// Principal curvatures, the larger first.
    pub(crate) fn principal(&self) -> (f64, f64) {
        let root = (self.jet.h * self.jet.h - self.jet.k).max(0.0).sqrt();
        (self.jet.h + root, self.jet.h - root)
    }
}

const ROWS: usize = 12;

struct SampleKernel<'a> {
    out: &'a mut [f64],
    stride: usize,
}

impl LaneKernel<THIRD> for SampleKernel<'_> {
    #[inline(always)]
    fn run<S: Simd>(&mut self, _: S, at: usize, d: &[Triple<Lanes<S>>; THIRD]) {
        let jet = curvature_jet(d);
        let rows = [
            d[0].x,
            d[0].y,
            d[0].z,
            d[1].dot(d[1]),
            d[1].dot(d[2]),
            d[2].dot(d[2]),
            jet.h,
            jet.k,
            jet.h_u,
            jet.h_v,
            jet.k_u,
            jet.k_v,
        ];
        for (row, value) in self.out.chunks_exact_mut(self.stride).zip(rows) {
            store(row, at, value);
        }
    }
}

/// Evaluates every sample that counts, in the order of [`SampleGrid::place`].
pub(crate) fn samples(grid: &SampleGrid, x: &[f64]) -> Vec<Sample> {
    let unrolled = grid.unroll(x);
    let stride = grid.stride();
    let row = |i: usize| {
        let mut scratch = Scratch::default();
        let mut out = vec![0.0; ROWS * stride];
        grid.sweep(i, &unrolled, &mut scratch, &mut SampleKernel { out: &mut out, stride });
        let at = move |j: usize| {
            let v = |row: usize| out[row * stride + j];
            Sample {
                point: DVec3::new(v(0), v(1), v(2)),
                e: v(3),
                f: v(4),
                g: v(5),
                jet: CurvatureJet {
                    h: v(6),
                    k: v(7),
                    h_u: v(8),
                    h_v: v(9),
                    k_u: v(10),
                    k_v: v(11),
                },
            }
        };
        (0..grid.v.len()).map(at)
    };
    let all: Vec<Sample> =
        (0..grid.u.len()).into_par_iter().with_min_len(4).flat_map_iter(row).collect();
    if grid.count() == all.len() {
        return all;
    }
    (0..grid.count()).map(|k| all[grid.place(k)]).collect()
}

struct DeltaKernel<'a> {
    out: &'a mut [f64],
}

impl LaneKernel<FIRST> for DeltaKernel<'_> {
    #[inline(always)]
    fn run<S: Simd>(&mut self, _: S, at: usize, d: &[Triple<Lanes<S>>; FIRST]) {
        let normal = d[1].cross(d[2]);
        store(self.out, at, normal.dot(normal));
    }
}

/// The determinant `Δ` of the first fundamental form at every sample, rows of samples padded to
/// the stride of the grid.
pub(crate) fn determinants_into(grid: &SampleGrid, x: &[f64], out: &mut [f64]) {
    let unrolled = grid.unroll(x);
    let mut scratch = Scratch::default();
    for (i, out) in out.chunks_exact_mut(grid.stride()).enumerate() {
        grid.sweep(i, &unrolled, &mut scratch, &mut DeltaKernel { out });
    }
}

struct ParallelScale<'a> {
    field: Field,
    out: &'a mut [f64],
    stride: usize,
}

impl LaneKernel<FOURTH> for ParallelScale<'_> {
    #[inline(always)]
    fn run<S: Simd>(&mut self, _: S, at: usize, d: &[Triple<Lanes<S>>; FOURTH]) {
        let jet = parallel_jet(self.field, d);
        let rows = [jet.f_u, jet.f_v, jet.psi_u, jet.psi_v];
        for (row, value) in self.out.chunks_exact_mut(self.stride).zip(rows) {
            store(row, at, value);
        }
    }
}

/// `|∇_s ψ| |∇_s f|` at every sample that counts, `ψ = |∇_s f|²`; `samples` are those of the same grid.
pub(crate) fn parallel_gradients(
    grid: &SampleGrid,
    field: Field,
    x: &[f64],
    samples: &[Sample],
) -> Vec<f64> {
    let unrolled = grid.unroll(x);
    let (stride, m_v) = (grid.stride(), grid.v.len());
    let mut scratch = Scratch::default();
    let mut out = vec![0.0; 4 * stride];
    let mut result = Vec::with_capacity(samples.len());
    for i in 0..grid.u.len() {
        grid.sweep(i, &unrolled, &mut scratch, &mut ParallelScale { field, out: &mut out, stride });
        while let Some(s) = samples.get(result.len()) {
            let place = grid.place(result.len());
            if place / m_v != i {
                break;
            }
            let j = place % m_v;
            let v = |row: usize| out[row * stride + j];
            let norm = |a: f64, b: f64| (s.g * a * a - 2.0 * s.f * a * b + s.e * b * b) / s.delta();
            result.push((norm(v(0), v(1)) * norm(v(2), v(3))).max(0.0).sqrt());
        }
    }
    result
}
