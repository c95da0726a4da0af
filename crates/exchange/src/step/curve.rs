//! Curves in space, as exact splines.

use super::file::StepFile;
use super::parse::Cursor;
use super::units::Context;
use crate::error::ReadError;
use crate::ron_text::MAX_DEPTH;
use bspline::{ArcSpans, BsplineCurve, Degree, Frame, KnotVector, SplineError};
use geom_core::DVec3;
use std::f64::consts::TAU;

/// A curve with the parameter that ISO 10303-42 gives it.
#[derive(Clone, Debug)]
pub(super) enum Curve {
    Line { origin: DVec3, direction: DVec3 },
    Ellipse { frame: Frame, radii: [f64; 2] },
    Parabola { frame: Frame, focus: f64 },
    Hyperbola { frame: Frame, radii: [f64; 2] },
    Spline(BsplineCurve),
}

impl Curve {
    pub(super) fn is_endless(&self) -> bool {
        matches!(self, Self::Line { .. } | Self::Parabola { .. } | Self::Hyperbola { .. })
    }

    /// The parameter of a point of the curve; an angle in `(−π, π]`.
    fn parameter(&self, point: DVec3) -> f64 {
        match self {
            Self::Line { origin, direction } => {
                (point - *origin).dot(*direction) / direction.length_squared()
            }
            Self::Ellipse { frame, radii } => {
                let p = frame.local(point);
                (p.y / radii[1]).atan2(p.x / radii[0])
            }
            Self::Parabola { frame, focus } => frame.local(point).y / (2.0 * focus),
            Self::Hyperbola { frame, radii } => (frame.local(point).y / radii[1]).asinh(),
            Self::Spline(curve) => curve.closest_parameter(point),
        }
    }

    /// The part from one parameter to a larger one; the knots at its ends are those parameters.
    pub(super) fn part(&self, from: f64, to: f64) -> Result<BsplineCurve, SplineError> {
        match self {
            Self::Line { origin, direction } => {
                let at = |t: f64| *origin + t * *direction;
                BsplineCurve::segment(at(from), at(to), from, to)
            }
            Self::Ellipse { frame, radii } => {
                let (x, y) = (radii[0] * frame.x, radii[1] * frame.y);
                let to = if to - from > TAU { from + TAU } else { to };
                if !(to > from) || !(to - from).is_finite() {
                    return Err(bspline::KnotError::EmptyDomain { start: from, end: to }.into());
                }
                BsplineCurve::arc(frame.origin, x, y, ArcSpans::new(from, to))
            }
            Self::Parabola { frame, focus } => {
                // Its middle control point is where the end tangents meet.
                let at =
                    |s: f64, t: f64| frame.point(DVec3::new(focus * s * t, focus * (s + t), 0.0));
                let points = vec![at(from, from), at(from, to), at(to, to)];
                BsplineCurve::new(bezier(from, to)?, points, None)
            }
            Self::Hyperbola { frame, radii } => {
                let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
                let at = |t: f64, scale: f64| {
                    let (x, y) = (radii[0] * t.cosh() * scale, radii[1] * t.sinh() * scale);
                    frame.point(DVec3::new(x, y, 0.0))
                };
                let weight = half.cosh();
                let points = vec![at(from, 1.0), at(middle, 1.0 / weight), at(to, 1.0)];
                BsplineCurve::new(bezier(from, to)?, points, Some(vec![1.0, weight, 1.0]))
            }
            Self::Spline(curve) => curve.subdomain(from, to),
        }
    }

    /// All of a curve with ends, or once around a closed one.
    pub(super) fn whole(&self) -> Result<BsplineCurve, SplineError> {
        match self {
            Self::Ellipse { .. } => self.part(0.0, TAU),
            Self::Spline(curve) => curve.clamped(),
            _ => self.part(0.0, 1.0),
        }
    }

