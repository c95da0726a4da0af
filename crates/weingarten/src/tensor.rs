//! Sum factorisation: derivative vectors of a row of samples from the control points, and rows of
//! a Jacobian back from gradients, one parameter direction after the other.
//!
//! Everything here is compiled for the vector unit at hand and, in the degrees that matter, with
//! the number of basis functions known. Vectors of space take four numbers, a register's worth;
//! the fourth means nothing.

use std::ops::Range;

use pulp::{Simd, WithSimd};

use crate::grid::SampleGrid;
use crate::kernel::{FOURTH, SECOND, order_index};

/// Highest number of basis functions at a parameter: that of degree 15.
const MOST: usize = 16;

/// Calls `run` with the orders of both directions known to the compiler where they are usual.
macro_rules! run_with_orders {
    ($self:ident) => {
        match ($self.grid.u.order, $self.grid.v.order) {
            (4, 4) => $self.run(4, 4),
            (5, 5) => $self.run(5, 5),
            (6, 6) => $self.run(6, 6),
            (u, v) => $self.run(u, v),
        }
    };
}

/// `sum += factor · vector`.
#[inline(always)]
fn add(sum: &mut [f64; 4], factor: f64, vector: &[f64; 4]) {
    for k in 0..4 {
        sum[k] += factor * vector[k];
    }
}

/// Derivative vectors up to total order `top` of all samples of row `i`, one padded row of samples
/// per vector and axis.
pub(crate) struct Differentiate<'a> {
    pub(crate) grid: &'a SampleGrid,
    pub(crate) i: usize,
    /// From [`SampleGrid::unroll`].
    pub(crate) unrolled: &'a [f64],
    pub(crate) top: usize,
    pub(crate) half: &'a mut Vec<f64>,
    pub(crate) derivatives: &'a mut [f64],
}

impl WithSimd for Differentiate<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        run_with_orders!(self);
    }
}

impl Differentiate<'_> {
    #[inline(always)]
    fn run(self, order_u: usize, order_v: usize) {
        let Self { grid, i, unrolled, top, half, derivatives } = self;
        let (width, stride) = (3 * grid.v.functions, grid.stride());
        // One number more, because vectors are read as four.
        half.resize((top + 1) * width + 1, 0.0);
        let base = grid.u.base(i) * width;
        for (a, half) in half.chunks_exact_mut(width).enumerate() {
            let values = &grid.u.values(i, a)[..order_u];
            for (p, (&value, row)) in
                values.iter().zip(unrolled[base..].chunks_exact(width)).enumerate()
            {
                if p == 0 {
                    for (h, c) in half.iter_mut().zip(row) {
                        *h = value * c;
                    }
                } else {
                    for (h, c) in half.iter_mut().zip(row) {
                        *h += value * c;
                    }
                }
            }
        }
        let m_v = grid.v.len();
        let mut vectors = [[0.0; 4]; FOURTH];
        for j in 0..m_v {
            let start = 3 * grid.v.base(j);
            for b in 0..=top {
                let values = &grid.v.values(j, b)[..order_v];
                for a in 0..=top - b {
                    let half = &half[a * width + start..a * width + start + 3 * order_v + 1];
                    let mut sum = [0.0; 4];
                    for (q, &value) in values.iter().enumerate() {
                        let c: &[f64; 4] = half[3 * q..].first_chunk().expect("one number more");
                        add(&mut sum, value, c);
                    }
                    vectors[order_index(a, b)] = sum;
                }
            }
            let vectors = &mut vectors[..(top + 1) * (top + 2) / 2];
            if let Some(rational) = &grid.rational {
                rational.divide(i * m_v + j, vectors);
            }
            for (rows, vector) in derivatives.chunks_exact_mut(3 * stride).zip(vectors) {
                for axis in 0..3 {
                    rows[axis * stride + j] = vector[axis];
                }
            }
        }
        // Lanes beyond the last sample repeat it, so that nothing singular appears there.
        for row in derivatives.chunks_exact_mut(stride) {
            let last = row[m_v - 1];
            row[m_v..].fill(last);
        }
    }
}

