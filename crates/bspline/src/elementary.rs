//! Planes, cylinders, cones, spheres and tori: their own parameters, and parts of them as exact
//! rational surfaces.

use crate::conic::ArcSpans;
use crate::curve::BsplineCurve;
use crate::error::SplineError;
use crate::surface::BsplineSurface;
use crate::sweep::Axis;
use glam::{DMat3, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// A right-handed orthonormal coordinate system.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// The origin.
    pub origin: DVec3,
    /// First axis.
    pub x: DVec3,
    /// Second axis.
    pub y: DVec3,
    /// Third axis, `x × y`.
    pub z: DVec3,
}

impl Frame {
    /// The frame with this third axis and, as far as it is not parallel to that, first axis; a
    /// missing or parallel first axis is replaced by a coordinate axis.
    #[must_use]
    pub fn new(origin: DVec3, z: DVec3, x: Option<DVec3>) -> Self {
        let z = z.try_normalize().unwrap_or(DVec3::Z);
        let across = |x: DVec3| {
            let left = x - z * x.dot(z);
            (left.length() > 1e-9 * x.length()).then(|| left.normalize())
        };
        let x = x.and_then(across).or_else(|| across(DVec3::X)).or_else(|| across(DVec3::Y));
        let x = x.unwrap_or(DVec3::X);
        Self { origin, x, y: z.cross(x), z }
    }

    /// The point with these coordinates.
    #[must_use]
    pub fn point(&self, local: DVec3) -> DVec3 {
        self.origin + local.x * self.x + local.y * self.y + local.z * self.z
    }

    /// The coordinates of a point.
    #[must_use]
    pub fn local(&self, point: DVec3) -> DVec3 {
        DMat3::from_cols(self.x, self.y, self.z).transpose() * (point - self.origin)
    }
}

/// The shape of an [`Elementary`] surface.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(missing_docs, reason = "the formulas name every field")]
pub enum ElementaryKind {
    /// `u x + v y`.
    Plane,
    /// `radius (cos u x + sin u y) + v z`.
    Cylinder { radius: f64 },
    /// `(radius + slope v) (cos u x + sin u y) + v z`.
    Cone { radius: f64, slope: f64 },
    /// `radius (cos v (cos u x + sin u y) + sin v z)`.
    Sphere { radius: f64 },
    /// `(major + minor cos v) (cos u x + sin u y) + minor sin v z`.
    Torus { major: f64, minor: f64 },
}

/// A plane, cylinder, cone, sphere or torus with the parameters of ISO 10303-42: angles in
/// radians, lengths along the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Elementary {
    /// Where it stands.
    pub frame: Frame,
    /// What it is.
    pub kind: ElementaryKind,
}

impl Elementary {
    /// The point at `(u, v)`.
    #[must_use]
    pub fn point(&self, [u, v]: [f64; 2]) -> DVec3 {
        let ((sin, cos), (sin_v, cos_v)) = (u.sin_cos(), v.sin_cos());
        let around = |r: f64, z: f64| self.frame.point(DVec3::new(r * cos, r * sin, z));
        match self.kind {
            ElementaryKind::Plane => self.frame.point(DVec3::new(u, v, 0.0)),
            ElementaryKind::Cylinder { radius } => around(radius, v),
            ElementaryKind::Cone { radius, slope } => around(radius + slope * v, v),
            ElementaryKind::Sphere { radius } => around(radius * cos_v, radius * sin_v),
            ElementaryKind::Torus { major, minor } => around(major + minor * cos_v, minor * sin_v),
        }
    }

    /// Parameters of the point of the surface that is nearest (to first order in the distance),
    /// angles in `(−π, π]`, and the distance from the axis that makes `u` an angle (infinite for
    /// a plane): where it vanishes `u` means nothing.
    #[must_use]
    pub fn locate(&self, point: DVec3) -> ([f64; 2], f64) {
        let p = self.frame.local(point);
        let (rho, u) = (p.x.hypot(p.y), p.y.atan2(p.x));
        match self.kind {
            ElementaryKind::Plane => ([p.x, p.y], f64::INFINITY),
            ElementaryKind::Cylinder { .. } => ([u, p.z], rho),
            ElementaryKind::Cone { radius, slope } => {
                // Beyond the apex the radius is negative, half a turn away.
                let u = if radius + slope * p.z >= 0.0 { u } else { (-p.y).atan2(-p.x) };
                ([u, p.z], rho)
            }
            ElementaryKind::Sphere { .. } => ([u, p.z.atan2(rho)], rho),
            ElementaryKind::Torus { major, .. } => ([u, p.z.atan2(rho - major)], rho),
        }
    }

