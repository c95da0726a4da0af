//! Tensor-product splines as plain numbers, evaluated by de Boor's algorithm.

use crate::ball::diameter;
use glam::{DVec3, DVec4};
use rayon::prelude::*;

/// Highest order of derivatives.
pub const ORDER: usize = 3;

/// Why numbers are no spline.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum SplineError {
    /// Counts that do not belong together.
    #[error(
        "{points} control points and {knots_u} x {knots_v} knots do not make a surface of degree {degree_u} x {degree_v}; write the surface again"
    )]
    Counts { points: usize, knots_u: usize, knots_v: usize, degree_u: usize, degree_v: usize },
    /// Weights that are not as many as control points, or not positive.
    #[error("{found} weights for {points} control points, all of which must be positive")]
    Weights { found: usize, points: usize },
}

/// A spline surface: degrees, all knots, control points with v running fastest, weights (none if
/// the surface is polynomial). A closed direction repeats its first control points at the end.
#[derive(Clone, Debug, PartialEq)]
pub struct Spline {
    degree: [usize; 2],
    knots: [Vec<f64>; 2],
    counts: [usize; 2],
    /// Control points.
    places: Vec<DVec3>,
    /// The same times their weights, with these.
    points: Vec<DVec4>,
    is_rational: bool,
    closed: [bool; 2],
}

/// Position and derivatives: `d[i][j]` is the derivative `i` times by u and `j` times by v, for
/// `i + j` up to the order asked for; the others are zero.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Jet {
    /// The derivatives.
    pub d: [[DVec3; ORDER + 1]; ORDER + 1],
}

impl Spline {
    /// Checks the counts.
    ///
    /// # Errors
    /// [`SplineError`] if they do not belong together.
    pub fn new(
        degree: [usize; 2],
        knots: [Vec<f64>; 2],
        points: &[DVec3],
        weights: Option<&[f64]>,
    ) -> Result<Self, SplineError> {
        let counts = [0, 1].map(|k| knots[k].len().saturating_sub(degree[k] + 1));
        let is_whole = (0..2).all(|k| degree[k] > 0 && counts[k] > degree[k]);
        if !is_whole || counts[0] * counts[1] != points.len() {
            return Err(SplineError::Counts {
                points: points.len(),
                knots_u: knots[0].len(),
                knots_v: knots[1].len(),
                degree_u: degree[0],
                degree_v: degree[1],
            });
        }
        if let Some(weights) = weights
            && (weights.len() != points.len() || !weights.iter().all(|w| *w > 0.0))
        {
            return Err(SplineError::Weights { found: weights.len(), points: points.len() });
        }
        let places = points.to_vec();
        let weight = |k: usize| weights.map_or(1.0, |w| w[k]);
        let points = points.iter().enumerate().map(|(k, p)| (*p * weight(k)).extend(weight(k)));
        Ok(Self {
            degree,
            knots,
            counts,
            places,
            points: points.collect(),
            is_rational: weights.is_some(),
            closed: [false; 2],
        })
    }

