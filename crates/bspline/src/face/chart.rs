//! The parameter plane of a carrier: where points lie in it, where it repeats, where it collapses.

use super::{Carrier, FaceEdge, FaceError};
use crate::closest::SurfaceLocator;
use crate::elementary::{Elementary, ElementaryKind};
use crate::error::SplineError;
use crate::surface::BsplineSurface;
use geom_core::BoundingBox;
use glam::DVec3;
use std::cell::OnceCell;

/// An edge further from the surface than this share of the size of the loops is not on it.
const OFF: f64 = 1e-3;

/// A point in the parameter plane.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) at: [f64; 2],
    /// The coordinate that is that of a pole, where the other means nothing.
    pub(super) pole: Option<usize>,
}

pub(super) struct Chart<'a> {
    kind: Kind<'a>,
    pub(super) periods: [Option<f64>; 2],
    /// All parameters, infinite where the surface is.
    pub(super) bounds: [[f64; 2]; 2],
    /// Values of each coordinate at which the other means nothing.
    pub(super) poles: [Vec<f64>; 2],
    /// About how long a unit of each coordinate is.
    pub(super) scale: [f64; 2],
    /// What counts as nothing, a length.
    pub(super) tolerance: f64,
    /// What counts as off the surface, a length.
    off: f64,
}

enum Kind<'a> {
    Elementary(&'a Elementary),
    /// With the points of the poles; the locator is made when it is first needed.
    Spline(OnceCell<SurfaceLocator<'a>>, &'a BsplineSurface, Vec<(usize, f64, DVec3)>),
}

impl<'a> Chart<'a> {
    pub(super) fn new(
        carrier: &'a Carrier,
        loops: &[Vec<FaceEdge>],
        tolerance: f64,
    ) -> Result<Self, FaceError> {
        let edges = loops.iter().flatten();
        let corners = edges.flat_map(|e| e.curve.control_points().iter().copied());
        let size = BoundingBox::of(corners).map_or(0.0, BoundingBox::diagonal);
        let off = (OFF * size).max(100.0 * tolerance);
        Ok(match carrier {
            Carrier::Elementary(surface) => {
                let scale = match surface.kind {
                    ElementaryKind::Plane => [1.0, 1.0],
                    ElementaryKind::Cylinder { radius } => [radius, 1.0],
                    ElementaryKind::Cone { radius, slope } => {
                        let edges = loops.iter().flatten().flat_map(|e| e.curve.control_points());
                        let widest = edges.map(|p| surface.locate(*p).1);
                        [widest.fold(radius.abs(), f64::max), (1.0 + slope * slope).sqrt()]
                    }
                    ElementaryKind::Sphere { radius } => [radius, radius],
                    ElementaryKind::Torus { major, minor } => [major.abs() + minor, minor],
                };
                Self {
                    kind: Kind::Elementary(surface),
                    periods: surface.periods(),
                    bounds: surface.bounds(),
                    poles: [Vec::new(), surface.poles()],
                    scale,
                    tolerance,
                    off,
                }
            }
            Carrier::Spline(surface) => Self::of_spline(surface, tolerance, off)?,
        })
    }

    fn of_spline(
        surface: &'a BsplineSurface,
        tolerance: f64,
        off: f64,
    ) -> Result<Self, SplineError> {
        let domains = [surface.knots_u().domain(), surface.knots_v().domain()];
        let side = |axis: usize, t: f64| {
            if axis == 0 { surface.curve_at_u(t) } else { surface.curve_at_v(t) }
        };
        let knots = [surface.knots_u(), surface.knots_v()];
        let (mut periods, mut poles, mut points) = ([None, None], [vec![], vec![]], Vec::new());
        for axis in 0..2 {
            let (start, end) = domains[axis];
            let (first, last) = (side(axis, start)?, side(axis, end)?);
            let one = |c: &crate::BsplineCurve| {
                let p = c.control_points();
                p.iter().all(|q| q.distance(p[0]) <= tolerance).then_some(p[0])
            };
            for (t, curve) in [(start, &first), (end, &last)] {
                if let Some(point) = one(curve) {
                    poles[axis].push(t);
                    points.push((axis, t, point));
                }
            }
            let mut pairs = first.control_points().iter().zip(last.control_points());
            let meets = poles[axis].is_empty() && pairs.all(|(a, b)| a.distance(*b) <= tolerance);
            if knots[axis].is_periodic() || meets {
                periods[axis] = Some(end - start);
            }
        }
        let bounds = domains.map(|(a, b)| [a, b]);
        let corners = surface.control_points().iter().copied();
        let size = BoundingBox::of(corners).map_or(0.0, BoundingBox::diagonal);
        Ok(Self {
            kind: Kind::Spline(OnceCell::new(), surface, points),
            periods,
            bounds,
            poles,
            scale: bounds.map(|[a, b]| size / (b - a)),
            tolerance,
            off: off.max(OFF * size),
        })
    }

