//! How a strip bends and twists along one curve.

use crate::curve::bezier::{BezierCurve, JetTable};

/// Samples per curve.
const SAMPLES: usize = 201;

/// Sampled integrals and extremes of one curve.
pub(crate) struct Profile {
    pub(crate) length: f64,
    pub(crate) curvature: f64,
    pub(crate) torsion: f64,
    pub(crate) twist: f64,
    pub(crate) width_bound: f64,
    pub(crate) bending: f64,
    pub(crate) twisting: f64,
}

impl Profile {
    /// Samples `curve`; a line has a length and nothing else.
    pub(crate) fn new(curve: &BezierCurve, line: bool) -> Self {
        let table = JetTable::new(curve);
        let mut out = Self {
            length: 0.0,
            curvature: 0.0,
            torsion: 0.0,
            twist: 0.0,
            width_bound: f64::INFINITY,
            bending: 0.0,
            twisting: 0.0,
        };
        let step = 1.0 / (SAMPLES - 1) as f64;
        let mut last: Option<(f64, f64)> = None;
        for k in 0..SAMPLES {
            let t = k as f64 * step;
            let jet = table.at(t);
            // Simpson's rule: fourth order, and the samples are needed for the extremes anyway.
            let share = match k {
                0 => 1.0,
                _ if k == SAMPLES - 1 => 1.0,
                _ if k % 2 == 1 => 4.0,
                _ => 2.0,
            };
            let ds = share * step / 3.0 * jet.first.length();
            out.length += ds;
            if line {
                continue;
            }
            let (kappa, tau) = (jet.curvature(), table.torsion(t, &jet));
            out.curvature = out.curvature.max(kappa);
            out.torsion = out.torsion.max(tau.abs());
            out.twist += ds * tau.abs();
            out.bending += ds * kappa * kappa;
            out.twisting += ds * tau * tau;
            let ratio = tau / kappa;
            if let Some((before, speed)) = last {
                let length = 0.5 * (speed + jet.first.length()) * step;
                out.width_bound = out.width_bound.min(2.0 * length / (ratio - before).abs());
            }
            last = Some((ratio, jet.first.length()));
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::DVec3;

    #[test]
    fn profile_of_a_helix_has_its_constant_curvature_and_torsion() {
        // Radius 1, pitch slope 0.5, one radian, interpolated by a degree-nine polynomial.
        let n = 9;
        let points: Vec<DVec3> = {
            let mut matrix = numerics::Matrix::zeros(n + 1, n + 1);
            for r in 0..=n {
                let basis = crate::curve::bernstein::bernstein(n, r as f64 / n as f64);
                matrix.row_mut(r).copy_from_slice(&basis);
            }
            let helix = |t: f64| DVec3::new(t.cos(), t.sin(), 0.5 * t);
            let solve = |axis: usize| {
                let b: Vec<f64> = (0..=n).map(|r| helix(r as f64 / n as f64)[axis]).collect();
                numerics::affine_space(&matrix, &b, &[1.0; 10], 1e-14).particular
            };
            let (x, y, z) = (solve(0), solve(1), solve(2));
            (0..=n).map(|k| DVec3::new(x[k], y[k], z[k])).collect()
        };
        let profile = Profile::new(&BezierCurve::new(points), false);
        let c = 1.25_f64;
        assert!((profile.length - c.sqrt()).abs() < 1e-7);
        assert!((profile.curvature - 1.0 / c).abs() < 1e-4);
        assert!((profile.torsion - 0.5 / c).abs() < 1e-2);
        assert!((profile.twisting - (0.5 / c).powi(2) * c.sqrt()).abs() < 1e-5);
    }
}