    /// A Bézier patch of one degree over the unit square.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn bezier(degree: usize, points: &[DVec3]) -> Result<Self, SplineError> {
        let mut knots = vec![0.0; degree + 1];
        knots.extend(vec![1.0; degree + 1]);
        Self::new([degree; 2], [knots.clone(), knots], points, None)
    }

    /// A bicubic patch of a uniform B-spline over the unit square: 16 control points.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn uniform_bicubic(points: &[DVec3]) -> Result<Self, SplineError> {
        let knots: Vec<f64> = (-3..=4).map(f64::from).collect();
        Self::new([3; 2], [knots.clone(), knots], points, None)
    }

    /// Says which directions are closed: their last `degree` control points are the first ones
    /// again.
    #[must_use]
    pub fn with_closed(mut self, closed: [bool; 2]) -> Self {
        self.closed = closed;
        self
    }

    /// Which directions are closed.
    #[must_use]
    pub fn closed(&self) -> [bool; 2] {
        self.closed
    }

    /// Numbers of different control points in u and v.
    #[must_use]
    pub fn different_counts(&self) -> [usize; 2] {
        [0, 1].map(|k| self.counts[k] - if self.closed[k] { self.degree[k] } else { 0 })
    }

    /// All control points, those a closed direction repeats included.
    pub fn control_points(&self) -> impl Iterator<Item = DVec3> {
        self.places.iter().copied()
    }

    /// The same moved by a vector.
    #[must_use]
    pub fn moved(&self, by: DVec3) -> Self {
        let mut moved = self.clone();
        // The products with weights are rounded where they stand, so they are made anew.
        for (place, point) in moved.places.iter_mut().zip(&mut moved.points) {
            *place += by;
            *point = (*place * point.w).extend(point.w);
        }
        moved
    }

    /// The same with its parameters exchanged.
    #[must_use]
    pub fn swapped(&self) -> Self {
        let [n_u, n_v] = self.counts;
        let from = |k: usize| (k % n_u) * n_v + k / n_u;
        let places = (0..n_u * n_v).map(|k| self.places[from(k)]);
        let points = (0..n_u * n_v).map(|k| self.points[from(k)]);
        let ([p, q], [u, v], [a, b]) = (self.degree, self.knots.clone(), self.closed);
        Self {
            degree: [q, p],
            knots: [v, u],
            counts: [n_v, n_u],
            places: places.collect(),
            points: points.collect(),
            is_rational: self.is_rational,
            closed: [b, a],
        }
    }

    /// Diameter of the smallest ball around the points of a grid of 20 cells to a control point in
    /// each direction, of at most 400 or, for nets of more than 200, two to a control point.
    #[must_use]
    pub fn size(&self) -> Option<f64> {
        let [u, v] = [0, 1].map(|k| {
            let n = self.different_counts()[k];
            self.equidistant(k, (20 * n).min((2 * n).max(400)) + 1)
        });
        diameter(self.jets(&u, &v, 0).iter().map(|jet| jet.d[0][0]))
    }

    /// Degrees in u and v.
    #[must_use]
    pub fn degree(&self) -> [usize; 2] {
        self.degree
    }

    /// Numbers of control points in u and v, those a closed direction repeats included.
    #[must_use]
    pub fn counts(&self) -> [usize; 2] {
        self.counts
    }

    /// Whether there are weights.
    #[must_use]
    pub fn is_rational(&self) -> bool {
        self.is_rational
    }

    /// A control point and its weight.
    #[must_use]
    pub fn control_point(&self, i: usize, j: usize) -> (DVec3, f64) {
        let k = i * self.counts[1] + j;
        (self.places[k], self.points[k].w)
    }

    /// Start and end of a direction.
    #[must_use]
    pub fn domain(&self, direction: usize) -> [f64; 2] {
        let (d, knots) = (self.degree[direction], &self.knots[direction]);
        [knots[d], knots[knots.len() - 1 - d]]
    }

    /// Knots of a direction within its domain, each once.
    #[must_use]
    pub fn breaks(&self, direction: usize) -> Vec<f64> {
        let (d, knots) = (self.degree[direction], &self.knots[direction]);
        let mut breaks = knots[d..knots.len() - d].to_vec();
        breaks.dedup();
        breaks
    }

    /// The middles of `count` equal cells of a direction.
    #[must_use]
    pub fn midpoints(&self, direction: usize, count: usize) -> Vec<f64> {
        let [start, end] = self.domain(direction);
        (0..count).map(|k| start + (end - start) * (k as f64 + 0.5) / count as f64).collect()
    }

    /// `count` equidistant parameters of a direction, both ends included.
    ///
    /// # Panics
    /// With fewer than two.
    #[must_use]
    pub fn equidistant(&self, direction: usize, count: usize) -> Vec<f64> {
        assert!(count > 1, "both ends are parameters");
        let [start, end] = self.domain(direction);
        (0..count).map(|k| start + (end - start) * k as f64 / (count - 1) as f64).collect()
    }

    /// The jet at one pair of parameters within the domain.
    ///
    /// # Panics
    /// If `order` is above [`ORDER`].
    #[must_use]
    pub fn jet(&self, u: f64, v: f64, order: usize) -> Jet {
        let mut jet = Jet::default();
        let (u, v) = (self.ready(0, &[u], order), self.ready(1, &[v], order));
        self.row(&u[0], &v, |_, found| jet = *found);
        jet
    }

    /// The jet at parameters that may lie a period beyond a closed direction, or by rounding beyond
    /// an open one.
    ///
    /// # Panics
    /// If `order` is above [`ORDER`].
    #[must_use]
    pub fn jet_around(&self, u: f64, v: f64, order: usize) -> Jet {
        let within = |k: usize, t: f64| {
            let [start, end] = self.domain(k);
            let t = if self.closed[k] && !(start..=end).contains(&t) {
                start + (t - start).rem_euclid(end - start)
            } else {
                t
            };
            t.clamp(start, end)
        };
        self.jet(within(0, u), within(1, v), order)
    }

    /// The jets at all pairs, `[i * v.len() + j]`.
    ///
    /// # Panics
    /// If `order` is above [`ORDER`].
    #[must_use]
    pub fn jets(&self, u: &[f64], v: &[f64], order: usize) -> Vec<Jet> {
        let (u, v) = (self.ready(0, u, order), self.ready(1, v, order));
        let rows: Vec<Vec<Jet>> = u
            .par_iter()
            .map(|u| {
                let mut row = Vec::with_capacity(v.len());
                self.row(u, &v, |_, jet| row.push(*jet));
                row
            })
            .collect();
        rows.concat()
    }

    /// Makes parameters of a direction ready for jets up to `order`.
    ///
    /// # Panics
    /// If `order` is above [`ORDER`].
    #[must_use]
    pub fn ready(&self, direction: usize, parameters: &[f64], order: usize) -> Vec<Ready> {
        assert!(order <= ORDER, "derivatives go to order {ORDER}");
        let (knots, degree) = (&self.knots[direction], self.degree[direction]);
        let count = self.counts[direction];
        parameters.iter().map(|t| Ready::new(knots, degree, count, *t, order)).collect()
    }

    /// Jets along `u = const`: the net is first reduced to curves in v, one per derivative by u.
    pub fn row(&self, u: &Ready, v: &[Ready], mut each: impl FnMut(usize, &Jet)) {
        let n_v = self.counts[1];
        let [p, q] = self.degree;
        let order = u.order;
        let mut local = vec![DVec4::ZERO; p.max(q) + 1];
        let mut work = local.clone();
        let mut reduced = vec![DVec4::ZERO; (order + 1) * n_v];
        for j in 0..n_v {
            for (i, slot) in local.iter_mut().enumerate().take(p + 1) {
                *slot = self.points[(u.span - p + i) * n_v + j];
            }
            let found = u.derivatives(&mut local[..=p], &mut work, order);
            for (i, value) in found.iter().enumerate().take(order + 1) {
                reduced[i * n_v + j] = *value;
            }
        }
        for (index, v) in v.iter().enumerate() {
            let mut all = [[DVec4::ZERO; ORDER + 1]; ORDER + 1];
            for (i, row) in all.iter_mut().enumerate().take(order + 1) {
                let from = i * n_v + v.span - q;
                local[..=q].copy_from_slice(&reduced[from..=from + q]);
                *row = v.derivatives(&mut local[..=q], &mut work, order - i);
            }
            each(index, &self.projected(&all, order));
        }
    }

    /// From homogeneous derivatives to those in space, by Leibniz' rule for `A = w S`.
    fn projected(&self, all: &[[DVec4; ORDER + 1]; ORDER + 1], order: usize) -> Jet {
        let mut jet = Jet::default();
        for i in 0..=order {
            for j in 0..=order - i {
                let mut sum = all[i][j].truncate();
                if self.is_rational {
                    for a in 0..=i {
                        for b in 0..=j {
                            if a + b > 0 {
                                let factor = binomial(i, a) * binomial(j, b) * all[a][b].w;
                                sum -= factor * jet.d[i - a][j - b];
                            }
                        }
                    }
                    sum /= all[0][0].w;
                }
                jet.d[i][j] = sum;
            }
        }
        jet
    }

    /// The parameters of the nearest point to `point` and its distance: Newton's method on the
    /// squared distance from the nearest points of a grid, within the domain.
    #[must_use]
    pub fn nearest(&self, grid: &NearestGrid, point: DVec3) -> ([f64; 2], f64) {
        let mut starts: Vec<(f64, usize)> =
            (0..grid.points.len()).map(|k| (grid.points[k].distance_squared(point), k)).collect();
        let count = STARTS.min(starts.len());
        starts.select_nth_unstable_by(count - 1, |a, b| a.0.total_cmp(&b.0));
        let mut best = ([f64::NAN; 2], f64::INFINITY);
        for (_, k) in &starts[..count] {
            let at = [grid.u[k / grid.v.len()], grid.v[k % grid.v.len()]];
            let found = self.descend(point, at);
            if found.1 < best.1 {
                best = found;
            }
        }
        best
    }

    fn descend(&self, point: DVec3, [mut u, mut v]: [f64; 2]) -> ([f64; 2], f64) {
        let (du, dv) = (self.domain(0), self.domain(1));
        let mut jet = self.jet(u, v, 2);
        let mut distance = jet.d[0][0].distance(point);
        let mut last = f64::INFINITY;
        for _ in 0..60 {
            let gap = jet.d[0][0] - point;
            let (su, sv) = (jet.d[1][0], jet.d[0][1]);
            let (a, b) = (gap.dot(su), gap.dot(sv));
            let mut e = su.dot(su) + gap.dot(jet.d[2][0]);
            let mut f = su.dot(sv) + gap.dot(jet.d[1][1]);
            let mut g = sv.dot(sv) + gap.dot(jet.d[0][2]);
            if !(e > 0.0 && e * g - f * f > 0.0) {
                (e, f, g) = (su.dot(su), su.dot(sv), sv.dot(sv));
            }
            // A parameter at its bound that wants to leave stays, and the other moves alone.
            let stays = |t: f64, slope: f64, [low, high]: [f64; 2]| {
                (t <= low && slope > 0.0) || (t >= high && slope < 0.0)
            };
            let (step_u, step_v) = match (stays(u, a, du), stays(v, b, dv)) {
                (true, true) => break,
                (true, false) => (0.0, -b / g),
                (false, true) => (-a / e, 0.0),
                (false, false) => {
                    let det = e * g - f * f;
                    (-(g * a - f * b) / det, -(e * b - f * a) / det)
                }
            };
            let length = (step_u / (du[1] - du[0])).hypot(step_v / (dv[1] - dv[0]));
            // Near the foot a step changes the distance by less than its rounding; there steps go on
            // as long as they become shorter.
            let slack = if length < 1e-4 { 1e-14 * distance } else { 0.0 };
            if length < 1e-15 || (slack > 0.0 && length > 0.5 * last) {
                break;
            }
            last = length;
            let mut share = 1.0;
            let better = loop {
                let next = [
                    (u + share * step_u).clamp(du[0], du[1]),
                    (v + share * step_v).clamp(dv[0], dv[1]),
                ];
                let there = self.jet(next[0], next[1], 2);
                let far = there.d[0][0].distance(point);
                if far < distance + slack {
                    break Some((next, there, far));
                }
                share *= 0.5;
                if share < 1e-4 {
                    break None;
                }
            };
            let Some((next, there, far)) = better else { break };
            ([u, v], jet, distance) = (next, there, far);
        }
        ([u, v], distance)
    }
}