    pub(super) fn is_plane(&self) -> Option<&'a Elementary> {
        match self.kind {
            Kind::Elementary(surface) if surface.kind == ElementaryKind::Plane => Some(surface),
            _ => None,
        }
    }

    pub(super) fn is_spline(&self) -> bool {
        matches!(self.kind, Kind::Spline(..))
    }

    pub(super) fn point(&self, at: [f64; 2]) -> DVec3 {
        match &self.kind {
            Kind::Elementary(surface) => surface.point(at),
            Kind::Spline(_, surface, _) => {
                surface.point(self.inside(0, at[0]), self.inside(1, at[1]))
            }
        }
    }

    /// How far apart ends of edges may be that are meant to meet, a length.
    pub(super) fn joint_slack(&self) -> f64 {
        self.off
    }

    /// What counts as nothing in a coordinate.
    pub(super) fn slack(&self, axis: usize) -> f64 {
        if self.scale[axis] > 0.0 { self.tolerance / self.scale[axis] } else { self.tolerance }
    }

    /// Parameters of a point of the surface, in any period.
    pub(super) fn locate(&self, point: DVec3, hint: Option<[f64; 2]>) -> Result<Place, FaceError> {
        match &self.kind {
            Kind::Elementary(surface) => {
                let (at, rho) = surface.locate(point);
                let distance = surface.point(at).distance(point);
                if !(distance <= self.off) {
                    return Err(FaceError::OffSurface { distance });
                }
                let near = |pole: &&f64| (**pole - at[1]).abs() <= 0.5;
                let pole = self.poles[1].iter().find(near).filter(|_| rho <= self.tolerance);
                Ok(match pole {
                    Some(v) => Place { at: [at[0], *v], pole: Some(1) },
                    None => Place { at, pole: None },
                })
            }
            Kind::Spline(locator, surface, poles) => {
                let locator = locator.get_or_init(|| {
                    SurfaceLocator::new(surface, self.periods.map(|p| p.is_some()))
                });
                let hint =
                    hint.map(|hint| std::array::from_fn(|axis| self.inside(axis, hint[axis])));
                let (at, distance) = locator.locate(point, hint, self.tolerance);
                if !(distance <= self.off) {
                    return Err(FaceError::OffSurface { distance });
                }
                let pole = poles.iter().find(|(.., p)| p.distance(point) <= self.tolerance);
                Ok(match pole {
                    Some(&(axis, t, _)) => {
                        let mut at = at;
                        at[axis] = t;
                        Place { at, pole: Some(axis) }
                    }
                    None => Place { at, pole: None },
                })
            }
        }
    }

    /// The value within the bounds that stands for `t`.
    fn inside(&self, axis: usize, t: f64) -> f64 {
        let [a, b] = self.bounds[axis];
        match self.periods[axis] {
            Some(period) if !(a..=b).contains(&t) => a + (t - a).rem_euclid(period),
            _ => t.clamp(a, b),
        }
    }

    /// The value that stands for `t` nearest to `target`.
    pub(super) fn near(&self, axis: usize, t: f64, target: f64) -> f64 {
        match self.periods[axis] {
            Some(period) => t + ((target - t) / period).round() * period,
            None => t,
        }
    }
}
