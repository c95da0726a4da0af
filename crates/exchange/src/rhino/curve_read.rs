//! Curves: splines, lines, arcs, polylines, and chains of them.

use super::codes::{ARC_CURVE, LINE_CURVE, NURBS_CURVE, POLY_CURVE, POLYLINE_CURVE, class_name};
use super::cursor::Cursor;
use super::lost::Lost;
use crate::wrapped::{Direction, unwrap_curve};
use bspline::{ArcSpans, BsplineCurve, Degree, KnotVector};
use geom_core::DVec3;

/// Chains may hold chains this deep.
const DEEPEST: usize = 8;

/// A curve with the parameters of its file.
#[derive(Clone)]
pub(super) enum Curve {
    Spline(BsplineCurve),
    Arc(Arc),
    /// Pieces, each with the interval of parameters it stands at.
    Chain(Vec<([f64; 2], Curve)>),
}

/// An arc of a circle whose angle is linear in the parameter.
#[derive(Clone)]
pub(super) struct Arc {
    center: DVec3,
    x: DVec3,
    y: DVec3,
    angles: [f64; 2],
    domain: [f64; 2],
}

/// The next object as a curve.
pub(super) fn curve_object(file: &mut Cursor<'_>, depth: usize) -> Result<Curve, Lost> {
    let (class, mut data) = file.object()?;
    let curve = match class {
        NURBS_CURVE => Curve::Spline(nurbs_curve(&mut data)?),
        LINE_CURVE => line_curve(&mut data)?,
        ARC_CURVE => arc_curve(&mut data)?,
        POLYLINE_CURVE => polyline_curve(&mut data)?,
        POLY_CURVE if depth < DEEPEST => chain(&mut data, depth)?,
        _ => return Err(Lost::Kind(class_name(&class))),
    };
    data.check()?;
    Ok(curve)
}

/// Data of a class that [`curve_object`] reads.
pub(super) fn is_curve(class: &super::codes::ClassId) -> bool {
    [NURBS_CURVE, LINE_CURVE, ARC_CURVE, POLYLINE_CURVE, POLY_CURVE].contains(class)
}

fn nurbs_curve(data: &mut Cursor<'_>) -> Result<BsplineCurve, Lost> {
    let (_, minor) = data.version()?;
    let dimension = dimension(data.i32()?)?;
    let rational = data.i32()? != 0;
    let order = data.count(0)?;
    let count = data.count(8)?;
    data.take(2 * 4 + 6 * 8)?;
    let knots = data.reals()?;
    let (points, weights) = control_points(data, count, dimension, rational)?;
    if minor >= 1 {
        // A word of subdivision surfaces.
        data.take(1)?;
    }
    let along = direction(order, knots, count)?;
    Ok(unwrap_curve(&along, &points, weights.as_deref())?)
}

/// Curves are in the plane or in space.
pub(super) fn dimension(found: i32) -> Result<usize, Lost> {
    match found {
        2 | 3 => Ok(found as usize),
        _ => Err(Lost::Unsound(format!("a spline in {found} dimensions"))),
    }
}

/// Points of `dimension` numbers; rational ones are given times their weights.
pub(super) fn control_points(
    data: &mut Cursor<'_>,
    count: usize,
    dimension: usize,
    rational: bool,
) -> Result<(Vec<DVec3>, Option<Vec<f64>>), Lost> {
    let found = data.count(8 * dimension)?;
    if found != count {
        return Err(data.error(format!("{found} control points where {count} belong")).into());
    }
    let (mut points, mut weights) = (Vec::with_capacity(count), Vec::new());
    for _ in 0..count {
        let mut p = [0.0; 3];
        for x in p.iter_mut().take(dimension) {
            *x = data.f64()?;
        }
        let w = if rational { data.f64()? } else { 1.0 };
        points.push(DVec3::from_array(if rational { p.map(|x| x / w) } else { p }));
        if rational {
            weights.push(w);
        }
    }
    Ok((points, rational.then_some(weights)))
}

