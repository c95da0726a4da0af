//! Border control points that glide on the curve through the border points of the reference.

use bspline::{BsplineCurve, Degree, KnotVector};
use glam::{DMat3, DVec3};
use gp_solver::{Elements, ResidualBlock};
use numerics::lu_solve;

use super::net::Net;

/// Interpolating cubics are searched for foot points from this many starts per segment.
const STARTS: usize = 8;
/// Newton steps of a foot point; started this near, it needs fewer.
const NEWTON_STEPS: usize = 8;

/// Indices of the border control points along each open side, ends included; a side that is
/// closed has no second copy of its first point.
pub(crate) fn border_points(net: Net) -> Vec<Vec<usize>> {
    let Net { n_u, n_v, closed_u, closed_v } = net;
    let mut sides = Vec::new();
    if !closed_v {
        for j in [0, n_v - 1] {
            sides.push((0..n_u).map(|i| i * n_v + j).collect());
        }
    }
    if !closed_u {
        for i in [0, n_u - 1] {
            sides.push((0..n_v).map(|j| i * n_v + j).collect());
        }
    }
    sides
}

/// `w (I − t tᵀ)(c − p)` for every border control point `c` with foot point `p` on the curve and
/// tangent `t` there, both of the last iterate; corners are held, `w (c − c⁰)`
/// (Pellis et al. 2021, Sec. 3.1.4).
#[derive(Clone, Debug)]
pub struct BorderGlide {
    elements: Elements,
    curves: Vec<BsplineCurve>,
    gliding: Vec<Gliding>,
    weight: f64,
}

/// A border point with the plane across its curve.
#[derive(Clone, Debug)]
struct Gliding {
    control: usize,
    /// The curve it glides on; corners have none.
    curve: Option<usize>,
    foot: DVec3,
    across: DMat3,
}

impl BorderGlide {
    /// Glides on the curves through the border points of `reference`.
    #[must_use]
    pub fn new(net: Net, reference: &[f64], weight: f64) -> Self {
        let at = |k: usize| DVec3::from_slice(&reference[3 * k..3 * k + 3]);
        let (mut curves, mut gliding) = (Vec::new(), Vec::new());
        let mut elements = Elements::new();
        // The sides along u come first; they are closed if u is.
        let open_v = if net.closed_v { 0 } else { 2 };
        for (side, points) in border_points(net).iter().enumerate() {
            let closed = if side < open_v { net.closed_u } else { net.closed_v };
            let positions: Vec<DVec3> = points.iter().map(|&k| at(k)).collect();
            // Sides collapsed to a point, and others no cubic goes through, are held.
            let curve = interpolate(&positions, closed);
            for (s, &control) in points.iter().enumerate() {
                let is_end = !closed && (s == 0 || s + 1 == points.len());
                // A corner lies on two sides, and is held once.
                if is_end && gliding.iter().any(|g: &Gliding| g.control == control) {
                    continue;
                }
                let held = is_end || curve.is_none();
                gliding.push(Gliding {
                    control,
                    curve: (!held).then_some(curves.len()),
                    foot: at(control),
                    across: DMat3::IDENTITY,
                });
                elements.push(&[3 * control, 3 * control + 1, 3 * control + 2], 3);
            }
            curves.extend(curve);
        }
        let mut made = Self { elements, curves, gliding, weight };
        made.refresh(reference);
        made
    }
}

