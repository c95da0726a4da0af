//! Fundamental forms and the curvatures that follow from them.

use glam::{DVec2, DVec3};

/// `E G − F²` at or below this share of `E G` makes a point singular: the tangents are then
/// parallel to within the rounding of `E G − F²` itself.
pub const SINGULAR_RATIO: f64 = 1e-13;

/// Why a curvature has no value.
///
/// # Example
/// ```
/// use geom_core::{CurvatureError, DVec3, FirstForm};
/// let pole = FirstForm::from_tangents(DVec3::X, DVec3::ZERO);
/// assert_eq!(pole.check(), Err(CurvatureError::Singular { e: 1.0, f: 0.0, g: 0.0 }));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum CurvatureError {
    /// A pole, a cusp, a collapsed edge, or a derivative that is not finite.
    #[error(
        "the surface is singular here: its tangents are parallel, vanish or are not finite \
         (E = {e}, F = {f}, G = {g}); measure beside the point or move the control points apart"
    )]
    Singular { e: f64, f: f64, g: f64 },
}

/// Coefficients `E = S_u·S_u`, `F = S_u·S_v`, `G = S_v·S_v` of the first fundamental form.
///
/// # Example
/// ```
/// use geom_core::{DVec2, DVec3, FirstForm};
/// // A plane with oblique tangents: the parallelogram they span has area 2.
/// let first = FirstForm::from_tangents(DVec3::new(2.0, 0.0, 0.0), DVec3::new(1.0, 1.0, 0.0));
/// assert_eq!(first.determinant().sqrt(), 2.0);
/// // The diagonal S_u + S_v = (3, 1, 0).
/// let diagonal = DVec2::new(1.0, 1.0);
/// assert_eq!(first.dot(diagonal, diagonal), 10.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstForm {
    /// `S_u · S_u`.
    pub e: f64,
    /// `S_u · S_v`.
    pub f: f64,
    /// `S_v · S_v`.
    pub g: f64,
}

impl FirstForm {
    /// The form of a surface with these tangents.
    #[must_use]
    pub fn from_tangents(s_u: DVec3, s_v: DVec3) -> Self {
        Self { e: s_u.dot(s_u), f: s_u.dot(s_v), g: s_v.dot(s_v) }
    }

    /// `E G − F²`, the squared area of the parallelogram of the tangents.
    #[must_use]
    pub fn determinant(self) -> f64 {
        self.e * self.g - self.f * self.f
    }

    /// Returns the determinant of a regular point.
    ///
    /// # Errors
    /// [`CurvatureError::Singular`] if `E G − F² ≤ SINGULAR_RATIO · E G`, or is not finite.
    pub fn check(self) -> Result<f64, CurvatureError> {
        let determinant = self.determinant();
        // Written so that NaN is refused too.
        if determinant > SINGULAR_RATIO * self.e * self.g && determinant.is_finite() {
            Ok(determinant)
        } else {
            Err(CurvatureError::Singular { e: self.e, f: self.f, g: self.g })
        }
    }

    /// Scalar product on the surface of two directions of the parameter plane.
    #[must_use]
    pub fn dot(self, a: DVec2, b: DVec2) -> f64 {
        self.e * a.x * b.x + self.f * (a.x * b.y + a.y * b.x) + self.g * a.y * b.y
    }
}

/// Coefficients `L = S_uu·n`, `M = S_uv·n`, `N = S_vv·n` of the second fundamental form.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondForm {
    /// `S_uu · n`.
    pub l: f64,
    /// `S_uv · n`.
    pub m: f64,
    /// `S_vv · n`.
    pub n: f64,
}

/// Principal curvatures and their directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PrincipalCurvatures {
    /// The larger principal curvature, in 1/length.
    pub k1: f64,
    /// The smaller principal curvature, in 1/length.
    pub k2: f64,
    /// Direction of `k1` in the parameter plane: `direction1.x S_u + direction1.y S_v` is a unit
    /// vector. At an umbilic it is along `S_u`.
    pub direction1: DVec2,
    /// Direction of `k2`, a quarter turn counterclockwise from `direction1` on the surface.
    pub direction2: DVec2,
}

