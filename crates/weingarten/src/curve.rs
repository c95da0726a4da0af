//! B-spline curves in the curvature diagram: fit, foot points, tangent lines.

use bspline::{Degree, KnotVector};
use numerics::lu_solve;

/// Control points of a fitted curve.
const CONTROL: usize = 8;
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

    /// A curve of eight control points near `points`: parameters first by the principal axis of
    /// the cloud, then by foot points.
    pub(crate) fn fit(points: &[[f64; 2]]) -> Option<Self> {
        let (mean, axis) = principal_axis(points);
        let along: Vec<f64> = points
            .iter()
            .map(|p| (p[0] - mean[0]) * axis[0] + (p[1] - mean[1]) * axis[1])
            .collect();
        let (low, high) = along
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &t| (l.min(t), h.max(t)));
        if !(high > low) {
            return None;
        }
        let mut parameters: Vec<f64> = along.iter().map(|t| (t - low) / (high - low)).collect();
        let mut curve = Self::new(vec![[0.0; 2]; CONTROL])?;
        curve.refit(points, &parameters)?;
        for _ in 0..ROUNDS {
            let feet = curve.feet(points);
            for (t, foot) in parameters.iter_mut().zip(feet) {
                *t = foot.parameter;
            }
            curve.refit(points, &parameters)?;
        }
        Some(curve)
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

    fn foot(&self, p: [f64; 2], candidates: &[[f64; 2]]) -> Foot {
        let square = |c: &[f64; 2]| (c[0] - p[0]).powi(2) + (c[1] - p[1]).powi(2);
        let mut best = (f64::INFINITY, 0);
        for (k, c) in candidates.iter().enumerate() {
            if square(c) < best.0 {
                best = (square(c), k);
            }
        }
        let mut t = best.1 as f64 / CANDIDATES as f64;
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
        let [point, d, _] = self.derivatives(t);
        let length = d[0].hypot(d[1]);
        let normal = if length > 0.0 { [-d[1] / length, d[0] / length] } else { [1.0, 0.0] };
        Foot { parameter: t, point, normal }
    }
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
        let curve = DiagramCurve::fit(&points).unwrap();
        for (foot, p) in curve.feet(&points).iter().zip(&points) {
            let distance = (foot.point[0] - p[0]).hypot(foot.point[1] - p[1]);
            assert!(distance < 2e-3, "{distance}");
        }
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