    /// The period of each parameter.
    #[must_use]
    pub fn periods(&self) -> [Option<f64>; 2] {
        match self.kind {
            ElementaryKind::Plane => [None, None],
            ElementaryKind::Torus { .. } => [Some(TAU), Some(TAU)],
            _ => [Some(TAU), None],
        }
    }

    /// All parameters there are; infinite where the surface is.
    #[must_use]
    pub fn bounds(&self) -> [[f64; 2]; 2] {
        let all = [f64::NEG_INFINITY, f64::INFINITY];
        match self.kind {
            ElementaryKind::Plane => [all, all],
            ElementaryKind::Cylinder { .. } | ElementaryKind::Cone { .. } => [[0.0, TAU], all],
            ElementaryKind::Sphere { .. } => [[0.0, TAU], [-FRAC_PI_2, FRAC_PI_2]],
            ElementaryKind::Torus { .. } => [[0.0, TAU], [0.0, TAU]],
        }
    }

    /// Values of `v` at which all `u` are one point.
    #[must_use]
    pub fn poles(&self) -> Vec<f64> {
        match self.kind {
            ElementaryKind::Sphere { .. } => vec![-FRAC_PI_2, FRAC_PI_2],
            ElementaryKind::Cone { radius, slope } if slope != 0.0 => vec![-radius / slope],
            _ => Vec::new(),
        }
    }

    /// The same surface `distance` further along its normal `S_u × S_v`; parameters stay.
    ///
    /// Returns `None` if nothing or only a point of a sphere, cylinder or tube would be left.
    #[must_use]
    pub fn offset(&self, distance: f64) -> Option<Self> {
        let mut frame = self.frame;
        let positive = |r: f64| (r > 0.0).then_some(r);
        let kind = match self.kind {
            ElementaryKind::Plane => {
                frame.origin += distance * frame.z;
                ElementaryKind::Plane
            }
            ElementaryKind::Cylinder { radius } => {
                ElementaryKind::Cylinder { radius: positive(radius + distance)? }
            }
            ElementaryKind::Cone { radius, slope } => {
                // The normal (1, −slope) / √(1 + slope²) in the half plane of radius and height.
                let unit = distance / (1.0 + slope * slope).sqrt();
                frame.origin -= unit * slope * frame.z;
                ElementaryKind::Cone { radius: radius + unit, slope }
            }
            ElementaryKind::Sphere { radius } => {
                ElementaryKind::Sphere { radius: positive(radius + distance)? }
            }
            ElementaryKind::Torus { major, minor } => {
                ElementaryKind::Torus { major, minor: positive(minor + distance)? }
            }
        };
        Some(Self { frame, kind })
    }

    /// The part over `u × v` as a rational surface of bidegree 2 x 1 or 2 x 2 (1 x 1 for a plane),
    /// exact. Its parameters agree with `u` and `v` at the knots; see [`Self::spline_parameters`].
    ///
    /// # Errors
    /// [`SplineError`] if a range is empty or infinite.
    ///
    /// # Panics
    /// If a range of angles is empty or more than a full turn.
    pub fn surface(&self, u: [f64; 2], v: [f64; 2]) -> Result<BsplineSurface, SplineError> {
        let f = &self.frame;
        if let ElementaryKind::Plane = self.kind {
            let base = BsplineCurve::segment(
                f.point(u[0] * DVec3::X),
                f.point(u[1] * DVec3::X),
                u[0],
                u[1],
            )?;
            return BsplineSurface::extrusion(&base, f.y, v[0], v[1]);
        }
        let axis = Axis { origin: f.origin, direction: f.z };
        let circle = |major: f64, minor: f64| {
            let (center, spans) = (f.origin + major * f.x, ArcSpans::new(v[0], v[1]));
            BsplineCurve::arc(center, minor * f.x, minor * f.z, spans)
        };
        let profile = match self.kind {
            ElementaryKind::Sphere { radius } => {
                let arc = circle(0.0, radius)?;
                let mut points = arc.control_points().to_vec();
                // The poles lie on the axis whatever the cosine of a right angle rounds to.
                let last = points.len() - 1;
                for (k, v) in [(0, v[0]), (last, v[1])] {
                    if FRAC_PI_2 - v.abs() < 1e-15 {
                        points[k] = f.origin + (radius * v.signum()) * f.z;
                    }
                }
                BsplineCurve::new(arc.knots().clone(), points, arc.weights().map(<[f64]>::to_vec))?
            }
            ElementaryKind::Torus { major, minor } => circle(major, minor)?,
            _ => {
                let end = |t: f64| match self.kind {
                    // At the apex itself the radius is nothing but rounding.
                    ElementaryKind::Cone { .. } if self.poles().contains(&t) => f.origin + t * f.z,
                    _ => self.point([0.0, t]),
                };
                BsplineCurve::segment(end(v[0]), end(v[1]), v[0], v[1])?
            }
        };
        BsplineSurface::revolution(&profile, axis, ArcSpans::new(u[0], u[1]))
    }

