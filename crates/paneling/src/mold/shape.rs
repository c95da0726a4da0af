//! Mold shapes: height functions over the tangent plane of a mold's own frame.

use gp_solver::{ListItem, OptionValue, choices};
use numerics::Taylor;
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
    /// Any patch of a torus: normal curvatures of the parallel through the origin (in x) and of the
    /// generating circle (in y), and geodesic curvature of the parallel. Panels can slide along the
    /// tube as long as it is not vertical.
    Torus,
    /// A cubic polynomial without constant and linear terms.
    Cubic,
}

choices!(MoldType {
    Plane = "plane",
    Cylinder = "cylinder",
    Sphere = "sphere",
    Paraboloid = "paraboloid",
    Torus = "torus",
    Cubic = "cubic",
});

impl ListItem for MoldType {
    const BETWEEN: char = ',';
    const LIST_FORM: &'static str = "TYPE,...";
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

    /// Number of free parameters of the shape.
    #[must_use]
    pub fn parameter_count(self) -> usize {
        match self {
            Self::Plane => 0,
            Self::Cylinder | Self::Sphere => 1,
            Self::Paraboloid => 2,
            Self::Torus => 3,
            Self::Cubic => 7,
        }
    }
}

impl std::str::FromStr for MoldType {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Self::read(name).map_err(|_| {
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
    /// Cubic: factors of `x², xy, y², x³, x²y, xy², y³`. Paraboloid: of `x², y²`. Cylinder, sphere:
    /// the curvature. Torus: `k₁, k₂, g`, the curvatures of the parallel and of the generating
    /// circle and the geodesic curvature of the parallel; its axis passes through
    /// `(0, g, k₁) / (k₁² + g²)` in the direction `(0, k₁, −g)`, and the tube has radius `1 / k₂`.
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

impl Height {
    /// From a Taylor expansion whose first two variables are x and y.
    fn of<const N: usize>(z: Taylor<N>) -> Self {
        Self {
            f: z.value,
            fx: z.first[0],
            fy: z.first[1],
            fxx: z.second[0][0],
            fxy: z.second[0][1],
            fyy: z.second[1][1],
        }
    }
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
            MoldType::Torus | MoldType::Cylinder | MoldType::Sphere => self.round_at(x, y),
        }
    }

    // Apart, so that the polynomials do not pay for its large stack frame.
    #[inline(never)]
    fn round_at(&self, x: f64, y: f64) -> Height {
        if self.kind != MoldType::Torus {
            let [k1, k2] = self.round_curvatures().map(Taylor::constant);
            let [x, y] = Taylor::variables([x, y]);
            return Height::of::<2>(round_height(x, y, k1, k2));
        }
        self.torus_height(x, y).map_or(UNREACHED, |z| {
            let [k1, k2, g, ..] = self.parameters.map(Taylor::constant);
            let [x, y, z] = Taylor::variables([x, y, z]);
            Height::of(explicit::<3, 2>(z.value, torus_equation(x, y, [k1, k2, g], z)))
        })
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
            MoldType::Torus | MoldType::Cylinder | MoldType::Sphere => {
                return self.round_rows(x, y);
            }
        }
        rows
    }

    #[inline(never)]
    fn round_rows(&self, x: f64, y: f64) -> ParameterRows {
        let mut rows = [[0.0; MAX_PARAMETERS]; 3];
        if self.kind == MoldType::Torus {
            match self.torus_rows(x, y) {
                Some(z) => {
                    for i in 0..3 {
                        rows[0][i] = z.first[2 + i];
                        rows[1][i] = z.second[0][2 + i];
                        rows[2][i] = z.second[1][2 + i];
                    }
                }
                None => rows.iter_mut().for_each(|row| row[..3].fill(f64::NAN)),
            }
            return rows;
        }
        let [k1, k2] = self.round_curvatures();
        let [x, y, k1, k2] = Taylor::variables([x, y, k1, k2]);
        let z = round_height(x, y, k1, k2);
        for (row, [along_x, along_y]) in rows.iter_mut().zip([
            [z.first[2], z.first[3]],
            [z.second[0][2], z.second[0][3]],
            [z.second[1][2], z.second[1][3]],
        ]) {
            let is_sphere = self.kind == MoldType::Sphere;
            row[0] = if is_sphere { along_x + along_y } else { along_x };
        }
        rows
    }

    /// Curvatures of a cylinder or sphere along x and y.
    fn round_curvatures(&self) -> [f64; 2] {
        let k = self.parameters[0];
        [k, if self.kind == MoldType::Sphere { k } else { 0.0 }]
    }