impl ResidualBlock for BorderGlide {
    fn name(&self) -> &str {
        "border"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn refresh(&mut self, x: &[f64]) {
        for g in &mut self.gliding {
            let Some(curve) = g.curve else { continue };
            let point = DVec3::from_slice(&x[3 * g.control..3 * g.control + 3]);
            let (foot, tangent) = foot_point(&self.curves[curve], point);
            g.foot = foot;
            g.across = DMat3::IDENTITY
                - DMat3::from_cols(tangent * tangent.x, tangent * tangent.y, tangent * tangent.z);
        }
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (rows, g) in residuals.chunks_exact_mut(3).zip(&self.gliding) {
            let point = DVec3::from_slice(&x[3 * g.control..3 * g.control + 3]);
            (g.across * (point - g.foot) * self.weight).write_to_slice(rows);
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        for (block, g) in jacobian.chunks_exact_mut(9).zip(&self.gliding) {
            // Symmetric, so that rows and columns are the same.
            block.copy_from_slice(&(g.across * self.weight).to_cols_array());
        }
    }
}

/// `w (l/l⁰ − 1)` for the edges of the control net along the open sides: gliding points keep their
/// spacing.
#[derive(Clone, Debug)]
pub struct BorderSpacing {
    elements: Elements,
    /// Ends and length at the reference.
    edges: Vec<([usize; 2], f64)>,
    weight: f64,
}

impl BorderSpacing {
    /// Keeps the spacing that `reference`, the coordinates of the control points, has.
    #[must_use]
    pub fn new(net: Net, reference: &[f64], weight: f64) -> Self {
        let (mut edges, mut elements) = (Vec::new(), Elements::new());
        let open_v = if net.closed_v { 0 } else { 2 };
        for (side, points) in border_points(net).iter().enumerate() {
            let closed = if side < open_v { net.closed_u } else { net.closed_v };
            let last = closed.then(|| [points[points.len() - 1], points[0]]);
            for [a, b] in points.windows(2).map(|p| [p[0], p[1]]).chain(last) {
                let length = edge(reference, [a, b]).length();
                // Points of a side collapsed to one have no spacing.
                if length > 0.0 {
                    edges.push(([a, b], length));
                    let column = |k: usize| [3 * k, 3 * k + 1, 3 * k + 2];
                    elements.push(&[column(a), column(b)].concat(), 1);
                }
            }
        }
        Self { elements, edges, weight }
    }
}

fn edge(x: &[f64], [a, b]: [usize; 2]) -> DVec3 {
    DVec3::from_slice(&x[3 * b..3 * b + 3]) - DVec3::from_slice(&x[3 * a..3 * a + 3])
}

impl ResidualBlock for BorderSpacing {
    fn name(&self) -> &str {
        "border_spacing"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (r, &(ends, length)) in residuals.iter_mut().zip(&self.edges) {
            *r = self.weight * (edge(x, ends).length() / length - 1.0);
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        for (row, &(ends, length)) in jacobian.chunks_exact_mut(6).zip(&self.edges) {
            let slope = edge(x, ends).normalize_or_zero() * (self.weight / length);
            row[..3].copy_from_slice(&(-slope).to_array());
            row[3..].copy_from_slice(&slope.to_array());
        }
    }
}

/// The cubic spline through `points` with chord lengths as parameters and the not-a-knot end
/// condition; of lower degree if there are fewer than four. `None` if two neighbours coincide.
fn interpolate(points: &[DVec3], closed: bool) -> Option<BsplineCurve> {
    let n = points.len();
    let mut chord = vec![0.0];
    for k in 1..if closed { n + 1 } else { n } {
        chord.push(chord[k - 1] + points[k - 1].distance(points[k % n]));
    }
    let total = *chord.last()?;
    if !chord.windows(2).all(|c| c[1] - c[0] > 1e-9 * total) {
        return None;
    }
    let knots = if closed {
        KnotVector::periodic(Degree::new(3.min(n - 1)).ok()?, &chord).ok()?
    } else {
        let degree = 3.min(n - 1);
        let mut knots = vec![0.0; degree + 1];
        // The second point and the last but one are no knots.
        if n > 4 {
            knots.extend_from_slice(&chord[2..n - 2]);
        }
        knots.extend(std::iter::repeat_n(total, degree + 1));
        KnotVector::new(Degree::new(degree).ok()?, knots).ok()?
    };
    let mut matrix = vec![0.0; n * n];
    let mut values = Vec::with_capacity(3 * n);
    for (k, point) in points.iter().enumerate() {
        let basis = knots.basis(chord[k], 0);
        for r in 0..knots.degree().order() {
            matrix[k * n + knots.control_index(basis.span, r)] += basis.values[0][r];
        }
        values.extend(point.to_array());
    }
    if !lu_solve(&mut matrix, &mut values, n) {
        return None;
    }
    let control = values.chunks_exact(3).map(DVec3::from_slice).collect();
    BsplineCurve::new(knots, control, None).ok()
}

/// The nearest point of `curve` and its unit tangent there.
fn foot_point(curve: &BsplineCurve, point: DVec3) -> (DVec3, DVec3) {
    let (start, end) = curve.knots().domain();
    let breaks = curve.knots().breaks();
    let mut best = (f64::INFINITY, start);
    for piece in breaks.windows(2) {
        for k in 0..=STARTS {
            let t = piece[0] + (piece[1] - piece[0]) * k as f64 / STARTS as f64;
            let distance = curve.point(t).distance_squared(point);
            if distance < best.0 {
                best = (distance, t);
            }
        }
    }
    let closed = curve.knots().is_periodic();
    let mut t = best.1;
    for _ in 0..NEWTON_STEPS {
        let d = curve.derivatives(t, 2);
        let away = point - d[0];
        let speed = d[1].length_squared();
        // Far from the curve the second-order term may turn the step around.
        let slope = (speed - away.dot(d[2])).max(1e-3 * speed);
        if !(slope > 0.0) {
            break;
        }
        t += away.dot(d[1]) / slope;
        t = if closed { curve.knots().normalize(t) } else { t.clamp(start, end) };
    }
    let d = curve.derivatives(t, 1);
    (d[0], d[1].normalize_or_zero())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_interpolated_exactly_and_its_points_are_their_own_feet() {
        let cubic = |t: f64| DVec3::new(t, 0.3 * t * t - t, 0.1 * t * t * t);
        let points: Vec<DVec3> = (0..9).map(|k| cubic(0.3 * f64::from(k))).collect();
        let curve = interpolate(&points, false).unwrap();
        for p in &points {
            let (foot, _) = foot_point(&curve, *p);
            assert!(foot.distance(*p) < 1e-12);
        }
        // Between the points the spline of chord-length parameters is close to the cubic.
        let (foot, tangent) = foot_point(&curve, cubic(1.0));
        assert!(foot.distance(cubic(1.0)) < 1e-3);
        assert!((tangent.length() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_closed_side_is_interpolated_with_its_period() {
        let points: Vec<DVec3> = (0..12)
            .map(|k| {
                let a = std::f64::consts::TAU * f64::from(k) / 12.0;
                DVec3::new(a.cos(), a.sin(), 0.0)
            })
            .collect();
        let curve = interpolate(&points, true).unwrap();
        let half = std::f64::consts::TAU / 24.0;
        let middle = DVec3::new(half.cos(), -half.sin(), 0.0);
        let (foot, tangent) = foot_point(&curve, middle);
        assert!(foot.distance(middle) < 1e-3);
        assert!(tangent.dot(middle).abs() < 1e-3);
    }
}
