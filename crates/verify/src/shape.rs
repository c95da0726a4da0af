//! Curvatures from derivatives.

use crate::spline::Jet;
use glam::DVec3;

/// First and second fundamental form and what follows from them, at one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// `S_u · S_u`.
    pub e: f64,
    /// `S_u · S_v`.
    pub f: f64,
    /// `S_v · S_v`.
    pub g: f64,
    /// `EG − F²`, the square of the area element.
    pub delta: f64,
    /// Unit normal, along `S_u × S_v`.
    pub normal: DVec3,
    /// `S_uu · n`, `S_uv · n`, `S_vv · n`.
    pub second: [f64; 3],
    /// Mean curvature, in 1/length.
    pub mean: f64,
    /// Gaussian curvature, in 1/length².
    pub gaussian: f64,
}

/// Derivatives of the curvatures by the parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slopes {
    /// `H_u, H_v`.
    pub mean: [f64; 2],
    /// `K_u, K_v`.
    pub gaussian: [f64; 2],
}

impl Shape {
    /// From a jet of order two; not finite where the tangents are parallel.
    #[must_use]
    pub fn new(jet: &Jet) -> Self {
        let (su, sv) = (jet.d[1][0], jet.d[0][1]);
        let (e, f, g) = (su.dot(su), su.dot(sv), sv.dot(sv));
        let cross = su.cross(sv);
        let delta = cross.length_squared();
        let normal = cross / delta.sqrt();
        let [l, m, n] = [jet.d[2][0], jet.d[1][1], jet.d[0][2]].map(|s| s.dot(normal));
        Self {
            e,
            f,
            g,
            delta,
            normal,
            second: [l, m, n],
            mean: (l * g - 2.0 * m * f + n * e) / (2.0 * delta),
            gaussian: (l * n - m * m) / delta,
        }
    }

    /// Principal curvatures, the larger first.
    #[must_use]
    pub fn principal(&self) -> [f64; 2] {
        let root = (self.mean * self.mean - self.gaussian).max(0.0).sqrt();
        [self.mean + root, self.mean - root]
    }

    /// Derivatives of the curvatures, from a jet of order three.
    ///
    /// With `N = S_u × S_v` and `l, m, n = S_uu·N, S_uv·N, S_vv·N`: `K = (l n − m²)/Δ²` and
    /// `H = (l G − 2 m F + n E)/(2 Δ^{3/2})`, differentiated by the product rule.
    #[must_use]
    pub fn slopes(&self, jet: &Jet) -> Slopes {
        let d = &jet.d;
        let (su, sv) = (d[1][0], d[0][1]);
        let cross = su.cross(sv);
        let [l, m, n] = [d[2][0], d[1][1], d[0][2]].map(|s| s.dot(cross));
        let (e, f, g) = (self.e, self.f, self.g);
        let along = |by: usize| {
            // Derivatives of S_u, S_v and of the second derivatives by u or by v.
            let (su_t, sv_t) = if by == 0 { (d[2][0], d[1][1]) } else { (d[1][1], d[0][2]) };
            let third =
                if by == 0 { [d[3][0], d[2][1], d[1][2]] } else { [d[2][1], d[1][2], d[0][3]] };
            let cross_t = su_t.cross(sv) + su.cross(sv_t);
            let seconds = [d[2][0], d[1][1], d[0][2]];
            let [l_t, m_t, n_t] = [0, 1, 2].map(|k| third[k].dot(cross) + seconds[k].dot(cross_t));
            let (e_t, f_t, g_t) =
                (2.0 * su.dot(su_t), su_t.dot(sv) + su.dot(sv_t), 2.0 * sv.dot(sv_t));
            let delta_t = 2.0 * cross.dot(cross_t);
            let top = l * g - 2.0 * m * f + n * e;
            let top_t = l_t * g + l * g_t - 2.0 * (m_t * f + m * f_t) + n_t * e + n * e_t;
            let mean = (top_t - 1.5 * top * delta_t / self.delta) / (2.0 * self.delta.powf(1.5));
            let bottom = self.delta * self.delta;
            let gaussian = (l_t * n + l * n_t - 2.0 * m * m_t) / bottom
                - 2.0 * (l * n - m * m) * delta_t / (bottom * self.delta);
            [mean, gaussian]
        };
        let (by_u, by_v) = (along(0), along(1));
        Slopes { mean: [by_u[0], by_v[0]], gaussian: [by_u[1], by_v[1]] }
    }

