//! A grid of samples on a surface: derivatives at the samples, and rows of a Jacobian back from
//! gradients there.
//!
//! The unknowns are the coordinates of the control points, `3 (i n_v + j) + axis`. Weights of a
//! rational surface stay fixed, so derivatives are linear in the unknowns there too.

use std::borrow::Cow;
use std::ops::Range;

use bspline::BsplineSurface;
use gp_solver::Elements;
use pulp::{Simd, WithSimd};

use crate::axis::Axis;
use crate::kernel::{ORDERS, SECOND};
use crate::rational::Rational;
use crate::real::{Lanes, Triple};
use crate::tensor::{Differentiate, ExpandRow, ExpandSample};

/// Rows of samples are padded to this many, a multiple of every register's lanes.
const PAD: usize = 8;

/// Samples of a tensor-product surface with fixed knots and weights.
#[derive(Clone, Debug)]
pub(crate) struct SampleGrid {
    pub(crate) u: Axis,
    pub(crate) v: Axis,
    pub(crate) rational: Option<Rational>,
}

/// Buffers of one worker.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    half: Vec<f64>,
    derivatives: Vec<f64>,
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
            let zero = Lanes::new(simd, simd.splat_f64s(0.0));
            let mut d = [Triple { x: zero, y: zero, z: zero }; N];
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
    /// A grid at the given parameters of `surface`, which must rise and lie in its domain.
    pub(crate) fn new(surface: &BsplineSurface, u: Vec<f64>, v: Vec<f64>) -> Self {
        let (u, v) = (Axis::new(surface.knots_u(), u), Axis::new(surface.knots_v(), v));
        let rational = surface.weights().map(|weights| Rational::new(&u, &v, weights));
        Self { u, v, rational }
    }

    /// `m_u × m_v` samples at equal parameter distances, ends included, a period's end excluded.
    pub(crate) fn uniform(surface: &BsplineSurface, m: [usize; 2]) -> Self {
        let u = surface.knots_u().uniform_parameters(m[0]);
        let v = surface.knots_v().uniform_parameters(m[1]);
        Self::new(surface, u, v)
    }

    /// The middles of `m_u × m_v` equal cells.
    pub(crate) fn midpoints(surface: &BsplineSurface, m: [usize; 2]) -> Self {
        let u = surface.knots_u().cell_midpoints(m[0]);
        let v = surface.knots_v().cell_midpoints(m[1]);
        Self::new(surface, u, v)
    }

    /// Number of samples.
    pub(crate) fn len(&self) -> usize {
        self.u.len() * self.v.len()
    }

    /// Number of unknowns.
    pub(crate) fn unknowns(&self) -> usize {
        3 * self.u.control * self.v.control
    }

    /// Length of a padded row of samples.
    pub(crate) fn stride(&self) -> usize {
        self.v.len().next_multiple_of(PAD)
    }

    /// The parameter pair of a sample.
    pub(crate) fn parameters(&self, sample: usize) -> [f64; 2] {
        let (i, j) = (sample / self.v.len(), sample % self.v.len());
        [self.u.parameters[i], self.v.parameters[j]]
    }

    /// One element per pair of knot spans that hold samples, one row per sample.
    pub(crate) fn elements(&self) -> Elements {
        let mut elements = Elements::new();
        let mut columns = Vec::new();
        for run_u in &self.u.runs {
            for run_v in &self.v.runs {
                columns.clear();
                for p in 0..self.u.order {
                    let i = self.u.wrap(self.u.base(run_u.start) + p);
                    for q in 0..self.v.order {
                        let j = self.v.wrap(self.v.base(run_v.start) + q);
                        let first = 3 * (i * self.v.control + j);
                        columns.extend(first..first + 3);
                    }
                }
                elements.push(&columns, run_u.len() * run_v.len());
            }
        }
        elements
    }

    /// Control coordinates times weights, with periodic directions unrolled.
    pub(crate) fn unroll<'x>(&self, x: &'x [f64]) -> Cow<'x, [f64]> {
        let wrapped = self.u.functions != self.u.control || self.v.functions != self.v.control;
        if !wrapped && self.rational.is_none() {
            return Cow::Borrowed(x);
        }
        let mut unrolled = Vec::with_capacity(3 * self.u.functions * self.v.functions);
        for i in 0..self.u.functions {
            for j in 0..self.v.functions {
                let k = self.u.wrap(i) * self.v.control + self.v.wrap(j);
                let weight = self.rational.as_ref().map_or(1.0, |r| r.weights[k]);
                unrolled.extend((0..3).map(|axis| weight * x[3 * k + axis]));
            }
        }
        Cow::Owned(unrolled)
    }

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

/// Splits per-run slices of a residual and a Jacobian off, so that runs fill them in parallel.
pub(crate) fn split_runs(
    sizes: impl Iterator<Item = usize>,
    mut slice: &mut [f64],
) -> Vec<&mut [f64]> {
    sizes
        .map(|size| {
            let (head, tail) = std::mem::take(&mut slice).split_at_mut(size);
            slice = tail;
            head
        })
        .collect()
}