/// Knots of a file, in which the first and the last are missing. They only matter for splines that
/// close: there they are the images of knots one period away.
pub(super) fn direction(order: usize, inner: Vec<f64>, count: usize) -> Result<Direction, Lost> {
    let degree = Degree::new(order.saturating_sub(1))?;
    let (d, n) = (degree.get(), count);
    let needed = (n + d).saturating_sub(1);
    if inner.len() != needed || n < degree.order() {
        let what = format!("{} knots for {n} control points of degree {d}", inner.len());
        return Err(Lost::Unsound(what));
    }
    let with = |first: f64, last: f64| {
        let mut knots = Vec::with_capacity(inner.len() + 2);
        knots.push(first);
        knots.extend_from_slice(&inner);
        knots.push(last);
        knots
    };
    let (start, end) = (inner[d - 1], inner[n - 1]);
    if n > 2 * d && (inner[0] < start || inner[needed - 1] > end) {
        let period = end - start;
        let knots = with(inner[n - d - 1] - period, inner[2 * d - 1] + period);
        if let Ok(closed) = Direction::new(degree, knots, true, n)
            && closed.may_close()
        {
            return Ok(closed);
        }
    }
    Ok(Direction::new(degree, with(inner[0], inner[needed - 1]), false, n)?)
}

fn line_curve(data: &mut Cursor<'_>) -> Result<Curve, Lost> {
    data.version()?;
    let (from, to) = (data.point()?, data.point()?);
    let [start, end] = data.f64s()?;
    dimension(data.i32()?)?;
    Ok(Curve::Spline(BsplineCurve::segment(from, to, start, end)?))
}

fn arc_curve(data: &mut Cursor<'_>) -> Result<Curve, Lost> {
    data.version()?;
    let [center, x, y] = [data.point()?, data.point()?, data.point()?];
    // The normal and the equation of the plane.
    data.take(7 * 8)?;
    let radius = data.f64()?;
    // Three points of the circle, which older files need.
    data.take(9 * 8)?;
    let (angles, domain) = (data.f64s()?, data.f64s()?);
    dimension(data.i32()?)?;
    Ok(Curve::Arc(Arc { center, x: radius * x, y: radius * y, angles, domain }))
}

fn polyline_curve(data: &mut Cursor<'_>) -> Result<Curve, Lost> {
    data.version()?;
    let count = data.count(24)?;
    let points = (0..count).map(|_| data.point()).collect::<Result<Vec<_>, _>>()?;
    let parameters = data.reals()?;
    dimension(data.i32()?)?;
    if parameters.len() != points.len() || points.len() < 2 {
        return Err(data.error("a polyline without a parameter for each point").into());
    }
    let ends = [parameters[0], parameters[parameters.len() - 1]];
    let mut knots = vec![ends[0]];
    knots.extend_from_slice(&parameters);
    knots.push(ends[1]);
    let knots = KnotVector::new(Degree::new(1)?, knots)?;
    Ok(Curve::Spline(BsplineCurve::new(knots, points, None)?))
}

fn chain(data: &mut Cursor<'_>, depth: usize) -> Result<Curve, Lost> {
    data.version()?;
    let count = data.count(0)?;
    data.take(2 * 4 + 6 * 8)?;
    let ends = data.reals()?;
    if ends.len() != count + 1 {
        return Err(data
            .error(format!("{} ends for {count} pieces of a curve", ends.len()))
            .into());
    }
    let mut pieces = Vec::with_capacity(count);
    for pair in ends.windows(2) {
        pieces.push(([pair[0], pair[1]], curve_object(data, depth + 1)?));
    }
    if pieces.is_empty() {
        return Err(Lost::Unsound("a curve without pieces".into()));
    }
    Ok(Curve::Chain(pieces))
}

