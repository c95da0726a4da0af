//! Faces: the names they give to surfaces, and whether they are trimmed.

use super::border::{Border, Side};
use super::file::{StepFile, counted};
use super::parse::{Cursor, Instance};
use crate::error::ReadError;
use bspline::BsplineSurface;
use geom_core::{BoundingBox, DVec3};
use std::cell::Cell;
use std::collections::hash_map::Entry;
use std::collections::{BTreeMap, HashMap};

/// Two points of an edge and a border are the same within this share of the bounding box.
const SAME_POINT: f64 = 1e-9;
/// A loop around a whole surface has no more edges than this.
const MOST_EDGES: usize = 4;

struct Face {
    instance: Instance,
    name: String,
}

/// What the faces of a file say about its surfaces.
pub(super) struct Faces {
    /// The first face on each surface.
    by_surface: HashMap<u64, Face>,
    reversed: usize,
    trimmed: Cell<usize>,
    shared: usize,
}

impl Faces {
    pub(super) fn of(file: &StepFile<'_>) -> Result<Self, ReadError> {
        let mut faces =
            Self { by_surface: HashMap::new(), reversed: 0, trimmed: Cell::new(0), shared: 0 };
        for instance in file.index.in_file_order() {
            let keyword = file.index.keyword(instance);
            if !matches!(keyword, b"ADVANCED_FACE" | b"FACE_SURFACE") {
                continue;
            }
            let body = file.index.at(instance);
            let Some(mut cursor) = body.record(&String::from_utf8_lossy(keyword)) else { continue };
            let name = cursor.string()?;
            cursor.comma()?;
            cursor.skip_value()?;
            cursor.comma()?;
            let surface = cursor.reference()?;
            cursor.comma()?;
            let forward = cursor.is_true()?;
            file.index.open(surface, &body)?;
            faces.reversed += usize::from(!forward);
            match faces.by_surface.entry(surface) {
                Entry::Occupied(_) => faces.shared += 1,
                Entry::Vacant(vacant) => {
                    vacant.insert(Face { instance, name });
                }
            }
        }
        Ok(faces)
    }

    pub(super) fn name(&self, surface: u64) -> Option<String> {
        self.by_surface.get(&surface).map(|face| face.name.clone())
    }

    /// Counts the face of this surface if it covers less than the surface.
    pub(super) fn check(
        &self,
        file: &StepFile<'_>,
        instance: Instance,
        surface: &BsplineSurface,
    ) -> Result<(), ReadError> {
        if let Some(face) = self.by_surface.get(&instance.id)
            && !covers(file, face.instance, surface)?
        {
            self.trimmed.set(self.trimmed.get() + 1);
        }
        Ok(())
    }

    /// Faces on surfaces of other kinds, such as `2 PLANE`.
    pub(super) fn other_kinds(&self, file: &StepFile<'_>) -> String {
        let mut kinds: BTreeMap<String, usize> = BTreeMap::new();
        for surface in self.by_surface.keys() {
            let Some(k) = file.index.position(*surface) else { continue };
            let instance = file.index.by_id()[k];
            let body = file.index.at(instance);
            let spline = [
                "B_SPLINE_SURFACE_WITH_KNOTS",
                "B_SPLINE_SURFACE",
                "BEZIER_SURFACE",
                "UNIFORM_SURFACE",
                "QUASI_UNIFORM_SURFACE",
            ];
            if !spline.iter().any(|kind| body.record(kind).is_some()) {
                let keyword = String::from_utf8_lossy(file.index.keyword(instance)).into_owned();
                let known = keyword.len() <= 40 && keyword != "(";
                *kinds.entry(if known { keyword } else { "other".into() }).or_default() += 1;
            }
        }
        counted(&kinds)
    }

    pub(super) fn report(&self, file: &StepFile<'_>, warnings: &mut Vec<String>) {
        let trimmed = self.trimmed.get();
        if trimmed > 0 {
            warnings.push(format!(
                "{trimmed} faces are trimmed; the trims are ignored and the whole surfaces taken"
            ));
        }
        if self.shared > 0 {
            warnings.push(format!(
                "{} faces share the surface of another face; each surface is taken once",
                self.shared
            ));
        }
        if self.reversed > 0 {
            warnings.push(format!(
                "{} faces are turned over; the normals of their surfaces are kept",
                self.reversed
            ));
        }
        let others = self.other_kinds(file);
        if !others.is_empty() {
            warnings.push(format!("faces on other kinds of surfaces are left out: {others}"));
        }
        let placed = ["MAPPED_ITEM", "ITEM_DEFINED_TRANSFORMATION"];
        let is_placed = |i: &&Instance| {
            let keyword = file.index.keyword(**i);
            placed.iter().any(|p| p.as_bytes() == keyword)
        };
        let count = file.index.by_id().iter().filter(is_placed).count();
        if count > 0 {
            warnings.push(format!(
                "{count} placements of parts in assemblies are ignored; surfaces stay in their own \
                 coordinates"
            ));
        }
    }
}

