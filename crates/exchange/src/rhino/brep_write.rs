//! Trimmed surfaces as openNURBS writes them: a surface, the curves around its part in the
//! parameter plane and in space, and how they hang together.

use super::chunks::Chunks;
use super::codes::{ANONYMOUS, BREP};
use bspline::{BsplineCurve, BsplineSurface, SplineError, Trim, TrimCurve, TrimLoop};
use geom_core::{DVec2, DVec3};

/// Curves in space are within this share of the tolerance of the surface.
const EXACT: f64 = 1e-3;

/// How a trim uses its edge, by the numbers of the format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Boundary = 1,
    Seam = 3,
    Singular = 4,
}

/// A curve between two vertices.
struct Edge {
    curve: BsplineCurve,
    vertices: [usize; 2],
    trims: Vec<usize>,
    /// How far the curve may be from the surface.
    accuracy: f64,
}

/// A side of a loop: a curve in the parameter plane.
struct Side {
    curve: BsplineCurve,
    /// The edge, and whether the side runs against it; none at a pole.
    edge: Option<(usize, bool)>,
    vertices: [usize; 2],
    kind: Kind,
    iso: i32,
    in_loop: usize,
}

struct Loop {
    sides: Vec<usize>,
    is_outer: bool,
    face: usize,
}

/// A surface with the faces that lie on it.
pub(super) struct Brep<'a> {
    surface: &'a BsplineSurface,
    tolerance: f64,
    vertices: Vec<(DVec3, Vec<usize>)>,
    edges: Vec<Edge>,
    sides: Vec<Side>,
    loops: Vec<Loop>,
    /// The loops of each face, the outer one first.
    faces: Vec<Vec<usize>>,
}

impl<'a> Brep<'a> {
    /// A face for every outer loop of the trim; ends of curves within `tolerance` are one vertex.
    pub(super) fn new(
        surface: &'a BsplineSurface,
        trim: &Trim,
        tolerance: f64,
    ) -> Result<Self, SplineError> {
        let mut made = Self {
            surface,
            tolerance,
            vertices: Vec::new(),
            edges: Vec::new(),
            sides: Vec::new(),
            loops: Vec::new(),
            faces: Vec::new(),
        };
        for (outer, holes) in islands(trim) {
            made.faces.push(Vec::new());
            made.add_loop(outer, true)?;
            for hole in holes {
                made.add_loop(hole, false)?;
            }
        }
        Ok(made)
    }

    fn vertex(&mut self, p: DVec3) -> usize {
        let near = |(q, _): &(DVec3, Vec<usize>)| q.distance(p) <= self.tolerance;
        if let Some(known) = self.vertices.iter().position(near) {
            return known;
        }
        self.vertices.push((p, Vec::new()));
        self.vertices.len() - 1
    }

    fn add_loop(&mut self, made: &TrimLoop, is_outer: bool) -> Result<(), SplineError> {
        let (face, in_loop) = (self.faces.len() - 1, self.loops.len());
        let first = self.sides.len();
        let starts: Vec<DVec3> = made
            .curves()
            .iter()
            .map(|c| {
                let p = c.parameters.control_points()[0];
                c.edge.as_ref().map_or_else(
                    || self.surface.point(p.x, p.y),
                    |edge| edge.point(edge.knots().domain().0),
                )
            })
            .collect();
        let starts: Vec<usize> = starts.into_iter().map(|p| self.vertex(p)).collect();
        for (k, curve) in made.curves().iter().enumerate() {
            let vertices = [starts[k], starts[(k + 1) % starts.len()]];
            let (edge, kind) = self.edge_of(curve, vertices, first)?;
            let iso = iso(curve, self.surface);
            let curve = curve.parameters.clone();
            let side = self.sides.len();
            if let Some((edge, _)) = edge {
                self.edges[edge].trims.push(side);
            }
            self.sides.push(Side { curve, edge, vertices, kind, iso, in_loop });
        }
        self.loops.push(Loop { sides: (first..self.sides.len()).collect(), is_outer, face });
        self.faces[face].push(in_loop);
        Ok(())
    }

