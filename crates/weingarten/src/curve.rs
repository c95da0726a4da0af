//! B-spline curves in the curvature diagram: fit, foot points, tangent lines.

use bspline::{Degree, KnotVector};
use numerics::lu_solve;

/// Control points of a fitted curve.
pub(crate) const CONTROL: usize = 8;
/// Rounds of foot points and refits.
const ROUNDS: usize = 6;
/// Weight of the second differences of the control points against the mean square distance: only
/// there to hold control points no sample reaches.
const SMOOTHING: f64 = 1e-4;
/// Candidates for a foot point.
const CANDIDATES: usize = 200;

/// A planar cubic B-spline curve.
#[derive(Clone, Debug)]
pub(crate) struct DiagramCurve {
    knots: KnotVector,
    control: Vec<[f64; 2]>,
}

/// Where a point of the plane meets a curve.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Foot {
    parameter: f64,
    /// The nearest point of the curve.
    pub(crate) point: [f64; 2],
    /// Unit normal there.
    pub(crate) normal: [f64; 2],
}

impl DiagramCurve {
    /// A curve with clamped uniform knots, of degree 3 or one less than the number of points;
    /// `None` for fewer than two points.
    pub(crate) fn new(control: Vec<[f64; 2]>) -> Option<Self> {
        let degree = Degree::new(3.min(control.len().saturating_sub(1))).ok()?;
        let knots = KnotVector::clamped_uniform(degree, control.len()).ok()?;
        Some(Self { knots, control })
    }