/// Whether the only loop of a face runs along the borders of its surface.
fn covers(
    file: &StepFile<'_>,
    face: Instance,
    surface: &BsplineSurface,
) -> Result<bool, ReadError> {
    let body = file.index.at(face);
    let keyword = file.index.keyword(face);
    let Some(mut cursor) = body.record(&String::from_utf8_lossy(keyword)) else { return Ok(false) };
    cursor.skip_value()?;
    cursor.comma()?;
    let Some(bounds) = few_references(&mut cursor, 1)? else { return Ok(false) };
    let [bound] = bounds[..] else { return Ok(bounds.is_empty()) };
    let bound = file.index.open(bound, &body)?;
    let Some(mut cursor) = bound.record("FACE_OUTER_BOUND").or(bound.record("FACE_BOUND")) else {
        return Ok(false);
    };
    cursor.skip_value()?;
    cursor.comma()?;
    let edge_loop = file.index.open(cursor.reference()?, &bound)?;
    let Some(mut cursor) = edge_loop.record("EDGE_LOOP") else { return Ok(false) };
    cursor.skip_value()?;
    cursor.comma()?;
    let Some(edges) = few_references(&mut cursor, MOST_EDGES)? else { return Ok(false) };
    let sides = [Side::UStart, Side::UEnd, Side::VStart, Side::VEnd];
    let borders = sides.map(|side| Border::of(surface, side));
    let size = BoundingBox::of(surface.control_points().iter().copied());
    let close = SAME_POINT * size.map_or(0.0, BoundingBox::diagonal);
    let mut covered = borders.each_ref().map(Border::is_collapsed);
    for edge in edges {
        let Some(curve) = edge_points(file, edge, &edge_loop, surface)? else { return Ok(false) };
        let mut matched = false;
        for (border, covered) in borders.iter().zip(&mut covered) {
            if runs_along(&curve, &border.points, close) {
                *covered = true;
                matched = true;
            }
        }
        if !matched {
            return Ok(false);
        }
    }
    Ok(covered.iter().all(|c| *c))
}

/// A list of references, or `None` if it is longer than `most`.
fn few_references(cursor: &mut Cursor<'_>, most: usize) -> Result<Option<Vec<u64>>, ReadError> {
    let (mut ids, mut more) = (Vec::new(), false);
    cursor.list(|c| {
        let id = c.reference()?;
        if ids.len() < most {
            ids.push(id);
        } else {
            more = true;
        }
        Ok(())
    })?;
    Ok((!more).then_some(ids))
}

/// The control points of an edge (its ends if it is a straight line), or `None` if the edge is no
/// spline or has more control points than the surface.
fn edge_points(
    file: &StepFile<'_>,
    edge: u64,
    from: &Cursor<'_>,
    surface: &BsplineSurface,
) -> Result<Option<Vec<DVec3>>, ReadError> {
    let open = |id: u64| file.index.position(id).map(|k| file.index.at(file.index.by_id()[k]));
    let Some(oriented) = open(edge) else {
        return Err(from.error(format!("#{edge} is defined nowhere"), "export the file again"));
    };
    let Some(mut cursor) = oriented.record("ORIENTED_EDGE") else { return Ok(None) };
    for _ in 0..3 {
        cursor.skip_value()?;
        cursor.comma()?;
    }
    let Some(edge) = open(cursor.reference()?) else { return Ok(None) };
    let Some(mut cursor) = edge.record("EDGE_CURVE") else { return Ok(None) };
    cursor.skip_value()?;
    cursor.comma()?;
    let start = cursor.reference()?;
    cursor.comma()?;
    let end = cursor.reference()?;
    cursor.comma()?;
    let Some(mut curve) = open(cursor.reference()?) else { return Ok(None) };
    if let Some(mut cursor) = curve.record("SURFACE_CURVE").or(curve.record("SEAM_CURVE")) {
        cursor.skip_value()?;
        cursor.comma()?;
        let Some(spatial) = open(cursor.reference()?) else { return Ok(None) };
        curve = spatial;
    }
    if curve.record("LINE").is_some() {
        let vertex = |id: u64| -> Result<Option<DVec3>, ReadError> {
            let Some(mut cursor) = open(id).and_then(|c| c.record("VERTEX_POINT")) else {
                return Ok(None);
            };
            cursor.skip_value()?;
            cursor.comma()?;
            let here = cursor.clone();
            file.point(cursor.reference()?, &here).map(Some)
        };
        return Ok(vertex(start)?.zip(vertex(end)?).map(|(a, b)| vec![a, b]));
    }
    let simple = curve.record("B_SPLINE_CURVE_WITH_KNOTS").or(curve.record("BEZIER_CURVE"));
    let cursor = match curve.record("B_SPLINE_CURVE") {
        Some(cursor) => Some(cursor),
        None => match simple {
            Some(mut cursor) => {
                cursor.skip_value()?;
                cursor.comma()?;
                Some(cursor)
            }
            None => None,
        },
    };
    let Some(mut cursor) = cursor else { return Ok(None) };
    cursor.skip_value()?;
    cursor.comma()?;
    let here = cursor.clone();
    let most = surface.control_points().len() + 2 * bspline::Degree::MAX;
    let Some(ids) = few_references(&mut cursor, most)? else { return Ok(None) };
    let points: Result<Vec<DVec3>, _> = ids.iter().map(|id| file.point(*id, &here)).collect();
    points.map(Some)
}

/// Whether a curve has the control points of a border, forwards or backwards, those of a periodic
/// one repeated; a straight line needs only its ends.
fn runs_along(curve: &[DVec3], border: &[DVec3], close: f64) -> bool {
    let same = |a: DVec3, b: DVec3| a.distance(b) <= close;
    let n = border.len();
    if let [a, b] = *curve
        && n > 2
    {
        let (first, last) = (border[0], border[n - 1]);
        let ends = (same(a, first) && same(b, last)) || (same(a, last) && same(b, first));
        let along = (last - first).normalize_or_zero();
        let straight = |p: &DVec3| (*p - first).reject_from_normalized(along).length() <= close;
        return ends && along != DVec3::ZERO && border.iter().all(straight);
    }
    let forward = curve.iter().enumerate().all(|(k, p)| same(*p, border[k % n]));
    let backward = curve.iter().rev().enumerate().all(|(k, p)| same(*p, border[k % n]));
    curve.len() >= n && (forward || backward)
}