    /// Second fundamental form and its covariant derivative in the orthonormal frame whose first
    /// vector is along `S_u`: `[II(1,1), II(1,2), II(2,2)]` and `C(1,1,1), C(1,1,2), C(1,2,2),
    /// C(2,2,2)`, from a jet of order three.
    ///
    /// `C_{ijk} = ∂_k b_{ij} − Γ^m_{ki} b_{mj} − Γ^m_{kj} b_{im}` in the parameters, by index.
    #[must_use]
    pub fn cubic(&self, jet: &Jet) -> ([f64; 3], [f64; 4]) {
        let d = &jet.d;
        let first = [d[1][0], d[0][1]];
        let second = [[d[2][0], d[1][1]], [d[1][1], d[0][2]]];
        let third = |i: usize, j: usize, k: usize| {
            let by_v = i + j + k;
            d[3 - by_v][by_v]
        };
        // Christoffel symbols: the tangential part of the second derivatives.
        let christoffel = |i: usize, j: usize| {
            let (a, b) = (second[i][j].dot(first[0]), second[i][j].dot(first[1]));
            [(self.g * a - self.f * b) / self.delta, (self.e * b - self.f * a) / self.delta]
        };
        let b = |i: usize, j: usize| self.second[i + j];
        // n_k = −b_k^m S_m, so ∂_k b_ij = S_ijk·n + S_ij·n_k.
        let weingarten = |k: usize| {
            let (x, y) = (b(k, 0), b(k, 1));
            let (p, q) =
                ((self.g * x - self.f * y) / self.delta, (self.e * y - self.f * x) / self.delta);
            -(p * first[0] + q * first[1])
        };
        let covariant = |i: usize, j: usize, k: usize| {
            let slope = third(i, j, k).dot(self.normal) + second[i][j].dot(weingarten(k));
            let (ki, kj) = (christoffel(k, i), christoffel(k, j));
            slope - (0..2).map(|m| ki[m] * b(m, j) + kj[m] * b(i, m)).sum::<f64>()
        };
        // Frame vectors in the parameters.
        let root = self.delta.sqrt();
        let length = self.e.sqrt();
        let frame = [[1.0 / length, 0.0], [-self.f / (length * root), length / root]];
        let pull_b = |p: usize, q: usize| {
            let mut sum = 0.0;
            for i in 0..2 {
                for j in 0..2 {
                    sum += frame[p][i] * frame[q][j] * b(i, j);
                }
            }
            sum
        };
        let mut c = [[[0.0; 2]; 2]; 2];
        for (i, plane) in c.iter_mut().enumerate() {
            for (j, row) in plane.iter_mut().enumerate() {
                for (k, value) in row.iter_mut().enumerate() {
                    *value = covariant(i, j, k);
                }
            }
        }
        let pull_c = |p: usize, q: usize, r: usize| {
            let mut sum = 0.0;
            for i in 0..2 {
                for j in 0..2 {
                    for k in 0..2 {
                        sum += frame[p][i] * frame[q][j] * frame[r][k] * c[i][j][k];
                    }
                }
            }
            sum
        };
        (
            [pull_b(0, 0), pull_b(0, 1), pull_b(1, 1)],
            [pull_c(0, 0, 0), pull_c(0, 0, 1), pull_c(0, 1, 1), pull_c(1, 1, 1)],
        )
    }
}

