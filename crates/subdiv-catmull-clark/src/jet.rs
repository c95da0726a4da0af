//! Jets: a value and its parameter derivatives up to order three.

use crate::stencils::Stencils;
use geom_core::{DVec3, SurfaceJet};

/// Number of derivatives in a jet.
pub const JET_LEN: usize = 10;

/// Orders `(∂u, ∂v)` of the entries of a [`Jet`]:
/// `f, f_u, f_v, f_uu, f_uv, f_vv, f_uuu, f_uuv, f_uvv, f_vvv`.
pub const JET_ORDERS: [(usize, usize); JET_LEN] =
    [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3)];

/// A scalar function's value and derivatives at one parameter pair, in the order of [`JET_ORDERS`].
pub type Jet = [f64; JET_LEN];

/// Position of the derivative `(i, j)` in a jet.
pub(crate) const fn jet_index(i: usize, j: usize) -> usize {
    let order = i + j;
    order * (order + 1) / 2 + j
}

/// The jet of a product, by Leibniz' rule.
///
/// # Example
/// ```
/// use subdiv_catmull_clark::{JET_ORDERS, jet_product};
/// // u times v at (2, 3).
/// let u = [2.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
/// let v = [3.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
/// assert_eq!(jet_product(&u, &v), [6.0, 3.0, 2.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
/// assert_eq!(JET_ORDERS[4], (1, 1));
/// ```
#[must_use]
pub fn jet_product(a: &Jet, b: &Jet) -> Jet {
    let [f, f_u, f_v, f_uu, f_uv, f_vv, f_uuu, f_uuv, f_uvv, f_vvv] = *a;
    let [g, g_u, g_v, g_uu, g_uv, g_vv, g_uuu, g_uuv, g_uvv, g_vvv] = *b;
    [
        f * g,
        f * g_u + f_u * g,
        f * g_v + f_v * g,
        f * g_uu + 2.0 * f_u * g_u + f_uu * g,
        f * g_uv + f_v * g_u + f_u * g_v + f_uv * g,
        f * g_vv + 2.0 * f_v * g_v + f_vv * g,
        f * g_uuu + 3.0 * f_u * g_uu + 3.0 * f_uu * g_u + f_uuu * g,
        f * g_uuv + f_v * g_uu + 2.0 * f_u * g_uv + 2.0 * f_uv * g_u + f_uu * g_v + f_uuv * g,
        f * g_uvv + 2.0 * f_v * g_uv + f_vv * g_u + f_u * g_vv + 2.0 * f_uv * g_v + f_uvv * g,
        f * g_vvv + 3.0 * f_v * g_vv + 3.0 * f_vv * g_v + f_vvv * g,
    ]
}

/// The jet of `f(u) g(v)` from the derivatives of the factors.
pub(crate) fn separable_jet(f: &[f64; 4], g: &[f64; 4]) -> Jet {
    JET_ORDERS.map(|(i, j)| f[i] * g[j])
}

/// The four uniform cubic B-spline basis functions on one span: `basis[d][k]` is the derivative
/// of order `d` of the function of control point `k` at `t` in `[0, 1]`.
///
/// # Example
/// ```
/// let [value, slope, bend, _] = subdiv_catmull_clark::cubic_basis(0.0);
/// assert_eq!(value, [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0, 0.0]);
/// assert_eq!((slope, bend), ([-0.5, 0.0, 0.5, 0.0], [1.0, -2.0, 1.0, 0.0]));
/// ```
#[must_use]
pub fn cubic_basis(t: f64) -> [[f64; 4]; 4] {
    let s = 1.0 - t;
    [
        [
            s * s * s / 6.0,
            (3.0 * t * t * t - 6.0 * t * t + 4.0) / 6.0,
            (-3.0 * t * t * t + 3.0 * t * t + 3.0 * t + 1.0) / 6.0,
            t * t * t / 6.0,
        ],
        [
            -s * s / 2.0,
            (9.0 * t * t - 12.0 * t) / 6.0,
            (-9.0 * t * t + 6.0 * t + 3.0) / 6.0,
            t * t / 2.0,
        ],
        [s, 3.0 * t - 2.0, 1.0 - 3.0 * t, t],
        [-1.0, 3.0, -3.0, 1.0],
    ]
}

