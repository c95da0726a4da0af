//! Surfaces under faces: splines, elementary surfaces, sweeps, surfaces at a distance, parts.

use super::curve::Curve;
use super::file::StepFile;
use super::parse::Cursor;
use super::units::Context;
use crate::error::ReadError;
use crate::ron_text::MAX_DEPTH;
use bspline::{ArcSpans, Axis, BsplineSurface, Carrier, Elementary, ElementaryKind, SplineError};
use geom_core::{BoundingBox, DVec3};
use std::f64::consts::TAU;

/// A surface at a distance is fitted to within this share of its size.
pub(super) const OFFSET_ACCURACY: f64 = 1e-6;
/// How much further than a face an endless sweep is made, as a share of the size of the face.
const BEYOND: f64 = 0.01;

/// A surface as the file describes it, before its extent is known.
pub(super) enum Shape {
    Carrier(Carrier),
    Extrusion(Curve, DVec3),
    Revolution(Curve, Axis),
    Offset(Box<Shape>, f64),
    Rectangle { basis: Box<Shape>, u: [f64; 2], v: [f64; 2], forward: [bool; 2] },
}

/// Why a shape has no surface.
pub(super) enum Lost {
    /// The file is at fault.
    Read(ReadError),
    /// It cannot be done, in words.
    Cannot(String),
}

impl From<ReadError> for Lost {
    fn from(error: ReadError) -> Self {
        Self::Read(error)
    }
}

impl From<SplineError> for Lost {
    fn from(error: SplineError) -> Self {
        Self::Cannot(error.to_string())
    }
}

