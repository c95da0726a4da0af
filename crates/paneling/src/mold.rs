//! Mold shapes: height functions over the tangent plane of a mold's own frame.

use serde::{Deserialize, Serialize};

/// The kinds of molds, from the simplest to the most general.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MoldType {
    /// `z = 0`.
    Plane,
    /// A circular cylinder with its axis along y: one curvature.
    Cylinder,
    /// A sphere: one curvature.
    Sphere,
    /// `z = a x² + b y²`.
    Paraboloid,
    /// A torus around its equator, axis along y: curvature of the equator (in x) and of the
    /// generating circle (in y). Panels can slide along the tube as long as it is not vertical.
    Torus,
    /// A cubic polynomial without constant and linear terms.
    Cubic,
}

impl MoldType {
    /// All kinds, from the simplest to the most general.
    pub const ALL: [Self; 6] =
        [Self::Plane, Self::Cylinder, Self::Sphere, Self::Paraboloid, Self::Torus, Self::Cubic];

    /// The name in options, price lists and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Plane => "plane",
            Self::Cylinder => "cylinder",
            Self::Sphere => "sphere",
            Self::Paraboloid => "paraboloid",
            Self::Torus => "torus",
            Self::Cubic => "cubic",
        }
    }

    /// The kind of this name.
    #[must_use]
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|t| t.name() == name)
    }

    /// Number of free parameters of the shape.
    #[must_use]
    pub fn parameter_count(self) -> usize {
        match self {
            Self::Plane => 0,
            Self::Cylinder | Self::Sphere => 1,
            Self::Paraboloid | Self::Torus => 2,
            Self::Cubic => 7,
        }
    }
}

impl std::str::FromStr for MoldType {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::from_name(name).ok_or_else(|| {
            let known = Self::ALL.map(Self::name).join(", ");
            format!("unknown mold type `{name}`; use {known}")
        })
    }
}

/// Most parameters a mold can have.
pub(crate) const MAX_PARAMETERS: usize = 7;

/// A mold: the surface `z = f(x, y)` in its own frame, which touches the plane `z = 0` at the
/// origin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mold {
    /// What kind of surface it is.
    pub kind: MoldType,
    /// The parameters; those beyond [`MoldType::parameter_count`] are zero.
    ///
    /// Cubic: factors of `x², xy, y², x³, x²y, xy², y³`. Paraboloid: of `x², y²`. Torus: curvature
    /// of the equator and of the generating circle. Cylinder, sphere: the curvature.
    pub parameters: [f64; MAX_PARAMETERS],
}

/// A height function and its derivatives at one point.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Height {
    pub(crate) f: f64,
    pub(crate) fx: f64,
    pub(crate) fy: f64,
    pub(crate) fxx: f64,
    pub(crate) fxy: f64,
    pub(crate) fyy: f64,
}

/// Derivatives of `f, f_x, f_y` in the parameters of the mold.
pub(crate) type ParameterRows = [[f64; MAX_PARAMETERS]; 3];

impl Mold {
    /// A flat mold of this kind.
    #[must_use]
    pub fn flat(kind: MoldType) -> Self {
        Self { kind, parameters: [0.0; MAX_PARAMETERS] }
    }

    /// The height at `(x, y)`; NaN beyond the reach of a round mold.
    #[must_use]
    pub fn height(&self, x: f64, y: f64) -> f64 {
        self.at(x, y).f
    }

    /// Slopes `(f_x, f_y)` at `(x, y)`; NaN beyond the reach of a round mold.
    #[must_use]
    pub fn slopes(&self, x: f64, y: f64) -> [f64; 2] {
        let height = self.at(x, y);
        [height.fx, height.fy]
    }