    /// Where the surface over `u × v` of [`Self::surface`] has the parameters `at`.
    #[must_use]
    pub fn spline_parameters(&self, u: [f64; 2], v: [f64; 2], at: [f64; 2]) -> [f64; 2] {
        let arc = |[a, b]: [f64; 2], t: f64| ArcSpans::new(a, b).parameter(t);
        match self.kind {
            ElementaryKind::Plane => at,
            ElementaryKind::Cylinder { .. } | ElementaryKind::Cone { .. } => [arc(u, at[0]), at[1]],
            _ => [arc(u, at[0]), arc(v, at[1])],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;
    use std::f64::consts::PI;

    fn all() -> Vec<(Elementary, [f64; 2], [f64; 2])> {
        let frame = Frame::new(
            DVec3::new(3.0, -1.0, 2.0),
            DVec3::new(1.0, 2.0, -0.5),
            Some(DVec3::new(0.3, 0.1, 1.0)),
        );
        let kinds = [
            (ElementaryKind::Plane, [-1.0, 2.0], [0.5, 4.0]),
            (ElementaryKind::Cylinder { radius: 2.0 }, [-1.0, 3.0], [0.5, 4.0]),
            (ElementaryKind::Cone { radius: 2.0, slope: -0.4 }, [0.0, TAU], [0.5, 4.0]),
            (ElementaryKind::Sphere { radius: 1.5 }, [0.5, 4.0], [-1.0, 0.3]),
            (ElementaryKind::Torus { major: 3.0, minor: 1.0 }, [0.0, TAU], [-2.0, -2.0 + TAU]),
        ];
        kinds.map(|(kind, u, v)| (Elementary { frame, kind }, u, v)).to_vec()
    }

    #[test]
    fn splines_are_the_surfaces_at_every_parameter() {
        for (surface, u, v) in all() {
            let spline = surface.surface(u, v).unwrap();
            for k in 0..=40 {
                let at = [0.37 * f64::from(k) % 1.0, f64::from(k) / 40.0];
                let at = [u[0] + at[0] * (u[1] - u[0]), v[0] + at[1] * (v[1] - v[0])];
                let [s, t] = surface.spline_parameters(u, v, at);
                let wanted = surface.point(at);
                assert_close(spline.point(s, t).distance(wanted), 0.0, 2e-14);
                let (found, _) = surface.locate(wanted);
                assert_close(surface.point(found).distance(wanted), 0.0, 2e-14);
            }
        }
    }

    #[test]
    fn offsets_lie_at_their_distance_along_the_normal() {
        for (surface, u, v) in all() {
            let spline = surface.surface(u, v).unwrap();
            let moved = surface.offset(0.3).unwrap().surface(u, v).unwrap();
            for (s, t) in [(0.1, 0.2), (0.6, 0.9)] {
                let (s, t) = (u[0] + s * (u[1] - u[0]), v[0] + t * (v[1] - v[0]));
                let jet = spline.jet(s, t, 1);
                let (to, normal) = (jet.position(), jet.normal().unwrap());
                let other = moved.jet(s, t, 1);
                assert_close(other.position().distance(to + 0.3 * normal), 0.0, 1e-13);
                assert_close(other.normal().unwrap().distance(normal), 0.0, 1e-13);
            }
        }
        let sphere = Elementary { kind: ElementaryKind::Sphere { radius: 1.0 }, ..all()[0].0 };
        assert!(sphere.offset(-1.0).is_none());
    }

    #[test]
    fn areas_are_those_of_the_formulas() {
        let area = |kind: ElementaryKind, u: [f64; 2], v: [f64; 2]| {
            let frame = Frame::new(DVec3::ZERO, DVec3::Z, None);
            let surface = Elementary { frame, kind }.surface(u, v).unwrap();
            surface.curvature_statistics().area
        };
        let torus =
            area(ElementaryKind::Torus { major: 50.0, minor: 20.0 }, [0.0, TAU], [0.0, TAU]);
        assert_close(torus / (4.0 * PI * PI * 1000.0), 1.0, 1e-12);
        let cone = area(ElementaryKind::Cone { radius: 0.0, slope: 0.75 }, [0.0, TAU], [0.0, 4.0]);
        assert_close(cone, PI * 3.0 * 5.0, 1e-11);
    }
}
