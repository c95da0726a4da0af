//! A grid of samples on a surface: derivatives by sum factorisation, and rows of a Jacobian back
//! from gradients at the samples.
//!
//! The unknowns are the coordinates of the control points, `3 (i n_v + j) + axis`. Weights of a
//! rational surface stay fixed, so derivatives are linear in the unknowns there too: with
//! `A = Σ w c N` and `R = 1/W`, a derivative of `s = A R` is a combination of derivatives of `A`
//! with fixed coefficients.

use std::borrow::Cow;

use bspline::BsplineSurface;
use gp_solver::Elements;
use pulp::{Simd, WithSimd};

use crate::axis::Axis;
use crate::kernel::{FOURTH, ORDERS, order_index};
use crate::real::{Lanes, Triple};

/// Rows of samples are padded to this many, a multiple of every register's lanes.
const PAD: usize = 8;

/// Samples of a tensor-product surface with fixed knots and weights.
#[derive(Clone, Debug)]
pub(crate) struct SampleGrid {
    pub(crate) u: Axis,
    pub(crate) v: Axis,
    rational: Option<Rational>,
}

/// What the fixed weights contribute.
#[derive(Clone, Debug)]
struct Rational {
    weights: Vec<f64>,
    /// Derivatives of `1/W` at every sample.
    reciprocals: Vec<[f64; FOURTH]>,
}

/// Buffers of one worker.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    half: Vec<f64>,
    derivatives: Vec<f64>,
    pub(crate) gradient: Vec<f64>,
    pub(crate) residual: Vec<f64>,
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
            let load = |row: usize| {
                let start = row * self.stride + at;
                let value = simd.partial_load_f64s(&self.derivatives[start..start + lanes]);
                Lanes::new(simd, value)
            };
            let d: [Triple<Lanes<S>>; N] = std::array::from_fn(|o| Triple {
                x: load(3 * o),
                y: load(3 * o + 1),
                z: load(3 * o + 2),
            });
            self.kernel.run(simd, at, &d);
        }
    }
}

/// Writes a register of samples to `row`, starting at sample `at`.
#[inline(always)]
pub(crate) fn store<S: Simd>(simd: S, row: &mut [f64], at: usize, value: Lanes<S>) {
    simd.partial_store_f64s(&mut row[at..at + S::F64_LANES], value.value);
}

/// Reads a register of samples from `row`.
#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, row: &[f64], at: usize) -> Lanes<S> {
    Lanes::new(simd, simd.partial_load_f64s(&row[at..at + S::F64_LANES]))
}