    /// The height of a torus; `None` beyond its reach.
    ///
    /// Turning `(x, y, z)` about the axis into the plane `x = 0` gives `(y + g d, z + k₁ d)` with
    /// `d = −x² / (1 − σ + √((k₁² + g²) x² + (1 − σ)²))` and `σ = g y + k₁ z`, which stays exact as
    /// the axis moves to infinity. There the generating circle has the height
    /// `p(t) = k₂ t² / (1 + √(1 − k₂² t²))`, so the height is the root of
    /// `z + k₁ d − p(y + g d)`.
    fn torus_height(&self, x: f64, y: f64) -> Option<f64> {
        let [k1, k2, g, ..] = self.parameters;
        let squared = k1 * k1 + g * g;
        let mut z = 0.5 * (k1 * x * x + k2 * y * y);
        let scale = x.abs() + y.abs() + z.abs();
        let mut is_root = false;
        for _ in 0..30 {
            let below = 1.0 - g * y - k1 * z;
            let w = (squared * x * x + below * below).sqrt();
            let (sum, along_w) = (below + w, -k1 * below / w);
            let d = -x * x / sum;
            let d_z = d * (k1 - along_w) / sum;
            let t = y + g * d;
            let root = (1.0 - k2 * k2 * t * t).sqrt();
            let value = z + k1 * d - k2 * t * t / (1.0 + root);
            let slope = 1.0 + k1 * d_z - k2 * t / root * g * d_z;
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

    /// The torus height as a function of x, y and the three parameters `k₁, k₂, g`.
    fn torus_rows(&self, x: f64, y: f64) -> Option<Taylor<5>> {
        let z = self.torus_height(x, y)?;
        let [k1, k2, g, ..] = self.parameters;
        let [x, y, k1, k2, g, z] = Taylor::variables([x, y, k1, k2, g, z]);
        Some(explicit(z.value, torus_equation(x, y, [k1, k2, g], z)))
    }
}

/// The height of a cylinder or sphere as a function of x, y and two curvatures, which are those
/// of the parallel and of the generating circle of a torus at its equator.
///
/// The generating circle has the height `p = k₂ y² / (1 + √(1 − k₂² y²))`; turning it about
/// the axis at height `1/k₁` gives `z = q / (1 + √(1 − k₁ q))` with
/// `q = 2 p + k₁ (x² − p²)`, which stays exact where a curvature vanishes (a cylinder) and is
/// a sphere for equal curvatures.
fn round_height<const N: usize>(
    x: Taylor<N>,
    y: Taylor<N>,
    k1: Taylor<N>,
    k2: Taylor<N>,
) -> Taylor<N> {
    let one = Taylor::constant(1.0);
    let p = k2 * y * y / (one + (one - k2 * k2 * y * y).sqrt());
    let q = p + p + k1 * (x * x - p * p);
    q / (one + (one - k1 * q).sqrt())
}

/// What vanishes on the torus, see [`Mold::torus_height`].
fn torus_equation<const N: usize>(
    x: Taylor<N>,
    y: Taylor<N>,
    [k1, k2, g]: [Taylor<N>; 3],
    z: Taylor<N>,
) -> Taylor<N> {
    let one = Taylor::constant(1.0);
    let below = one - g * y - k1 * z;
    let xx = x * x;
    let w = (xx * (k1 * k1 + g * g) + below * below).sqrt();
    let d = Taylor::constant(0.0) - xx / (below + w);
    let t = y + g * d;
    let tube = k2 * t;
    let p = tube * t / (one + (one - tube * tube).sqrt());
    z + k1 * d - p
}

/// The last variable of an equation, of value `z`, as a function of the `M = N − 1` others, by
/// implicit differentiation.
fn explicit<const N: usize, const M: usize>(z: f64, equation: Taylor<N>) -> Taylor<M> {
    let (first, second) = (equation.first, equation.second);
    let mut height = Taylor::<M>::constant(z);
    for i in 0..M {
        height.first[i] = -first[i] / first[M];
    }
    for i in 0..M {
        for j in 0..M {
            let (fi, fj) = (height.first[i], height.first[j]);
            let sum = second[i][j] + second[i][M] * fj + second[M][j] * fi + second[M][M] * fi * fj;
            height.second[i][j] = -sum / first[M];
        }
    }
    height
}

/// Beyond the reach of a round mold.
const UNREACHED: Height =
    Height { f: f64::NAN, fx: f64::NAN, fy: f64::NAN, fxx: f64::NAN, fxy: f64::NAN, fyy: f64::NAN };

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
        assert!(mold(MoldType::Torus, 0.2, 1.0).height(0.1, 1.1).is_nan());
    }

    #[test]
    fn tori_of_any_latitude_lie_on_their_surfaces() {
        let (big, small) = (3.0, 1.0);
        // The outer equator, a place above it, the top circle, the inner side, the inner equator.
        for latitude in [0.0, 0.8, std::f64::consts::FRAC_PI_2, 2.2, 3.1, -1.0] {
            let (sin, cos) = f64::sin_cos(latitude);
            // Seen from inside the tube, y towards rising latitude.
            let to_axis = big + small * cos;
            let mut mold = Mold::flat(MoldType::Torus);
            mold.parameters[..3].copy_from_slice(&[cos / to_axis, 1.0 / small, sin / to_axis]);
            for (x, y) in [(0.0, 0.0), (0.4, 0.3), (-0.3, 0.5), (0.2, -0.6)] {
                let z = mold.height(x, y);
                // Away from the axis, along the axis.
                let away = to_axis - sin * y - cos * z;
                let height = small * sin + cos * y - sin * z;
                assert_close((away.hypot(x) - big).hypot(height), small, 1e-13);
            }
        }
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
            assert_eq!(MoldType::read(kind.name()), Ok(kind));
        }
        assert!(MoldType::read("conic").is_err());
    }
}