impl Shape {
    /// The surface, at least as large as `around` (points of the border of the face on it)
    /// demands. Without points an endless extrusion is as long as its vector.
    pub(super) fn realise(&self, around: &[DVec3]) -> Result<Carrier, Lost> {
        Ok(match self {
            Self::Carrier(carrier) => carrier.clone(),
            Self::Extrusion(curve, vector) => {
                let length = vector.length_squared();
                if !(length > 0.0) {
                    return Err(Lost::Cannot("the direction of an extrusion has no length".into()));
                }
                let profile = endless(curve, around, |p| {
                    // Along the line, as far as that leads away from the direction.
                    p.reject_from(*vector)
                })?;
                let along = |p: &DVec3| p.dot(*vector) / length;
                let range = |points: &[DVec3]| {
                    let values = points.iter().map(along);
                    values
                        .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(t), b.max(t)))
                };
                let (mut start, mut end) = (0.0, 1.0);
                if !around.is_empty() {
                    let ((a, b), (c, d)) = (range(around), range(profile.control_points()));
                    let margin = BEYOND * (b - d - (a - c)).abs().max(b - a).max(1e-9);
                    (start, end) = ((a - d).min(a - c) - margin, (b - c).max(b - d) + margin);
                }
                Carrier::Spline(BsplineSurface::extrusion(&profile, *vector, start, end)?)
            }
            Self::Revolution(curve, axis) => {
                let profile = endless(curve, around, |p| {
                    let along = axis.direction.dot(p);
                    along * axis.direction
                })
                .or_else(|_| endless(curve, around, |p| p.reject_from(axis.direction)))?;
                let turn = ArcSpans::new(0.0, TAU);
                Carrier::Spline(BsplineSurface::revolution(&profile, *axis, turn)?)
            }
            Self::Offset(basis, distance) => match basis.realise(around)? {
                Carrier::Elementary(surface) => match surface.offset(*distance) {
                    Some(moved) => Carrier::Elementary(moved),
                    None => {
                        let what = "nothing is left of a surface moved by its own radius";
                        return Err(Lost::Cannot(what.into()));
                    }
                },
                Carrier::Spline(surface) => {
                    let points = surface.control_points().iter().copied();
                    let size = BoundingBox::of(points).map_or(0.0, BoundingBox::diagonal);
                    let moved = surface.offset(*distance, OFFSET_ACCURACY * size);
                    Carrier::Spline(moved.map_err(|e| Lost::Cannot(e.to_string()))?)
                }
            },
            Self::Rectangle { basis, u, v, forward } => {
                let mut surface = basis.part(*u, *v, around)?;
                if !forward[0] {
                    surface = surface.reversed_u();
                }
                if !forward[1] {
                    surface = surface.swapped().reversed_u().swapped();
                }
                Carrier::Spline(surface)
            }
        })
    }

    /// The part over ranges of the parameters of the standard.
    fn part(&self, u: [f64; 2], v: [f64; 2], around: &[DVec3]) -> Result<BsplineSurface, Lost> {
        let range = |[a, b]: [f64; 2], period: Option<f64>| match period {
            // Around a closed direction from the first to the second.
            Some(period) if b <= a => [a, b + period * ((a - b) / period + 1e-9).ceil().max(1.0)],
            _ => [a, b],
        };
        let sound = |[a, b]: [f64; 2]| b > a && (b - a).is_finite();
        let bad = || Lost::Cannot("a part of a surface without extent".into());
        match self {
            Self::Carrier(Carrier::Elementary(surface)) => {
                let periods = surface.periods();
                let (u, v) = (range(u, periods[0]), range(v, periods[1]));
                let fits = |[a, b]: [f64; 2], period: Option<f64>| {
                    sound([a, b]) && period.is_none_or(|p| b - a <= p * (1.0 + 1e-12))
                };
                if !fits(u, periods[0]) || !fits(v, periods[1]) {
                    return Err(bad());
                }
                Ok(surface.surface(u, v)?)
            }
            Self::Extrusion(curve, vector) => {
                let profile = curve.part(u[0], range(u, closed(curve))[1])?;
                Ok(BsplineSurface::extrusion(&profile, *vector, v[0], v[1])?)
            }
            Self::Revolution(curve, axis) => {
                let u = range(u, Some(TAU));
                if !sound(u) || u[1] - u[0] > TAU * (1.0 + 1e-12) {
                    return Err(bad());
                }
                let profile = curve.part(v[0], range(v, closed(curve))[1])?;
                Ok(BsplineSurface::revolution(&profile, *axis, ArcSpans::new(u[0], u[1]))?)
            }
            Self::Offset(basis, distance) => {
                let part = Self::Carrier(Carrier::Spline(basis.part(u, v, around)?));
                match Self::Offset(Box::new(part), *distance).realise(around)? {
                    Carrier::Spline(surface) => Ok(surface),
                    Carrier::Elementary(_) => Err(bad()),
                }
            }
            Self::Carrier(Carrier::Spline(_)) | Self::Rectangle { .. } => {
                match self.realise(around)? {
                    Carrier::Spline(surface) => {
                        let domains = [surface.knots_u().domain(), surface.knots_v().domain()];
                        let inside = |[a, b]: [f64; 2], (start, end): (f64, f64)| {
                            // Files round the ends of the domain.
                            let slack = 1e-9 * (end - start);
                            let snap =
                                |t: f64, to: f64| if (t - to).abs() <= slack { to } else { t };
                            [snap(a, start), snap(b, end)]
                        };
                        Ok(surface.subdomain(inside(u, domains[0]), inside(v, domains[1]))?)
                    }
                    Carrier::Elementary(_) => Err(bad()),
                }
            }
        }
    }
}

fn closed(curve: &Curve) -> Option<f64> {
    matches!(curve, Curve::Ellipse { .. }).then_some(TAU)
}

/// The curve as a spline; of an endless one the part that reaches all points, compared after
/// `project`.
fn endless(
    curve: &Curve,
    around: &[DVec3],
    project: impl Fn(DVec3) -> DVec3,
) -> Result<bspline::BsplineCurve, Lost> {
    let Curve::Line { origin, direction } = curve else {
        if curve.is_endless() {
            return Err(Lost::Cannot("a sweep of an endless curve".into()));
        }
        return Ok(curve.whole()?);
    };
    let (base, step) = (project(*origin), project(*direction));
    let length = step.length_squared();
    if around.is_empty() || !(length > 1e-18 * direction.length_squared()) {
        return Err(Lost::Cannot("a sweep of a line without an end".into()));
    }
    // The component of every point along the projected line, in either sense of a turned line.
    let mut values: Vec<f64> = Vec::with_capacity(2 * around.len());
    for p in around {
        let t = (project(*p) - base).dot(step) / length;
        let radius = (project(*p) - base).length() / length.sqrt();
        values.push(t);
        if (radius - t.abs()).abs() > 1e-9 * radius {
            values.extend([radius, -radius]);
        }
    }
    let (low, high) =
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), t| (a.min(*t), b.max(*t)));
    let margin = BEYOND * (high - low).max(1e-9);
    Ok(curve.part(low - margin, high + margin)?)
}