/// Starts of the search for the nearest point.
const STARTS: usize = 3;

/// Points of a surface from which the search for nearest points starts.
#[derive(Clone, Debug)]
pub struct NearestGrid {
    u: Vec<f64>,
    v: Vec<f64>,
    points: Vec<DVec3>,
}

impl NearestGrid {
    /// Four points to a knot span, and at least 24, in each direction.
    #[must_use]
    pub fn new(surface: &Spline) -> Self {
        let parameters = |k: usize| {
            let spans = surface.breaks(k).len() - 1;
            surface.equidistant(k, (4 * spans).max(24) + 1)
        };
        let (u, v) = (parameters(0), parameters(1));
        let points = surface.jets(&u, &v, 0).iter().map(|jet| jet.d[0][0]).collect();
        Self { u, v, points }
    }
}

fn binomial(n: usize, k: usize) -> f64 {
    const TABLE: [[f64; ORDER + 1]; ORDER + 1] =
        [[1.0, 0.0, 0.0, 0.0], [1.0, 1.0, 0.0, 0.0], [1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]];
    TABLE[n][k]
}

/// The index `k` of the span `[t_k, t_{k+1})` with `t`; the last span takes the end of the domain.
fn span(knots: &[f64], degree: usize, count: usize, t: f64) -> usize {
    let mut k = degree;
    let mut high = count;
    while high - k > 1 {
        let middle = usize::midpoint(k, high);
        if knots[middle] <= t { k = middle } else { high = middle }
    }
    while knots[k + 1] <= knots[k] && k > degree {
        k -= 1;
    }
    k
}