    /// The curve from one of its points to another along its own direction; all around if they
    /// are the same. A line takes the points themselves.
    pub(super) fn between(
        &self,
        start: DVec3,
        end: DVec3,
        tolerance: f64,
    ) -> Result<BsplineCurve, SplineError> {
        let same = start.distance(end) <= tolerance;
        match self {
            Self::Line { direction, .. } => {
                let (a, b) = (self.parameter(start), self.parameter(end));
                let length = (b - a).abs().max(f64::MIN_POSITIVE);
                let from = if direction.length_squared() > 0.0 { a.min(b) } else { 0.0 };
                BsplineCurve::segment(start, end, from, from + length)
            }
            Self::Ellipse { .. } => {
                let (a, b) = (self.parameter(start), self.parameter(end));
                let turn = (b - a).rem_euclid(TAU);
                let turn = if same || turn == 0.0 { TAU } else { turn };
                with_ends(self.part(a, a + turn)?, start, end, tolerance)
            }
            Self::Parabola { .. } | Self::Hyperbola { .. } => {
                let (a, b) = (self.parameter(start), self.parameter(end));
                if a < b { self.part(a, b) } else { Ok(self.part(b, a)?.reversed()) }
            }
            Self::Spline(curve) => part_of_spline(curve, start, end, same, tolerance),
        }
    }
}

fn bezier(from: f64, to: f64) -> Result<KnotVector, SplineError> {
    Ok(KnotVector::new(Degree::new(2)?, vec![from, from, from, to, to, to])?)
}

/// The same arc with the vertices of the file for ends, so that neighbours share them.
fn with_ends(
    curve: BsplineCurve,
    start: DVec3,
    end: DVec3,
    tolerance: f64,
) -> Result<BsplineCurve, SplineError> {
    let mut points = curve.control_points().to_vec();
    let last = points.len() - 1;
    if points[0].distance(start) <= tolerance && points[last].distance(end) <= tolerance {
        (points[0], points[last]) = (start, end);
    }
    BsplineCurve::new(curve.knots().clone(), points, curve.weights().map(<[f64]>::to_vec))
}

fn part_of_spline(
    curve: &BsplineCurve,
    start: DVec3,
    end: DVec3,
    same: bool,
    tolerance: f64,
) -> Result<BsplineCurve, SplineError> {
    let (first, last) = curve.knots().domain();
    let (head, tail) = (curve.point(first), curve.point(last));
    let closed = head.distance(tail) <= tolerance;
    if head.distance(start) <= tolerance && tail.distance(end) <= tolerance {
        return Ok(curve.clone());
    }
    let (a, b) = (curve.closest_parameter(start), curve.closest_parameter(end));
    // A closed curve runs on across its own end.
    let a = if closed && a >= last { first } else { a };
    let b = if closed && b <= first { last } else { b };
    if a < b && !(same && closed) {
        return curve.subdomain(a, b);
    }
    if !closed {
        return if a > b { Ok(curve.subdomain(b, a)?.reversed()) } else { Ok(curve.clone()) };
    }
    let b = if same { a } else { b };
    match (a > first, b > first) {
        (true, true) => curve.subdomain(a, last)?.joined(&curve.subdomain(first, b)?),
        (true, false) => curve.subdomain(a, last),
        _ => Ok(curve.clone()),
    }
}

impl<'a> StepFile<'a> {
    /// The curve `#id`, wanted by `from`; `None` if it is of a kind that is not read.
    pub(super) fn curve(
        &self,
        id: u64,
        from: &Cursor<'a>,
        context: &Context,
    ) -> Result<Option<Curve>, ReadError> {
        self.nested_curve(id, from, context, 0)
    }

