//! Position and derivatives of a parametrised surface at one parameter pair.

use crate::forms::{CurvatureError, FirstForm, SecondForm};
use glam::DVec3;

/// Position and partial derivatives of a surface `S(u, v)` up to total order [`SurfaceJet::ORDER`].
///
/// Derivatives stand in the order `S, S_u, S_v, S_uu, S_uv, S_vv, S_uuu, S_uuv, …`; entries beyond
/// the order that was asked for are zero.
///
/// # Example
/// ```
/// use geom_core::{CurvatureError, DVec3, SurfaceJet};
/// // The paraboloid z = (x² + 3 y²) / 2 at its vertex.
/// let mut jet = SurfaceJet::default();
/// jet.derivatives[SurfaceJet::index(1, 0)] = DVec3::X;
/// jet.derivatives[SurfaceJet::index(0, 1)] = DVec3::Y;
/// jet.derivatives[SurfaceJet::index(2, 0)] = DVec3::Z;
/// jet.derivatives[SurfaceJet::index(0, 2)] = 3.0 * DVec3::Z;
/// assert_eq!(jet.normal()?, DVec3::Z);
/// assert_eq!((jet.mean_curvature()?, jet.gaussian_curvature()?), (2.0, 3.0));
/// # Ok::<(), CurvatureError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceJet {
    /// `derivatives[SurfaceJet::index(a, b)]` is the derivative `a` times in u and `b` times in v.
    pub derivatives: [DVec3; Self::LEN],
}

impl Default for SurfaceJet {
    fn default() -> Self {
        Self { derivatives: [DVec3::ZERO; Self::LEN] }
    }
}

impl SurfaceJet {
    /// Highest total order of derivatives a jet can hold.
    pub const ORDER: usize = 4;
    /// Number of derivatives of total order 0 to 4.
    pub const LEN: usize = 15;

    /// Where the derivative `a` times in u and `b` times in v stands.
    ///
    /// # Panics
    /// In debug builds, if `a + b` exceeds [`SurfaceJet::ORDER`].
    #[must_use]
    pub const fn index(a: usize, b: usize) -> usize {
        debug_assert!(a + b <= Self::ORDER);
        (a + b) * (a + b + 1) / 2 + b
    }

    /// The derivative `a` times in u and `b` times in v.
    #[must_use]
    pub const fn d(&self, a: usize, b: usize) -> DVec3 {
        self.derivatives[Self::index(a, b)]
    }

    /// The point itself.
    #[must_use]
    pub const fn position(&self) -> DVec3 {
        self.derivatives[0]
    }

    /// Coefficients of the first fundamental form.
    #[must_use]
    pub fn first_form(&self) -> FirstForm {
        FirstForm::from_tangents(self.d(1, 0), self.d(0, 1))
    }

    /// Unit normal `S_u × S_v / |S_u × S_v|`.
    ///
    /// # Errors
    /// [`CurvatureError::Singular`] where the tangents are parallel or vanish.
    pub fn normal(&self) -> Result<DVec3, CurvatureError> {
        self.first_form().check()?;
        Ok(self.d(1, 0).cross(self.d(0, 1)).normalize())
    }

    /// Coefficients of the second fundamental form for the normal `S_u × S_v`.
    ///
    /// # Errors
    /// [`CurvatureError::Singular`] where the tangents are parallel or vanish.
    pub fn second_form(&self) -> Result<SecondForm, CurvatureError> {
        let normal = self.normal()?;
        Ok(SecondForm {
            l: self.d(2, 0).dot(normal),
            m: self.d(1, 1).dot(normal),
            n: self.d(0, 2).dot(normal),
        })
    }

    /// Mean curvature `H` in 1/length, see [`crate::mean_curvature`].
    ///
    /// # Errors
    /// [`CurvatureError::Singular`] where the tangents are parallel or vanish.
    pub fn mean_curvature(&self) -> Result<f64, CurvatureError> {
        crate::mean_curvature(self.first_form(), self.second_form()?)
    }

    /// Gaussian curvature `K` in 1/length², see [`crate::gaussian_curvature`].
    ///
    /// # Errors
    /// [`CurvatureError::Singular`] where the tangents are parallel or vanish.
    pub fn gaussian_curvature(&self) -> Result<f64, CurvatureError> {
        crate::gaussian_curvature(self.first_form(), self.second_form()?)
    }

    /// The tangent vector `a S_u + b S_v` of a direction in the parameter plane.
    #[must_use]
    pub fn tangent(&self, direction: glam::DVec2) -> DVec3 {
        self.d(1, 0) * direction.x + self.d(0, 1) * direction.y
    }
}
