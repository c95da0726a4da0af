//! The characteristic map: the plane picture that the surface around an extraordinary vertex
//! tends to, and into which it shrinks by one ratio with every step.

use crate::chart_net::{COARSE, FINE, cell, count, cubic, inner, place};
use numerics::Matrix;
use std::f64::consts::TAU;

/// Steps until the eigenvector stands still; the next eigenvalue of its kind is at most half of its
/// own.
const STEPS: usize = 80;
/// Newton steps of the inverse.
const NEWTON_STEPS: usize = 60;
/// Distance in the chart, where the first ring has size one, that counts as none.
const SAME: f64 = 1e-12;
/// Parameters nearer to the vertex are those of the vertex.
const LEAST: f64 = 1e-4;

/// The characteristic map of a valence (Reif 1995): sector 0 begins at the first axis.
pub(crate) struct Chart {
    /// By how much a step shrinks it: the subdominant eigenvalue.
    pub(crate) ratio: f64,
    valence: usize,
    /// The eigenvector, on a net of reach [`FINE`].
    pub(crate) fine: Vec<[f64; 2]>,
}

impl Chart {
    /// Of the rows of [`refinement`](crate::chart_net::refinement).
    pub(crate) fn new(valence: usize, rows: &Matrix) -> Self {
        let direction = |k: usize| {
            let angle = TAU * k as f64 / valence as f64;
            [angle.cos(), angle.sin()]
        };
        let mut coarse = vec![[0.0; 2]; count(valence, COARSE)];
        for sector in 0..valence {
            let ([x, y], [p, q]) = (direction(sector), direction(sector + 1));
            for a in 1..=COARSE as isize {
                for b in 0..=COARSE as isize {
                    let (i, j) = (a as f64, b as f64);
                    let at = place(valence, sector, [a, b], COARSE);
                    coarse[at] = [i * x + j * p, i * y + j * q];
                }
            }
        }
        let (mut fine, mut ratio) = (Vec::new(), 0.0);
        let inner = inner(valence);
        for _ in 0..STEPS {
            fine = step(rows, &coarse);
            // Rounding must not let the constant functions in, whose eigenvalue is larger.
            let ring = (0..valence).map(|k| fine[place(valence, k, [1, 0], FINE)]);
            let mean = ring.fold([0.0; 2], |m, p| [m[0] + p[0], m[1] + p[1]]);
            let mean = mean.map(|x| x / valence as f64);
            let first = fine[place(valence, 0, [1, 0], FINE)];
            ratio = (first[0] - mean[0]).hypot(first[1] - mean[1]);
            for p in &mut fine {
                *p = [(p[0] - mean[0]) / ratio, (p[1] - mean[1]) / ratio];
            }
            coarse = inner.iter().map(|k| fine[*k]).collect();
        }
        Self { ratio, valence, fine }
    }

    /// The place of parameters of sector 0 in `[0, 1]²`, and its derivatives by both.
    pub(crate) fn point(&self, [u, v]: [f64; 2]) -> ([f64; 2], [[f64; 2]; 2]) {
        let ([x, y], halvings) = magnified([u, v]);
        let [a, b] = cell([x, y]);
        let (at_u, at_v) = (cubic(x - a as f64), cubic(y - b as f64));
        let mut sums = [[0.0; 2]; 3];
        for p in 0..4 {
            for q in 0..4 {
                let at = place(self.valence, 0, [a - 1 + p as isize, b - 1 + q as isize], FINE);
                let weights =
                    [at_u[0][p] * at_v[0][q], at_u[1][p] * at_v[0][q], at_u[0][p] * at_v[1][q]];
                for (sum, weight) in sums.iter_mut().zip(weights) {
                    *sum = [0, 1].map(|k| sum[k] + weight * self.fine[at][k]);
                }
            }
        }
        // The net is that of parameters `2^halvings` as large.
        let scale = self.ratio.powi(halvings);
        let speed = scale * 2.0_f64.powi(halvings);
        (sums[0].map(|x| x * scale), [sums[1], sums[2]].map(|d| d.map(|x| x * speed)))
    }

    /// Parameters of sector 0 whose place is `target`, searched from a guess.
    pub(crate) fn inverse(&self, target: [f64; 2], guess: [f64; 2]) -> [f64; 2] {
        let off = |at: [f64; 2]| {
            let (p, d) = self.point(at);
            ([p[0] - target[0], p[1] - target[1]], d)
        };
        let mut at = guess;
        let ([mut x, mut y], mut d) = off(at);
        for _ in 0..NEWTON_STEPS {
            if x.hypot(y) < SAME {
                break;
            }
            let determinant = d[0][0] * d[1][1] - d[0][1] * d[1][0];
            let step = [
                (x * d[1][1] - y * d[1][0]) / determinant,
                (y * d[0][0] - x * d[0][1]) / determinant,
            ];
            let mut length = 1.0;
            let (next, error, slopes) = loop {
                let next = [0, 1].map(|k| (at[k] - length * step[k]).clamp(0.0, 1.0));
                let next = if next[0].max(next[1]) < LEAST { [LEAST; 2] } else { next };
                let (error, slopes) = off(next);
                if error[0].hypot(error[1]) < x.hypot(y) || length < 1e-3 {
                    break (next, error, slopes);
                }
                length *= 0.5;
            };
            (at, [x, y], d) = (next, error, slopes);
        }
        at
    }
}

/// Parameters scaled by powers of two until the larger is in `(1, 2]`, and by how many.
pub(crate) fn magnified([mut u, mut v]: [f64; 2]) -> ([f64; 2], i32) {
    let mut halvings = 0;
    if u.max(v) < LEAST {
        (u, v) = (LEAST, LEAST);
    }
    while u.max(v) <= 1.0 {
        (u, v, halvings) = (2.0 * u, 2.0 * v, halvings + 1);
    }
    ([u, v], halvings)
}

fn step(rows: &Matrix, net: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let sum = |i: usize, axis: usize| -> f64 {
        rows.row(i).iter().zip(net).map(|(w, p)| w * p[axis]).sum()
    };
    (0..rows.rows()).map(|i| [sum(i, 0), sum(i, 1)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chart_net::refinement;
    use geom_core::assert_close;

    #[test]
    fn the_chart_is_continuous_over_its_rings_and_inverted() {
        for valence in [3, 5, 8] {
            let chart = Chart::new(valence, &refinement(valence));
            let (at, d) = chart.point([0.5, 0.3]);
            let (beyond, beyond_d) = chart.point([0.5 + 1e-9, 0.3]);
            assert_close((at[0] - beyond[0]).hypot(at[1] - beyond[1]), 0.0, 1e-8);
            assert_close(d[0][0], beyond_d[0][0], 1e-7);
            for (u, v) in [(0.9, 0.1), (0.4, 0.45), (0.05, 0.02), (0.0, 0.3)] {
                let found = chart.inverse(chart.point([u, v]).0, [0.5, 0.5]);
                assert_close((found[0] - u).hypot(found[1] - v), 0.0, 1e-8);
            }
        }
    }
}
