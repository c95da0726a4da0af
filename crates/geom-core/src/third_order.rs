//! Third-order shape of a surface: how the normal curvature changes along it.

use crate::forms::CurvatureError;
use crate::jet::SurfaceJet;
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

/// Second- and third-order shape of a surface at a point, in an orthonormal tangent frame.
///
/// The covariant derivative of the second fundamental form is a symmetric cubic form `C` (by the
/// Codazzi equations), so the arc-length derivative of the normal curvature along the direction at
/// angle `θ` from `e1` is (Mehlum and Tarrou 1998; Joshi 2008, sec. 3.6)
///
/// `κ_n'(θ) = C(θ, θ, θ) = F1 cos(θ + α) + F3 cos 3(θ + α + β)`.
///
/// All formulas avoid angles except for display. Where the printed formulas are wrong (Joshi 2008,
/// Eqs. 3.26 and 3.36: the roles of the angles, an extra quarter) these are the corrected ones.
///
/// # Example
/// ```
/// use geom_core::{CurvatureError, DVec3, SurfaceJet, ThirdOrder};
/// // The cylinder z = x³ / 6: along x the curvature grows at rate 1, along y it does not change.
/// let mut jet = SurfaceJet::default();
/// jet.derivatives[SurfaceJet::index(1, 0)] = DVec3::X;
/// jet.derivatives[SurfaceJet::index(0, 1)] = DVec3::Y;
/// jet.derivatives[SurfaceJet::index(3, 0)] = DVec3::Z;
/// let shape = ThirdOrder::new(&jet)?;
/// assert_eq!((shape.inline_derivative(0.0), shape.cubic), (1.0, [1.0, 0.0, 0.0, 0.0]));
/// assert_eq!((shape.f1(), shape.f3()), (0.75, 0.25)); // cos³ = (3 cos + cos 3·) / 4
/// # Ok::<(), CurvatureError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ThirdOrder {
    /// First tangent, along `S_u`.
    pub e1: DVec3,
    /// Second tangent; `e1 × e2` is the normal.
    pub e2: DVec3,
    /// Second fundamental form `II(e1,e1), II(e1,e2), II(e2,e2)`, in 1/length.
    pub second: [f64; 3],
    /// `C(e1,e1,e1), C(e1,e1,e2), C(e1,e2,e2), C(e2,e2,e2)`, in 1/length².
    pub cubic: [f64; 4],
}

/// Pattern of the curvature lines around an umbilic (Berry and Hannay 1977).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UmbilicKind {
    /// Index +1/2, one curvature line ends at the umbilic.
    Lemon,
    /// Index +1/2, a sheaf of curvature lines ends at the umbilic.
    Monstar,
    /// Index −1/2.
    Star,
}

impl ThirdOrder {
    /// Shape from a surface's derivatives up to order three.
    ///
    /// # Errors
    /// [`CurvatureError::Singular`] where the tangents are parallel or vanish.
    pub fn new(jet: &SurfaceJet) -> Result<Self, CurvatureError> {
        let (su, sv) = (jet.d(1, 0), jet.d(0, 1));
        let area = jet.first_form().check()?.sqrt();
        let n = su.cross(sv) / area;
        let length = su.length();
        // e1 = a S_u, e2 = b S_u + c S_v.
        let (a, c) = (1.0 / length, length / area);
        let b = -su.dot(sv) * a / area;
        let (e1, e2) = (a * su, b * su + c * sv);
        // Pulls a quadratic form on (u, v) back to the frame.
        let frame = |f: [f64; 3]| {
            [
                a * a * f[0],
                a * (b * f[0] + c * f[1]),
                b * b * f[0] + 2.0 * b * c * f[1] + c * c * f[2],
            ]
        };
        let seconds = [jet.d(2, 0), jet.d(1, 1), jet.d(0, 2)];
        let [l, m, q] = frame(seconds.map(|s| s.dot(n)));
        let x = frame(seconds.map(|s| s.dot(e1)));
        let y = frame(seconds.map(|s| s.dot(e2)));
        let h = [jet.d(3, 0), jet.d(2, 1), jet.d(1, 2), jet.d(0, 3)].map(|s| s.dot(n));
        // C = D³S·n − the symmetric sum of II(D²S tangential, ·), from n_u = −II(S_u, ·).
        let cubic = [
            a * a * a * h[0] - 3.0 * (x[0] * l + y[0] * m),
            a * a * (b * h[0] + c * h[1]) - 2.0 * (x[1] * l + y[1] * m) - (x[0] * m + y[0] * q),
            a * (b * b * h[0] + 2.0 * b * c * h[1] + c * c * h[2])
                - 2.0 * (x[1] * m + y[1] * q)
                - (x[2] * l + y[2] * m),
            b * b * b * h[0] + 3.0 * (b * b * c * h[1] + b * c * c * h[2]) + c * c * c * h[3]
                - 3.0 * (x[2] * m + y[2] * q),
        ];
        Ok(Self { e1, e2, second: [l, m, q], cubic })
    }