impl SampleGrid {
    /// A grid at the given parameters of `surface`, which must rise and lie in its domain.
    pub(crate) fn new(surface: &BsplineSurface, u: Vec<f64>, v: Vec<f64>) -> Self {
        let (u, v) = (Axis::new(surface.knots_u(), u), Axis::new(surface.knots_v(), v));
        let mut grid = Self { u, v, rational: None };
        if let Some(weights) = surface.weights() {
            grid.rational = Some(Rational {
                weights: weights.to_vec(),
                reciprocals: grid.reciprocals(weights),
            });
        }
        grid
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

    /// Derivative vectors of all samples of row `i` into `scratch`, up to the total order of `n`
    /// vectors; `unrolled` comes from [`SampleGrid::unroll`].
    fn differentiate(&self, i: usize, unrolled: &[f64], n: usize, scratch: &mut Scratch) {
        let (width, stride) = (3 * self.v.functions, self.stride());
        let top = ORDERS[n - 1].0 + ORDERS[n - 1].1;
        scratch.half.resize((top + 1) * width, 0.0);
        scratch.derivatives.resize(3 * n * stride, 0.0);
        let base = self.u.base(i) * width;
        for a in 0..=top {
            let half = &mut scratch.half[a * width..(a + 1) * width];
            half.fill(0.0);
            for (p, &value) in self.u.values(i, a).iter().enumerate() {
                let row = &unrolled[base + p * width..base + (p + 1) * width];
                for (h, c) in half.iter_mut().zip(row) {
                    *h += value * c;
                }
            }
        }
        let mut vectors = [[0.0; 3]; FOURTH];
        for j in 0..stride {
            let s = j.min(self.v.len() - 1);
            if s == j {
                let start = 3 * self.v.base(s);
                for (vector, &(a, b)) in vectors.iter_mut().zip(&ORDERS[..n]) {
                    let half = &scratch.half[a * width + start..];
                    let mut sum = [0.0; 3];
                    for (value, c) in self.v.values(s, b).iter().zip(half.chunks_exact(3)) {
                        for axis in 0..3 {
                            sum[axis] += value * c[axis];
                        }
                    }
                    *vector = sum;
                }
                if let Some(r) = &self.rational {
                    divide(&r.reciprocals[i * self.v.len() + s], &mut vectors[..n]);
                }
            }
            for (o, vector) in vectors[..n].iter().enumerate() {
                for axis in 0..3 {
                    scratch.derivatives[(3 * o + axis) * stride + j] = vector[axis];
                }
            }
        }
    }

    /// Runs `kernel` over the samples of row `i`.
    pub(crate) fn sweep<const N: usize, K: LaneKernel<N>>(
        &self,
        i: usize,
        unrolled: &[f64],
        scratch: &mut Scratch,
        kernel: &mut K,
    ) {
        self.differentiate(i, unrolled, N, scratch);
        let (derivatives, stride) = (scratch.derivatives.as_slice(), self.stride());
        pulp::Arch::new().dispatch(Sweep { derivatives, stride, kernel });
    }

    /// The Jacobian row of sample `(i, j)`: `gradient` holds, for each of `n` derivative vectors
    /// and each axis, a padded row of samples.
    pub(crate) fn expand(&self, i: usize, j: usize, n: usize, gradient: &[f64], row: &mut [f64]) {
        let stride = self.stride();
        let mut g = [[0.0; 3]; FOURTH];
        for (o, vector) in g[..n].iter_mut().enumerate() {
            *vector = std::array::from_fn(|axis| gradient[(3 * o + axis) * stride + j]);
        }
        self.expand_vectors(i, j, &mut g[..n], row);
    }

    /// As [`SampleGrid::expand`] from the gradient by each derivative vector; uses `g` up.
    pub(crate) fn expand_vectors(&self, i: usize, j: usize, g: &mut [[f64; 3]], row: &mut [f64]) {
        let n = g.len();
        if let Some(r) = &self.rational {
            transpose_divide(&r.reciprocals[i * self.v.len() + j], g);
        }
        let top = ORDERS[n - 1].0 + ORDERS[n - 1].1;
        let width = 3 * self.v.order;
        // First over v, then over u: `half[a]` collects all orders with `a` derivatives by u.
        let mut half = [[0.0; 3 * 16]; 5];
        for (vector, &(a, b)) in g.iter().zip(&ORDERS[..n]) {
            let slots = half[a].chunks_exact_mut(3);
            for (value, slot) in self.v.values(j, b).iter().zip(slots) {
                for axis in 0..3 {
                    slot[axis] += value * vector[axis];
                }
            }
        }
        for (p, slots) in row.chunks_exact_mut(width).enumerate() {
            slots.fill(0.0);
            for (a, half) in half[..=top].iter().enumerate() {
                let value = self.u.values(i, a)[p];
                for (slot, h) in slots.iter_mut().zip(half) {
                    *slot += value * h;
                }
            }
        }
        if let Some(r) = &self.rational {
            for p in 0..self.u.order {
                let k = self.u.wrap(self.u.base(i) + p) * self.v.control;
                for q in 0..self.v.order {
                    let weight = r.weights[k + self.v.wrap(self.v.base(j) + q)];
                    let first = 3 * (p * self.v.order + q);
                    row[first..first + 3].iter_mut().for_each(|x| *x *= weight);
                }
            }
        }
    }

    /// Derivatives of the reciprocal weight function at every sample.
    fn reciprocals(&self, weights: &[f64]) -> Vec<[f64; FOURTH]> {
        let mut result = Vec::with_capacity(self.len());
        for i in 0..self.u.len() {
            for j in 0..self.v.len() {
                let mut w = [0.0; FOURTH];
                for p in 0..self.u.order {
                    let row = self.u.wrap(self.u.base(i) + p) * self.v.control;
                    for q in 0..self.v.order {
                        let weight = weights[row + self.v.wrap(self.v.base(j) + q)];
                        for (o, &(a, b)) in ORDERS.iter().enumerate() {
                            w[o] += weight * self.u.values(i, a)[p] * self.v.values(j, b)[q];
                        }
                    }
                }
                result.push(reciprocal(&w));
            }
        }
        result
    }
}

const BINOMIAL: [[f64; 5]; 5] = [
    [1.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0],
    [1.0, 2.0, 1.0, 0.0, 0.0],
    [1.0, 3.0, 3.0, 1.0, 0.0],
    [1.0, 4.0, 6.0, 4.0, 1.0],
];

/// The terms of `(f g)^(a,b)`: index in `f`, index in `g`, coefficient (Leibniz).
fn leibniz(a: usize, b: usize) -> impl Iterator<Item = (usize, usize, f64)> {
    (0..=a).flat_map(move |k| {
        (0..=b).map(move |l| {
            (order_index(a - k, b - l), order_index(k, l), BINOMIAL[a][k] * BINOMIAL[b][l])
        })
    })
}

/// Derivatives of `1/W` from those of `W`: `(R W)^(a,b) = 0` beyond order zero.
fn reciprocal(w: &[f64; FOURTH]) -> [f64; FOURTH] {
    let mut r = [0.0; FOURTH];
    r[0] = 1.0 / w[0];
    for (o, &(a, b)) in ORDERS.iter().enumerate().skip(1) {
        // The term of `R^(a,b) W` is the one sought; its slot in `r` is still zero.
        let sum: f64 = leibniz(a, b).map(|(f, g, c)| c * w[f] * r[g]).sum();
        r[o] = -sum * r[0];
    }
    r
}

/// Derivatives of `A` to derivatives of `s = A R`, in place.
fn divide(r: &[f64; FOURTH], vectors: &mut [[f64; 3]]) {
    for o in (0..vectors.len()).rev() {
        let (a, b) = ORDERS[o];
        let mut sum = [0.0; 3];
        for (f, g, c) in leibniz(a, b) {
            for axis in 0..3 {
                sum[axis] += c * r[g] * vectors[f][axis];
            }
        }
        vectors[o] = sum;
    }
}

/// The transpose of [`divide`]: gradients by derivatives of `s` to gradients by those of `A`.
fn transpose_divide(r: &[f64; FOURTH], gradient: &mut [[f64; 3]]) {
    for o in 0..gradient.len() {
        let (a, b) = ORDERS[o];
        let from = std::mem::take(&mut gradient[o]);
        for (f, g, c) in leibniz(a, b) {
            for axis in 0..3 {
                gradient[f][axis] += c * r[g] * from[axis];
            }
        }
    }
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
