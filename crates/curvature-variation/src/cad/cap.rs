//! Polynomial caps for the middle of an extraordinary vertex.
//!
//! A cap has one patch of bidegree six in each sector. Its outer edges and the derivatives across
//! them are those of the ring of bi-cubic patches around it. Two neighbours `p` and `q` join along
//! their common edge by
//!
//! `p_v(u, 0) + q_u(0, u) = 2 cos(2π/n) (1 − u)² p_u(u, 0)`
//!
//! with an edge of degree five, so that tangent planes agree to the last digit wherever the control
//! points are; the factor is that of a regular polygon of tangents at the vertex and vanishes twice
//! at the ring, where neighbours join smoothly. What freedom is left brings the cap near to the
//! subdivision surface by least squares, at places that correspond in the characteristic map: all
//! of it is linear in the control points and is computed once for a valence.

use crate::chart::{Chart, magnified};
use crate::chart_net::{COARSE, FINE, cell, count, cubic, inner, place, refinement, turned};
use geom_core::DVec3;
use numerics::{Cholesky, Matrix};

/// Degree of the caps in both directions.
pub(super) const DEGREE: usize = 6;
/// Control points in one direction.
pub(super) const SIDE: usize = DEGREE + 1;
/// Places in one direction of a sector at which the cap is to be near to the surface.
const PLACES: usize = 8;
/// Places in one direction at which its distance is taken.
const CHECKS: usize = 11;
/// Entries smaller than this share of the largest are rounding.
const ROUNDING: f64 = 1e-9;
/// Equations that follow from others leave no more than this, where the net has size one.
const CONSISTENT: f64 = 1e-6;
/// Binomial coefficients.
const BINOMIAL: [[f64; 7]; 7] = [
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 2.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [1.0, 3.0, 3.0, 1.0, 0.0, 0.0, 0.0],
    [1.0, 4.0, 6.0, 4.0, 1.0, 0.0, 0.0],
    [1.0, 5.0, 10.0, 10.0, 5.0, 1.0, 0.0],
    [1.0, 6.0, 15.0, 20.0, 15.0, 6.0, 1.0],
];

/// The caps of a valence.
pub(super) struct CapRule {
    valence: usize,
    /// One step of subdivision.
    pub(super) rows: Matrix,
    inner: Vec<usize>,
    /// Control points of the patches of all sectors from a net of reach [`COARSE`] one level
    /// coarser than the ring around the cap.
    points: Matrix,
    checks: Vec<Check>,
}

/// A place of a cap and the place of the surface that corresponds to it.
struct Check {
    /// Parameters of the patch of a sector.
    at: [f64; 2],
    /// Weights of the point of the surface in sector 0, on a net of the level of the cap.
    weights: Vec<f64>,
}

impl CapRule {
    /// `None` if the equations of the valence are singular to rounding.
    pub(super) fn new(valence: usize) -> Option<Self> {
        let rows = refinement(valence);
        let inner = inner(valence);
        let chart = Chart::new(valence, &rows);
        let step = picked(&rows, &inner);
        // Columns: the control points of the coarser net, then both coordinates of the chart.
        let n = count(valence, COARSE);
        let mut data = Matrix::zeros(rows.rows(), n + 2);
        for i in 0..rows.rows() {
            data.row_mut(i)[..n].copy_from_slice(rows.row(i));
            data.row_mut(i)[n..].copy_from_slice(&chart.fine[i]);
        }
        let system = Joints::new(valence, &data).solve()?;
        let middles = |count: usize| -> Vec<[f64; 2]> {
            let t = |k: usize| (k as f64 + 0.5) / count as f64;
            (0..count * count).map(|k| [t(k / count), t(k % count)]).collect()
        };
        let places = middles(PLACES);
        let fit = Fit::new(&system, valence, &places)?;
        // The chart of the cap: near to that of the surface at the same parameters.
        let mut targets = Matrix::zeros(valence * places.len(), 2);
        for sector in 0..valence {
            let turn = std::f64::consts::TAU * sector as f64 / valence as f64;
            for (k, at) in places.iter().enumerate() {
                let [x, y] = chart.point(*at).0;
                let row = targets.row_mut(sector * places.len() + k);
                row[0] = turn.cos() * x - turn.sin() * y;
                row[1] = turn.sin() * x + turn.cos() * y;
            }
        }
        let plane = fit.solve(&system, n, &targets);
        let weights = |at: [f64; 2]| {
            let basis = bernstein_grid(at);
            let sum = |axis: usize| (0..basis.len()).map(|k| basis[k] * plane[(k, axis)]).sum();
            limit_weights(valence, &rows, &inner, chart.inverse([sum(0), sum(1)], at))
        };
        // Every basis function, near to the surface at the places the chart of the cap leads to.
        let mut targets = Matrix::zeros(valence * places.len(), n);
        for (k, at) in places.iter().enumerate() {
            let row = weights(*at);
            for sector in 0..valence {
                // The net seen from a sector is turned against its weights.
                let turned = turned_back(&row, valence, sector);
                let coarser = step.apply_transpose(&turned);
                targets.row_mut(sector * places.len() + k).copy_from_slice(&coarser);
            }
        }
        let points = fit.solve(&system, 0, &targets);
        let check = |at: [f64; 2]| Check { at, weights: weights(at) };
        let checks = middles(CHECKS).into_iter().map(check).collect();
        Some(Self { valence, rows, inner, points, checks })
    }

