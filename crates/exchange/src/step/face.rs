//! Faces: a surface, loops of edges, a name, a colour.

use super::border::{Borders, Side, is_near_point};
use super::curve::Curve;
use super::file::StepFile;
use super::parse::{Cursor, Instance};
use super::surface::{Lost, Shape};
use super::units::Context;
use crate::error::ReadError;
use bspline::{BsplineCurve, BsplineSurface, Carrier, FaceEdge, Trim};
use geom_core::{BoundingBox, DVec3};
use std::collections::HashMap;
use std::rc::Rc;

/// Two points are the same within this share of the size of a face, where the file says nothing.
const SAME_POINT: f64 = 1e-9;
/// No file is so inexact that points this share of the size of a face apart are the same.
const MOST_INEXACT: f64 = 1e-4;
/// A loop around a whole surface has no more edges than this.
const MOST_EDGES: usize = 4;

/// A face in the coordinates of its representation.
#[derive(Clone)]
pub(super) struct Face {
    pub(super) name: String,
    pub(super) surface: BsplineSurface,
    pub(super) trim: Option<Trim>,
}

/// What is read of a face before its loops are fitted to its surface.
pub(super) struct FaceText {
    pub(super) name: String,
    pub(super) surface: u64,
    pub(super) forward: bool,
    bounds: Vec<u64>,
}

impl FaceText {
    /// Whether the file gives the face no border at all.
    pub(super) fn is_boundless(&self) -> bool {
        self.bounds.is_empty()
    }
}

/// Curves and surfaces that several faces use.
#[derive(Default)]
pub(super) struct Shared {
    edges: HashMap<u64, Option<Rc<Edge>>>,
    shapes: HashMap<u64, Option<Rc<(String, Shape)>>>,
}

/// An edge from its first to its second vertex.
struct Edge {
    curve: BsplineCurve,
    /// Curves in the parameter planes of surfaces, by the number of the surface.
    parameters: Vec<(u64, BsplineCurve)>,
}

impl<'a> StepFile<'a> {
    /// The head of a face; `None` if the instance is none.
    pub(super) fn face_text(&self, instance: Instance) -> Result<Option<FaceText>, ReadError> {
        let keyword = self.index.keyword(instance);
        if !matches!(keyword, b"ADVANCED_FACE" | b"FACE_SURFACE") {
            return Ok(None);
        }
        let body = self.index.at(instance);
        let Some(mut cursor) = body.record(&String::from_utf8_lossy(keyword)) else {
            return Ok(None);
        };
        let name = cursor.string()?;
        cursor.comma()?;
        let bounds = cursor.reference_list()?;
        cursor.comma()?;
        let surface = cursor.reference()?;
        cursor.comma()?;
        let forward = cursor.is_true()?;
        self.index.open(surface, &body)?;
        Ok(Some(FaceText { name, surface, forward, bounds }))
    }

    /// The surface of a face or of its own; `None` if it is of a kind that is not read.
    pub(super) fn shared_shape(
        &self,
        id: u64,
        from: &Cursor<'a>,
        context: &Context,
        shared: &mut Shared,
    ) -> Result<Option<Rc<(String, Shape)>>, ReadError> {
        if let Some(found) = shared.shapes.get(&id) {
            return Ok(found.clone());
        }
        let found = self.shape(id, from, context)?.map(Rc::new);
        shared.shapes.insert(id, found.clone());
        Ok(found)
    }

    /// A face with its loops fitted to its surface, its normal that of the face.
    pub(super) fn face(
        &self,
        text: &FaceText,
        shape: &Shape,
        from: &Cursor<'a>,
        context: &Context,
        shared: &mut Shared,
    ) -> Result<Face, Lost> {
        let mut loops = self.loops(text, from, context, shared)?;
        if !shape.keeps_parameters() {
            loops.iter_mut().flatten().for_each(|edge| edge.parameters.clear());
        }
        let points = loops.iter().flatten().flat_map(|e| e.curve.control_points().iter().copied());
        let around: Vec<DVec3> = points.collect();
        let carrier = shape.realise(&around)?;
        let size = match (&carrier, BoundingBox::of(around)) {
            (_, Some(bounds)) => bounds.diagonal(),
            (Carrier::Spline(surface), None) => {
                let points = surface.control_points().iter().copied();
                BoundingBox::of(points).map_or(1.0, BoundingBox::diagonal)
            }
            (Carrier::Elementary(_), None) => 1.0,
        };
        let tolerance = context.uncertainty.unwrap_or(0.0).min(MOST_INEXACT * size);
        let tolerance = tolerance.max(SAME_POINT * size);
        let (surface, trim) = match carrier {
            Carrier::Spline(surface) if covers(&surface, &loops, tolerance) => (surface, None),
            carrier => {
                let face = carrier.face(&loops, tolerance);
                let face = face.map_err(|error| Lost::Cannot(error.to_string()))?;
                (face.surface, face.trim)
            }
        };
        let name = text.name.clone();
        Ok(if text.forward {
            Face { name, surface, trim }
        } else {
            Face { name, surface: surface.swapped(), trim: trim.map(|t| t.swapped()) }
        })
    }

