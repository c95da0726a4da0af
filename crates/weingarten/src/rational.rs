//! What the fixed weights of a rational surface contribute to its derivatives.
//!
//! With `A = Σ w c N`, `W = Σ w N` and `R = 1/W` the surface is `s = A R`. The weights stay fixed, so a
//! derivative of `s` is a combination of derivatives of `A` with fixed coefficients (Leibniz).

use bspline::BINOMIAL;

use crate::axis::Axis;
use crate::kernel::{FOURTH, ORDERS, order_index};

/// Weights, and derivatives of `1/W` at every sample of a grid.
#[derive(Clone, Debug)]
pub(crate) struct Rational {
    /// Weight of each control point.
    pub(crate) weights: Vec<f64>,
    reciprocals: Vec<[f64; FOURTH]>,
}

impl Rational {
    /// Tables for the samples of `u` and `v`, sample `(i, j)` at `i m_v + j`.
    pub(crate) fn new(u: &Axis, v: &Axis, weights: &[f64]) -> Self {
        let mut reciprocals = Vec::with_capacity(u.len() * v.len());
        for i in 0..u.len() {
            for j in 0..v.len() {
                let mut w = [0.0; FOURTH];
                for p in 0..u.order {
                    let row = u.wrap(u.base(i) + p) * v.control;
                    for q in 0..v.order {
                        let weight = weights[row + v.wrap(v.base(j) + q)];
                        for (o, &(a, b)) in ORDERS.iter().enumerate() {
                            w[o] += weight * u.values(i, a)[p] * v.values(j, b)[q];
                        }
                    }
                }
                reciprocals.push(reciprocal(&w));
            }
        }
        Self { weights: weights.to_vec(), reciprocals }
    }

    /// Derivatives of `A` at a sample to derivatives of `s = A R`, in place.
    pub(crate) fn divide(&self, sample: usize, vectors: &mut [[f64; 4]]) {
        let r = &self.reciprocals[sample];
        for o in (0..vectors.len()).rev() {
            let (a, b) = ORDERS[o];
            let mut sum = [0.0; 4];
            for (f, g, c) in leibniz(a, b) {
                for axis in 0..4 {
                    sum[axis] += c * r[g] * vectors[f][axis];
                }
            }
            vectors[o] = sum;
        }
    }

    /// The transpose of [`divide`](Self::divide): gradients by derivatives of `s` to gradients by
    /// those of `A`.
    pub(crate) fn transpose_divide(&self, sample: usize, gradient: &mut [[f64; 4]]) {
        let r = &self.reciprocals[sample];
        for o in 0..gradient.len() {
            let (a, b) = ORDERS[o];
            let from = std::mem::take(&mut gradient[o]);
            for (f, g, c) in leibniz(a, b) {
                for axis in 0..4 {
                    gradient[f][axis] += c * r[g] * from[axis];
                }
            }
        }
    }
}

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