    /// The net of reach [`COARSE`] one step finer.
    pub(super) fn finer(&self, net: &[DVec3]) -> Vec<DVec3> {
        let apply =
            |i: &usize| -> DVec3 { self.rows.row(*i).iter().zip(net).map(|(w, p)| *w * *p).sum() };
        self.inner.iter().map(apply).collect()
    }

    /// The patches of the cap inside the ring that one step of subdivision of `net` gives.
    pub(super) fn patches(&self, net: &[DVec3]) -> Vec<[DVec3; SIDE * SIDE]> {
        let at =
            |i: usize| -> DVec3 { self.points.row(i).iter().zip(net).map(|(w, p)| *w * *p).sum() };
        let size = SIDE * SIDE;
        let mut patches: Vec<[DVec3; SIDE * SIDE]> = (0..self.valence)
            .map(|sector| std::array::from_fn(|k| at(sector * size + k)))
            .collect();
        // The same edges to the last bit.
        for sector in 0..self.valence {
            let next = (sector + 1) % self.valence;
            let edge: [DVec3; SIDE] = std::array::from_fn(|k| patches[next][k * SIDE]);
            patches[sector][..SIDE].copy_from_slice(&edge);
            patches[sector][0] = patches[0][0];
        }
        patches
    }

    /// Largest distance of the caps over `net` from the tangent planes of the surface at the places
    /// that correspond.
    pub(super) fn distance(&self, net: &[DVec3], patches: &[[DVec3; SIDE * SIDE]]) -> f64 {
        let finer = self.finer(net);
        let mut worst = 0.0_f64;
        for (sector, patch) in patches.iter().enumerate() {
            let seen = turned(&finer, self.valence, sector);
            for Check { at, weights } in &self.checks {
                let wanted: DVec3 = weights.iter().zip(&seen).map(|(w, p)| *w * *p).sum();
                let [point, by_u, by_v] = evaluate(patch, *at);
                let normal = by_u.cross(by_v).normalize_or_zero();
                worst = worst.max((point - wanted).dot(normal).abs());
            }
        }
        worst
    }
}

/// Point and derivatives of a patch.
fn evaluate(patch: &[DVec3; SIDE * SIDE], [u, v]: [f64; 2]) -> [DVec3; 3] {
    let (bu, bv) = (bernstein(DEGREE, u), bernstein(DEGREE, v));
    let slope = |t: f64| -> [f64; SIDE] {
        let low = bernstein(DEGREE - 1, t);
        let at = |k: usize| low.get(k).copied().unwrap_or(0.0);
        std::array::from_fn(|k| DEGREE as f64 * (if k > 0 { at(k - 1) } else { 0.0 } - at(k)))
    };
    let sum = |a: &[f64], b: &[f64]| -> DVec3 {
        (0..SIDE * SIDE).map(|k| a[k / SIDE] * b[k % SIDE] * patch[k]).sum()
    };
    [sum(&bu, &bv), sum(&slope(u), &bv), sum(&bu, &slope(v))]
}