    /// The loops with the face to their left when seen against the normal of the surface.
    fn loops(
        &self,
        text: &FaceText,
        from: &Cursor<'a>,
        context: &Context,
        shared: &mut Shared,
    ) -> Result<Vec<Vec<FaceEdge>>, ReadError> {
        let mut loops = Vec::with_capacity(text.bounds.len());
        for bound in &text.bounds {
            let bound = self.index.open(*bound, from)?;
            let Some(mut cursor) = bound.record("FACE_OUTER_BOUND").or(bound.record("FACE_BOUND"))
            else {
                return Err(bound.error("expected a FACE_BOUND", "export the file again"));
            };
            cursor.skip_arguments(1)?;
            let id = cursor.reference()?;
            cursor.comma()?;
            let forward = cursor.is_true()? == text.forward;
            let mut edges = self.loop_edges(id, &bound, text.surface, context, shared)?;
            if !forward {
                edges.reverse();
                edges.iter_mut().for_each(reverse);
            }
            loops.push(edges);
        }
        Ok(loops)
    }

    fn loop_edges(
        &self,
        id: u64,
        from: &Cursor<'a>,
        surface: u64,
        context: &Context,
        shared: &mut Shared,
    ) -> Result<Vec<FaceEdge>, ReadError> {
        let body = self.index.open(id, from)?;
        let mut edges = Vec::new();
        if let Some(mut cursor) = body.record("POLY_LOOP") {
            cursor.skip_arguments(1)?;
            let ids = cursor.reference_list()?;
            let points: Vec<DVec3> =
                ids.iter().map(|id| self.point(*id, &body)).collect::<Result<_, _>>()?;
            for (k, a) in points.iter().enumerate() {
                let b = points[(k + 1) % points.len()];
                if let Ok(curve) = BsplineCurve::segment(*a, b, 0.0, 1.0) {
                    edges.push(FaceEdge { curve, parameters: Vec::new() });
                }
            }
            return Ok(edges);
        }
        // A VERTEX_LOOP and what is unknown bound nothing.
        let Some(mut cursor) = body.record("EDGE_LOOP") else { return Ok(edges) };
        cursor.skip_arguments(1)?;
        for id in cursor.reference_list()? {
            let mut oriented = self.record(id, "ORIENTED_EDGE", &body)?;
            oriented.skip_arguments(3)?;
            let edge = oriented.reference()?;
            oriented.comma()?;
            let forward = oriented.is_true()?;
            let Some(edge) = self.shared_edge(edge, &body, context, shared)? else { continue };
            let parameters = edge.parameters.iter().filter(|(id, _)| *id == surface);
            let mut edge = FaceEdge {
                curve: edge.curve.clone(),
                parameters: parameters.map(|(_, curve)| curve.clone()).collect(),
            };
            if !forward {
                reverse(&mut edge);
            }
            edges.push(edge);
        }
        Ok(edges)
    }

    fn shared_edge(
        &self,
        id: u64,
        from: &Cursor<'a>,
        context: &Context,
        shared: &mut Shared,
    ) -> Result<Option<Rc<Edge>>, ReadError> {
        if let Some(found) = shared.edges.get(&id) {
            return Ok(found.clone());
        }
        let found = self.edge(id, from, context)?.map(Rc::new);
        shared.edges.insert(id, found.clone());
        Ok(found)
    }