/// Angle between two vectors, in degrees, exact for small ones.
#[must_use]
pub fn angle_deg(a: DVec3, b: DVec3) -> f64 {
    a.cross(b).length().atan2(a.dot(b)).to_degrees()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The jet of a torus of radii 3 and 1 at angles `(u, v)`.
    fn torus(u: f64, v: f64) -> Jet {
        let mut jet = Jet::default();
        let turn = |n: usize, t: f64| {
            let t = t + n as f64 * std::f64::consts::FRAC_PI_2;
            [t.cos(), t.sin()]
        };
        for i in 0..=3 {
            for j in 0..=3 - i {
                let ([cu, su], [cv, sv]) = (turn(i, u), turn(j, v));
                let radius = if j == 0 { 3.0 + cv } else { cv };
                let z = if i == 0 { sv } else { 0.0 };
                jet.d[i][j] = DVec3::new(radius * cu, radius * su, z);
            }
        }
        jet
    }

    #[test]
    fn a_torus_has_its_curvatures_and_their_slopes() {
        let (u, v) = (0.7, 0.9);
        let jet = torus(u, v);
        let shape = Shape::new(&jet);
        let parallel = |v: f64| v.cos() / (3.0 + v.cos());
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-13, "{a} {b}");
        close(shape.gaussian, parallel(v));
        close(shape.mean, -0.5 * (1.0 + parallel(v)));
        let slope = -3.0 * v.sin() / (3.0 + v.cos()).powi(2);
        let slopes = shape.slopes(&jet);
        close(slopes.gaussian[0], 0.0);
        close(slopes.gaussian[1], slope);
        close(slopes.mean[1], -0.5 * slope);
        // Along a parallel κ is constant, but the direction turns: C(1,1,2) is half of 3 of them.
        let ([l, m, n], [c111, c112, c122, c222]) = shape.cubic(&jet);
        close(l, -parallel(v));
        close(m, 0.0);
        close(n, -1.0);
        close(c111, 0.0);
        close(c112, -slope);
        close(c122, 0.0);
        close(c222, 0.0);
    }

    #[test]
    fn the_cubic_form_is_symmetric_in_skew_parameters() {
        // A graph with a skew frame: C must not depend on the order of its indices.
        let mut jet = Jet::default();
        jet.d[0][0] = DVec3::ZERO;
        jet.d[1][0] = DVec3::new(1.0, 0.2, 0.3);
        jet.d[0][1] = DVec3::new(0.4, 1.1, -0.2);
        jet.d[2][0] = DVec3::new(0.3, -0.1, 0.7);
        jet.d[1][1] = DVec3::new(0.1, 0.2, -0.4);
        jet.d[0][2] = DVec3::new(-0.2, 0.3, 0.5);
        jet.d[3][0] = DVec3::new(0.1, 0.1, 0.2);
        jet.d[2][1] = DVec3::new(0.0, 0.3, -0.6);
        jet.d[1][2] = DVec3::new(0.2, -0.3, 0.8);
        jet.d[0][3] = DVec3::new(0.5, 0.1, 0.9);
        let shape = Shape::new(&jet);
        let ([l, m, n], [a, b, c, d]) = shape.cubic(&jet);
        // |∇H|² from the trace of C agrees with the slopes of H.
        let slopes = shape.slopes(&jet);
        let [hu, hv] = slopes.mean;
        let squared =
            (shape.g * hu * hu - 2.0 * shape.f * hu * hv + shape.e * hv * hv) / shape.delta;
        let trace = 0.25 * ((a + c).powi(2) + (b + d).powi(2));
        assert!((squared - trace).abs() < 1e-13 * trace, "{squared} {trace}");
        assert!((0.5 * (l + n) - shape.mean).abs() < 1e-14);
        assert!((l * n - m * m - shape.gaussian).abs() < 1e-14);
    }
}