/// Mean curvature `H` of a surface at a regular point, in 1/length.
///
/// `H = (L G − 2 M F + N E) / (2 (E G − F²))`  (do Carmo 1976, §3-3)
///
/// `first` holds `E, F, G` and `second` holds `L, M, N` at the same parameter pair.
/// The sign follows the normal `S_u × S_v`: with an outward normal a sphere has `H < 0`.
///
/// # Errors
/// [`CurvatureError::Singular`] if `E G − F² ≤ SINGULAR_RATIO · E G` (pole, cusp, collapsed edge).
///
/// # Example
/// ```
/// use geom_core::{CurvatureError, FirstForm, SecondForm, mean_curvature};
/// let first = FirstForm { e: 4.0, f: 0.0, g: 4.0 };
/// let second = SecondForm { l: -2.0, m: 0.0, n: -2.0 }; // sphere of radius 2
/// assert_eq!(mean_curvature(first, second)?, -0.5);
/// # Ok::<(), CurvatureError>(())
/// ```
pub fn mean_curvature(first: FirstForm, second: SecondForm) -> Result<f64, CurvatureError> {
    let determinant = first.check()?;
    let SecondForm { l, m, n } = second;
    Ok((l * first.g - 2.0 * m * first.f + n * first.e) / (2.0 * determinant))
}

/// Gaussian curvature `K` of a surface at a regular point, in 1/length².
///
/// `K = (L N − M²) / (E G − F²)`  (do Carmo 1976, §3-3)
///
/// # Errors
/// [`CurvatureError::Singular`] if `E G − F² ≤ SINGULAR_RATIO · E G` (pole, cusp, collapsed edge).
///
/// # Example
/// ```
/// use geom_core::{CurvatureError, FirstForm, SecondForm, gaussian_curvature};
/// let first = FirstForm { e: 4.0, f: 0.0, g: 4.0 };
/// let second = SecondForm { l: -2.0, m: 0.0, n: -2.0 }; // sphere of radius 2
/// assert_eq!(gaussian_curvature(first, second)?, 0.25);
/// # Ok::<(), CurvatureError>(())
/// ```
pub fn gaussian_curvature(first: FirstForm, second: SecondForm) -> Result<f64, CurvatureError> {
    let determinant = first.check()?;
    Ok((second.l * second.n - second.m * second.m) / determinant)
}

/// Normal curvature of the direction `direction.x S_u + direction.y S_v`, in 1/length.
///
/// `κ_n = II(d, d) / I(d, d)`; the length of `direction` does not matter.
///
/// # Errors
/// [`CurvatureError::Singular`] at a singular point or for a direction of zero length.
///
/// # Example
/// ```
/// use geom_core::{CurvatureError, DVec2, FirstForm, SecondForm, normal_curvature};
/// let first = FirstForm { e: 1.0, f: 0.0, g: 4.0 };
/// let second = SecondForm { l: 0.0, m: 0.0, n: -2.0 }; // cylinder of radius 2, v around it
/// let along = |x, y| normal_curvature(first, second, DVec2::new(x, y));
/// assert_eq!((along(1.0, 0.0)?, along(0.0, 1.0)?), (0.0, -0.5));
/// assert_eq!(along(2.0, 1.0)?, -0.25); // at 45° to the axis: Euler's cos² 45° of −1/2
/// # Ok::<(), CurvatureError>(())
/// ```
pub fn normal_curvature(
    first: FirstForm,
    second: SecondForm,
    direction: DVec2,
) -> Result<f64, CurvatureError> {
    first.check()?;
    let length_squared = first.dot(direction, direction);
    if !(length_squared > 0.0) {
        return Err(CurvatureError::Singular { e: first.e, f: first.f, g: first.g });
    }
    let DVec2 { x, y } = direction;
    Ok((second.l * x * x + 2.0 * second.m * x * y + second.n * y * y) / length_squared)
}

/// Principal curvatures `k1 ≥ k2` and their directions at a regular point.
///
/// The shape operator is written in the orthonormal frame of `S_u` and its quarter turn, where it
/// is symmetric, so that the difference `k1 − k2` keeps its digits near umbilics (which
/// `√(H² − K)` does not).
///
/// # Errors
/// [`CurvatureError::Singular`] if `E G − F² ≤ SINGULAR_RATIO · E G`.
///
/// # Example
/// ```
/// use geom_core::{CurvatureError, FirstForm, SecondForm, principal_curvatures};
/// let first = FirstForm { e: 1.0, f: 0.0, g: 4.0 };
/// let second = SecondForm { l: 0.0, m: 0.0, n: -2.0 }; // cylinder of radius 2, v around it
/// let principal = principal_curvatures(first, second)?;
/// assert_eq!((principal.k1, principal.k2), (0.0, -0.5));
/// # Ok::<(), CurvatureError>(())
/// ```
pub fn principal_curvatures(
    first: FirstForm,
    second: SecondForm,
) -> Result<PrincipalCurvatures, CurvatureError> {
    let determinant = first.check()?;
    let FirstForm { e, f, .. } = first;
    let SecondForm { l, m, n } = second;
    let root = determinant.sqrt();
    // The frame x = S_u/√E, y = (E S_v − F S_u)/√(E Δ), in the parameter plane.
    let x = DVec2::new(1.0 / e.sqrt(), 0.0);
    let y = DVec2::new(-f, e) / (e.sqrt() * root);
    let a = l / e;
    let b = (e * m - f * l) / (e * root);
    let c = (e * (e * n - 2.0 * f * m) + f * f * l) / (e * determinant);
    let (middle, half_difference) = (0.5 * (a + c), (0.5 * (a - c)).hypot(b));
    // atan2(0, 0) = 0: at an umbilic the first direction is S_u.
    let (sin, cos) = (0.5 * (2.0 * b).atan2(a - c)).sin_cos();
    Ok(PrincipalCurvatures {
        k1: middle + half_difference,
        k2: middle - half_difference,
        direction1: x * cos + y * sin,
        direction2: y * cos - x * sin,
    })
}

