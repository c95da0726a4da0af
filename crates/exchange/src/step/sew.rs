//! Faces that share curves, joined into shells: which edges and vertices they have in common, which
//! way round each must lie, and what is closed.

use super::border::{Borders, Side, is_near_point};
use crate::model::NamedSurface;
use bspline::{BsplineCurve, BsplineSurface, SplineError, Trim, TrimCurve};
use geom_core::{BoundingBox, DVec3};
use std::collections::{HashMap, VecDeque};

/// Edge curves are within this share of the tolerance of the surfaces, straight ones of a line.
const EXACT: f64 = 1e-3;
/// Places at which two curves are compared that differ in their control points.
const CHECKS: usize = 7;
/// Places along a course from which the nearest to a point is looked for, and steps from there.
const PLACES: usize = 256;
/// See [`PLACES`].
const HALVINGS: usize = 90;

/// An edge as one face runs along it.
#[derive(Clone, Debug)]
pub(super) struct Use {
    pub(super) edge: usize,
    /// Whether the face runs in the direction of the edge.
    pub(super) forward: bool,
    /// The course in the parameter plane of a trimmed face, in the direction of the use.
    pub(super) parameters: Option<BsplineCurve>,
}

/// A face with its loops; one without edges is a point.
#[derive(Clone, Debug)]
pub(super) struct SewnFace {
    pub(super) surface: BsplineSurface,
    pub(super) loops: Vec<Vec<Use>>,
    /// A vertex for a face without edges.
    pub(super) point: usize,
}

/// A curve between two vertices with the faces along it.
#[derive(Clone, Debug)]
pub(super) struct SewnEdge {
    pub(super) vertices: [usize; 2],
    pub(super) curve: BsplineCurve,
    pub(super) is_straight: bool,
    /// Face and direction of each use.
    pub(super) uses: Vec<(usize, bool)>,
}

/// Faces that hang together.
#[derive(Clone, Debug)]
pub(super) struct Shell {
    pub(super) faces: Vec<usize>,
    pub(super) is_closed: bool,
}

/// All faces of a model with what they share.
#[derive(Clone, Debug, Default)]
pub(super) struct Sewn {
    pub(super) vertices: Vec<DVec3>,
    pub(super) edges: Vec<SewnEdge>,
    pub(super) faces: Vec<SewnFace>,
    pub(super) shells: Vec<Shell>,
}

/// Sews what lies together within `tolerance`. A face that would lie against its neighbours is
/// turned over by swapping its parameters; a closed shell has its normals outside.
pub(super) fn sew(surfaces: &[NamedSurface], tolerance: f64) -> Result<Sewn, SplineError> {
    let mut parts: Vec<Part> =
        surfaces.iter().map(|s| (s.surface.clone(), s.trim.clone())).collect();
    let mut sewn = whole(&parts, tolerance)?;
    let turned = sewn.turned(&parts);
    if turned.contains(&true) {
        for (part, _) in parts.iter_mut().zip(&turned).filter(|(_, turn)| **turn) {
            *part = (part.0.swapped(), part.1.as_ref().map(Trim::swapped));
        }
        sewn = whole(&parts, tolerance)?;
    }
    sewn.find_shells();
    Ok(sewn)
}

type Part = (BsplineSurface, Option<Trim>);
/// Points at which a use (by its face and its place among the uses of the face) is to be cut.
type Cuts = HashMap<(usize, usize), Vec<DVec3>>;

/// Joins faces; where a face has one long edge and its neighbours several, the long one is cut.
fn whole(parts: &[Part], tolerance: f64) -> Result<Sewn, SplineError> {
    let sewn = joined(parts, tolerance, Cuts::new())?;
    let cuts = sewn.cuts(tolerance);
    if cuts.is_empty() { Ok(sewn) } else { joined(parts, tolerance, cuts) }
}