    /// The edge of a trim curve: a new one, or the other side of a seam among the sides of the
    /// loop, which begin at `first`; none for a point.
    fn edge_of(
        &mut self,
        curve: &TrimCurve,
        vertices: [usize; 2],
        first: usize,
    ) -> Result<(Option<(usize, bool)>, Kind), SplineError> {
        let (edge, accuracy) = match &curve.edge {
            Some(edge) => (edge.clamped()?, 0.0),
            None => self.surface.curve_on(&curve.parameters, EXACT * self.tolerance)?,
        };
        let points = edge.control_points();
        if points.iter().all(|p| p.distance(points[0]) <= self.tolerance) {
            return Ok((None, Kind::Singular));
        }
        let middle = middle(&edge);
        for side in first..self.sides.len() {
            let Some((other, false)) = self.sides[side].edge else { continue };
            let known = &self.edges[other];
            let back = known.vertices == [vertices[1], vertices[0]] && known.trims.len() == 1;
            if back && self::middle(&known.curve).distance(middle) <= self.tolerance {
                self.sides[side].kind = Kind::Seam;
                return Ok((Some((other, true)), Kind::Seam));
            }
        }
        let id = self.edges.len();
        for vertex in vertices {
            self.vertices[vertex].1.push(id);
        }
        self.edges.push(Edge { curve: edge, vertices, trims: Vec::new(), accuracy });
        Ok((Some((id, false)), Kind::Boundary))
    }

    /// Writes the object.
    pub(super) fn write(&self, file: &mut Chunks) {
        file.object(&BREP, |file| {
            file.u8(0x33);
            file.list(self.sides.iter(), |file, side| {
                file.i32(1);
                file.nurbs_curve(&side.curve, 2);
            });
            file.list(self.edges.iter(), |file, edge| {
                file.i32(1);
                file.nurbs_curve(&edge.curve, 3);
            });
            file.list([self.surface].into_iter(), |file, surface| {
                file.i32(1);
                file.nurbs_surface(surface);
            });
            self.write_topology(file);
            file.bounds(self.surface.control_points().iter().copied());
            // No face has a mesh for display or analysis.
            for _ in 0..2 {
                file.chunk(ANONYMOUS, |file| file.zeros(self.faces.len()));
            }
            file.i32(0);
            file.chunk(ANONYMOUS, |file| {
                file.i32s(&[1, 1]);
                file.u8(0);
            });
        });
    }

    fn write_topology(&self, file: &mut Chunks) {
        file.list(self.vertices.iter().enumerate(), |file, (k, (point, edges))| {
            file.int(k);
            file.point(*point);
            file.indices(edges.iter().copied());
            file.f64(0.0);
        });
        file.list(self.edges.iter().enumerate(), |file, (k, edge)| {
            file.int(k);
            file.int(k);
            file.i32(0);
            file.domain(&edge.curve);
            file.i32s(&edge.vertices.map(|v| v as i32));
            file.indices(edge.trims.iter().copied());
            file.f64(edge.accuracy);
            file.domain(&edge.curve);
        });
        file.list(self.sides.iter().enumerate(), |file, (k, side)| {
            file.int(k);
            file.int(k);
            file.domain(&side.curve);
            file.i32(side.edge.map_or(-1, |(edge, _)| edge as i32));
            file.i32s(&side.vertices.map(|v| v as i32));
            file.i32(i32::from(side.edge.is_some_and(|(_, against)| against)));
            file.i32(side.kind as i32);
            file.i32(side.iso);
            file.int(side.in_loop);
            file.f64s(&[0.0; 2]);
            file.domain(&side.curve);
            file.zeros(32);
            file.f64s(&[0.0; 2]);
        });
        file.list(self.loops.iter().enumerate(), |file, (k, made)| {
            file.int(k);
            file.indices(made.sides.iter().copied());
            file.i32(if made.is_outer { 1 } else { 2 });
            file.int(made.face);
        });
        file.chunk(ANONYMOUS, |file| {
            file.u8(0x11);
            file.int(self.faces.len());
            for (k, loops) in self.faces.iter().enumerate() {
                file.int(k);
                file.indices(loops.iter().copied());
                file.i32s(&[0; 3]);
            }
            file.zeros(16 * self.faces.len());
        });
    }
}