    /// Mean curvature, in 1/length.
    #[must_use]
    pub fn mean_curvature(&self) -> f64 {
        0.5 * (self.second[0] + self.second[2])
    }

    /// Gaussian curvature, in 1/length².
    #[must_use]
    pub fn gaussian_curvature(&self) -> f64 {
        self.second[0] * self.second[2] - self.second[1] * self.second[1]
    }

    /// Cosine and sine amplitude of the first harmonic of `κ_n'`.
    #[must_use]
    pub fn first_harmonic(&self) -> [f64; 2] {
        let [a, b, c, d] = self.cubic;
        [0.75 * (a + c), 0.75 * (b + d)]
    }

    /// Cosine and sine amplitude of the third harmonic of `κ_n'`.
    #[must_use]
    pub fn third_harmonic(&self) -> [f64; 2] {
        let [a, b, c, d] = self.cubic;
        [0.25 * (a - 3.0 * c), 0.25 * (3.0 * b - d)]
    }

    /// `F1`, in 1/length²; `F1² = (9/4) |∇H|²`.
    #[must_use]
    pub fn f1(&self) -> f64 {
        let [c, s] = self.first_harmonic();
        c.hypot(s)
    }

    /// `F3`, in 1/length².
    #[must_use]
    pub fn f3(&self) -> f64 {
        let [c, s] = self.third_harmonic();
        c.hypot(s)
    }

    /// Phase `α` of the first harmonic, in radians; 0 where `F1 = 0`.
    #[must_use]
    pub fn alpha(&self) -> f64 {
        let [c, s] = self.first_harmonic();
        (-s).atan2(c)
    }

    /// Phase `β` of the third harmonic against the first, in radians and up to thirds of a turn.
    #[must_use]
    pub fn beta(&self) -> f64 {
        let [c, s] = self.third_harmonic();
        (-s).atan2(c) / 3.0 - self.alpha()
    }

    /// Normal curvature along the direction at angle `theta` from `e1`.
    #[must_use]
    pub fn normal_curvature(&self, theta: f64) -> f64 {
        let (s, c) = theta.sin_cos();
        let [l, m, q] = self.second;
        c * c * l + 2.0 * c * s * m + s * s * q
    }

    /// Inline derivative `κ_n'(θ)`: of the normal curvature along its own direction.
    #[must_use]
    pub fn inline_derivative(&self, theta: f64) -> f64 {
        let (s, c) = theta.sin_cos();
        let [a, b, d, e] = self.cubic;
        c * c * c * a + 3.0 * c * c * s * b + 3.0 * c * s * s * d + s * s * s * e
    }

    /// Cross derivative `κ_n^×(θ)`: of the normal curvature in direction `θ`, along `θ + π/2`
    /// (Joshi 2008, Eq. 3.38). It is a third of the derivative of `κ_n'` by `θ`.
    #[must_use]
    pub fn cross_derivative(&self, theta: f64) -> f64 {
        self.derivative(theta, theta + FRAC_PI_2)
    }

    /// Derivative of the normal curvature in direction `theta` along the direction `psi`, both as
    /// angles from `e1` (Joshi 2008, Eq. 3.42).
    #[must_use]
    pub fn derivative(&self, theta: f64, psi: f64) -> f64 {
        let ((s, c), (t, r)) = (theta.sin_cos(), psi.sin_cos());
        let [a0, a1, a2, a3] = self.cubic;
        let along_e1 = c * c * a0 + 2.0 * c * s * a1 + s * s * a2;
        let along_e2 = c * c * a1 + 2.0 * c * s * a2 + s * s * a3;
        r * along_e1 + t * along_e2
    }