    /// The mold in other units of length: one old unit is `factor` new ones.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let mut scaled = *self;
        for (i, p) in scaled.parameters.iter_mut().enumerate() {
            let cubic_term = self.kind == MoldType::Cubic && i >= 3;
            *p /= if cubic_term { factor * factor } else { factor };
        }
        scaled
    }

    pub(crate) fn at(&self, x: f64, y: f64) -> Height {
        let p = &self.parameters;
        match self.kind {
            MoldType::Plane => Height::default(),
            MoldType::Paraboloid => Height {
                f: p[0] * x * x + p[1] * y * y,
                fx: 2.0 * p[0] * x,
                fy: 2.0 * p[1] * y,
                fxx: 2.0 * p[0],
                fxy: 0.0,
                fyy: 2.0 * p[1],
            },
            MoldType::Cubic => {
                let [a, b, c, d, e, g, h] = *p;
                Height {
                    f: x * (a * x + b * y + x * (d * x + e * y) + g * y * y) + y * y * (c + h * y),
                    fx: 2.0 * a * x + b * y + x * (3.0 * d * x + 2.0 * e * y) + g * y * y,
                    fy: b * x + 2.0 * c * y + x * (e * x + 2.0 * g * y) + 3.0 * h * y * y,
                    fxx: 2.0 * a + 6.0 * d * x + 2.0 * e * y,
                    fxy: b + 2.0 * e * x + 2.0 * g * y,
                    fyy: 2.0 * c + 2.0 * g * x + 6.0 * h * y,
                }
            }
            MoldType::Cylinder | MoldType::Sphere | MoldType::Torus => {
                let z = self.round(x, y);
                Height {
                    f: z.value,
                    fx: z.first[0],
                    fy: z.first[1],
                    fxx: z.second[0][0],
                    fxy: z.second[0][1],
                    fyy: z.second[1][1],
                }
            }
        }
    }

    /// Derivatives of `f, f_x, f_y` in the parameters at `(x, y)`.
    pub(crate) fn parameter_rows(&self, x: f64, y: f64) -> ParameterRows {
        let mut rows = [[0.0; MAX_PARAMETERS]; 3];
        match self.kind {
            MoldType::Plane => {}
            MoldType::Paraboloid => {
                rows[0][..2].copy_from_slice(&[x * x, y * y]);
                rows[1][0] = 2.0 * x;
                rows[2][1] = 2.0 * y;
            }
            MoldType::Cubic => {
                let (xx, xy, yy) = (x * x, x * y, y * y);
                rows[0] = [xx, xy, yy, xx * x, xx * y, x * yy, yy * y];
                rows[1] = [2.0 * x, y, 0.0, 3.0 * xx, 2.0 * xy, yy, 0.0];
                rows[2] = [0.0, x, 2.0 * y, 0.0, xx, 2.0 * xy, 3.0 * yy];
            }
            MoldType::Cylinder | MoldType::Sphere | MoldType::Torus => {
                let z = self.round(x, y);
                let along = |k: usize| [z.first[k], z.second[0][k], z.second[1][k]];
                let (first, second) = (along(2), along(3));
                for row in 0..3 {
                    match self.kind {
                        MoldType::Cylinder => rows[row][0] = first[row],
                        MoldType::Sphere => rows[row][0] = first[row] + second[row],
                        _ => rows[row][..2].copy_from_slice(&[first[row], second[row]]),
                    }
                }
            }
        }
        rows
    }

    /// The torus height as a function of x, y and the two curvatures.
    ///
    /// The generating circle has the height `p = k₂ y² / (1 + √(1 − k₂² y²))`; turning it about
    /// the axis at height `1/k₁` gives `z = q / (1 + √(1 − k₁ q))` with
    /// `q = 2 p + k₁ (x² − p²)`, which stays exact where a curvature vanishes (a cylinder) and is
    /// a sphere for equal curvatures.
    fn round(&self, x: f64, y: f64) -> Taylor {
        let (k1, k2) = match self.kind {
            MoldType::Cylinder => (self.parameters[0], 0.0),
            MoldType::Sphere => (self.parameters[0], self.parameters[0]),
            _ => (self.parameters[0], self.parameters[1]),
        };
        let [x, y, k1, k2] =
            [(x, 0), (y, 1), (k1, 2), (k2, 3)].map(|(v, i)| Taylor::variable(v, i));
        let one = Taylor::constant(1.0);
        let p = k2.mul(y).mul(y).div(one.add(one.sub(k2.mul(k2).mul(y).mul(y)).sqrt()));
        let q = p.add(p).add(k1.mul(x.mul(x).sub(p.mul(p))));
        q.div(one.add(one.sub(k1.mul(q)).sqrt()))
    }
}

/// A function of four variables with first and second derivatives.
#[derive(Clone, Copy)]
struct Taylor {
    value: f64,
    first: [f64; 4],
    second: [[f64; 4]; 4],
}

impl Taylor {
    fn constant(value: f64) -> Self {
        Self { value, first: [0.0; 4], second: [[0.0; 4]; 4] }
    }

    fn variable(value: f64, index: usize) -> Self {
        let mut made = Self::constant(value);
        made.first[index] = 1.0;
        made
    }

    fn zip(self, other: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut out = self;
        out.value = f(self.value, other.value);
        for i in 0..4 {
            out.first[i] = f(self.first[i], other.first[i]);
            for j in 0..4 {
                out.second[i][j] = f(self.second[i][j], other.second[i][j]);
            }
        }
        out
    }

    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    fn mul(self, other: Self) -> Self {
        let mut out = Self::constant(self.value * other.value);
        for i in 0..4 {
            out.first[i] = self.value * other.first[i] + self.first[i] * other.value;
            for j in 0..4 {
                out.second[i][j] = self.value * other.second[i][j]
                    + self.first[i] * other.first[j]
                    + self.first[j] * other.first[i]
                    + self.second[i][j] * other.value;
            }
        }
        out
    }

