//! Heights of spheres, cylinders and tori with their derivatives, in closed form.
//!
//! A sphere or cylinder of curvature `k` has the height `k ρ² / (1 + r)` with `r = √(1 − k² ρ²)`,
//! where `ρ` is the distance from the origin or from the axis.
//!
//! Turning a point `(x, y, z)` about the axis of a torus into the plane `x = 0` gives
//! `(y + g d, z + k₁ d)` with `d = −x² / (b + w)`, `b = 1 − g y − k₁ z` and
//! `w = √((k₁² + g²) x² + b²)`, which stays exact as the axis moves to infinity. There the
//! generating circle has the height `p(t) = k₂ t² / (1 + √(1 − k₂² t²))`, so that
//! `F = z + k₁ d − p(y + g d)` vanishes on the torus. The derivatives of `d` are short:
//! `d_x = −x/w`, `d_b = −d/w`, and with `s = k₁² + g²` also `d_s = d²/(2 w)`.

use crate::mold::height::{Height, MAX_PARAMETERS, ParameterRows, UNREACHED};

/// A sphere of curvature `k`, or a cylinder with its axis along y.
pub(crate) fn round_at(k: f64, is_sphere: bool, x: f64, y: f64) -> Height {
    let (y, across) = if is_sphere { (y, k) } else { (0.0, 0.0) };
    let squared = x * x + y * y;
    let r = (1.0 - k * k * squared).sqrt();
    let cubed = r * r * r;
    Height {
        f: k * squared / (1.0 + r),
        fx: k * x / r,
        fy: k * y / r,
        fxx: k * (r * r + k * k * x * x) / cubed,
        fxy: k * k * k * x * y / cubed,
        fyy: across * (r * r + k * k * y * y) / cubed,
    }
}

/// Derivatives of its `f, f_x, f_y` in `k`.
pub(crate) fn round_rows(k: f64, is_sphere: bool, x: f64, y: f64) -> ParameterRows {
    let y = if is_sphere { y } else { 0.0 };
    let squared = x * x + y * y;
    let r = (1.0 - k * k * squared).sqrt();
    let cubed = r * r * r;
    let mut rows = [[0.0; MAX_PARAMETERS]; 3];
    rows[0][0] = squared / (r * (1.0 + r));
    rows[1][0] = x / cubed;
    rows[2][0] = y / cubed;
    rows
}

/// A torus with the curvatures of [`Mold`](crate::Mold): the parallel, the generating circle, and
/// the geodesic curvature of the parallel.
#[derive(Clone, Copy)]
pub(crate) struct Torus {
    pub(crate) k1: f64,
    pub(crate) k2: f64,
    pub(crate) g: f64,
}

/// What vanishes on a torus at one of its points, with first and second derivatives.
struct Jet {
    x: f64,
    y: f64,
    z: f64,
    b: f64,
    w: f64,
    d: f64,
    /// `1/w³`.
    cubed: f64,
    t: f64,
    /// `√(1 − k₂² t²)`.
    root: f64,
    /// `p', p''` at `t`.
    slope: f64,
    bend: f64,
    /// `k₁ − g p'`.
    q: f64,
    /// Derivatives of `d` in x, b, and in x, y, z.
    d_b: f64,
    d_i: [f64; 3],
    gradient: [f64; 3],
    hessian: [[f64; 3]; 3],
}

impl Torus {
    /// The height, or `None` beyond the reach of the torus.
    pub(crate) fn height(&self, x: f64, y: f64) -> Option<f64> {
        let Self { k1, k2, g } = *self;
        let squared = k1 * k1 + g * g;
        let mut z = 0.5 * (k1 * x * x + k2 * y * y);
        let scale = x.abs() + y.abs() + z.abs();
        let mut is_root = false;
        for _ in 0..30 {
            let below = 1.0 - g * y - k1 * z;
            let w = (squared * x * x + below * below).sqrt();
            let d = -x * x / (below + w);
            let d_z = k1 * d / w;
            let t = y + g * d;
            let root = (1.0 - k2 * k2 * t * t).sqrt();
            let value = z + k1 * d - k2 * t * t / (1.0 + root);
            let slope = 1.0 + (k1 - k2 * t / root * g) * d_z;
            // Beyond the axis or where the tube has turned over there is no height; NaN as well.
            if !(below > 0.0 && slope > 0.0) {
                return None;
            }
            let step = value / slope;
            z -= step;
            if is_root {
                break;
            }
            // The step after a small one only removes rounding.
            is_root = step.abs() <= 1e-9 * scale;
        }
        is_root.then_some(z)
    }

