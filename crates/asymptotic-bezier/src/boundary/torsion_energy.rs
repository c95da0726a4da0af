//! The boundary energy `Σ L ∫ τ² ds`: least torsion among the curves the corner torsions span.
//!
//! Each curve is affine in the torsions at its two ends, so the residuals of a curve at Gauss
//! points depend on two unknowns and have closed derivatives.

use geom_core::DVec3;
use gp_solver::{Elements, Group, Options as SolverOptions, Problem, ResidualBlock};

use crate::boundary::curve_energy::torsion_variables;
use crate::curve::bernstein::{derivative, eval};
use crate::error::Error;
use crate::watch::Watch;

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

/// A curve as `P₀ + σ_s τ_s P₁ + σ_e τ_e P₂`, affine in the torsions of its vertices.
#[derive(Clone, Debug, PartialEq)]
pub struct TorsionCurve {
    /// Control points `P₀`, `P₁`, `P₂`, measured from the start of the curve.
    pub points: [Vec<DVec3>; 3],
    /// Vertices at its start and end.
    pub ends: [usize; 2],
    /// `σ`: sign of the torsion of the curve over that of its vertex.
    pub signs: [f64; 2],
}

/// The problem of the curves with the torsions marked held; `None` if nothing is left to move.
pub(crate) fn problem(
    curves: &[TorsionCurve],
    vertices: usize,
    held: &[bool],
) -> Option<Problem<'static>> {
    let (mut variables, torsions) = torsion_variables(vertices);
    let mut used = vec![false; vertices];
    for v in curves.iter().flat_map(|c| c.ends) {
        used[v] = true;
    }
    let free = |v: usize| used[v] && !held[v];
    (0..vertices).filter(|v| !free(*v)).for_each(|v| _ = variables.fix(torsions, v));
    let mut problem = Problem::new(variables);
    problem.add(TorsionRows::new(curves.to_vec(), torsions));
    (0..vertices).any(free).then_some(problem)
}

/// Minimises the energy from `tau` over the unknowns whose bounds leave room. Unknowns that leave
/// their bounds are held there and the others solved again.
pub(crate) fn minimize(
    curves: &[TorsionCurve],
    bounds: &[[f64; 2]],
    tau: &mut [f64],
    watch: &mut Watch<'_, '_>,
) -> Result<(), Error> {
    let mut held: Vec<bool> = bounds.iter().map(|b| b[0] == b[1]).collect();
    loop {
        let Some(mut problem) = problem(curves, tau.len(), &held) else { return Ok(()) };
        let stage = watch.stage().clone();
        watch.extend(&stage, &mut problem)?;
        // A failure leaves the strain minimum, which is a valid answer to start from.
        watch.improve(problem, tau, &SolverOptions::default())?;
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
            return Ok(());
        }
    }
}

/// Rows `√(w L |r′|) τ(t)` at eight Gauss points of every curve (weights `w`, chord `L`), so that
/// their squares sum to `L ∫ τ² ds`, which has no unit; the sign is that of the torsion
/// `τ = det(r′, r″, r‴) / |r′ × r″|²`. Two unknowns a curve, derivatives in closed form.
///
/// Wang et al. 2019, Remark 3.4, names the torsion among the energies one may take.
#[derive(Clone, Debug)]
pub struct TorsionRows {
    curves: Vec<TorsionCurve>,
    torsions: Group,
    elements: Elements,
}

impl TorsionRows {
    /// The rows of the curves in the group of the torsions, one per vertex.
    #[must_use]
    pub fn new(curves: Vec<TorsionCurve>, torsions: Group) -> Self {
        let mut elements = Elements::new();
        for curve in &curves {
            elements.push(&curve.ends.map(|v| torsions.column(v, 0)), GAUSS.len());
        }
        Self { curves, torsions, elements }
    }

    /// Torsions of the curve itself at its ends.
    fn ends(&self, curve: &TorsionCurve, x: &[f64]) -> [f64; 2] {
        [0, 1].map(|e| x[self.torsions.column(curve.ends[e], 0)] * curve.signs[e])
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

impl ResidualBlock for TorsionRows {
    fn name(&self) -> &str {
        "torsion"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (curve, out) in self.curves.iter().zip(residuals.chunks_mut(GAUSS.len())) {
            let tau = self.ends(curve, x);
            for (out, node) in out.iter_mut().zip(GAUSS) {
                *out = Self::row(curve, tau, node).0;
            }
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        for (i, curve) in self.curves.iter().enumerate() {
            let tau = self.ends(curve, x);
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
    use gp_solver::check_jacobian;

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
        let (_, torsions) = torsion_variables(2);
        let worst = check_jacobian(&TorsionRows::new(vec![curve], torsions), &[0.3, 0.2]);
        let worst = worst.unwrap().unwrap();
        assert!(worst.error < 1e-7, "{worst:?}");
    }
}