/// The Jacobian rows of all samples of row `i`; see [`SampleGrid::expand_row`].
pub(crate) struct ExpandRow<'a> {
    pub(crate) grid: &'a SampleGrid,
    pub(crate) i: usize,
    pub(crate) run: &'a Range<usize>,
    pub(crate) top: usize,
    pub(crate) gradient: &'a [f64],
    pub(crate) out: &'a mut [f64],
}

impl WithSimd for ExpandRow<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        run_with_orders!(self);
    }
}

impl ExpandRow<'_> {
    #[inline(always)]
    fn run(self, order_u: usize, order_v: usize) {
        let Self { grid, i, run, top, gradient, out } = self;
        let (stride, columns) = (grid.stride(), 3 * order_u * order_v);
        let mut vectors = [[0.0; 4]; FOURTH];
        let vectors = &mut vectors[..(top + 1) * (top + 2) / 2];
        let half = &mut [[[0.0; 4]; MOST]; 5];
        // Elements of this knot span row follow one another, each with rows i-major.
        let mut first = 0;
        for run_v in &grid.v.runs {
            let row = first + (i - run.start) * run_v.len();
            let rows = out[row * columns..].chunks_exact_mut(columns);
            for (j, row) in run_v.clone().zip(rows) {
                for (vector, rows) in vectors.iter_mut().zip(gradient.chunks_exact(3 * stride)) {
                    *vector = [rows[j], rows[stride + j], rows[2 * stride + j], 0.0];
                }
                expand(grid, i, j, [order_u, order_v], top, vectors, half, row);
            }
            first += run.len() * run_v.len();
        }
    }
}

/// The Jacobian row of one sample; see [`SampleGrid::expand`].
pub(crate) struct ExpandSample<'a> {
    pub(crate) grid: &'a SampleGrid,
    pub(crate) i: usize,
    pub(crate) j: usize,
    pub(crate) vectors: &'a mut [[f64; 4]; SECOND],
    pub(crate) row: &'a mut [f64],
}

impl WithSimd for ExpandSample<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        run_with_orders!(self);
    }
}

impl ExpandSample<'_> {
    #[inline(always)]
    fn run(self, order_u: usize, order_v: usize) {
        let Self { grid, i, j, vectors, row } = self;
        let half = &mut [[[0.0; 4]; MOST]; 5];
        expand(grid, i, j, [order_u, order_v], 2, vectors, half, row);
    }
}

/// First over v: `half[a][q] = Σ_b N_q^(b)(v) g_ab`, then over u: entry `(p, q)` of the row is
/// `Σ_a N_p^(a)(u) half[a][q]`.
#[inline(always)]
fn expand(
    grid: &SampleGrid,
    i: usize,
    j: usize,
    [order_u, order_v]: [usize; 2],
    top: usize,
    vectors: &mut [[f64; 4]],
    half: &mut [[[f64; 4]; MOST]; 5],
    row: &mut [f64],
) {
    if let Some(rational) = &grid.rational {
        rational.transpose_divide(i * grid.v.len() + j, vectors);
    }
    for a in 0..=top {
        for q in 0..order_v {
            let mut sum = [0.0; 4];
            for b in 0..=top - a {
                add(&mut sum, grid.v.values(j, b)[q], &vectors[order_index(a, b)]);
            }
            half[a][q] = sum;
        }
    }
    for (p, slots) in row.chunks_exact_mut(3 * order_v).enumerate() {
        for q in 0..order_v {
            let mut sum = [0.0; 4];
            for a in 0..=top {
                add(&mut sum, grid.u.values(i, a)[p], &half[a][q]);
            }
            slots[3 * q..3 * q + 3].copy_from_slice(&sum[..3]);
        }
    }
    if let Some(rational) = &grid.rational {
        for p in 0..order_u {
            let k = grid.u.wrap(grid.u.base(i) + p) * grid.v.control;
            for q in 0..order_v {
                let weight = rational.weights[k + grid.v.wrap(grid.v.base(j) + q)];
                let first = 3 * (p * order_v + q);
                row[first..first + 3].iter_mut().for_each(|x| *x *= weight);
            }
        }
    }
}