impl<'a> StepFile<'a> {
    /// The surface `#id` with its name, wanted by `from`; `None` if it is of a kind that is not
    /// read.
    pub(super) fn shape(
        &self,
        id: u64,
        from: &Cursor<'a>,
        context: &Context,
    ) -> Result<Option<(String, Shape)>, ReadError> {
        self.nested_shape(id, from, context, 0)
    }

    fn nested_shape(
        &self,
        id: u64,
        from: &Cursor<'a>,
        context: &Context,
        depth: usize,
    ) -> Result<Option<(String, Shape)>, ReadError> {
        if depth > MAX_DEPTH {
            return Err(from.error("surfaces are nested too deeply", "export the file again"));
        }
        let body = self.index.open(id, from)?;
        let Some(instance) = self.instance(id) else { return Ok(None) };
        if let Some((name, surface)) = self.spline_surface(instance)? {
            return Ok(Some((name, Shape::Carrier(Carrier::Spline(surface)))));
        }
        let keyword = self.index.keyword(instance);
        let Some(mut cursor) = body.record(&String::from_utf8_lossy(keyword)) else {
            return Ok(None);
        };
        let here = cursor.clone();
        let elementary =
            |kind| Elementary { frame: bspline::Frame::new(DVec3::ZERO, DVec3::Z, None), kind };
        let positive = |value: f64| {
            let what = format!("#{id} has a radius of {value}");
            if value > 0.0 { Ok(value) } else { Err(here.error(what, "export it again")) }
        };
        if !is_read(keyword) {
            return Ok(None);
        }
        let name = cursor.string()?;
        cursor.comma()?;
        let shape = match keyword {
            b"PLANE"
            | b"CYLINDRICAL_SURFACE"
            | b"CONICAL_SURFACE"
            | b"SPHERICAL_SURFACE"
            | b"TOROIDAL_SURFACE"
            | b"DEGENERATE_TOROIDAL_SURFACE" => {
                let frame = self.frame(cursor.reference()?, &here)?;
                let mut next = || {
                    cursor.comma()?;
                    cursor.real()
                };
                let kind = match keyword {
                    b"PLANE" => ElementaryKind::Plane,
                    b"CYLINDRICAL_SURFACE" => {
                        ElementaryKind::Cylinder { radius: positive(next()?)? }
                    }
                    b"CONICAL_SURFACE" => {
                        let radius = next()?;
                        let slope = (next()? * context.angle).tan();
                        if !(radius >= 0.0 && slope.is_finite()) {
                            let what = format!("#{id} is no cone");
                            return Err(here.error(what, "export it again"));
                        }
                        ElementaryKind::Cone { radius, slope }
                    }
                    b"SPHERICAL_SURFACE" => ElementaryKind::Sphere { radius: positive(next()?)? },
                    _ => {
                        let major = positive(next()?)?;
                        ElementaryKind::Torus { major, minor: positive(next()?)? }
                    }
                };
                Shape::Carrier(Carrier::Elementary(Elementary { frame, ..elementary(kind) }))
            }
            b"SURFACE_OF_LINEAR_EXTRUSION" | b"SURFACE_OF_REVOLUTION" => {
                let Some(curve) = self.curve(cursor.reference()?, &here, context)? else {
                    return Ok(None);
                };
                cursor.comma()?;
                let second = cursor.reference()?;
                if keyword == b"SURFACE_OF_LINEAR_EXTRUSION" {
                    Shape::Extrusion(curve, self.vector(second, &here)?)
                } else {
                    Shape::Revolution(curve, self.axis(second, &here)?)
                }
            }
            b"OFFSET_SURFACE" => {
                let basis = self.nested_shape(cursor.reference()?, &here, context, depth + 1)?;
                let Some((_, basis)) = basis else { return Ok(None) };
                cursor.comma()?;
                Shape::Offset(Box::new(basis), cursor.measure()?)
            }
            _ => {
                let basis = self.nested_shape(cursor.reference()?, &here, context, depth + 1)?;
                let Some((_, basis)) = basis else { return Ok(None) };
                let mut ends = [0.0; 4];
                for end in &mut ends {
                    cursor.comma()?;
                    *end = cursor.measure()?;
                }
                cursor.comma()?;
                let forward_u = cursor.is_true()?;
                cursor.comma()?;
                let forward = [forward_u, cursor.is_true()?];
                // The second end comes before the first where the sense is against the basis.
                let order = |a: f64, b: f64, forward: bool| if forward { [a, b] } else { [b, a] };
                let [u, v] =
                    [order(ends[0], ends[1], forward[0]), order(ends[2], ends[3], forward[1])];
                let angles = basis.angles();
                let scaled = |r: [f64; 2], angle: bool| {
                    if angle { r.map(|t| t * context.angle) } else { r }
                };
                Shape::Rectangle {
                    basis: Box::new(basis),
                    u: scaled(u, angles[0]),
                    v: scaled(v, angles[1]),
                    forward,
                }
            }
        };
        Ok(Some((name, shape)))
    }