    /// `|C|² = a² + 3b² + 3c² + d²`, in 1/length⁴.
    #[must_use]
    pub fn cubic_norm_squared(&self) -> f64 {
        let [a, b, c, d] = self.cubic;
        a * a + 3.0 * (b * b + c * c) + d * d
    }

    /// `(k1 − k2)²/4` over `|II|²`: zero at an umbilic, at most 1/2.
    #[must_use]
    pub fn umbilic_deviation_ratio(&self) -> f64 {
        let [l, m, q] = self.second;
        let half = 0.5 * (l - q);
        (half * half + m * m) / (l * l + 2.0 * m * m + q * q)
    }

    /// Kind of the umbilic the point is, by the third order alone.
    ///
    /// It is a star if and only if `3 F3 > F1`; otherwise a monstar if the cubic form has six
    /// extrema around the circle and a lemon if it has two. (Joshi 2008, sec. 3.7.3 puts six zero
    /// crossings in place of the first condition, which is sufficient but not necessary.)
    ///
    /// # Example
    /// ```
    /// use geom_core::{DMat3, DVec3, ThirdOrder, UmbilicKind};
    /// // The monkey saddle z = (x³ − 3 x y²) / 6.
    /// let DMat3 { x_axis: e1, y_axis: e2, .. } = DMat3::IDENTITY;
    /// let monkey = ThirdOrder { e1, e2, second: [0.0; 3], cubic: [1.0, 0.0, -1.0, 0.0] };
    /// assert_eq!(monkey.umbilic_kind(), UmbilicKind::Star);
    /// assert_eq!(e1.cross(e2), DVec3::Z);
    /// ```
    #[must_use]
    pub fn umbilic_kind(&self) -> UmbilicKind {
        if 3.0 * self.f3() > self.f1() {
            return UmbilicKind::Star;
        }
        // κ_n' has an extremum where its cross derivative vanishes, a cubic in t = tan θ:
        // b + (2c − a) t + (d − 2b) t² − c t³. It has three real roots where its discriminant is
        // positive.
        let [a, b, c, d] = self.cubic;
        let (p3, p2, p1, p0) = (-c, d - 2.0 * b, 2.0 * c - a, b);
        let discriminant = 18.0 * p3 * p2 * p1 * p0 - 4.0 * p2 * p2 * p2 * p0 + p2 * p2 * p1 * p1
            - 4.0 * p3 * p1 * p1 * p1
            - 27.0 * p3 * p3 * p0 * p0;
        if discriminant > 0.0 { UmbilicKind::Monstar } else { UmbilicKind::Lemon }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assert_close;
    use std::f64::consts::PI;

    // Jet of a torus in skewed parameters: (u, v) ↦ (u + s v, v).
    fn torus(big: f64, small: f64, u: f64, v: f64, skew: f64) -> SurfaceJet {
        let mut jet = SurfaceJet::default();
        let f = |u: f64, v: f64| {
            let x = u + skew * v;
            let r = big + small * v.cos();
            DVec3::new(r * x.cos(), r * x.sin(), small * v.sin())
        };
        // d/du differentiates x; d/dv = skew d/dx + d/dy. Derivatives of the plain map are exact.
        let plain = |i: usize, j: usize| {
            let x = u + skew * v;
            let turn = x + FRAC_PI_2 * i as f64;
            let wave = v + FRAC_PI_2 * j as f64;
            let r = if j == 0 { big + small * v.cos() } else { small * wave.cos() };
            let z = if i == 0 { small * wave.sin() } else { 0.0 };
            DVec3::new(r * turn.cos(), r * turn.sin(), z)
        };
        for order in 0..4_usize {
            for j in 0..=order {
                let i = order - j;
                let mut sum = DVec3::ZERO;
                let mut binomial = 1.0;
                for k in 0..=j {
                    // k of the j derivatives go to x.
                    sum += binomial * skew.powi(k as i32) * plain(i + k, j - k);
                    binomial *= (j - k) as f64 / (k + 1) as f64;
                }
                jet.derivatives[SurfaceJet::index(i, j)] = sum;
            }
        }
        assert!(jet.position().distance(f(u, v)) < 1e-14);
        jet
    }

    #[test]
    fn torus_has_one_cubic_coefficient() {
        let (big, small) = (1.0, 0.4);
        for skew in [0.0, 0.7] {
            for v in (0..12).map(|k| 0.55 * f64::from(k)) {
                let shape = ThirdOrder::new(&torus(big, small, 0.3, v, skew)).unwrap();
                // Along parallels κ = −cos v/(R + r cos v); it changes along meridians only.
                // F1 = 3/4 |c|, F3 = 3/4 |c| with c = dκ_parallel/ds.
                let c = v.sin() * big / (small * (big + small * v.cos()).powi(2));
                assert_close(shape.f1(), 0.75 * c.abs(), 1e-11);
                assert_close(shape.f3(), 0.75 * c.abs(), 1e-11);
                assert_close(shape.cubic_norm_squared(), 3.0 * c * c, 1e-10);
                // F1² = 9/4 |∇H|², and only one principal curvature varies.
                assert_close(shape.f1().powi(2), 2.25 * (0.5 * c).powi(2), 1e-10);
                assert_close(
                    shape.mean_curvature(),
                    -0.5 * (1.0 / small + v.cos() / (big + small * v.cos())),
                    1e-12,
                );
                assert_close(
                    shape.gaussian_curvature(),
                    v.cos() / (small * (big + small * v.cos())),
                    1e-12,
                );
            }
        }
    }

    #[test]
    fn harmonics_rebuild_the_inline_and_cross_derivatives() {
        let shape = ThirdOrder::new(&torus(1.0, 0.6, 0.2, 1.1, 0.4)).unwrap();
        for theta in (0..10).map(|k| 0.61 * f64::from(k)) {
            let (f1, f3, alpha, beta) = (shape.f1(), shape.f3(), shape.alpha(), shape.beta());
            let inline = f1 * (theta + alpha).cos() + f3 * (3.0 * (theta + alpha + beta)).cos();
            assert_close(shape.inline_derivative(theta), inline, 1e-12);
            let cross =
                -f1 / 3.0 * (theta + alpha).sin() - f3 * (3.0 * (theta + alpha + beta)).sin();
            assert_close(shape.cross_derivative(theta), cross, 1e-12);
            assert_close(shape.derivative(theta, theta), inline, 1e-12);
        }
    }

    #[test]
    fn inline_derivative_is_that_of_the_normal_curvature_along_a_meridian() {
        // On a general graph z = x² y/2 + x³/3 at the origin, C is the third derivative itself.
        let mut jet = SurfaceJet::default();
        jet.derivatives[SurfaceJet::index(1, 0)] = DVec3::X;
        jet.derivatives[SurfaceJet::index(0, 1)] = DVec3::Y;
        jet.derivatives[SurfaceJet::index(3, 0)] = 2.0 * DVec3::Z;
        jet.derivatives[SurfaceJet::index(2, 1)] = DVec3::Z;
        let shape = ThirdOrder::new(&jet).unwrap();
        assert_eq!(shape.cubic, [2.0, 1.0, 0.0, 0.0]);
        assert_close(shape.inline_derivative(0.0), 2.0, 1e-15);
    }

    fn umbilic(f1: f64, f3: f64, phase: f64) -> UmbilicKind {
        // Inverse of the harmonics: a + c = 4/3 f1c, a − 3c = 4 f3c, and so on.
        let (f1c, f1s) = (f1, 0.0);
        let (f3c, f3s) = (f3 * phase.cos(), f3 * phase.sin());
        let a = f1c + f3c;
        let c = f1c / 3.0 - f3c;
        let b = f1s / 3.0 + f3s;
        let d = f1s - f3s;
        let shape =
            ThirdOrder { e1: DVec3::X, e2: DVec3::Y, second: [1.0, 0.0, 1.0], cubic: [a, b, c, d] };
        assert_close(shape.f1(), f1, 1e-14);
        assert_close(shape.f3(), f3, 1e-14);
        shape.umbilic_kind()
    }

    #[test]
    fn umbilics_are_told_apart() {
        assert_eq!(umbilic(1.0, 0.1, 0.0), UmbilicKind::Lemon);
        assert_eq!(umbilic(1.0, 0.4, 0.3), UmbilicKind::Star);
        // The elliptic umbilic z = x³ − 3xy² is a star, and so is a point with two zeros only.
        assert_eq!(umbilic(0.0, 1.0, 0.0), UmbilicKind::Star);
        // Just below the bound the direction of the phases decides.
        let kinds = [umbilic(1.0, 0.33, 0.0), umbilic(1.0, 0.33, PI)];
        assert!(kinds.contains(&UmbilicKind::Monstar), "{kinds:?}");
    }
}