    fn jet(&self, x: f64, y: f64) -> Option<Jet> {
        let z = self.height(x, y)?;
        let Self { k1, k2, g } = *self;
        let b = 1.0 - g * y - k1 * z;
        let w = ((k1 * k1 + g * g) * x * x + b * b).sqrt();
        let d = -x * x / (b + w);
        let cubed = 1.0 / (w * w * w);
        let t = y + g * d;
        let root = (1.0 - k2 * k2 * t * t).sqrt();
        let (slope, bend) = (k2 * t / root, k2 / (root * root * root));
        let q = k1 - g * slope;
        let d_b = -d / w;
        let d_i = [-x / w, -g * d_b, -k1 * d_b];
        let t_i = [g * d_i[0], 1.0 + g * d_i[1], g * d_i[2]];
        let gradient = [q * d_i[0], q * d_i[1] - slope, 1.0 + q * d_i[2]];
        // Second derivatives of d in x and b, where b has the derivatives 0, −g, −k₁.
        let (d_xx, d_xb, d_bb) = (-b * b * cubed, x * b * cubed, -x * x * cubed);
        let b_i = [0.0, -g, -k1];
        let mut hessian = [[0.0; 3]; 3];
        for i in 0..3 {
            for j in 0..3 {
                let d_ij = match (i, j) {
                    (0, 0) => d_xx,
                    (0, k) | (k, 0) => d_xb * b_i[k],
                    _ => d_bb * b_i[i] * b_i[j],
                };
                hessian[i][j] = q * d_ij - bend * t_i[i] * t_i[j];
            }
        }
        Some(Jet { x, y, z, b, w, d, cubed, t, root, slope, bend, q, d_b, d_i, gradient, hessian })
    }

    /// The height with its derivatives.
    pub(crate) fn at(&self, x: f64, y: f64) -> Height {
        let Some(jet) = self.jet(x, y) else { return UNREACHED };
        let [fx, fy] = jet.slopes();
        let second = |i: usize, j: usize| {
            let (zi, zj) = ([fx, fy][i], [fx, fy][j]);
            jet.explicit(jet.hessian[i][j], i, [zi, zj], jet.hessian[j][2])
        };
        Height { f: jet.z, fx, fy, fxx: second(0, 0), fxy: second(0, 1), fyy: second(1, 1) }
    }

    /// Derivatives of `f, f_x, f_y` in `k₁, k₂, g`; NaN beyond the reach.
    pub(crate) fn rows(&self, x: f64, y: f64) -> ParameterRows {
        let mut rows = [[0.0; MAX_PARAMETERS]; 3];
        let Some(jet) = self.jet(x, y) else {
            rows.iter_mut().for_each(|row| row[..3].fill(f64::NAN));
            return rows;
        };
        let slopes = jet.slopes();
        for (a, [value, along_x, along_y, along_z]) in self.parameters(&jet).into_iter().enumerate()
        {
            let za = -value / jet.gradient[2];
            rows[0][a] = za;
            for (i, along) in [along_x, along_y].into_iter().enumerate() {
                rows[1 + i][a] = jet.explicit(along, i, [slopes[i], za], along_z);
            }
        }
        rows
    }

    /// Derivatives of `F` and of its gradient in `k₁, k₂, g`.
    fn parameters(&self, jet: &Jet) -> [[f64; 4]; 3] {
        let Self { k1, g, .. } = *self;
        let Jet { x, y, z, b, w, d, cubed, t, root, slope, bend, q, d_b, d_i, .. } = *jet;
        let (d_xb, d_bb) = (x * b * cubed, -x * x * cubed);
        let d_s = d * d / (2.0 * w);
        let d_xs = 0.5 * x * x * x * cubed;
        let d_bs = -d * d / (2.0 * w * w) + 0.5 * d * x * x * cubed;
        // From the changes of b and s, and how k₁ and g come in besides.
        let of = |b_a: f64, s_a: f64, is_g: bool| {
            let d_a = d_b * b_a + d_s * s_a;
            let d_xa = d_xb * b_a + d_xs * s_a;
            let d_ba = d_bb * b_a + d_bs * s_a;
            let (one_k1, one_g) = if is_g { (0.0, 1.0) } else { (1.0, 0.0) };
            let t_a = one_g * d + g * d_a;
            let q_a = one_k1 - one_g * slope - g * bend * t_a;
            let d_ya = -one_g * d_b - g * d_ba;
            let d_za = -one_k1 * d_b - k1 * d_ba;
            [
                one_k1 * d - one_g * slope * d + q * d_a,
                q_a * d_i[0] + q * d_xa,
                q_a * d_i[1] + q * d_ya - bend * t_a,
                q_a * d_i[2] + q * d_za,
            ]
        };
        let height = t * t / (root * (1.0 + root));
        let slope_k2 = t / (root * root * root);
        let q_k2 = -g * slope_k2;
        [
            of(-z, 2.0 * k1, false),
            [-height, q_k2 * d_i[0], q_k2 * d_i[1] - slope_k2, q_k2 * d_i[2]],
            of(-y, 2.0 * g, true),
        ]
    }
}

impl Jet {
    fn slopes(&self) -> [f64; 2] {
        [0, 1].map(|i| -self.gradient[i] / self.gradient[2])
    }

    /// `z_ij` by implicit differentiation, from `F_ij` and `F_jz`; `z_i` and `z_j` are given.
    /// The second index may stand for a parameter.
    fn explicit(&self, mixed: f64, i: usize, [zi, zj]: [f64; 2], other: f64) -> f64 {
        let [.., last] = self.hessian;
        -(mixed + self.hessian[i][2] * zj + other * zi + last[2] * zi * zj) / self.gradient[2]
    }
}
