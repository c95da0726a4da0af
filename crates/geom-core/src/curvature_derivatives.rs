//! Mean and Gaussian curvature with their exact parameter derivatives.

use crate::forms::CurvatureError;
use crate::jet::SurfaceJet;

/// `H` and `K` with their first derivatives in the parameters.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CurvatureDerivatives {
    /// Mean curvature, in 1/length.
    pub h: f64,
    /// Gaussian curvature, in 1/length².
    pub k: f64,
    /// `∂H/∂u`.
    pub h_u: f64,
    /// `∂H/∂v`.
    pub h_v: f64,
    /// `∂K/∂u`.
    pub k_u: f64,
    /// `∂K/∂v`.
    pub k_v: f64,
}

impl SurfaceJet {
    /// Mean and Gaussian curvature and their derivatives from derivatives up to order three.
    ///
    /// With `n = S_u × S_v` left at its length, `Δ = n·n` and `l = S_uu·n, m = S_uv·n, q = S_vv·n`:
    /// `K = (l q − m²)/Δ²` and `H = (l G − 2 m F + q E)/(2 Δ^{3/2})`; the derivatives follow by
    /// the product rule.
    ///
    /// # Errors
    /// [`CurvatureError::Singular`] where the tangents are parallel or vanish.
    ///
    /// # Example
    /// ```
    /// use geom_core::{CurvatureError, DVec3, SurfaceJet};
    /// // The cylinder z = x² / 2 + x³ / 6 at x = 0, of curvature 1 that grows at rate 1.
    /// let mut jet = SurfaceJet::default();
    /// jet.derivatives[SurfaceJet::index(1, 0)] = DVec3::X;
    /// jet.derivatives[SurfaceJet::index(0, 1)] = DVec3::Y;
    /// jet.derivatives[SurfaceJet::index(2, 0)] = DVec3::Z;
    /// jet.derivatives[SurfaceJet::index(3, 0)] = DVec3::Z;
    /// let change = jet.curvature_derivatives()?;
    /// assert_eq!((change.h, change.h_u, change.h_v), (0.5, 0.5, 0.0));
    /// assert_eq!((change.k, change.k_u), (0.0, 0.0));
    /// # Ok::<(), CurvatureError>(())
    /// ```
    pub fn curvature_derivatives(&self) -> Result<CurvatureDerivatives, CurvatureError> {
        let first = self.first_form();
        first.check()?;
        let (a, b) = (self.d(1, 0), self.d(0, 1));
        let (c, d, e) = (self.d(2, 0), self.d(1, 1), self.d(0, 2));
        let n = a.cross(b);
        let delta = n.dot(n);
        let (l, m, q) = (c.dot(n), d.dot(n), e.dot(n));
        let half = 0.5 / (delta * delta.sqrt());
        let h = (l * first.g - 2.0 * m * first.f + q * first.e) * half;
        let k = (l * q - m * m) / (delta * delta);
        // Derivatives of (a, b, c, d, e) in one parameter give those of H and K in it.
        let along = |[a1, b1, c1, d1, e1]: [glam::DVec3; 5]| {
            let n1 = a1.cross(b) + a.cross(b1);
            let relative = 2.0 * n.dot(n1) / delta;
            let (e_1, g_1) = (2.0 * a.dot(a1), 2.0 * b.dot(b1));
            let f_1 = a1.dot(b) + a.dot(b1);
            let l1 = c1.dot(n) + c.dot(n1);
            let m1 = d1.dot(n) + d.dot(n1);
            let q1 = e1.dot(n) + e.dot(n1);
            let numerator =
                l1 * first.g + l * g_1 - 2.0 * (m1 * first.f + m * f_1) + q1 * first.e + q * e_1;
            let h1 = numerator * half - 1.5 * h * relative;
            let k1 = (l1 * q + l * q1 - 2.0 * m * m1) / (delta * delta) - 2.0 * k * relative;
            (h1, k1)
        };
        let (h_u, k_u) = along([c, d, self.d(3, 0), self.d(2, 1), self.d(1, 2)]);
        let (h_v, k_v) = along([d, e, self.d(2, 1), self.d(1, 2), self.d(0, 3)]);
        Ok(CurvatureDerivatives { h, k, h_u, h_v, k_u, k_v })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assert_close;
    use glam::DVec3;

    /// Jet of order three of the torus of radii 3 and 1, u around the axis.
    fn torus(u: f64, v: f64) -> SurfaceJet {
        let mut jet = SurfaceJet::default();
        let cos = |t: f64, k: usize| (t + k as f64 * std::f64::consts::FRAC_PI_2).cos();
        let sin = |t: f64, k: usize| (t + k as f64 * std::f64::consts::FRAC_PI_2).sin();
        for total in 0..=3 {
            for b in 0..=total {
                let a = total - b;
                let r = cos(v, b) + if b == 0 { 3.0 } else { 0.0 };
                let z = if a == 0 { sin(v, b) } else { 0.0 };
                jet.derivatives[SurfaceJet::index(a, b)] =
                    DVec3::new(r * cos(u, a), r * sin(u, a), z);
            }
        }
        jet
    }

    #[test]
    fn torus_derivatives_are_closed_form() {
        for v in (0..12).map(|i| 0.5 * f64::from(i)) {
            let got = torus(0.8, v).curvature_derivatives().unwrap();
            let r = 3.0 + v.cos();
            assert_close(got.k, v.cos() / r, 1e-14);
            assert_close(got.h, -0.5 * (1.0 + v.cos() / r), 1e-14);
            let k_v = -3.0 * v.sin() / (r * r);
            assert_close(got.k_v, k_v, 1e-14);
            assert_close(got.h_v, -0.5 * k_v, 1e-14);
            assert_close(got.h_u, 0.0, 1e-14);
            assert_close(got.k_u, 0.0, 1e-14);
        }
    }
}
