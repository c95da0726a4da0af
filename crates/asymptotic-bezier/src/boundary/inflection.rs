//! Boundary curves with declared inflections.
//!
//! An inflection needs `r″(t₀) = ρ r′(t₀)`, three equations that the two torsion equations of a
//! quintic leave no room for unless its end curvatures give way. With the torsions at both ends
//! fixed by the other curves, the five unknowns `x₀, κ₀, x₁, κ₁, ρ` are solved for every `t₀` of a
//! grid by Newton's method, and the `t₀` with the least strain and curvature change is refined.
//! Two inflections take their parameters as unknowns as well.

use geom_core::DVec3;

use crate::curve::bernstein::{derivative, eval};
use crate::curve::bezier::BezierCurve;
use numerics::{Matrix, affine_space, norm};

/// Relative residual at which the equations count as solved.
const TOL: f64 = 1e-13;
/// Curvatures may change by this factor at most.
const MAX_CURVATURE_FACTOR: f64 = 5.0;
/// Weight of the squared logarithm of a curvature ratio against the relative strain.
const CURVATURE_WEIGHT: f64 = 4.0;

/// Data of one curve between two vertices whose torsions are known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct InflectedCurve {
    /// From start to end; the start is the origin.
    pub(crate) chord: DVec3,
    pub(crate) arms: [DVec3; 2],
    pub(crate) normals: [DVec3; 2],
    /// Left-signed wishes.
    pub(crate) curvatures: [f64; 2],
    pub(crate) torsions: [f64; 2],
}

/// A solved curve with its inflection parameters.
pub(crate) struct Inflected {
    pub(crate) curve: BezierCurve,
    pub(crate) parameters: Vec<f64>,
}

impl InflectedCurve {
    /// The quintic with `count` (1 or 2) inflections, or the best relative defect and the number
    /// of Newton runs when none was found.
    pub(crate) fn solve(&self, count: usize) -> Result<Inflected, (f64, usize)> {
        let candidates: Vec<Vec<f64>> = match count {
            1 => (1..50).map(|k| vec![f64::from(k) / 50.0]).collect(),
            2 => (1..12)
                .flat_map(|a| (a + 1..12).map(move |b| (a, b)))
                .map(|(a, b)| vec![f64::from(a) / 12.0, f64::from(b) / 12.0])
                .collect(),
            _ => return Err((f64::INFINITY, 0)),
        };
        let runs = candidates.len();
        let mut least_defect = f64::INFINITY;
        let mut best: Option<(f64, Vec<f64>, Vec<f64>)> = None;
        for start in candidates {
            match self.newton(&start, count == 2) {
                Ok((cost, z, t)) => {
                    if best.as_ref().is_none_or(|b| cost < b.0) {
                        best = Some((cost, z, t));
                    }
                }
                Err(defect) => least_defect = least_defect.min(defect),
            }
        }
        let Some((mut cost, mut z, mut t)) = best else { return Err((least_defect, runs)) };
        if count == 1 {
            // Shrinking steps around the best grid value.
            let mut step = 0.01;
            while step > 1e-9 {
                let mut improved = false;
                for side in [-step, step] {
                    let trial = t[0] + side;
                    if trial <= 0.0 || trial >= 1.0 {
                        continue;
                    }
                    if let Ok((c, y, s)) = self.newton(&[trial], false)
                        && c < cost
                    {
                        (cost, z, t) = (c, y, s);
                        improved = true;
                    }
                }
                if !improved {
                    step *= 0.5;
                }
            }
        }
        Ok(Inflected { curve: self.curve(&z), parameters: t })
    }