fn joined(parts: &[Part], tolerance: f64, cuts: Cuts) -> Result<Sewn, SplineError> {
    let mut sewing = Sewing { tolerance, cuts, ..Sewing::default() };
    for (face, (surface, trim)) in parts.iter().enumerate() {
        sewing.owner = face;
        sewing.own.clear();
        sewing.used = 0;
        let loops = match trim {
            None => vec![sewing.natural(surface)?],
            Some(trim) => {
                let mut loops = Vec::with_capacity(trim.loops().len());
                for made in trim.loops() {
                    loops.push(sewing.trimmed(surface, made.curves())?);
                }
                loops
            }
        };
        let (u, v) = (surface.knots_u().domain().0, surface.knots_v().domain().0);
        let bare = loops.iter().all(Vec::is_empty);
        let point = if bare { sewing.vertex(surface.point(u, v)) } else { 0 };
        sewing.sewn.faces.push(SewnFace { surface: surface.clone(), loops, point });
    }
    Ok(sewing.sewn)
}

/// Vertices and edges so far.
#[derive(Default)]
struct Sewing {
    tolerance: f64,
    /// The face at work.
    owner: usize,
    sewn: Sewn,
    /// Vertices by the cell of the size of the tolerance that they lie in.
    cells: HashMap<[i64; 3], Vec<usize>>,
    /// The last face that used each vertex.
    users: Vec<usize>,
    /// Places of the face at work that have a vertex.
    own: Vec<(DVec3, usize)>,
    by_ends: HashMap<[usize; 2], Vec<usize>>,
    cuts: Cuts,
    /// Uses of the face at work so far, cuts not counted.
    used: usize,
}

impl Sewing {
    fn cell(&self, p: DVec3) -> [i64; 3] {
        (p / self.tolerance).to_array().map(|x| x.floor() as i64)
    }

    /// The vertex at a point: the same for the same point, and for one of another face nearby.
    fn vertex(&mut self, p: DVec3) -> usize {
        if let Some((_, k)) = self.own.iter().find(|(own, _)| *own == p) {
            return *k;
        }
        let k = self.shared_vertex(p);
        self.own.push((p, k));
        k
    }

    fn shared_vertex(&mut self, p: DVec3) -> usize {
        let [x, y, z] = self.cell(p);
        let around = |a: i64| [a, a.saturating_sub(1), a.saturating_add(1)];
        let mut near: Option<(f64, usize)> = None;
        for cell in around(x)
            .into_iter()
            .flat_map(|x| around(y).map(|y| (x, y)))
            .flat_map(|(x, y)| around(z).map(|z| [x, y, z]))
        {
            for &k in self.cells.get(&cell).into_iter().flatten() {
                let distance = self.sewn.vertices[k].distance(p);
                let fits =
                    distance == 0.0 || (distance <= self.tolerance && self.users[k] != self.owner);
                if fits && near.is_none_or(|(least, _)| distance < least) {
                    near = Some((distance, k));
                }
            }
        }
        if let Some((_, k)) = near {
            self.users[k] = self.owner;
            return k;
        }
        let k = self.sewn.vertices.len();
        self.sewn.vertices.push(p);
        self.users.push(self.owner);
        self.cells.entry([x, y, z]).or_default().push(k);
        k
    }

    /// The edge along a curve from one vertex to another, shared with the face that has it, and
    /// whether the curve runs in its direction.
    fn edge(&mut self, curve: BsplineCurve, vertices: [usize; 2]) -> (usize, bool) {
        let is_straight = is_straight(&curve, EXACT * self.tolerance);
        let key = [vertices[0].min(vertices[1]), vertices[0].max(vertices[1])];
        for &k in self.by_ends.get(&key).into_iter().flatten() {
            let edge = &self.sewn.edges[k];
            let free = edge.uses.len() == 1 && edge.uses[0].0 != self.owner;
            if !free {
                continue;
            }
            let found = if is_straight && edge.is_straight {
                Some(edge.vertices == vertices)
            } else {
                same_course(&edge.curve, &curve, self.tolerance)
            };
            if let Some(forward) = found {
                return (k, forward);
            }
        }
        let k = self.sewn.edges.len();
        self.sewn.edges.push(SewnEdge { vertices, curve, is_straight, uses: Vec::new() });
        self.by_ends.entry(key).or_default().push(k);
        (k, true)
    }

