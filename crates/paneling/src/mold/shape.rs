//! Mold shapes: height functions over the tangent plane of a mold's own frame.

pub(crate) use crate::mold::height::{Height, MAX_PARAMETERS, ParameterRows};
use crate::mold::round::{Torus, round_at, round_rows};
use glam::DVec3;
use gp_solver::{ListItem, OptionValue, choices};
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

/// Area of the rectangle around points in the frame of a mold: what its blank has to have. 0 if
/// there are none.
pub(crate) fn blank(points: impl Iterator<Item = DVec3>) -> f64 {
    let start = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    let (low, high) = points.fold(start, |(low, high), x| (low.min(x), high.max(x)));
    let size = (high - low).max(DVec3::ZERO);
    size.x * size.y
}

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
            MoldType::Cylinder | MoldType::Sphere => {
                round_at(p[0], self.kind == MoldType::Sphere, x, y)
            }
            MoldType::Torus => self.torus().at(x, y),
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
            MoldType::Cylinder | MoldType::Sphere => {
                return round_rows(self.parameters[0], self.kind == MoldType::Sphere, x, y);
            }
            MoldType::Torus => return self.torus().rows(x, y),
        }
        rows
    }

    fn torus(&self) -> Torus {
        let [k1, k2, g, ..] = self.parameters;
        Torus { k1, k2, g }
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
