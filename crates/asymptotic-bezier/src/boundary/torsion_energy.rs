//! The boundary energy `Σ L ∫ τ² ds`: least torsion among the curves the corner torsions span.
//!
//! Each curve is affine in the torsions at its two ends, so the residuals of a curve at Gauss
//! points depend on two unknowns and have closed derivatives.

use geom_core::DVec3;
use gp_solver::{Elements, Options, Problem, ResidualBlock, solve};

use crate::curve::bernstein::{derivative, eval};

/// Gauss-Legendre nodes and weights on `[0, 1]`, eight points.
const GAUSS: [(f64, f64); 8] = [
    (0.019_855_071_751_231_9, 0.050_614_268_145_188_1),
    (0.101_666_761_293_186_6, 0.111_190_517_226_687_2),
    (0.237_233_795_041_835_5, 0.156_853_322_938_943_6),
    (0.408_282_678_752_175_1, 0.181_341_891_689_181),
    (0.591_717_321_247_825, 0.181_341_891_689_181),
    (0.762_766_204_958_164_5, 0.156_853_322_938_943_6),
    (0.898_333_238_706_813_4, 0.111_190_517_226_687_2),
    (0.980_144_928_248_768_1, 0.050_614_268_145_188_1),
];

/// A curve as `P₀ + τ_s P₁ + τ_e P₂` with its unknowns and their signs.
pub(crate) struct TorsionCurve {
    pub(crate) points: [Vec<DVec3>; 3],
    pub(crate) ends: [usize; 2],
    pub(crate) signs: [f64; 2],
}

/// Minimises the energy from `tau` over the unknowns whose bounds leave room; returns the number
/// of steps. Unknowns that leave their bounds are held there and the others solved again.
pub(crate) fn minimize(curves: &[TorsionCurve], bounds: &[[f64; 2]], tau: &mut [f64]) -> usize {
    let mut held: Vec<bool> = bounds.iter().map(|b| b[0] == b[1]).collect();
    let mut iterations = 0;
    loop {
        let mut problem = Problem::new(tau.len());
        problem.add(TorsionRows::new(curves));
        let mut used = vec![false; tau.len()];
        for v in curves.iter().flat_map(|c| c.ends) {
            used[v] = true;
        }
        for v in 0..tau.len() {
            if held[v] || !used[v] {
                problem.variables_mut().fix_unknown(v);
            }
        }
        if (0..tau.len()).all(|v| held[v] || !used[v]) {
            return iterations;
        }
        // A failure leaves the strain minimum, which is a valid answer to start from.
        iterations += solve(problem, tau, &Options::default()).map_or(0, |r| r.iterations);
        let mut changed = false;
        for v in 0..tau.len() {
            let inside = tau[v].clamp(bounds[v][0], bounds[v][1]);
            if inside != tau[v] {
                tau[v] = inside;
                held[v] = true;
                changed = true;
            }
        }
        if !changed {
            return iterations;
        }
    }
}

struct TorsionRows<'a> {
    curves: &'a [TorsionCurve],
    elements: Elements,
}

impl<'a> TorsionRows<'a> {
    fn new(curves: &'a [TorsionCurve]) -> Self {
        let mut elements = Elements::new();
        for curve in curves {
            elements.push(&curve.ends, GAUSS.len());
        }
        Self { curves, elements }
    }

    /// Residual at one Gauss point and its derivatives in the two end torsions.
    fn row(curve: &TorsionCurve, tau: [f64; 2], (t, weight): (f64, f64)) -> (f64, [f64; 2]) {
        let jets: [[DVec3; 3]; 3] = std::array::from_fn(|k| {
            let first = derivative(&curve.points[k]);
            let second = derivative(&first);
            let third = derivative(&second);
            [eval(&first, t), eval(&second, t), eval(&third, t)]
        });
        let r: [DVec3; 3] =
            std::array::from_fn(|d| jets[0][d] + jets[1][d] * tau[0] + jets[2][d] * tau[1]);
        let chord = (curve.points[0][curve.points[0].len() - 1] - curve.points[0][0]).length();
        let c = r[0].cross(r[1]);
        let (cc, det, speed) = (c.length_squared(), c.dot(r[2]), r[0].length());
        let torsion = det / cc;
        let share = (weight * chord * speed).sqrt();
        let slopes = std::array::from_fn(|k| {
            let dr = &jets[k + 1];
            let dc = dr[0].cross(r[1]) + r[0].cross(dr[1]);
            let d_torsion = (dc.dot(r[2]) + c.dot(dr[2])) / cc - 2.0 * det * c.dot(dc) / (cc * cc);
            let d_share = 0.5 * share * r[0].dot(dr[0]) / (speed * speed);
            (share * d_torsion + d_share * torsion) * curve.signs[k]
        });
        (share * torsion, slopes)
    }
}

impl ResidualBlock for TorsionRows<'_> {
    fn name(&self) -> &str {
        "torsion"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (curve, out) in self.curves.iter().zip(residuals.chunks_mut(GAUSS.len())) {
            let tau = [0, 1].map(|e| x[curve.ends[e]] * curve.signs[e]);
            for (out, node) in out.iter_mut().zip(GAUSS) {
                *out = Self::row(curve, tau, node).0;
            }
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        for (i, curve) in self.curves.iter().enumerate() {
            let tau = [0, 1].map(|e| x[curve.ends[e]] * curve.signs[e]);
            for (k, node) in GAUSS.into_iter().enumerate() {
                let (value, slopes) = Self::row(curve, tau, node);
                let row = i * GAUSS.len() + k;
                residuals[row] = value;
                jacobian[2 * row..2 * row + 2].copy_from_slice(&slopes);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jacobian_matches_central_differences() {
        let base: Vec<DVec3> = (0..6)
            .map(|k| f64::from(k) / 5.0)
            .map(|t| DVec3::new(t, 0.4 * t * t, 0.3 * t * t * t))
            .collect();
        let mut along = vec![vec![DVec3::ZERO; 6]; 2];
        along[0][3] = DVec3::new(0.1, 0.02, 0.05);
        along[1][2] = DVec3::new(0.05, -0.03, 0.1);
        let curve = TorsionCurve {
            points: [base, along[0].clone(), along[1].clone()],
            ends: [0, 1],
            signs: [1.0, -1.0],
        };
        let curves = [curve];
        let rows = TorsionRows::new(&curves);
        let x = [0.3, 0.2];
        let (mut r, mut j) = (vec![0.0; 8], vec![0.0; 16]);
        rows.linearize(&x, &mut r, &mut j);
        for k in 0..2 {
            let h = 1e-6;
            let (mut plus, mut minus) = (vec![0.0; 8], vec![0.0; 8]);
            let mut y = x;
            y[k] += h;
            rows.residuals(&y, &mut plus);
            y[k] -= 2.0 * h;
            rows.residuals(&y, &mut minus);
            for i in 0..8 {
                let want = (plus[i] - minus[i]) / (2.0 * h);
                assert!((j[2 * i + k] - want).abs() < 1e-6 * (1.0 + want.abs()));
            }
        }
    }
}