    fn use_of(&mut self, (edge, same): (usize, bool), forward: bool) -> Use {
        let forward = forward == same;
        self.sewn.edges[edge].uses.push((self.owner, forward));
        Use { edge, forward, parameters: None }
    }

    /// The loop around the whole parameter rectangle. A closed surface runs its seam twice, in
    /// opposite directions; a side that is one point has no edge.
    fn natural(&mut self, surface: &BsplineSurface) -> Result<Vec<Use>, SplineError> {
        let borders = Borders::of(surface, EXACT * self.tolerance)?;
        let ((u0, u1), (v0, v1)) = (surface.knots_u().domain(), surface.knots_v().domain());
        // The end of a closed direction is its start, to the last bit.
        let u1 = if borders.closed_u { u0 } else { u1 };
        let v1 = if borders.closed_v { v0 } else { v1 };
        let at = |(u, v): (f64, f64)| surface.point(u, v);
        let corners = [(u0, v0), (u1, v0), (u1, v1), (u0, v1)].map(at);
        let turns = [
            (Side::VStart, [0, 1], true),
            (Side::UEnd, [1, 2], true),
            (Side::VEnd, [3, 2], false),
            (Side::UStart, [0, 3], false),
        ];
        let mut found: [Vec<(usize, bool)>; 4] = Default::default();
        let mut uses = Vec::new();
        for (k, (side, ends, forward)) in turns.into_iter().enumerate() {
            let curve = borders.side(side);
            if is_near_point(curve, EXACT * self.tolerance) {
                continue;
            }
            // The sides of a closed direction are one seam.
            let closed = if k % 2 == 0 { borders.closed_v } else { borders.closed_u };
            if closed && k >= 2 {
                found[k] = std::mem::take(&mut found[k - 2]);
            } else {
                let ends = ends.map(|corner| self.vertex(corners[corner]));
                let pieces = self.pieces(curve, None, ends)?;
                found[k] = pieces.into_iter().map(|(edge, _)| edge).collect();
            }
            self.used += 1;
            if !forward {
                found[k].reverse();
            }
            for edge in found[k].clone() {
                uses.push(self.use_of(edge, forward));
            }
        }
        Ok(uses)
    }

    /// The edges along a curve, one unless it is to be cut, each with its part of the course in
    /// the parameter plane.
    #[expect(clippy::type_complexity, reason = "an edge with its direction and its course")]
    fn pieces(
        &mut self,
        curve: &BsplineCurve,
        course: Option<(&BsplineSurface, &BsplineCurve)>,
        ends: [usize; 2],
    ) -> Result<Vec<((usize, bool), Option<BsplineCurve>)>, SplineError> {
        let whole = course.map(|(_, c)| c.clone());
        let Some(points) = self.cuts.get(&(self.owner, self.used)).cloned() else {
            return Ok(vec![(self.edge(curve.clone(), ends), whole)]);
        };
        let curve = curve.clamped()?;
        let (start, end) = curve.knots().domain();
        let mut cuts: Vec<(f64, DVec3)> =
            points.into_iter().map(|p| (curve.closest_parameter(p), p)).collect();
        cuts.retain(|(t, _)| *t > start && *t < end);
        cuts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut pieces = Vec::with_capacity(cuts.len() + 1);
        let (mut from, mut first) = ((start, ends[0]), true);
        let mut rest = whole;
        for (t, p) in cuts.into_iter().map(|(t, p)| (t, Some(p))).chain([(end, None)]) {
            let vertex = p.map_or(ends[1], |p| self.vertex(p));
            let part =
                if first && p.is_none() { curve.clone() } else { curve.subdomain(from.0, t)? };
            let course = match (p, &rest, course) {
                (Some(p), Some(left), Some((surface, _))) => {
                    let s = nearest_on(surface, left, p);
                    let (a, b) = left.knots().domain();
                    let (before, after) = (left.subdomain(a, s)?, left.subdomain(s, b)?);
                    rest = Some(after);
                    Some(before)
                }
                _ => rest.clone(),
            };
            pieces.push((self.edge(part, [from.1, vertex]), course));
            (from, first) = ((t, vertex), false);
        }
        Ok(pieces)
    }