    /// Composition with a function of one variable, given its value and two derivatives.
    fn then(self, value: f64, d1: f64, d2: f64) -> Self {
        let mut out = Self::constant(value);
        for i in 0..4 {
            out.first[i] = d1 * self.first[i];
            for j in 0..4 {
                out.second[i][j] = d1 * self.second[i][j] + d2 * self.first[i] * self.first[j];
            }
        }
        out
    }

    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.then(root, 0.5 / root, -0.25 / (root * self.value))
    }

    fn div(self, other: Self) -> Self {
        let r = 1.0 / other.value;
        self.mul(other.then(r, -r * r, 2.0 * r * r * r))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    fn molds() -> Vec<Mold> {
        MoldType::ALL
            .into_iter()
            .map(|kind| {
                let mut mold = Mold::flat(kind);
                for i in 0..kind.parameter_count() {
                    mold.parameters[i] = 0.3 * (1.0 + 1.7 * i as f64).sin();
                }
                mold
            })
            .collect()
    }

    #[test]
    fn derivatives_match_central_differences() {
        let h = 1e-6;
        for mold in molds() {
            let (x, y) = (0.6, -0.4);
            let at = mold.at(x, y);
            let dx =
                |g: fn(&Height) -> f64| (g(&mold.at(x + h, y)) - g(&mold.at(x - h, y))) / (2.0 * h);
            let dy =
                |g: fn(&Height) -> f64| (g(&mold.at(x, y + h)) - g(&mold.at(x, y - h))) / (2.0 * h);
            assert_close(at.fx, dx(|z| z.f), 1e-9);
            assert_close(at.fy, dy(|z| z.f), 1e-9);
            assert_close(at.fxx, dx(|z| z.fx), 1e-9);
            assert_close(at.fxy, dy(|z| z.fx), 1e-9);
            assert_close(at.fyy, dy(|z| z.fy), 1e-9);
            let rows = mold.parameter_rows(x, y);
            for i in 0..MAX_PARAMETERS {
                let (mut more, mut less) = (mold, mold);
                if i < mold.kind.parameter_count() {
                    more.parameters[i] += h;
                    less.parameters[i] -= h;
                }
                let (a, b) = (more.at(x, y), less.at(x, y));
                let differences = [a.f - b.f, a.fx - b.fx, a.fy - b.fy];
                for row in 0..3 {
                    assert_close(rows[row][i], differences[row] / (2.0 * h), 1e-9);
                }
            }
        }
    }

    #[test]
    fn round_molds_lie_on_their_surfaces() {
        let mold = |kind, a, b| {
            let mut mold = Mold::flat(kind);
            (mold.parameters[0], mold.parameters[1]) = (a, b);
            mold
        };
        let (x, y) = (0.5, 0.7);
        let z = mold(MoldType::Sphere, 0.5, 0.0).height(x, y);
        assert_close(x * x + y * y + (z - 2.0).powi(2), 4.0, 1e-14);
        let z = mold(MoldType::Cylinder, -0.5, 0.0).height(x, y);
        assert_close(x * x + (z + 2.0).powi(2), 4.0, 1e-14);
        // Equator of radius 3 seen from inside the tube of radius 1, and from the hole.
        for k2 in [1.0, -1.0] {
            let z = mold(MoldType::Torus, 1.0 / 3.0, k2).height(x, y);
            let to_axis = x.hypot(3.0 - z);
            assert_close((to_axis - (3.0 - 1.0 / k2)).hypot(y), 1.0, 1e-14);
        }
        assert!(mold(MoldType::Sphere, 1.0, 0.0).height(1.0, 1.0).is_nan());
    }

    #[test]
    fn scaling_scales_the_shape() {
        for mold in molds() {
            let scaled = mold.scaled(10.0);
            assert_close(scaled.height(6.0, -4.0), 10.0 * mold.height(0.6, -0.4), 1e-13);
            assert_close(scaled.slopes(6.0, -4.0)[0], mold.slopes(0.6, -0.4)[0], 1e-13);
        }
    }

    #[test]
    fn names_go_both_ways() {
        for kind in MoldType::ALL {
            assert_eq!(MoldType::from_name(kind.name()), Some(kind));
        }
        assert_eq!(MoldType::from_name("conic"), None);
    }
}