/// Jets of a patch's control-point weights: `weights[d][k]` belongs to derivative `d` and
/// control point `k`.
#[derive(Clone, Debug, PartialEq)]
pub struct JetWeights {
    count: usize,
    values: Vec<f64>,
}

impl JetWeights {
    /// All zero, for `count` control points.
    #[must_use]
    pub fn zeros(count: usize) -> Self {
        Self { count, values: vec![0.0; JET_LEN * count] }
    }

    /// Number of control points.
    #[must_use]
    pub fn control_points(&self) -> usize {
        self.count
    }

    /// Weights of derivative `d`, one per control point.
    #[must_use]
    pub fn row(&self, d: usize) -> &[f64] {
        &self.values[d * self.count..(d + 1) * self.count]
    }

    pub(crate) fn row_mut(&mut self, d: usize) -> &mut [f64] {
        &mut self.values[d * self.count..(d + 1) * self.count]
    }

    /// The jet of control point `k`.
    #[must_use]
    pub fn jet(&self, k: usize) -> Jet {
        std::array::from_fn(|d| self.values[d * self.count + k])
    }

    pub(crate) fn set_jet(&mut self, k: usize, jet: &Jet) {
        for (d, &value) in jet.iter().enumerate() {
            self.values[d * self.count + k] = value;
        }
    }

    /// `self · matrix`, the matrix with one row per control point of `self`.
    pub(crate) fn times(&self, matrix: &Stencils, columns: usize) -> Self {
        let mut out = Self::zeros(columns);
        for d in 0..JET_LEN {
            for (k, &w) in self.row(d).iter().enumerate() {
                if w != 0.0 {
                    let (at, row) = matrix.row(k);
                    let out = &mut out.values[d * columns..(d + 1) * columns];
                    for (&c, m) in at.iter().zip(row) {
                        out[c as usize] += w * m;
                    }
                }
            }
        }
        out
    }

    /// Multiplies every derivative of order `m` by `scale^m`, the chain rule of `t ↦ scale · t`.
    pub(crate) fn rescale(&mut self, scale: f64) {
        for (d, &(i, j)) in JET_ORDERS.iter().enumerate() {
            let factor = scale.powi((i + j) as i32);
            self.row_mut(d).iter_mut().for_each(|w| *w *= factor);
        }
    }

    /// Applies the weights to control points; the fourth derivatives of the jet stay zero.
    ///
    /// # Panics
    /// If `controls` yields fewer points than there are weights.
    #[must_use]
    pub fn apply(&self, controls: impl Fn(usize) -> DVec3) -> SurfaceJet {
        let mut out = SurfaceJet::default();
        for k in 0..self.count {
            let p = controls(k);
            for (d, value) in out.derivatives[..JET_LEN].iter_mut().enumerate() {
                *value += self.values[d * self.count + k] * p;
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn product_of_monomials_is_a_monomial() {
        // u² v at (2, 3) times u at (2, 3) must be u³ v.
        let (u, v) = (2.0, 3.0);
        let a = [u * u * v, 2.0 * u * v, u * u, 2.0 * v, 2.0 * u, 0.0, 0.0, 2.0, 0.0, 0.0];
        let b = [u, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let want = [
            u * u * u * v,
            3.0 * u * u * v,
            u * u * u,
            6.0 * u * v,
            3.0 * u * u,
            0.0,
            6.0 * v,
            6.0 * u,
            0.0,
            0.0,
        ];
        assert_eq!(jet_product(&a, &b), want);
    }

    #[test]
    fn product_of_exponentials_adds_their_exponents() {
        // e^(a u + b v) at the origin has the derivatives a^i b^j.
        let exponential = |a: f64, b: f64| separable_jet(&powers(a), &powers(b));
        let powers_of_two = jet_product(&exponential(0.5, -2.0), &exponential(4.0, 0.25));
        assert_eq!(powers_of_two, exponential(4.5, -1.75));
    }

    fn powers(x: f64) -> [f64; 4] {
        [1.0, x, x * x, x * x * x]
    }

    #[test]
    fn cubic_basis_is_a_partition_of_unity() {
        for t in [0.0, 0.3, 1.0] {
            let basis = cubic_basis(t);
            assert!((basis[0].iter().sum::<f64>() - 1.0).abs() < 1e-15);
            for row in &basis[1..] {
                assert!(row.iter().sum::<f64>().abs() < 1e-15);
            }
        }
    }
}