impl Chunks {
    fn list<T>(&mut self, items: impl ExactSizeIterator<Item = T>, write: impl Fn(&mut Self, T)) {
        self.chunk(ANONYMOUS, |file| {
            file.u8(0x10);
            file.int(items.len());
            items.for_each(|item| write(file, item));
        });
    }

    fn domain(&mut self, curve: &BsplineCurve) {
        let (start, end) = curve.knots().domain();
        self.f64(start);
        self.f64(end);
    }
}

/// Every outer loop with the holes in it.
fn islands(trim: &Trim) -> Vec<(&TrimLoop, Vec<&TrimLoop>)> {
    let mut islands: Vec<(&TrimLoop, Vec<&TrimLoop>)> = Vec::new();
    let is_outer = |made: &&TrimLoop| made.signed_area() > 0.0;
    islands.extend(trim.loops().iter().filter(is_outer).map(|made| (made, Vec::new())));
    let areas: Vec<f64> = islands.iter().map(|(outer, _)| outer.signed_area()).collect();
    let regions: Vec<Option<Trim>> =
        islands.iter().map(|(outer, _)| Trim::new(vec![(*outer).clone()]).ok()).collect();
    for hole in trim.loops().iter().filter(|made| !is_outer(made)) {
        let at: DVec2 = hole.polygon()[0];
        let around = |k: &usize| regions[*k].as_ref().is_some_and(|r| r.contains(at.x, at.y));
        let nearest = (0..islands.len()).filter(around);
        // The smallest loop around a hole is the one it is cut out of.
        let nearest = nearest.min_by(|a, b| areas[*a].total_cmp(&areas[*b]));
        if let Some((_, holes)) = islands.get_mut(nearest.unwrap_or(0)) {
            holes.push(hole);
        }
    }
    islands
}

/// The number of a line of constant parameter: on the borders 3 (first u), 4 (first v), 5 (last
/// u), 6 (last v), inside 1 (constant u) and 2 (constant v), else 0.
fn iso(curve: &TrimCurve, surface: &BsplineSurface) -> i32 {
    let points = curve.parameters.control_points();
    let line = |get: fn(&DVec3) -> f64, along: fn(&DVec3) -> f64, domain: (f64, f64)| {
        let low = points.iter().map(get).fold(f64::INFINITY, f64::min);
        let high = points.iter().map(get).fold(f64::NEG_INFINITY, f64::max);
        let near = same_parameter(domain);
        let straight = points.is_sorted_by(|a, b| along(a) <= along(b))
            || points.is_sorted_by(|a, b| along(a) >= along(b));
        let at = |t: f64| t - near <= low && high <= t + near;
        (straight && at(0.5 * (low + high))).then(|| [at(domain.0), at(domain.1)])
    };
    let (u, v) = (surface.knots_u().domain(), surface.knots_v().domain());
    match (line(|p| p.x, |p| p.y, u), line(|p| p.y, |p| p.x, v)) {
        (Some([true, _]), None) => 3,
        (Some([_, true]), None) => 5,
        (Some(_), None) => 1,
        (None, Some([true, _])) => 4,
        (None, Some([_, true])) => 6,
        (None, Some(_)) => 2,
        _ => 0,
    }
}

/// Parameters of a domain that are nearer than this count as equal in openNURBS.
fn same_parameter((start, end): (f64, f64)) -> f64 {
    (end - start) * 8.0 * f64::EPSILON.sqrt() + (start.abs() + end.abs()) * f64::EPSILON
}

fn middle(curve: &BsplineCurve) -> DVec3 {
    let (start, end) = curve.knots().domain();
    curve.point(0.5 * (start + end))
}