    fn trimmed(
        &mut self,
        surface: &BsplineSurface,
        curves: &[TrimCurve],
    ) -> Result<Vec<Use>, SplineError> {
        let mut lifted = Vec::with_capacity(curves.len());
        for curve in curves {
            let edge = match &curve.edge {
                Some(edge) => edge.clamped()?,
                None => surface.curve_on(&curve.parameters, EXACT * self.tolerance)?.0,
            };
            // A course along a pole has no length.
            if !is_near_point(&edge, EXACT * self.tolerance) {
                lifted.push((edge, &curve.parameters));
            }
        }
        let ends = |edge: &BsplineCurve| {
            let points = edge.control_points();
            [points[0], points[points.len() - 1]]
        };
        let n = lifted.len();
        // The end of an edge is the beginning of the next, to within the tolerance of the loop.
        let mut starts: Vec<usize> = Vec::with_capacity(n);
        for (edge, _) in &lifted {
            let start = ends(edge)[0];
            // A seam comes back to the vertices where it began, to within the tolerance.
            let back = self.own.iter().find(|(own, _)| own.distance(start) <= self.tolerance);
            let back = back.map(|(_, k)| *k);
            starts.push(back.unwrap_or_else(|| self.vertex(start)));
        }
        let mut uses = Vec::with_capacity(n);
        let mut own: Vec<(usize, DVec3, [usize; 2])> = Vec::new();
        for (k, (edge, parameters)) in lifted.into_iter().enumerate() {
            let vertices = [starts[k], starts[(k + 1) % n]];
            let middle = middle_of(&edge);
            let seam = own.iter().find(|(_, other, ends)| {
                [ends[1], ends[0]] == vertices && other.distance(middle) <= self.tolerance
            });
            // The other side of a seam within the loop is the same edge.
            let pieces = match seam {
                Some(&(edge, ..)) => vec![((edge, false), Some(parameters.clone()))],
                None => self.pieces(&edge, Some((surface, parameters)), vertices)?,
            };
            if let [(only, _)] = pieces[..] {
                own.push((only.0, middle, vertices));
            }
            self.used += 1;
            for (edge, course) in pieces {
                let mut made = self.use_of(edge, true);
                made.parameters = course;
                uses.push(made);
            }
        }
        Ok(uses)
    }
}