    /// A curve of `control` points near `points`. Parameters come from the principal axis of the
    /// cloud or from the order along it, whichever leads to the nearer curve, and then from foot
    /// points.
    pub(crate) fn fit(points: &[[f64; 2]], control: usize) -> Option<Self> {
        let orders = [along_axis(points), along_cloud(points)];
        let fits = orders.into_iter().flatten().filter_map(|order| {
            let curve = Self::fit_from(points, control, order)?;
            let square = |(p, foot): (&[f64; 2], Foot)| apart(*p, foot.point).powi(2);
            let miss: f64 = points.iter().zip(curve.feet(points)).map(square).sum();
            Some((miss, curve))
        });
        fits.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, curve)| curve)
    }

    /// Root mean square distance of `points` from the curve of so many control points fitted to them.
    pub(crate) fn thickness(points: &[[f64; 2]], control: usize) -> f64 {
        let Some(curve) = Self::fit(points, control) else { return 0.0 };
        let feet = curve.feet(points);
        let square = |(p, foot): (&[f64; 2], &Foot)| apart(*p, foot.point).powi(2);
        (points.iter().zip(&feet).map(square).sum::<f64>() / points.len() as f64).sqrt()
    }

    fn fit_from(points: &[[f64; 2]], control: usize, mut order: Vec<f64>) -> Option<Self> {
        let mut curve = Self::new(vec![[0.0; 2]; control])?;
        curve.refit(points, &order)?;
        for round in 1..=ROUNDS {
            // Feet move little from round to round; the last one looks for them everywhere.
            if round < ROUNDS {
                for (t, p) in order.iter_mut().zip(points) {
                    *t = curve.descend(*p, *t);
                }
            } else {
                for (t, foot) in order.iter_mut().zip(curve.feet(points)) {
                    *t = foot.parameter;
                }
            }
            curve.refit(points, &order)?;
        }
        Some(curve)
    }

    /// The control points.
    pub(crate) fn control(&self) -> &[[f64; 2]] {
        &self.control
    }

    /// The curve, run through in the sense in which it is nearer to `other`, one of as many control
    /// points.
    pub(crate) fn oriented_like(mut self, other: &Self) -> Self {
        let square = |a: &[f64; 2], b: &[f64; 2]| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
        let pairs = || self.control.iter().zip(&other.control);
        let here: f64 = pairs().map(|(a, b)| square(a, b)).sum();
        let turned = self.control.iter().rev().zip(&other.control);
        if turned.map(|(a, b)| square(a, b)).sum::<f64>() < here {
            self.control.reverse();
        }
        self
    }

    /// Mean distance of points of equal parameters from `other`, a curve of as many control points.
    pub(crate) fn distance(&self, other: &Self) -> f64 {
        let (here, there) = (self.points(), other.points());
        let apart = here.iter().zip(&there).map(|(a, b)| (a[0] - b[0]).hypot(a[1] - b[1]));
        apart.sum::<f64>() / here.len() as f64
    }

    /// The curve at `share` of the way to `other`, one of as many control points.
    pub(crate) fn towards(&self, other: &Self, share: f64) -> Self {
        let between = |(a, b): (&[f64; 2], &[f64; 2])| {
            [0, 1].map(|axis| a[axis] + share * (b[axis] - a[axis]))
        };
        let control = self.control.iter().zip(&other.control).map(between).collect();
        Self { knots: self.knots.clone(), control }
    }

    /// Least squares with fixed parameters.
    fn refit(&mut self, points: &[[f64; 2]], parameters: &[f64]) -> Option<()> {
        let n = self.control.len();
        let (mut matrix, mut values) = (vec![0.0; n * n], vec![0.0; 2 * n]);
        for (p, &t) in points.iter().zip(parameters) {
            let basis = self.knots.basis(t, 0);
            for r in 0..self.knots.degree().order() {
                let i = self.knots.control_index(basis.span, r);
                for s in 0..self.knots.degree().order() {
                    let j = self.knots.control_index(basis.span, s);
                    matrix[i * n + j] += basis.values[0][r] * basis.values[0][s];
                }
                for axis in 0..2 {
                    values[2 * i + axis] += basis.values[0][r] * p[axis];
                }
            }
        }
        let weight = SMOOTHING * points.len() as f64;
        for k in 1..n - 1 {
            let difference = [(k - 1, 1.0), (k, -2.0), (k + 1, 1.0)];
            for (i, a) in difference {
                for (j, b) in difference {
                    matrix[i * n + j] += weight * a * b;
                }
            }
        }
        if !lu_solve(&mut matrix, &mut values, n) {
            return None;
        }
        self.control = values.chunks_exact(2).map(|c| [c[0], c[1]]).collect();
        Some(())
    }

    /// Point and first two derivatives.
    fn derivatives(&self, t: f64) -> [[f64; 2]; 3] {
        let basis = self.knots.basis(t, 2);
        let mut out = [[0.0; 2]; 3];
        for r in 0..self.knots.degree().order() {
            let c = self.control[self.knots.control_index(basis.span, r)];
            for (order, value) in out.iter_mut().enumerate() {
                for axis in 0..2 {
                    value[axis] += basis.values[order][r] * c[axis];
                }
            }
        }
        out
    }

    /// Points along the whole curve, both ends included.
    pub(crate) fn points(&self) -> Vec<[f64; 2]> {
        (0..=CANDIDATES).map(|k| self.derivatives(k as f64 / CANDIDATES as f64)[0]).collect()
    }

    /// The foot points of `points`.
    pub(crate) fn feet(&self, points: &[[f64; 2]]) -> Vec<Foot> {
        let candidates = self.points();
        points.iter().map(|&p| self.foot(p, &candidates)).collect()
    }

    /// The parameter of the foot point of `p` that is near to `t`.
    fn descend(&self, p: [f64; 2], mut t: f64) -> f64 {
        for _ in 0..4 {
            let [c, d, e] = self.derivatives(t);
            let away = [p[0] - c[0], p[1] - c[1]];
            let speed = d[0] * d[0] + d[1] * d[1];
            let slope = (speed - away[0] * e[0] - away[1] * e[1]).max(1e-3 * speed);
            if !(slope > 0.0) {
                break;
            }
            t = (t + (away[0] * d[0] + away[1] * d[1]) / slope).clamp(0.0, 1.0);
        }
        t
    }

    fn foot(&self, p: [f64; 2], candidates: &[[f64; 2]]) -> Foot {
        let square = |c: &[f64; 2]| (c[0] - p[0]).powi(2) + (c[1] - p[1]).powi(2);
        let mut best = (f64::INFINITY, 0);
        for (k, c) in candidates.iter().enumerate() {
            if square(c) < best.0 {
                best = (square(c), k);
            }
        }
        let t = self.descend(p, best.1 as f64 / CANDIDATES as f64);
        let [point, d, _] = self.derivatives(t);
        let length = d[0].hypot(d[1]);
        let across = if length > 0.0 { [-d[1] / length, d[0] / length] } else { [1.0, 0.0] };
        // Beyond an end the distance is that from the end itself.
        let away = [p[0] - point[0], p[1] - point[1]];
        let outside = away[0].hypot(away[1]);
        let is_beyond = (t == 0.0 || t == 1.0)
            && (away[0] * d[0] + away[1] * d[1]).abs() > 1e-9 * outside * length;
        let normal = if is_beyond { away.map(|x| x / outside) } else { across };
        Foot { parameter: t, point, normal }
    }
}

