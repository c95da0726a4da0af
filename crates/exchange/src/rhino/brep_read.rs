//! The faces of a Brep: surfaces with loops of curves in their parameter planes and in space.

use super::budget::Budget;
use super::codes::ANONYMOUS;
use super::cursor::Cursor;
use super::curve_read::{Curve, curve_object};
use super::lost::Lost;
use super::surface_read::{Surface, surface_object};
use crate::error::ReadError;
use bspline::{BsplineCurve, BsplineSurface, Carrier, FaceEdge, Trim, TrimCurve, TrimLoop};
use geom_core::{BoundingBox, DVec3};

/// Ends of curves this share of the size of the parameter plane apart are joined.
const SLACK: f64 = 1e-4;
/// Points this share of the size of a surface apart are the same.
const SAME_POINT: f64 = 1e-6;
/// A loop along the border of a surface is within this share of the size of its domain.
const ON_BORDER: f64 = 1e-9;

/// A face with its surface, its normal that of the face.
pub(super) struct Face {
    pub(super) surface: BsplineSurface,
    pub(super) trim: Option<Trim>,
}

struct Edge {
    curve: Option<usize>,
    against: bool,
    interval: [f64; 2],
}

struct Side {
    curve: Option<usize>,
    interval: [f64; 2],
    edge: Option<usize>,
    against: bool,
    reversed: bool,
}

struct FaceText {
    loops: Vec<Option<usize>>,
    surface: Option<usize>,
    reversed: bool,
}

/// What is in a Brep; what is of an unknown kind stays as the reason why.
struct Brep {
    planar: Vec<Result<Curve, Lost>>,
    curves: Vec<Result<Curve, Lost>>,
    surfaces: Vec<Result<Surface, Lost>>,
    edges: Vec<Edge>,
    sides: Vec<Side>,
    /// The sides of each loop.
    loops: Vec<Vec<Option<usize>>>,
    faces: Vec<FaceText>,
}

/// All faces of the data of a Brep of version 3, and for each that cannot be read the reason.
pub(super) fn brep_data(
    mut data: Cursor<'_>,
    budget: &mut Budget,
) -> Result<Vec<Result<Face, Lost>>, Lost> {
    let (major, _) = data.version()?;
    if major != 3 {
        return Err(Lost::Unsound(format!("a Brep of version {major}")));
    }
    let brep = Brep {
        planar: objects(&mut data, |file| curve_object(file, 0))?,
        curves: objects(&mut data, |file| curve_object(file, 0))?,
        surfaces: objects(&mut data, surface_object)?,
        edges: {
            list(&mut data, |_| Ok(()), 36)?;
            list(&mut data, edge, 60)?
        },
        sides: list(&mut data, side, 96)?,
        loops: list(&mut data, loop_sides, 16)?,
        faces: list(&mut data, face_text, 20)?,
    };
    let mut faces = Vec::with_capacity(brep.faces.len());
    for text in &brep.faces {
        faces.push(match brep.face(text, budget, &data) {
            Err(Lost::Damaged(error)) => return Err(error.into()),
            face => face,
        });
    }
    Ok(faces)
}