/// The parameter of a course in the parameter plane at which the surface is nearest to a point.
fn nearest_on(surface: &BsplineSurface, course: &BsplineCurve, p: DVec3) -> f64 {
    let (start, end) = course.knots().domain();
    let distance = |t: f64| {
        let at = course.point(t);
        surface.point(at.x, at.y).distance(p)
    };
    let at = |k: usize| start + (end - start) * k as f64 / PLACES as f64;
    let nearest = (1..PLACES).min_by(|a, b| distance(at(*a)).total_cmp(&distance(at(*b))));
    let nearest = nearest.unwrap_or(1);
    let (mut low, mut high) = (at(nearest - 1), at(nearest + 1));
    // The distance falls and rises once between the neighbours.
    for _ in 0..HALVINGS {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if distance(a) < distance(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}

fn middle_of(curve: &BsplineCurve) -> DVec3 {
    let (start, end) = curve.knots().domain();
    curve.point(0.5 * (start + end))
}

fn is_straight(curve: &BsplineCurve, close: f64) -> bool {
    let points = curve.control_points();
    let (first, last) = (points[0], points[points.len() - 1]);
    let along = (last - first).normalize_or_zero();
    let ahead = |pair: &[DVec3]| (pair[1] - pair[0]).dot(along) >= 0.0;
    let near = |p: &DVec3| (*p - first).reject_from_normalized(along).length() <= close;
    !curve.knots().is_periodic()
        && along != DVec3::ZERO
        && points.iter().all(near)
        && points.windows(2).all(ahead)
}

/// Whether two curves run through the same points, and if so whether in the same direction.
fn same_course(a: &BsplineCurve, b: &BsplineCurve, tolerance: f64) -> Option<bool> {
    let (p, q) = (a.control_points(), b.control_points());
    let near = |(a, b): (&DVec3, &DVec3)| a.distance(*b) <= tolerance;
    let ratio = |a: Option<&[f64]>, k: usize| a.map_or(1.0, |w| w[k] / w[0]);
    let n = p.len();
    if n == q.len() && a.knots().degree() == b.knots().degree() {
        let weights = |backwards: bool| {
            (0..n).all(|k| {
                let j = if backwards { n - 1 - k } else { k };
                let first = if backwards { ratio(b.weights(), n - 1) } else { 1.0 };
                (ratio(a.weights(), k) - ratio(b.weights(), j) / first).abs() < 1e-9
            })
        };
        // Equal control points over different knots are another curve.
        let knots = |backwards: bool| {
            let scaled = |c: &BsplineCurve, k: usize| {
                let (start, end) = c.knots().domain();
                (c.knots().knots()[k] - start) / (end - start)
            };
            let m = a.knots().knots().len();
            m == b.knots().knots().len()
                && (0..m).all(|k| {
                    let other = if backwards { 1.0 - scaled(b, m - 1 - k) } else { scaled(b, k) };
                    (scaled(a, k) - other).abs() < 1e-9
                })
        };
        if p.iter().zip(q).all(near) && weights(false) && knots(false) {
            return Some(true);
        }
        if p.iter().zip(q.iter().rev()).all(near) && weights(true) && knots(true) {
            return Some(false);
        }
    }
    let along = |from: &BsplineCurve, on: &BsplineCurve| -> Option<bool> {
        let (start, end) = from.knots().domain();
        let mut found = Vec::with_capacity(CHECKS);
        for k in 1..=CHECKS {
            let t = start + (end - start) * k as f64 / (CHECKS + 1) as f64;
            let s = on.closest_parameter(from.point(t));
            if on.point(s).distance(from.point(t)) > tolerance {
                return None;
            }
            found.push(s);
        }
        let rising = found.windows(2).filter(|pair| pair[0] < pair[1]).count();
        Some(2 * rising >= CHECKS - 1)
    };
    let forward = along(a, b)?;
    along(b, a).map(|_| forward)
}

impl Sewn {
    /// Where open edges pass through vertices of open edges of other faces.
    fn cuts(&self, tolerance: f64) -> Cuts {
        let open: Vec<usize> =
            (0..self.edges.len()).filter(|&k| self.edges[k].uses.len() == 1).collect();
        let mut ends: Vec<(f64, usize, usize)> = Vec::new();
        for edge in open.iter().map(|&k| &self.edges[k]) {
            let face = edge.uses[0].0;
            ends.extend(edge.vertices.map(|v| (self.vertices[v].x, v, face)));
        }
        ends.sort_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
        ends.dedup();
        let mut places: HashMap<usize, (usize, usize)> = HashMap::new();
        for (f, face) in self.faces.iter().enumerate() {
            for (k, made) in face.loops.iter().flatten().enumerate() {
                places.insert(made.edge, (f, k));
            }
        }
        let mut cuts = Cuts::new();
        for k in open {
            let edge = &self.edges[k];
            let Some(bounds) = BoundingBox::of(edge.curve.control_points().iter().copied()) else {
                continue;
            };
            let (min, max) = (bounds.min - tolerance, bounds.max + tolerance);
            let first = ends.partition_point(|(x, ..)| *x < min.x);
            for &(_, v, face) in ends[first..].iter().take_while(|(x, ..)| *x <= max.x) {
                let p = self.vertices[v];
                let inside = p.cmpge(min).all() && p.cmple(max).all();
                let apart = |end: usize| self.vertices[end].distance(p) > tolerance;
                let own = face == edge.uses[0].0;
                if own || !inside || !edge.vertices.iter().all(|end| apart(*end)) {
                    continue;
                }
                let nearest = edge.curve.point(edge.curve.closest_parameter(p));
                if nearest.distance(p) <= tolerance
                    && let Some(place) = places.get(&k)
                {
                    let points = cuts.entry(*place).or_default();
                    if !points.contains(&p) {
                        points.push(p);
                    }
                }
            }
        }
        cuts
    }

    /// Neighbours over shared edges: the other face, and whether it lies the other way round.
    fn neighbours(&self) -> Vec<Vec<(usize, bool)>> {
        let mut next = vec![Vec::new(); self.faces.len()];
        for edge in &self.edges {
            if let [(a, forward_a), (b, forward_b)] = edge.uses[..]
                && a != b
            {
                // Two faces that lie alike run along their edge in opposite directions.
                let against = forward_a == forward_b;
                next[a].push((b, against));
                next[b].push((a, against));
            }
        }
        next
    }

    /// Faces that must be turned over.
    fn turned(&self, parts: &[Part]) -> Vec<bool> {
        let next = self.neighbours();
        let mut side: Vec<Option<bool>> = vec![None; self.faces.len()];
        for first in 0..self.faces.len() {
            if side[first].is_some() {
                continue;
            }
            side[first] = Some(false);
            let (mut shell, mut queue) = (vec![first], VecDeque::from([first]));
            while let Some(face) = queue.pop_front() {
                let own = side[face] == Some(true);
                for &(other, against) in &next[face] {
                    if side[other].is_none() {
                        side[other] = Some(own != against);
                        shell.push(other);
                        queue.push_back(other);
                    }
                }
            }
            let sound = |edge: &SewnEdge| {
                let turned = |face: usize| side[face] == Some(true);
                match edge.uses[..] {
                    [(a, x), (b, y)] => (x != turned(a)) != (y != turned(b)),
                    _ => false,
                }
            };
            if self.shell_edges(&shell).all(|e| sound(&self.edges[e])) {
                let origin = self.vertices.first().copied().unwrap_or_default();
                let volume: f64 = shell
                    .iter()
                    .map(|&face| {
                        let (surface, trim) = &parts[face];
                        let volume = surface.cone_volume(trim.as_ref(), origin);
                        if side[face] == Some(true) { -volume } else { volume }
                    })
                    .sum();
                if volume < 0.0 {
                    shell.iter().for_each(|&face| side[face] = side[face].map(|turn| !turn));
                }
            }
        }
        side.into_iter().map(|turn| turn == Some(true)).collect()
    }

    /// The edges of some faces, each once or twice.
    fn shell_edges<'s>(&'s self, faces: &'s [usize]) -> impl Iterator<Item = usize> + 's {
        faces.iter().flat_map(|&f| self.faces[f].loops.iter().flatten()).map(|made| made.edge)
    }

    fn find_shells(&mut self) {
        let next = self.neighbours();
        let mut done = vec![false; self.faces.len()];
        for first in 0..self.faces.len() {
            if done[first] {
                continue;
            }
            done[first] = true;
            let (mut faces, mut queue) = (vec![first], VecDeque::from([first]));
            while let Some(face) = queue.pop_front() {
                for &(other, _) in &next[face] {
                    if !done[other] {
                        done[other] = true;
                        faces.push(other);
                        queue.push_back(other);
                    }
                }
            }
            faces.sort_unstable();
            let shut = |e: usize| matches!(self.edges[e].uses[..], [(_, a), (_, b)] if a != b);
            let is_closed = self.shell_edges(&faces).all(shut);
            self.shells.push(Shell { faces, is_closed });
        }
    }
}

/// A stated uncertainty: what counts as the same place.
pub(super) fn tolerance(surfaces: &[NamedSurface], share: f64) -> f64 {
    let points = surfaces.iter().flat_map(|s| s.surface.control_points());
    let size = BoundingBox::of(points.copied()).map_or(1.0, BoundingBox::diagonal);
    if size > 0.0 && size.is_finite() { size * share } else { share }
}