/// Parameters in 0..=1 by the place along the principal axis; `None` for a cloud without extent.
fn along_axis(points: &[[f64; 2]]) -> Option<Vec<f64>> {
    let (mean, axis) = principal_axis(points);
    let along = points.iter().map(|p| (p[0] - mean[0]) * axis[0] + (p[1] - mean[1]) * axis[1]);
    to_unit(along.collect())
}

fn to_unit(mut values: Vec<f64>) -> Option<Vec<f64>> {
    let (low, high) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &t| (l.min(t), h.max(t)));
    if !(high > low) {
        return None;
    }
    values.iter_mut().for_each(|t| *t = (*t - low) / (high - low));
    Some(values)
}

/// Parameters in 0..=1 by the order along the cloud: the cells it fills are joined by a shortest tree,
/// and the longest way through the tree is the order. Side branches count where they leave the way.
fn along_cloud(points: &[[f64; 2]]) -> Option<Vec<f64>> {
    let (cells, cell_of) = occupied_cells(points)?;
    let parents = shortest_tree(&cells);
    // The tree is listed in the order it grew, so that a parent stands before its children.
    let (_, far) = farthest(&cells, &parents, 0);
    let (distance, end) = farthest(&cells, &parents, far);
    let mut is_on_way = vec![false; cells.len()];
    let neighbours = neighbours(&parents);
    let mut at = end;
    is_on_way[at] = true;
    while at != far {
        // The neighbour nearer to the start.
        at = *neighbours[at].iter().find(|&&n| distance[n] < distance[at])?;
        is_on_way[at] = true;
    }
    // Side branches take the place of where they leave.
    let mut place: Vec<Option<f64>> =
        (0..cells.len()).map(|c| is_on_way[c].then(|| distance[c])).collect();
    let mut open: Vec<usize> = (0..cells.len()).filter(|&c| is_on_way[c]).collect();
    while let Some(cell) = open.pop() {
        for &n in &neighbours[cell] {
            if place[n].is_none() {
                place[n] = place[cell];
                open.push(n);
            }
        }
    }
    to_unit(cell_of.iter().map(|&c| place[c].unwrap_or(0.0)).collect())
}

/// Cells per side of the box of a cloud.
const CELLS: usize = 24;

/// Centroids of the cells of the cloud's box that hold points, and the cell of every point.
fn occupied_cells(points: &[[f64; 2]]) -> Option<(Vec<[f64; 2]>, Vec<usize>)> {
    let mut low = [f64::INFINITY; 2];
    let mut high = [f64::NEG_INFINITY; 2];
    for p in points {
        for axis in 0..2 {
            low[axis] = low[axis].min(p[axis]);
            high[axis] = high[axis].max(p[axis]);
        }
    }
    let side = (high[0] - low[0]).max(high[1] - low[1]) / CELLS as f64;
    if !(side > 0.0 && side.is_finite()) {
        return None;
    }
    let mut number = vec![usize::MAX; CELLS * CELLS];
    let mut sums: Vec<([f64; 2], f64)> = Vec::new();
    let mut cell_of = Vec::with_capacity(points.len());
    for p in points {
        let index = |axis: usize| (((p[axis] - low[axis]) / side) as usize).min(CELLS - 1);
        let slot = &mut number[index(0) * CELLS + index(1)];
        if *slot == usize::MAX {
            *slot = sums.len();
            sums.push(([0.0; 2], 0.0));
        }
        let (sum, count) = &mut sums[*slot];
        *sum = [sum[0] + p[0], sum[1] + p[1]];
        *count += 1.0;
        cell_of.push(*slot);
    }
    Some((sums.iter().map(|(sum, n)| [sum[0] / n, sum[1] / n]).collect(), cell_of))
}