impl Curve {
    /// First and last parameter.
    pub(super) fn domain(&self) -> [f64; 2] {
        match self {
            Self::Spline(curve) => curve.knots().domain().into(),
            Self::Arc(arc) => arc.domain,
            Self::Chain(pieces) => [pieces[0].0[0], pieces[pieces.len() - 1].0[1]],
        }
    }

    /// The whole as a spline.
    pub(super) fn whole(&self) -> Result<BsplineCurve, Lost> {
        let [start, end] = self.domain();
        self.part(start, end)
    }

    /// The part between two parameters as a spline, whose parameters are those of the curve unless
    /// it has arcs.
    pub(super) fn part(&self, start: f64, end: f64) -> Result<BsplineCurve, Lost> {
        if !(end > start) {
            return Err(Lost::Unsound(format!("a curve from parameter {start} to {end}")));
        }
        match self {
            Self::Spline(curve) => {
                let (from, to) = curve.knots().domain();
                if (start, end) == (from, to) {
                    return Ok(curve.clone());
                }
                Ok(curve.subdomain(start.max(from), end.min(to))?)
            }
            Self::Arc(arc) => arc.part(start, end),
            Self::Chain(pieces) => {
                let mut parts = Vec::new();
                for ([from, to], piece) in pieces {
                    let (a, b) = (start.max(*from), end.min(*to));
                    if !(b > a) {
                        continue;
                    }
                    let [first, last] = piece.domain();
                    let own = |t: f64| match t {
                        t if t == *from => first,
                        t if t == *to => last,
                        t => first + (last - first) * (t - from) / (to - from),
                    };
                    parts.push(rescaled(&piece.part(own(a), own(b))?, a, b)?);
                }
                joined(parts)
            }
        }
    }
}

/// Curves one after the other, all in the highest of their degrees.
fn joined(mut parts: Vec<BsplineCurve>) -> Result<BsplineCurve, Lost> {
    let degree = parts.iter().map(|c| c.knots().degree()).max();
    let Some(degree) = degree else { return Err(Lost::Unsound("a curve without pieces".into())) };
    for part in &mut parts {
        *part = part.elevated(degree)?;
    }
    // In pairs, so that no piece is copied more often than there are rounds.
    while parts.len() > 1 {
        let pairs = parts.chunks(2);
        parts = pairs
            .map(|pair| match pair {
                [a, b] => a.joined(b),
                _ => Ok(pair[0].clone()),
            })
            .collect::<Result<_, _>>()?;
    }
    Ok(parts.swap_remove(0))
}

/// The same curve over another interval.
fn rescaled(curve: &BsplineCurve, start: f64, end: f64) -> Result<BsplineCurve, Lost> {
    let curve = curve.clamped()?;
    let (a, b) = curve.knots().domain();
    if (a, b) == (start, end) {
        return Ok(curve);
    }
    let moved = |t: &f64| match *t {
        t if t == a => start,
        t if t == b => end,
        t => start + (end - start) * (t - a) / (b - a),
    };
    let knots = curve.knots().knots().iter().map(moved).collect();
    let knots = KnotVector::new(curve.knots().degree(), knots)?;
    let weights = curve.weights().map(<[f64]>::to_vec);
    Ok(BsplineCurve::new(knots, curve.control_points().to_vec(), weights)?)
}

impl Arc {
    fn part(&self, start: f64, end: f64) -> Result<BsplineCurve, Lost> {
        let ([a, b], [from, to]) = (self.domain, self.angles);
        let angle = |t: f64| from + (to - from) * (t - a) / (b - a);
        let (first, last) = (angle(start), angle(end));
        let turn = last - first;
        if !(turn > 0.0 && turn <= std::f64::consts::TAU * (1.0 + 1e-12)) {
            return Err(Lost::Unsound(format!("an arc over an angle of {turn}")));
        }
        let arc = BsplineCurve::arc(self.center, self.x, self.y, ArcSpans::new(first, last))?;
        rescaled(&arc, start, end)
    }
}