fn bernstein(degree: usize, t: f64) -> Vec<f64> {
    let power = |k: usize| t.powi(k as i32) * (1.0 - t).powi((degree - k) as i32);
    (0..=degree).map(|k| BINOMIAL[degree][k] * power(k)).collect()
}

fn bernstein_grid([u, v]: [f64; 2]) -> Vec<f64> {
    let (bu, bv) = (bernstein(DEGREE, u), bernstein(DEGREE, v));
    bu.iter().flat_map(|a| bv.iter().map(move |b| a * b)).collect()
}

/// Some rows of a matrix.
fn picked(rows: &Matrix, which: &[usize]) -> Matrix {
    let mut out = Matrix::zeros(which.len(), rows.cols());
    for (k, i) in which.iter().enumerate() {
        out.row_mut(k).copy_from_slice(rows.row(*i));
    }
    out
}

/// Weights on the net as it stands, from those on the net seen from a sector.
fn turned_back(weights: &[f64], valence: usize, sector: usize) -> Vec<f64> {
    turned(weights, valence, (valence - sector) % valence)
}

/// Weights of the point of the subdivision surface at parameters of sector 0 on a net of reach
/// [`COARSE`].
fn limit_weights(valence: usize, rows: &Matrix, inner: &[usize], at: [f64; 2]) -> Vec<f64> {
    let ([x, y], halvings) = magnified(at);
    let [a, b] = cell([x, y]);
    let (at_u, at_v) = (cubic(x - a as f64)[0], cubic(y - b as f64)[0]);
    let mut weights = vec![0.0; rows.rows()];
    for p in 0..4 {
        for q in 0..4 {
            let corner = [a - 1 + p as isize, b - 1 + q as isize];
            weights[place(valence, 0, corner, FINE)] += at_u[p] * at_v[q];
        }
    }
    let mut weights = rows.apply_transpose(&weights);
    for _ in 1..halvings {
        let mut fine = vec![0.0; rows.rows()];
        inner.iter().zip(&weights).for_each(|(k, w)| fine[*k] = *w);
        weights = rows.apply_transpose(&fine);
    }
    weights
}

/// The equations that a cap keeps, and the data on their right-hand sides.
struct Joints<'d> {
    valence: usize,
    /// Columns of data for the points of the net of reach [`FINE`] at the level of the cap.
    data: &'d Matrix,
    left: Vec<Vec<f64>>,
    right: Vec<Vec<f64>>,
}

/// The unknown of control point `(a, b)` of a sector.
fn unknown(sector: usize, a: usize, b: usize) -> usize {
    (sector * SIDE + a) * SIDE + b
}

impl<'d> Joints<'d> {
    fn new(valence: usize, data: &'d Matrix) -> Self {
        let mut made = Self { valence, data, left: Vec::new(), right: Vec::new() };
        for sector in 0..valence {
            made.add_ring(sector);
            made.add_joint(sector);
        }
        made.add_middle();
        made
    }

    fn push(&mut self, terms: &[(usize, f64)], points: &[(usize, f64)]) {
        let mut left = vec![0.0; self.valence * SIDE * SIDE];
        terms.iter().for_each(|(k, w)| left[*k] += w);
        let mut right = vec![0.0; self.data.cols()];
        for (point, weight) in points {
            right.iter_mut().zip(self.data.row(*point)).for_each(|(r, d)| *r += weight * d);
        }
        self.left.push(left);
        self.right.push(right);
    }