fn apart(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The parent of every point but the first in the tree of least length (Prim 1957).
fn shortest_tree(points: &[[f64; 2]]) -> Vec<usize> {
    let mut parents = vec![0; points.len()];
    let mut near: Vec<f64> = points.iter().map(|p| apart(*p, points[0])).collect();
    let mut is_in = vec![false; points.len()];
    is_in[0] = true;
    for _ in 1..points.len() {
        let outside = (0..points.len()).filter(|&k| !is_in[k]);
        let Some(next) = outside.min_by(|&a, &b| near[a].total_cmp(&near[b])) else { break };
        is_in[next] = true;
        for k in 0..points.len() {
            let distance = apart(points[k], points[next]);
            if !is_in[k] && distance < near[k] {
                (near[k], parents[k]) = (distance, next);
            }
        }
    }
    parents
}

fn neighbours(parents: &[usize]) -> Vec<Vec<usize>> {
    let mut lists = vec![Vec::new(); parents.len()];
    for (child, &parent) in parents.iter().enumerate().skip(1) {
        lists[child].push(parent);
        lists[parent].push(child);
    }
    lists
}

/// Distances through the tree from `start`, and the point farthest away.
fn farthest(points: &[[f64; 2]], parents: &[usize], start: usize) -> (Vec<f64>, usize) {
    let neighbours = neighbours(parents);
    let mut distance = vec![f64::NAN; points.len()];
    distance[start] = 0.0;
    let (mut open, mut far) = (vec![start], start);
    while let Some(at) = open.pop() {
        if distance[at] > distance[far] {
            far = at;
        }
        for &n in &neighbours[at] {
            if distance[n].is_nan() {
                distance[n] = distance[at] + apart(points[at], points[n]);
                open.push(n);
            }
        }
    }
    (distance, far)
}

/// Mean of a planar cloud and the unit vector along which it extends most.
pub(crate) fn principal_axis(points: &[[f64; 2]]) -> ([f64; 2], [f64; 2]) {
    let n = points.len().max(1) as f64;
    let mut mean = [0.0; 2];
    for p in points {
        mean[0] += p[0] / n;
        mean[1] += p[1] / n;
    }
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for p in points {
        let (x, y) = (p[0] - mean[0], p[1] - mean[1]);
        xx += x * x;
        xy += x * y;
        yy += y * y;
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    (mean, [angle.cos(), angle.sin()])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fit_to_a_parabola_lies_on_it() {
        let points: Vec<[f64; 2]> = (0..200)
            .map(|k| {
                let t = f64::from(k) / 100.0 - 1.0;
                [t, 0.6 * t * t]
            })
            .collect();
        let curve = DiagramCurve::fit(&points, CONTROL).unwrap();
        for (foot, p) in curve.feet(&points).iter().zip(&points) {
            let distance = (foot.point[0] - p[0]).hypot(foot.point[1] - p[1]);
            assert!(distance < 2e-3, "{distance}");
        }
    }

    #[test]
    fn a_cloud_that_turns_back_on_itself_is_followed_along() {
        // A horseshoe: along its principal axis the two arms would be mixed up.
        let points: Vec<[f64; 2]> = (0..600)
            .map(|k| {
                let t = f64::from(k) / 599.0;
                let angle = 1.6 * std::f64::consts::PI * t;
                [angle.cos(), angle.sin() + 0.02 * f64::from(k % 5)]
            })
            .collect();
        let curve = DiagramCurve::fit(&points, CONTROL).unwrap();
        let distance = |(foot, p): (&Foot, &[f64; 2])| apart(foot.point, *p);
        let feet = curve.feet(&points);
        let worst = feet.iter().zip(&points).map(distance).fold(0.0, f64::max);
        assert!(worst < 0.1, "{worst}");
    }

    #[test]
    fn beyond_an_end_the_distance_is_that_from_the_end() {
        let curve = DiagramCurve::new(vec![[0.0, 0.0], [1.0, 0.0], [2.0, 0.0]]).unwrap();
        let foot = curve.feet(&[[3.0, 0.75]])[0];
        assert_eq!(foot.point, [2.0, 0.0]);
        assert!((foot.normal[0] - 0.8).abs() < 1e-12 && (foot.normal[1] - 0.6).abs() < 1e-12);
    }

    #[test]
    fn the_normal_at_a_foot_point_is_along_the_distance() {
        let curve =
            DiagramCurve::new(vec![[0.0, 0.0], [1.0, 2.0], [2.0, -1.0], [3.0, 0.5]]).unwrap();
        let p = [1.2, 1.1];
        let foot = curve.feet(&[p])[0];
        let away = [p[0] - foot.point[0], p[1] - foot.point[1]];
        assert!((away[0] * foot.normal[1] - away[1] * foot.normal[0]).abs() < 1e-9);
    }
}