    /// An `AXIS1_PLACEMENT`.
    fn axis(&self, id: u64, from: &Cursor<'a>) -> Result<Axis, ReadError> {
        let mut cursor = self.record(id, "AXIS1_PLACEMENT", from)?;
        let here = cursor.clone();
        cursor.skip_arguments(1)?;
        let origin = self.point(cursor.reference()?, &here)?;
        cursor.comma()?;
        let direction = match cursor.optional_reference()? {
            Some(id) => self.direction(id, &here)?,
            None => DVec3::Z,
        };
        Ok(Axis { origin, direction: direction.try_normalize().unwrap_or(DVec3::Z) })
    }
}

impl Shape {
    /// Which parameters are angles.
    fn angles(&self) -> [bool; 2] {
        match self {
            Self::Carrier(Carrier::Elementary(surface)) => match surface.kind {
                ElementaryKind::Plane => [false, false],
                ElementaryKind::Cylinder { .. } | ElementaryKind::Cone { .. } => [true, false],
                ElementaryKind::Sphere { .. } | ElementaryKind::Torus { .. } => [true, true],
            },
            Self::Carrier(Carrier::Spline(_)) => [false, false],
            Self::Extrusion(curve, _) => [matches!(curve, Curve::Ellipse { .. }), false],
            Self::Revolution(curve, _) => [true, matches!(curve, Curve::Ellipse { .. })],
            Self::Offset(basis, _) | Self::Rectangle { basis, .. } => basis.angles(),
        }
    }
}

/// Surfaces that are read, splines apart.
pub(super) fn is_read(keyword: &[u8]) -> bool {
    matches!(
        keyword,
        b"PLANE"
            | b"CYLINDRICAL_SURFACE"
            | b"CONICAL_SURFACE"
            | b"SPHERICAL_SURFACE"
            | b"TOROIDAL_SURFACE"
            | b"DEGENERATE_TOROIDAL_SURFACE"
            | b"SURFACE_OF_LINEAR_EXTRUSION"
            | b"SURFACE_OF_REVOLUTION"
            | b"OFFSET_SURFACE"
            | b"RECTANGULAR_TRIMMED_SURFACE"
    )
}

impl Shape {
    /// Whether the spline has the parameters that the file gives the surface, so that curves in its
    /// parameter plane can be taken as they are: not where an angle is one.
    pub(super) fn keeps_parameters(&self) -> bool {
        match self {
            Self::Carrier(carrier) => matches!(carrier, Carrier::Spline(_)),
            Self::Extrusion(curve, _) => matches!(curve, Curve::Spline(_)),
            Self::Revolution(..) => false,
            Self::Offset(basis, _) => basis.keeps_parameters(),
            Self::Rectangle { basis, forward, .. } => {
                *forward == [true, true] && basis.keeps_parameters()
            }
        }
    }

    /// Whether the surface is only near to what the file describes.
    pub(super) fn is_fitted(&self) -> bool {
        match self {
            Self::Offset(basis, _) => !matches!(&**basis, Self::Carrier(Carrier::Elementary(_))),
            Self::Rectangle { basis, .. } => basis.is_fitted(),
            _ => false,
        }
    }
}