/// A list of objects, some of which may be missing.
fn objects<T>(
    data: &mut Cursor<'_>,
    read: impl Fn(&mut Cursor<'_>) -> Result<T, Lost>,
) -> Result<Vec<Result<T, Lost>>, Lost> {
    let mut list = data.expect(ANONYMOUS)?;
    list.version()?;
    let count = list.count(4)?;
    let mut made = Vec::new();
    for _ in 0..count {
        if list.i32()? == 0 {
            made.push(Err(Lost::Unsound("a part that is not there".into())));
            continue;
        }
        // The next object begins behind this one, whatever is read of it.
        let mut one = list.clone();
        list.chunk()?;
        made.push(match read(&mut one) {
            Err(Lost::Damaged(error)) => return Err(error.into()),
            object => object,
        });
    }
    Ok(made)
}

fn list<T>(
    data: &mut Cursor<'_>,
    read: impl Fn(&mut Cursor<'_>) -> Result<T, ReadError>,
    least: usize,
) -> Result<Vec<T>, ReadError> {
    let mut list = data.expect(ANONYMOUS)?;
    list.version()?;
    let count = list.count(least)?;
    // Each begins with its own number.
    (0..count).map(|_| list.i32().and_then(|_| read(&mut list))).collect()
}

fn edge(data: &mut Cursor<'_>) -> Result<Edge, ReadError> {
    let curve = data.index()?;
    let against = data.i32()? != 0;
    let interval = data.f64s()?;
    // Vertices, trims, tolerance, the interval of the edge.
    data.take(8)?;
    data.indices()?;
    data.take(24)?;
    Ok(Edge { curve, against, interval })
}

fn side(data: &mut Cursor<'_>) -> Result<Side, ReadError> {
    let curve = data.index()?;
    let interval = data.f64s()?;
    let edge = data.index()?;
    data.take(8)?;
    let against = data.i32()? != 0;
    // Kind, course, loop, tolerances, the interval of the side.
    data.take(12 + 16 + 16)?;
    let reversed = data.u8()? == 1;
    data.take(7 + 24 + 16)?;
    Ok(Side { curve, interval, edge, against, reversed })
}

fn loop_sides(data: &mut Cursor<'_>) -> Result<Vec<Option<usize>>, ReadError> {
    let sides = data.indices()?;
    data.take(8)?;
    Ok(sides)
}

fn face_text(data: &mut Cursor<'_>) -> Result<FaceText, ReadError> {
    let loops = data.indices()?;
    let surface = data.index()?;
    let reversed = data.i32()? != 0;
    data.take(4)?;
    Ok(FaceText { loops, surface, reversed })
}

/// An item by its number, or why it is not there.
fn named<T>(list: &[Result<T, Lost>], index: Option<usize>) -> Result<&T, Lost> {
    match index.and_then(|k| list.get(k)) {
        Some(Ok(item)) => Ok(item),
        Some(Err(Lost::Kind(kind))) => Err(Lost::Kind(kind)),
        Some(Err(Lost::Unsound(reason))) => Err(Lost::Unsound(reason.clone())),
        _ => Err(Lost::Unsound("a face names a part that is not there".into())),
    }
}

impl Brep {
    fn face(&self, text: &FaceText, budget: &mut Budget, at: &Cursor<'_>) -> Result<Face, Lost> {
        let surface = named(&self.surfaces, text.surface)?;
        budget.spend(surface.spline.control_points().len(), at)?;
        let mut loops = Vec::with_capacity(text.loops.len());
        for one in &text.loops {
            let Some(sides) = one.and_then(|k| self.loops.get(k)) else {
                return Err(Lost::Unsound("a face names a loop that is not there".into()));
            };
            let mut curves = Vec::with_capacity(sides.len());
            for side in sides {
                let Some(side) = side.and_then(|k| self.sides.get(k)) else {
                    return Err(Lost::Unsound("a loop names a side that is not there".into()));
                };
                let curve = self.curve(side)?;
                let points = curve.edge.as_ref().map_or(0, |e| e.control_points().len());
                budget.spend(curve.parameters.control_points().len() + points, at)?;
                curves.push(curve);
            }
            loops.push(curves);
        }
        let face = match surface {
            whole if covers(&surface.domain, &loops) => {
                Face { surface: whole.spline.clone(), trim: None }
            }
            Surface { spline, keeps_parameters: true, .. } => trimmed(spline, loops)?,
            Surface { spline, .. } => projected(spline, loops)?,
        };
        Ok(if text.reversed {
            Face { surface: face.surface.swapped(), trim: face.trim.map(|t| t.swapped()) }
        } else {
            face
        })
    }

    fn curve(&self, side: &Side) -> Result<TrimCurve, Lost> {
        let [start, end] = side.interval;
        let mut parameters = named(&self.planar, side.curve)?.part(start, end)?;
        if side.reversed {
            parameters = parameters.reversed();
        }
        let flat = parameters.mapped(|p| DVec3::new(p.x, p.y, 0.0))?;
        // The curve in space is a help for neighbours; without it the surface has it.
        let edge = side.edge.and_then(|k| self.edges.get(k)).and_then(|edge| {
            let [start, end] = edge.interval;
            let curve = named(&self.curves, edge.curve).ok()?.part(start, end).ok()?;
            Some(if edge.against != side.against { curve.reversed() } else { curve })
        });
        Ok(TrimCurve { parameters: flat, edge })
    }
}

/// Whether one loop runs along the whole border of the parameter rectangle.
fn covers([u, v]: &[[f64; 2]; 2], loops: &[Vec<TrimCurve>]) -> bool {
    let [only] = loops else { return loops.is_empty() };
    let along = |curve: &BsplineCurve| {
        let on = |get: fn(&DVec3) -> f64, [a, b]: &[f64; 2]| {
            let all = |t: &f64| {
                let near = |p: &DVec3| (get(p) - t).abs() <= ON_BORDER * (b - a);
                curve.control_points().iter().all(near)
            };
            all(a) || all(b)
        };
        on(|p| p.x, u) || on(|p| p.y, v)
    };
    let mut bounds: Option<BoundingBox> = None;
    for p in only.iter().flat_map(|c| c.parameters.control_points()) {
        bounds = Some(bounds.map_or(BoundingBox { min: *p, max: *p }, |b| b.including(*p)));
    }
    let Some(bounds) = bounds else { return true };
    let whole = |low: f64, high: f64, [a, b]: &[f64; 2]| {
        (low - a).abs() <= ON_BORDER * (b - a) && (high - b).abs() <= ON_BORDER * (b - a)
    };
    only.iter().all(|c| along(&c.parameters))
        && whole(bounds.min.x, bounds.max.x, u)
        && whole(bounds.min.y, bounds.max.y, v)
}

fn trimmed(surface: &BsplineSurface, loops: Vec<Vec<TrimCurve>>) -> Result<Face, Lost> {
    let ((u0, u1), (v0, v1)) = (surface.knots_u().domain(), surface.knots_v().domain());
    let slack = SLACK * (u1 - u0).hypot(v1 - v0);
    let loops = loops.into_iter().map(|curves| TrimLoop::new(curves, slack));
    let trim = Trim::new(loops.collect::<Result<_, _>>()?)?;
    Ok(Face { surface: surface.clone(), trim: Some(trim) })
}

/// A face by its curves in space alone.
fn projected(surface: &BsplineSurface, loops: Vec<Vec<TrimCurve>>) -> Result<Face, Lost> {
    let points = surface.control_points().iter().copied();
    let size = BoundingBox::of(points).map_or(1.0, BoundingBox::diagonal);
    let edges = |curves: Vec<TrimCurve>| -> Vec<FaceEdge> {
        let curves = curves.into_iter().filter_map(|c| c.edge);
        curves.map(|curve| FaceEdge { curve, parameters: Vec::new() }).collect()
    };
    let loops: Vec<Vec<FaceEdge>> = loops.into_iter().map(edges).collect();
    let face = Carrier::Spline(surface.clone()).face(&loops, SAME_POINT * size)?;
    Ok(Face { surface: face.surface, trim: face.trim })
}
