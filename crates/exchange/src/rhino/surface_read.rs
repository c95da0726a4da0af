//! Surfaces: splines, planes, surfaces of revolution and sums of curves, all exact.

use super::codes::{ClassId, NURBS_SURFACE, PLANE_SURFACE, REV_SURFACE, SUM_SURFACE, class_name};
use super::cursor::Cursor;
use super::curve_read::{control_points, curve_object, direction};
use super::lost::Lost;
use crate::wrapped::unwrap;
use bspline::{ArcSpans, Axis, BsplineSurface, Degree, KnotVector};
use geom_core::DVec3;

/// A surface as a spline.
pub(super) struct Surface {
    pub(super) spline: BsplineSurface,
    /// Whether its parameters are those of the file; an angle is no parameter of a spline.
    pub(super) keeps_parameters: bool,
    /// The intervals of the parameters of the file.
    pub(super) domain: [[f64; 2]; 2],
}

impl From<BsplineSurface> for Surface {
    fn from(spline: BsplineSurface) -> Self {
        let domain = [spline.knots_u().domain().into(), spline.knots_v().domain().into()];
        Self { spline, keeps_parameters: true, domain }
    }
}

/// Whether [`surface_data`] reads a class.
pub(super) fn is_surface(class: &ClassId) -> bool {
    [NURBS_SURFACE, PLANE_SURFACE, REV_SURFACE, SUM_SURFACE].contains(class)
}

/// The next object as a surface.
pub(super) fn surface_object(file: &mut Cursor<'_>) -> Result<Surface, Lost> {
    let (class, data) = file.object()?;
    surface_data(&class, data)
}

/// The data of a class as a surface.
pub(super) fn surface_data(class: &ClassId, mut data: Cursor<'_>) -> Result<Surface, Lost> {
    let surface = match *class {
        NURBS_SURFACE => nurbs_surface(&mut data)?.into(),
        PLANE_SURFACE => plane_surface(&mut data)?.into(),
        REV_SURFACE => rev_surface(&mut data)?,
        SUM_SURFACE => sum_surface(&mut data)?.into(),
        _ => return Err(Lost::Kind(class_name(class))),
    };
    data.check()?;
    Ok(surface)
}

fn nurbs_surface(data: &mut Cursor<'_>) -> Result<BsplineSurface, Lost> {
    data.version()?;
    let dimension = data.i32()?;
    if dimension != 3 {
        return Err(Lost::Unsound(format!("a surface in {dimension} dimensions")));
    }
    let rational = data.i32()? != 0;
    let orders = [data.count(0)?, data.count(0)?];
    let counts = [data.count(8)?, data.count(8)?];
    data.take(2 * 4 + 6 * 8)?;
    let knots = [data.reals()?, data.reals()?];
    let count = counts[0].saturating_mul(counts[1]);
    let (points, weights) = control_points(data, count, 3, rational)?;
    let [knots_u, knots_v] = knots;
    let u = direction(orders[0], knots_u, counts[0])?;
    let v = direction(orders[1], knots_v, counts[1])?;
    Ok(unwrap(&u, &v, &points, weights.as_deref())?)
}

fn plane_surface(data: &mut Cursor<'_>) -> Result<BsplineSurface, Lost> {
    let (_, minor) = data.version()?;
    let [origin, x, y] = [data.point()?, data.point()?, data.point()?];
    // The normal and the equation of the plane.
    data.take(7 * 8)?;
    let domains: [[f64; 2]; 2] = [data.f64s()?, data.f64s()?];
    let extents = if minor >= 1 { [data.f64s()?, data.f64s()?] } else { domains };
    let corner = |i: usize, j: usize| origin + extents[0][i] * x + extents[1][j] * y;
    let points = vec![corner(0, 0), corner(0, 1), corner(1, 0), corner(1, 1)];
    let line = |[a, b]: [f64; 2]| KnotVector::new(Degree::new(1)?, vec![a, a, b, b]);
    Ok(BsplineSurface::new(line(domains[0])?, line(domains[1])?, points, None)?)
}

fn rev_surface(data: &mut Cursor<'_>) -> Result<Surface, Lost> {
    let (major, _) = data.version()?;
    let [from, to] = [data.point()?, data.point()?];
    let angles: [f64; 2] = data.f64s()?;
    // Of the second version: the parameters at which the angles stand.
    let stands_at = if major >= 2 { data.f64s()? } else { angles };
    data.take(6 * 8)?;
    let transposed = data.i32()? != 0;
    if data.u8()? == 0 {
        return Err(Lost::Unsound("a surface of revolution without a curve".into()));
    }
    let profile = curve_object(data, 0)?.whole()?;
    let turn = angles[1] - angles[0];
    let direction = (to - from).normalize_or_zero();
    if !(turn > 0.0 && turn <= std::f64::consts::TAU * (1.0 + 1e-12)) || direction == DVec3::ZERO {
        return Err(Lost::Unsound(format!("a surface of revolution over an angle of {turn}")));
    }
    let axis = Axis { origin: from, direction };
    let spans = ArcSpans::new(angles[0], angles[1]);
    let spline = BsplineSurface::revolution(&profile, axis, spans)?;
    let along = profile.knots().domain().into();
    Ok(if transposed {
        let domain = [along, stands_at];
        Surface { spline: spline.swapped(), keeps_parameters: false, domain }
    } else {
        Surface { spline, keeps_parameters: false, domain: [stands_at, along] }
    })
}

fn sum_surface(data: &mut Cursor<'_>) -> Result<BsplineSurface, Lost> {
    data.version()?;
    let base = data.point()?;
    data.take(6 * 8)?;
    let [a, b] = [curve_object(data, 0)?.whole()?, curve_object(data, 0)?.whole()?];
    // Both sides are in the file, their product need not be.
    if a.control_points().len().saturating_mul(b.control_points().len()) > LARGEST_SUM {
        return Err(Lost::Unsound("a sum of two long curves".into()));
    }
    let rows = a.control_points().iter();
    let points =
        rows.flat_map(|p| b.control_points().iter().map(move |q| base + *p + *q)).collect();
    let weights = (a.weights().is_some() || b.weights().is_some()).then(|| {
        let of = |w: Option<&[f64]>, k: usize| w.map_or(1.0, |w| w[k]);
        let across = b.control_points().len();
        let all = 0..a.control_points().len() * across;
        all.map(|k| of(a.weights(), k / across) * of(b.weights(), k % across)).collect()
    });
    Ok(BsplineSurface::new(a.knots().clone(), b.knots().clone(), points, weights)?)
}

/// Control points of a sum of two curves.
const LARGEST_SUM: usize = 1 << 16;