    /// Newton's method from the wished curvatures; with `free` the parameters are unknowns too.
    fn newton(&self, start: &[f64], free: bool) -> Result<(f64, Vec<f64>, Vec<f64>), f64> {
        let m = start.len();
        let mut z = vec![2.0, self.curvatures[0], 2.0, self.curvatures[1]];
        z.extend(vec![0.0; m]);
        let mut t = start.to_vec();
        let unknowns = if free { 4 + 2 * m } else { 4 + m };
        let mut scale = vec![1.0, self.curvatures[0].abs(), 1.0, self.curvatures[1].abs()];
        scale.resize(unknowns, 1.0);
        let mut defect = f64::INFINITY;
        for _ in 0..30 {
            let value = self.equations(&z, &t);
            defect = norm(&value);
            if defect <= TOL {
                break;
            }
            let mut jacobian = Matrix::zeros(value.len(), unknowns);
            for k in 0..4 + m {
                // Linear in each of them alone, so any step is exact.
                let mut y = z.clone();
                y[k] += scale[k];
                for (r, (a, b)) in self.equations(&y, &t).iter().zip(&value).enumerate() {
                    jacobian[(r, k)] = (a - b) / scale[k];
                }
            }
            if free {
                let curve = self.curve(&z);
                for (k, t) in t.iter().enumerate() {
                    let jet = curve.jet(*t);
                    let slope = (jet.third - jet.second * z[4 + k]) / self.chord.length();
                    for axis in 0..3 {
                        jacobian[(2 + 3 * k + axis, 4 + m + k)] = slope[axis];
                    }
                }
            }
            let negative: Vec<f64> = value.iter().map(|v| -v).collect();
            let step = affine_space(&jacobian, &negative, &scale, 1e-12).particular;
            for k in 0..unknowns {
                if k < 4 + m {
                    z[k] += step[k];
                } else {
                    t[k - 4 - m] += step[k].clamp(-0.1, 0.1);
                }
            }
            if !z.iter().chain(&t).all(|v| v.is_finite()) {
                return Err(f64::INFINITY);
            }
        }
        // Rounding may stop just above the tolerance.
        if defect > 100.0 * TOL {
            return Err(defect);
        }
        let ratios = [z[1] / self.curvatures[0], z[3] / self.curvatures[1]];
        let inside = t.iter().all(|t| *t > 0.0 && *t < 1.0) && t.windows(2).all(|w| w[0] < w[1]);
        let allowed = 1.0 / MAX_CURVATURE_FACTOR..MAX_CURVATURE_FACTOR;
        if !inside || !ratios.iter().all(|r| allowed.contains(r)) {
            return Err(1.0);
        }
        let curve = self.curve(&z);
        let chord = self.chord.length_squared();
        let strain = curve.derivative_energy(2) / chord;
        let moved: f64 = ratios.iter().map(|r| r.ln().powi(2)).sum();
        Ok((strain + CURVATURE_WEIGHT * moved, z, t))
    }

    fn end(&self, e: usize) -> DVec3 {
        self.chord * e as f64
    }

    fn curve(&self, z: &[f64]) -> BezierCurve {
        let third = |e: usize, x: f64, k: f64| {
            let arm = self.arms[e];
            self.end(e) + arm * x + self.normals[e].cross(arm) * (1.25 * k * arm.length())
        };
        let [p, q] = [self.end(0), self.end(1)];
        BezierCurve::new(vec![
            p,
            p + self.arms[0],
            third(0, z[0], z[1]),
            third(1, z[2], z[3]),
            q + self.arms[1],
            q,
        ])
    }

    /// Torsion equations and `r″ − ρ r′` at each parameter, over the chord.
    fn equations(&self, z: &[f64], t: &[f64]) -> Vec<f64> {
        let curve = self.curve(z);
        let points = curve.points();
        let chord = self.chord.length();
        let mut out = Vec::with_capacity(2 + 3 * t.len());
        for (e, k) in [(0, z[1]), (1, z[3])] {
            let third = points[if e == 0 { 3 } else { 2 }];
            let lever = k * self.arms[e].length().powi(3) * 25.0 / 12.0;
            let height = self.normals[e].dot(third - self.end(e));
            out.push((height - lever * self.torsions[e]) / chord);
        }
        let first = derivative(points);
        let second = derivative(&first);
        for (t, rho) in t.iter().zip(&z[4..]) {
            let v = (eval(&second, *t) - eval(&first, *t) * *rho) / chord;
            out.extend(v.to_array());
        }
        out
    }
}