    /// Position and cross derivative along both outer sides of a sector are those of the ring.
    fn add_ring(&mut self, sector: usize) {
        // Bezier points of a span of a uniform cubic spline: the first, and thrice the step to the
        // second, which is the derivative; and its points raised to the degree of the cap.
        let first = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0, 0.0];
        let slope = [-0.5, 0.0, 0.5, 0.0];
        let along = raised_span();
        for swapped in [false, true] {
            for k in 0..SIDE {
                let points = |across: &[f64; 4]| {
                    let mut points = Vec::with_capacity(16);
                    for p in 0..4 {
                        for q in 0..4 {
                            let (i, j) = (p as isize, q as isize - 1);
                            let at = if swapped { [j, i] } else { [i, j] };
                            let at = place(self.valence, sector, at, FINE);
                            points.push((at, across[p] * along[k][q]));
                        }
                    }
                    points
                };
                let (value, derivative) = (points(&first), points(&slope));
                let at = |from_end: usize| {
                    let (a, b) = (DEGREE - from_end, k);
                    if swapped { unknown(sector, b, a) } else { unknown(sector, a, b) }
                };
                let d = DEGREE as f64;
                self.push(&[(at(0), 1.0)], &value);
                self.push(&[(at(0), d), (at(1), -d)], &derivative);
            }
        }
    }

    /// The edge that a sector shares with the one before it.
    fn add_joint(&mut self, sector: usize) {
        let before = (sector + self.valence - 1) % self.valence;
        for k in 0..SIDE {
            self.push(&[(unknown(sector, k, 0), 1.0), (unknown(before, 0, k), -1.0)], &[]);
        }
        // Of one degree less: the last difference vanishes.
        let sign = |k: usize| if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let differences: Vec<(usize, f64)> =
            (0..SIDE).map(|k| (unknown(sector, k, 0), sign(k) * BINOMIAL[DEGREE][k])).collect();
        self.push(&differences, &[]);
        let cosine = (std::f64::consts::TAU / self.valence as f64).cos();
        let bend = bent(cosine);
        let d = DEGREE as f64;
        for k in 0..SIDE {
            let mut terms = vec![
                (unknown(sector, k, 1), d),
                (unknown(sector, k, 0), -d),
                (unknown(before, 1, k), d),
                (unknown(before, 0, k), -d),
            ];
            terms.extend((0..SIDE).map(|j| (unknown(sector, j, 0), -bend[k][j])));
            self.push(&terms, &[]);
        }
    }

    /// The vertex is where the surface has it: `(n² v + 4 Σ e + Σ f) / (n (n + 5))` (Halstead et al.
    /// 1993).
    fn add_middle(&mut self) {
        let n = self.valence as f64;
        let mut points = vec![(0, n / (n + 5.0))];
        for sector in 0..self.valence {
            points.push((place(self.valence, sector, [1, 0], FINE), 4.0 / (n * (n + 5.0))));
            points.push((place(self.valence, sector, [1, 1], FINE), 1.0 / (n * (n + 5.0))));
        }
        self.push(&[(unknown(0, 0, 0), 1.0)], &points);
    }

    /// Elimination of the largest unknown of every equation; some equations follow from others.
    fn solve(self) -> Option<Solved> {
        let (unknowns, columns) = (self.valence * SIDE * SIDE, self.data.cols());
        let mut rows: Vec<Vec<f64>> =
            self.left.into_iter().zip(self.right).map(|(l, r)| [l, r].concat()).collect();
        let mut pivots: Vec<usize> = Vec::new();
        let mut is_pivot = vec![false; unknowns];
        let (mut first, mut rest) = (0.0_f64, 0.0_f64);
        let mut done = 0;
        while done < rows.len() {
            let size = |j: &usize| rows[done][*j].abs();
            let largest = (0..unknowns).max_by(|a, b| size(a).total_cmp(&size(b)))?;
            first = first.max(size(&largest));
            if size(&largest) <= ROUNDING * first {
                // What is left over must be fulfilled by itself.
                let left = rows.remove(done);
                rest = left[unknowns..].iter().fold(rest, |m, x| m.max(x.abs()));
                continue;
            }
            let scale = rows[done][largest].recip();
            rows[done].iter_mut().for_each(|x| *x *= scale);
            let pivot = std::mem::take(&mut rows[done]);
            for (k, row) in rows.iter_mut().enumerate() {
                let factor = if k == done { 0.0 } else { row[largest] };
                if factor != 0.0 {
                    row.iter_mut().zip(&pivot).for_each(|(x, p)| *x -= factor * p);
                    row[largest] = 0.0;
                }
            }
            rows[done] = pivot;
            pivots.push(largest);
            is_pivot[largest] = true;
            done += 1;
        }
        let free: Vec<usize> = (0..unknowns).filter(|j| !is_pivot[*j]).collect();
        let mut null = Matrix::zeros(unknowns, free.len());
        let mut given = Matrix::zeros(unknowns, columns);
        for (row, j) in rows.iter().zip(&pivots) {
            for (k, f) in free.iter().enumerate() {
                null[(*j, k)] = -row[*f];
            }
            given.row_mut(*j).copy_from_slice(&row[unknowns..]);
        }
        free.iter().enumerate().for_each(|(k, f)| null[(*f, k)] = 1.0);
        (rest <= CONSISTENT).then_some(Solved { null, given })
    }
}