    /// An edge as a spline; `None` if it has no length.
    fn edge(
        &self,
        id: u64,
        from: &Cursor<'a>,
        context: &Context,
    ) -> Result<Option<Edge>, ReadError> {
        let mut cursor = self.record(id, "EDGE_CURVE", from)?;
        let body = cursor.clone();
        cursor.skip_arguments(1)?;
        let mut vertices = [DVec3::ZERO; 2];
        for vertex in &mut vertices {
            let mut point = self.record(cursor.reference()?, "VERTEX_POINT", &body)?;
            point.skip_arguments(1)?;
            *vertex = self.point(point.reference()?, &body)?;
            cursor.comma()?;
        }
        let geometry = cursor.reference()?;
        cursor.comma()?;
        let forward = cursor.is_true()?;
        let Some(curve) = self.curve(geometry, &body, context)? else {
            let keyword = String::from_utf8_lossy(self.keyword(geometry)).into_owned();
            let what =
                format!("the edge lies on a curve of the kind {}", crate::error::clip(&keyword));
            return Err(body.error(what, "export the curves as splines"));
        };
        let [start, end] = vertices;
        let [from, to] = if forward { [start, end] } else { [end, start] };
        let size = match &curve {
            Curve::Spline(curve) => {
                let points = curve.control_points().iter().copied();
                BoundingBox::of(points).map_or(0.0, BoundingBox::diagonal)
            }
            Curve::Ellipse { radii, .. } => radii[0].max(radii[1]),
            _ => start.distance(end),
        };
        let tolerance = context.uncertainty.unwrap_or(0.0).min(MOST_INEXACT * size);
        let tolerance = tolerance.max(SAME_POINT * size);
        let endless = curve.is_endless();
        if endless && start == end {
            return Ok(None);
        }
        let made = match curve.between(from, to, tolerance) {
            Ok(made) => made,
            // Numbers beyond the range of the format; the loop will have a gap.
            Err(_) => return Ok(None),
        };
        let made = if forward { made } else { made.reversed() };
        let mut parameters = Vec::new();
        for (surface, curve) in self.parameter_curves(geometry, &body)? {
            parameters.push((surface, if forward { curve } else { curve.reversed() }));
        }
        Ok(Some(Edge { curve: made, parameters }))
    }

    /// The splines in parameter planes that belong to a curve on surfaces.
    fn parameter_curves(
        &self,
        id: u64,
        from: &Cursor<'a>,
    ) -> Result<Vec<(u64, BsplineCurve)>, ReadError> {
        let mut found = Vec::new();
        let keyword = self.keyword(id);
        if !matches!(keyword, b"SURFACE_CURVE" | b"SEAM_CURVE" | b"INTERSECTION_CURVE") {
            return Ok(found);
        }
        let mut cursor = self.record(id, &String::from_utf8_lossy(keyword), from)?;
        cursor.skip_arguments(2)?;
        for id in cursor.reference_list()? {
            if self.keyword(id) != b"PCURVE" {
                continue;
            }
            let mut cursor = self.record(id, "PCURVE", from)?;
            cursor.skip_arguments(1)?;
            let surface = cursor.reference()?;
            cursor.comma()?;
            let definition = cursor.reference()?;
            if self.keyword(definition) != b"DEFINITIONAL_REPRESENTATION" {
                continue;
            }
            let mut cursor = self.record(definition, "DEFINITIONAL_REPRESENTATION", from)?;
            cursor.skip_arguments(1)?;
            let Some(curve) = cursor.reference_list()?.first().and_then(|id| self.instance(*id))
            else {
                continue;
            };
            if let Some(curve) = self.spline_curve(curve, 2)?
                && let Ok(curve) = curve.clamped()
            {
                found.push((surface, curve));
            }
        }
        Ok(found)
    }
}

fn reverse(edge: &mut FaceEdge) {
    edge.curve = edge.curve.reversed();
    for curve in &mut edge.parameters {
        *curve = curve.reversed();
    }
}

/// Whether the only loop runs along the borders of a surface, by its control points: the quick
/// way out for files that hold whole surfaces.
fn covers(surface: &BsplineSurface, loops: &[Vec<FaceEdge>], close: f64) -> bool {
    let edges = match loops {
        [] => return true,
        [edges] if edges.len() <= MOST_EDGES => edges,
        _ => return false,
    };
    let Ok(borders) = Borders::of(surface, close) else { return false };
    let borders = [Side::UStart, Side::UEnd, Side::VStart, Side::VEnd].map(|s| borders.side(s));
    let mut covered = borders.map(|border| is_near_point(border, close));
    for edge in edges {
        let mut matched = false;
        for (border, covered) in borders.iter().zip(&mut covered) {
            if runs_along(edge.curve.control_points(), border.control_points(), close) {
                *covered = true;
                matched = true;
            }
        }
        if !matched {
            return false;
        }
    }
    covered.iter().all(|c| *c)
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