/// A parameter with what de Boor's algorithm takes from the knots around it, the same for all
/// points.
#[derive(Clone, Debug)]
pub struct Ready {
    span: usize,
    degree: usize,
    order: usize,
    /// For each derivative the shares of the triangle, level by level, then the factors that make
    /// points of the next derivative.
    numbers: Vec<f64>,
}

impl Ready {
    fn new(knots: &[f64], degree: usize, count: usize, t: f64, order: usize) -> Self {
        let k = span(knots, degree, count, t);
        let mut numbers = Vec::new();
        for r in 0..=order.min(degree) {
            let p = degree - r;
            for level in 1..=p {
                for i in (level..=p).rev() {
                    let (low, high) = (knots[k - p + i], knots[k + 1 + i - level]);
                    numbers.push((t - low) / (high - low));
                }
            }
            numbers.extend((0..p).map(|i| p as f64 / (knots[k + 1 + i] - knots[k - p + 1 + i])));
        }
        Self { span: k, degree, order, numbers }
    }

    /// Derivatives 0 to `order` of the curve piece with these `degree + 1` points, which are
    /// overwritten by those of its derivatives.
    fn derivatives(
        &self,
        points: &mut [DVec4],
        work: &mut [DVec4],
        order: usize,
    ) -> [DVec4; ORDER + 1] {
        let mut out = [DVec4::ZERO; ORDER + 1];
        let mut numbers = self.numbers.iter();
        let mut next = || numbers.next().copied().unwrap_or(f64::NAN);
        for (r, slot) in out.iter_mut().enumerate().take(order.min(self.degree) + 1) {
            // Points `0..=p` of the derivative of order `r`, a piece of degree `p`.
            let p = self.degree - r;
            work[..=p].copy_from_slice(&points[..=p]);
            for level in 1..=p {
                for i in (level..=p).rev() {
                    work[i] = work[i - 1] + next() * (work[i] - work[i - 1]);
                }
            }
            *slot = work[p];
            for i in 0..p {
                points[i] = (points[i + 1] - points[i]) * next();
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `x, y` are the parameters, `z = u³ v² − u v`, as a Bézier patch of degree three.
    fn graph() -> Spline {
        let mut points = Vec::new();
        for i in 0..4 {
            for j in 0..4 {
                let (x, y) = (f64::from(i) / 3.0, f64::from(j) / 3.0);
                // Blossoms of u³ and v² at the control points.
                let cube = if i == 3 { 1.0 } else { 0.0 };
                let square = f64::from(j * (j - 1)) / 6.0;
                points.push(DVec3::new(x, y, cube * square - x * y));
            }
        }
        Spline::bezier(3, &points).unwrap()
    }

    #[test]
    fn a_polynomial_has_its_derivatives() {
        let (u, v) = (0.3, 0.8);
        let jet = graph().jet(u, v, 3);
        let z = |i: usize, j: usize| jet.d[i][j].z;
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-13, "{a} {b}");
        close(z(0, 0), u.powi(3) * v * v - u * v);
        close(z(1, 0), 3.0 * u * u * v * v - v);
        close(z(0, 1), 2.0 * u.powi(3) * v - u);
        close(z(2, 0), 6.0 * u * v * v);
        close(z(1, 1), 6.0 * u * u * v - 1.0);
        close(z(0, 2), 2.0 * u.powi(3));
        close(z(3, 0), 6.0 * v * v);
        close(z(2, 1), 12.0 * u * v);
        close(z(1, 2), 6.0 * u * u);
        close(z(0, 3), 0.0);
    }

    #[test]
    fn a_rational_arc_is_a_circle() {
        let s = std::f64::consts::FRAC_1_SQRT_2;
        let arc = [(2.0, 0.0), (2.0, 2.0), (0.0, 2.0)];
        let points: Vec<DVec3> =
            arc.iter().flat_map(|&(x, y)| [DVec3::new(x, y, 0.0), DVec3::new(x, y, 3.0)]).collect();
        let knots = [vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]];
        let weights = [1.0, 1.0, s, s, 1.0, 1.0];
        let cylinder = Spline::new([2, 1], knots, &points, Some(&weights)).unwrap();
        for u in [0.0, 0.2, 0.77, 1.0] {
            let jet = cylinder.jet(u, 0.4, 3);
            let [p, a, b] = [0, 1, 2].map(|i| jet.d[i][0]);
            assert!((p.truncate().length() - 2.0).abs() < 1e-14);
            let curvature = a.cross(b).length() / a.length().powi(3);
            assert!((curvature - 0.5).abs() < 1e-13, "{curvature}");
            // Differences of the second derivative are the third.
            let h = 1e-5;
            let [low, high] = [u - h, u + h].map(|t| cylinder.jet(t, 0.4, 2).d[2][0]);
            let want = (high - low) / (2.0 * h);
            if (h..1.0 - h).contains(&u) {
                assert!((jet.d[3][0] - want).length() < 1e-6 * want.length());
            }
        }
    }

    #[test]
    fn knots_inside_are_met_from_both_sides() {
        let knots = [vec![0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0], vec![0.0, 0.0, 1.0, 1.0]];
        let points: Vec<DVec3> = (0..8)
            .map(|k| DVec3::new(f64::from(k / 2), f64::from(k % 2), f64::from(k * k)))
            .collect();
        let s = Spline::new([2, 1], knots, &points, None).unwrap();
        let (a, b) = (s.jet(0.5 - 1e-12, 0.3, 1), s.jet(0.5, 0.3, 1));
        assert!((a.d[0][0] - b.d[0][0]).length() < 1e-10);
        assert!((a.d[1][0] - b.d[1][0]).length() < 1e-10);
        assert_eq!(s.jet(1.0, 1.0, 0).d[0][0], points[7]);
        assert_eq!(s.jet(0.0, 0.0, 0).d[0][0], points[0]);
    }

    #[test]
    fn the_nearest_point_is_perpendicular_or_on_the_border() {
        let s = graph();
        let grid = NearestGrid::new(&s);
        let ([u, v], far) = s.nearest(&grid, DVec3::new(0.4, 0.5, 0.7));
        let jet = s.jet(u, v, 1);
        let gap = jet.d[0][0] - DVec3::new(0.4, 0.5, 0.7);
        assert!(gap.dot(jet.d[1][0]).abs() < 1e-9 && gap.dot(jet.d[0][1]).abs() < 1e-9);
        assert!((gap.length() - far).abs() < 1e-15);
        let ([u, _], _) = s.nearest(&grid, DVec3::new(-1.0, 0.5, 0.0));
        assert_eq!(u, 0.0);
    }

    #[test]
    fn exchanged_parameters_give_the_same_points() {
        let s = graph();
        let (there, here) = (s.swapped().jet(0.8, 0.3, 2), s.jet(0.3, 0.8, 2));
        assert!(there.d[0][0].distance(here.d[0][0]) < 1e-15);
        assert!(there.d[2][0].distance(here.d[0][2]) < 1e-13);
        assert_eq!(s.swapped().swapped(), s);
    }

    #[test]
    fn counts_that_do_not_fit_are_refused() {
        assert!(Spline::bezier(2, &[DVec3::ZERO; 8]).unwrap_err().to_string().starts_with("8 "));
    }
}
