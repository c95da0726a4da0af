//! Kernels swept over a grid of samples: derivatives at the samples in, and rows of a Jacobian back
//! from gradients there.

use std::ops::Range;

use numerics::{Lanes, Triple};
use pulp::{Simd, WithSimd};

use crate::grid::SampleGrid;
use crate::kernel::{ORDERS, SECOND};
use crate::tensor::{Differentiate, ExpandRow, ExpandSample};

/// Buffers of one worker.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    half: Vec<f64>,
    derivatives: Vec<f64>,
    /// For what a kernel hands on, lent out while a sweep runs.
    pub(crate) spare: Vec<f64>,
}

/// What is done with the derivative vectors of a register full of samples.
pub(crate) trait LaneKernel<const N: usize> {
    /// `at` is the first sample of the register.
    fn run<S: Simd>(&mut self, simd: S, at: usize, d: &[Triple<Lanes<S>>; N]);
}

struct Sweep<'a, const N: usize, K> {
    derivatives: &'a [f64],
    stride: usize,
    kernel: &'a mut K,
}

impl<const N: usize, K: LaneKernel<N>> WithSimd for Sweep<'_, N, K> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let lanes = S::F64_LANES;
        for at in (0..self.stride).step_by(lanes) {
            let mut d = [Triple::splat(Lanes::splat(simd, 0.0)); N];
            for (vector, rows) in d.iter_mut().zip(self.derivatives.chunks_exact(3 * self.stride)) {
                vector.x = load(simd, &rows[..self.stride], at);
                vector.y = load(simd, &rows[self.stride..2 * self.stride], at);
                vector.z = load(simd, &rows[2 * self.stride..], at);
            }
            self.kernel.run(simd, at, &d);
        }
    }
}

/// Writes a register of samples to `row`, starting at sample `at`.
#[inline(always)]
pub(crate) fn store<S: Simd>(row: &mut [f64], at: usize, value: Lanes<S>) {
    S::as_mut_simd_f64s(&mut row[at..at + S::F64_LANES]).0[0] = value.value;
}

/// Reads a register of samples from `row`.
#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, row: &[f64], at: usize) -> Lanes<S> {
    Lanes::new(simd, S::as_simd_f64s(&row[at..at + S::F64_LANES]).0[0])
}

impl SampleGrid {
    /// Runs `kernel` over the samples of row `i`.
    pub(crate) fn sweep<const N: usize, K: LaneKernel<N>>(
        &self,
        i: usize,
        unrolled: &[f64],
        scratch: &mut Scratch,
        kernel: &mut K,
    ) {
        let stride = self.stride();
        scratch.derivatives.resize(3 * N * stride, 0.0);
        let arch = pulp::Arch::new();
        arch.dispatch(Differentiate {
            grid: self,
            i,
            unrolled,
            top: top_order(N),
            half: &mut scratch.half,
            derivatives: &mut scratch.derivatives,
        });
        arch.dispatch(Sweep { derivatives: &scratch.derivatives, stride, kernel });
    }

    /// The Jacobian rows of the samples `(i, …)`, where `i` lies in the run `run` of knot span
    /// rows: `gradient` holds, for each of `n` derivative vectors and each axis, a padded row of
    /// samples, and `out` the rows of the whole run in the order of [`SampleGrid::elements`].
    pub(crate) fn expand_row(
        &self,
        i: usize,
        run: &Range<usize>,
        n: usize,
        gradient: &[f64],
        out: &mut [f64],
    ) {
        let top = top_order(n);
        pulp::Arch::new().dispatch(ExpandRow { grid: self, i, run, top, gradient, out });
    }

    /// The Jacobian row of sample `(i, j)` from the gradient by each derivative vector up to
    /// second order; uses `vectors` up.
    pub(crate) fn expand(
        &self,
        i: usize,
        j: usize,
        vectors: &mut [[f64; 4]; SECOND],
        row: &mut [f64],
    ) {
        pulp::Arch::new().dispatch(ExpandSample { grid: self, i, j, vectors, row });
    }
}

/// The highest total order among the first `n` derivative vectors.
fn top_order(n: usize) -> usize {
    let (a, b) = ORDERS[n - 1];
    a + b
}