    fn nested_curve(
        &self,
        id: u64,
        from: &Cursor<'a>,
        context: &Context,
        depth: usize,
    ) -> Result<Option<Curve>, ReadError> {
        if depth > MAX_DEPTH {
            return Err(from.error("curves are nested too deeply", "export the file again"));
        }
        let body = self.index.open(id, from)?;
        let Some(instance) = self.instance(id) else { return Ok(None) };
        let refused = |error: SplineError| {
            let message = error.to_string();
            let (what, mend) = message.split_once("; ").unwrap_or((&message, "export it again"));
            body.error(format!("#{id}: {what}"), mend)
        };
        let keyword = self.index.keyword(instance);
        let open = || body.record(&String::from_utf8_lossy(keyword));
        let Some(mut cursor) = (if keyword == b"(" { Some(body.clone()) } else { open() }) else {
            return Ok(None);
        };
        let here = cursor.clone();
        match keyword {
            b"LINE" => {
                cursor.skip_arguments(1)?;
                let origin = self.point(cursor.reference()?, &here)?;
                cursor.comma()?;
                let direction = self.vector(cursor.reference()?, &here)?;
                Ok(Some(Curve::Line { origin, direction }))
            }
            b"CIRCLE" | b"ELLIPSE" | b"HYPERBOLA" | b"PARABOLA" => {
                cursor.skip_arguments(1)?;
                let frame = self.frame(cursor.reference()?, &here)?;
                cursor.comma()?;
                let first = cursor.real()?;
                let second = match keyword {
                    b"ELLIPSE" | b"HYPERBOLA" => {
                        cursor.comma()?;
                        cursor.real()?
                    }
                    _ => first,
                };
                if !(first > 0.0 && second > 0.0) {
                    let what = format!("#{id} has a radius that is not positive");
                    return Err(here.error(what, "export it again"));
                }
                let radii = [first, second];
                Ok(Some(match keyword {
                    b"HYPERBOLA" => Curve::Hyperbola { frame, radii },
                    b"PARABOLA" => Curve::Parabola { frame, focus: first },
                    _ => Curve::Ellipse { frame, radii },
                }))
            }
            b"SURFACE_CURVE" | b"SEAM_CURVE" | b"INTERSECTION_CURVE" => {
                cursor.skip_arguments(1)?;
                self.nested_curve(cursor.reference()?, &here, context, depth + 1)
            }
            b"POLYLINE" => {
                cursor.skip_arguments(1)?;
                let ids = cursor.reference_list()?;
                let points: Vec<DVec3> =
                    ids.iter().map(|id| self.point(*id, &here)).collect::<Result<_, _>>()?;
                let line = Degree::new(1).map_err(SplineError::from).and_then(|degree| {
                    let n = points.len();
                    let mut knots = vec![0.0];
                    knots.extend((0..n).map(|k| k as f64));
                    knots.push(n.saturating_sub(1) as f64);
                    BsplineCurve::new(KnotVector::new(degree, knots)?, points, None)
                });
                line.map(|line| Some(Curve::Spline(line))).map_err(refused)
            }
            b"TRIMMED_CURVE" => {
                cursor.skip_arguments(1)?;
                let basis = self.nested_curve(cursor.reference()?, &here, context, depth + 1)?;
                let Some(basis) = basis else { return Ok(None) };
                cursor.comma()?;
                let ends = [
                    self.trim(&mut cursor, &basis, context)?,
                    self.trim(&mut cursor, &basis, context)?,
                ];
                let forward = cursor.is_true()?;
                let [Some(a), Some(b)] = ends else { return Ok(None) };
                let (a, b) = if forward { (a, b) } else { (b, a) };
                let b = match basis {
                    Curve::Ellipse { .. } if b <= a => {
                        b + TAU * ((a - b) / TAU + 1e-12).ceil().max(1.0)
                    }
                    _ => b,
                };
                let part = basis.part(a.min(b), a.max(b)).map_err(refused)?;
                Ok(Some(Curve::Spline(if forward == (a <= b) { part } else { part.reversed() })))
            }
            _ => Ok(self.spline_curve(instance, 3)?.map(Curve::Spline)),
        }
    }

    /// One end of a trimmed curve: a parameter or a point; the cursor moves behind its comma.
    fn trim(
        &self,
        cursor: &mut Cursor<'a>,
        basis: &Curve,
        context: &Context,
    ) -> Result<Option<f64>, ReadError> {
        let mut found = None;
        cursor.list(|c| {
            let here = c.clone();
            if c.at_reference() {
                let point = self.point(c.reference()?, &here)?;
                found = found.or(Some(basis.parameter(point)));
            } else {
                let value = c.measure()?;
                let angle = matches!(basis, Curve::Ellipse { .. });
                found = Some(if angle { value * context.angle } else { value });
            }
            Ok(())
        })?;
        cursor.comma()?;
        Ok(found)
    }

    /// A `VECTOR`: direction and length.
    pub(super) fn vector(&self, id: u64, from: &Cursor<'a>) -> Result<DVec3, ReadError> {
        let mut cursor = self.record(id, "VECTOR", from)?;
        cursor.skip_arguments(1)?;
        let here = cursor.clone();
        let direction = self.direction(cursor.reference()?, &here)?;
        cursor.comma()?;
        let length = cursor.real()?;
        Ok(length * direction.normalize_or_zero())
    }
}