/// Bezier points, in the degree of the cap, of a span of a uniform cubic spline by its four control
/// points.
fn raised_span() -> [[f64; 4]; SIDE] {
    const CUBIC: [[f64; 4]; 4] = [
        [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0, 0.0],
        [0.0, 4.0 / 6.0, 2.0 / 6.0, 0.0],
        [0.0, 2.0 / 6.0, 4.0 / 6.0, 0.0],
        [0.0, 1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0],
    ];
    let raise = DEGREE - 3;
    std::array::from_fn(|k| {
        std::array::from_fn(|q| {
            // The product with the constant of the degree that is missing.
            let weight = |i: usize| match k.checked_sub(i) {
                Some(j) if j <= raise => BINOMIAL[3][i] * BINOMIAL[raise][j] / BINOMIAL[DEGREE][k],
                _ => 0.0,
            };
            (0..4).map(|i| weight(i) * CUBIC[i][q]).sum()
        })
    })
}

/// `2 cosine (1 − u)² b'(u)` in Bernstein form of the degree of the cap, by the control points of
/// an edge `b` of one degree less that is given in the degree of the cap.
fn bent(cosine: f64) -> [[f64; SIDE]; SIDE] {
    // The points of the lower degree, from the ends towards the middle.
    let d = DEGREE as f64;
    let mut low = [[0.0; SIDE]; DEGREE];
    low[0][0] = 1.0;
    for k in 1..DEGREE / 2 {
        for j in 0..SIDE {
            let given = if j == k { d } else { 0.0 };
            low[k][j] = (given - k as f64 * low[k - 1][j]) / (d - k as f64);
        }
    }
    low[DEGREE - 1][DEGREE] = 1.0;
    for k in (DEGREE / 2 + 1..DEGREE).rev() {
        for j in 0..SIDE {
            let given = if j == k { d } else { 0.0 };
            low[k - 1][j] = (given - (d - k as f64) * low[k][j]) / k as f64;
        }
    }
    let mut out = [[0.0; SIDE]; SIDE];
    for (k, row) in out.iter_mut().enumerate() {
        // The square has the one coefficient of index 0.
        let Some(pair) = low.get(k..k + 2) else { continue };
        let weight = 2.0 * cosine * BINOMIAL[DEGREE - 2][k] / BINOMIAL[DEGREE][k];
        for j in 0..SIDE {
            row[j] = weight * (d - 1.0) * (pair[1][j] - pair[0][j]);
        }
    }
    out
}

/// All solutions of the equations: `given · data + null · z`.
struct Solved {
    null: Matrix,
    given: Matrix,
}

/// Least squares among the solutions.
struct Fit {
    /// The values of the cap at the places, by its control points.
    values: Matrix,
    free: Matrix,
    normal: Cholesky,
}

impl Fit {
    fn new(system: &Solved, valence: usize, places: &[[f64; 2]]) -> Option<Self> {
        let size = SIDE * SIDE;
        let mut values = Matrix::zeros(valence * places.len(), valence * size);
        for sector in 0..valence {
            for (k, at) in places.iter().enumerate() {
                let row = values.row_mut(sector * places.len() + k);
                row[sector * size..(sector + 1) * size].copy_from_slice(&bernstein_grid(*at));
            }
        }
        let free = values.product(&system.null);
        let normal = Cholesky::new(&free.transpose_product(&free), 1e-14)?;
        Some(Self { values, free, normal })
    }