/// The two asymptotic directions (normal curvature zero) in the parameter plane, each giving a
/// unit vector `d.x S_u + d.y S_v`; `None` where `K > 0` and at planar points.
///
/// They lie at `± atan √(k1 / −k2)` from the first principal direction, first the one turned
/// clockwise and then the one turned counterclockwise. Where one principal curvature is zero both
/// coincide with its direction.
///
/// # Errors
/// [`CurvatureError::Singular`] if `E G − F² ≤ SINGULAR_RATIO · E G`.
///
/// # Example
/// ```
/// use geom_core::{CurvatureError, FirstForm, SecondForm, asymptotic_directions, normal_curvature};
/// let first = FirstForm { e: 1.0, f: 0.0, g: 1.0 };
/// let saddle = SecondForm { l: 3.0, m: 0.0, n: -1.0 }; // z = (3 x² − y²) / 2
/// let [left, right] = asymptotic_directions(first, saddle)?.expect("K < 0");
/// assert!((left.x.abs() - 0.5).abs() < 1e-15 && (right.y.abs() - 0.75_f64.sqrt()).abs() < 1e-15);
/// assert!(normal_curvature(first, saddle, left)?.abs() < 1e-15);
/// let bowl = SecondForm { l: 3.0, m: 0.0, n: 1.0 };
/// assert_eq!(asymptotic_directions(first, bowl)?, None);
/// # Ok::<(), CurvatureError>(())
/// ```
pub fn asymptotic_directions(
    first: FirstForm,
    second: SecondForm,
) -> Result<Option<[DVec2; 2]>, CurvatureError> {
    let principal = principal_curvatures(first, second)?;
    let PrincipalCurvatures { k1, k2, direction1, direction2 } = principal;
    if k1 < 0.0 || k2 > 0.0 || (k1 == 0.0 && k2 == 0.0) {
        return Ok(None);
    }
    let (sin, cos) = k1.sqrt().atan2((-k2).sqrt()).sin_cos();
    Ok(Some([direction1 * cos - direction2 * sin, direction1 * cos + direction2 * sin]))
}