    /// The control points whose data begin at a column, near to the targets.
    fn solve(&self, system: &Solved, first: usize, targets: &Matrix) -> Matrix {
        let mut given = Matrix::zeros(system.given.rows(), targets.cols());
        for i in 0..given.rows() {
            let columns = first..first + targets.cols();
            given.row_mut(i).copy_from_slice(&system.given.row(i)[columns]);
        }
        let mut missing = targets.clone();
        missing.add_scaled(-1.0, &self.values.product(&given));
        let z = self.normal.solve_matrix(&self.free.transpose_product(&missing));
        given.add_scaled(1.0, &system.null.product(&z));
        given
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    /// A bumpy net.
    fn net(valence: usize) -> Vec<DVec3> {
        let mut net = vec![DVec3::new(0.0, 0.0, 0.3); count(valence, COARSE)];
        for sector in 0..valence {
            for (a, b) in [(1, 0), (2, 0), (1, 1), (1, 2), (2, 1), (2, 2)] {
                let angle = |k: usize| std::f64::consts::TAU * k as f64 / valence as f64;
                let (p, q) = (angle(sector), angle(sector + 1));
                let x = a as f64 * p.cos() + b as f64 * q.cos();
                let y = a as f64 * p.sin() + b as f64 * q.sin();
                let at = place(valence, sector, [a, b], COARSE);
                net[at] =
                    DVec3::new(x, y, 0.3 - 0.2 * x * x + 0.1 * x * y + 0.05 * (2.0 * y).sin());
            }
        }
        net
    }

    #[test]
    fn caps_are_near_and_have_one_tangent_plane_along_all_edges() {
        // Distances of a strongly bent net whose edges have length one.
        for (valence, bound) in [(3, 1e-4), (5, 1e-3), (6, 3e-3), (8, 1e-2)] {
            let rule = CapRule::new(valence).unwrap();
            let net = net(valence);
            let patches = rule.patches(&net);
            let distance = rule.distance(&net, &patches);
            assert!(distance < bound, "valence {valence}: {distance}");
            let finer = rule.finer(&net);
            assert!(rule.distance(&finer, &rule.patches(&finer)) < 0.6 * distance);
            for sector in 0..valence {
                let next = (sector + 1) % valence;
                for k in 0..=8 {
                    let t = f64::from(k) / 8.0;
                    let [p, a, b] = evaluate(&patches[sector], [0.0, t]);
                    let [q, c, d] = evaluate(&patches[next], [t, 0.0]);
                    assert_close(p.distance(q), 0.0, 1e-13);
                    let turn = a.cross(b).angle_between(c.cross(d));
                    assert!(turn < 1e-7, "valence {valence}, {t}: {turn}");
                }
            }
        }
    }

    #[test]
    fn the_outer_edges_are_those_of_the_ring() {
        let rule = CapRule::new(5).unwrap();
        let net = net(5);
        let fine: Vec<DVec3> = (0..rule.rows.rows())
            .map(|i| rule.rows.row(i).iter().zip(&net).map(|(w, p)| *w * *p).sum())
            .collect();
        let patches = rule.patches(&net);
        for (sector, patch) in patches.iter().enumerate() {
            for t in [0.0, 0.2, 0.7, 1.0] {
                let [at_v, _] = cubic(t);
                let [value, slope] = cubic(0.0);
                let sum = |across: [f64; 4]| -> DVec3 {
                    (0..16)
                        .map(|k| {
                            let at = [(k / 4) as isize, (k % 4) as isize - 1];
                            across[k / 4] * at_v[k % 4] * fine[place(5, sector, at, FINE)]
                        })
                        .sum()
                };
                let [point, by_u, _] = evaluate(patch, [1.0, t]);
                assert_close(point.distance(sum(value)), 0.0, 1e-12);
                assert_close(by_u.distance(sum(slope)), 0.0, 1e-11);
            }
        }
    }
}