/// Squared length of the intrinsic gradient of a function `ψ` on the surface.
///
/// `|∇ψ|² = (G ψ_u² − 2 F ψ_u ψ_v + E ψ_v²) / (E G − F²)`. Pellis et al. 2021, Sec. 3.2.1, print
/// this with `E` and `G` exchanged and a square root in the denominator; their Eq. 7 agrees with
/// the form here.
///
/// # Errors
/// [`CurvatureError::Singular`] if `E G − F² ≤ SINGULAR_RATIO · E G`.
///
/// # Example
/// ```
/// use geom_core::{CurvatureError, FirstForm, gradient_norm_squared};
/// // The function u on a plane with u stretched to length 2 has slope 1/2.
/// assert_eq!(gradient_norm_squared(FirstForm { e: 4.0, f: 0.0, g: 1.0 }, 1.0, 0.0)?, 0.25);
/// # Ok::<(), CurvatureError>(())
/// ```
pub fn gradient_norm_squared(
    first: FirstForm,
    psi_u: f64,
    psi_v: f64,
) -> Result<f64, CurvatureError> {
    let determinant = first.check()?;
    let FirstForm { e, f, g } = first;
    Ok((g * psi_u * psi_u - 2.0 * f * psi_u * psi_v + e * psi_v * psi_v) / determinant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assert_close;

    /// Forms of a torus with outward normal, u around the axis, v around the tube.
    fn torus(big: f64, small: f64, v: f64) -> (FirstForm, SecondForm) {
        let r = big + small * v.cos();
        (
            FirstForm { e: r * r, f: 0.0, g: small * small },
            SecondForm { l: -r * v.cos(), m: 0.0, n: -small },
        )
    }

    #[test]
    fn torus_curvatures_are_closed_form() {
        for v in (0..16).map(|i| 0.4 * f64::from(i)) {
            let (first, second) = torus(3.0, 1.0, v);
            let parallel = -v.cos() / (3.0 + v.cos());
            assert_close(gaussian_curvature(first, second).unwrap(), -parallel, 1e-14);
            assert_close(mean_curvature(first, second).unwrap(), 0.5 * (parallel - 1.0), 1e-14);
            let principal = principal_curvatures(first, second).unwrap();
            assert_close(principal.k1, parallel, 1e-14);
            assert_close(principal.k2, -1.0, 1e-14);
            assert_close(principal.direction1.y, 0.0, 1e-14);
        }
    }

    /// Change of parameters u = p + s q, v = q: the curvatures stay, the directions turn with it.
    fn sheared(first: FirstForm, second: SecondForm, s: f64) -> (FirstForm, SecondForm) {
        let FirstForm { e, f, g } = first;
        let SecondForm { l, m, n } = second;
        (
            FirstForm { e, f: f + s * e, g: g + 2.0 * s * f + s * s * e },
            SecondForm { l, m: m + s * l, n: n + 2.0 * s * m + s * s * l },
        )
    }

    #[test]
    fn shear_of_parameters_changes_no_curvature() {
        let (first, second) = torus(3.0, 1.0, 2.5);
        let want = principal_curvatures(first, second).unwrap();
        let (first2, second2) = sheared(first, second, 0.7);
        let got = principal_curvatures(first2, second2).unwrap();
        assert_close(got.k1, want.k1, 1e-13);
        assert_close(got.k2, want.k2, 1e-13);
        let h = mean_curvature(first2, second2).unwrap();
        assert_close(h, mean_curvature(first, second).unwrap(), 1e-13);
        for (direction, k) in [(got.direction1, got.k1), (got.direction2, got.k2)] {
            assert_close(normal_curvature(first2, second2, direction).unwrap(), k, 1e-13);
            assert_close(first2.dot(direction, direction), 1.0, 1e-13);
        }
        assert_close(first2.dot(got.direction1, got.direction2), 0.0, 1e-13);
    }

    #[test]
    fn asymptotic_directions_have_no_normal_curvature() {
        let (first, second) = torus(3.0, 1.0, 2.5);
        let (first, second) = sheared(first, second, -0.4);
        let directions = asymptotic_directions(first, second).unwrap().unwrap();
        for direction in directions {
            assert_close(normal_curvature(first, second, direction).unwrap(), 0.0, 1e-13);
            assert_close(first.dot(direction, direction), 1.0, 1e-13);
        }
        assert!((directions[0] - directions[1]).length() > 0.1);
        let (first, second) = torus(3.0, 1.0, 0.3);
        assert_eq!(asymptotic_directions(first, second).unwrap(), None);
        let flat = SecondForm { l: 0.0, m: 0.0, n: 0.0 };
        assert_eq!(asymptotic_directions(first, flat).unwrap(), None);
    }

    #[test]
    fn gradient_norm_on_a_sheared_patch_is_the_tangential_part_of_the_axis() {
        // psi = x has the gradient e_x minus its normal part, so |grad|^2 = 1 - n_x^2.
        let (s_u, s_v) = (DVec3::new(1.0, 0.3, -0.2), DVec3::new(0.4, 0.9, 0.5));
        let n = s_u.cross(s_v).normalize();
        let first = FirstForm::from_tangents(s_u, s_v);
        let got = gradient_norm_squared(first, s_u.x, s_v.x).unwrap();
        assert_close(got, 1.0 - n.x * n.x, 1e-14);
    }

    #[test]
    fn singular_points_are_refused_with_a_message() {
        let second = SecondForm { l: 1.0, m: 0.0, n: 1.0 };
        for first in [
            FirstForm { e: 0.0, f: 0.0, g: 1.0 },
            FirstForm { e: 1.0, f: 1.0, g: 1.0 },
            FirstForm { e: f64::NAN, f: 0.0, g: 1.0 },
            FirstForm { e: f64::INFINITY, f: 0.0, g: 1.0 },
        ] {
            assert!(mean_curvature(first, second).is_err());
            assert!(gaussian_curvature(first, second).is_err());
            assert!(principal_curvatures(first, second).is_err());
            assert!(asymptotic_directions(first, second).is_err());
            assert!(gradient_norm_squared(first, 1.0, 0.0).is_err());
        }
        let error = mean_curvature(FirstForm { e: 0.0, f: 0.0, g: 1.0 }, second).unwrap_err();
        assert!(error.to_string().starts_with("the surface is singular here"), "{error}");
        // A small but regular patch is not singular: the test is relative.
        assert!(FirstForm { e: 1e-18, f: 0.0, g: 1e-6 }.check().is_ok());
    }
}
