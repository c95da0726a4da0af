//! Panels of a surface: sample points, normals, frames, and the seams between them.

use crate::error::Error;
use crate::layout::polygon::Corner;
use crate::layout::tiling::Layout;
use bspline::BsplineSurface;
use geom_core::{BoundingBox, SurfaceJet, principal_curvatures};
use glam::{DMat3, DVec3};
use rayon::prelude::*;
use std::collections::HashMap;
use std::sync::Arc;

/// Points at which a seam is measured, both ends included.
pub const SEAM_SAMPLES: usize = 5;

/// Where a panel or its mold stands: `world = rotation · local + origin`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Origin of the local frame.
    pub origin: DVec3,
    /// Columns are the local axes; the third points along the surface normal.
    pub rotation: DMat3,
}

impl Pose {
    /// Local coordinates of a point.
    #[must_use]
    pub fn to_local(&self, point: DVec3) -> DVec3 {
        self.rotation.transpose() * (point - self.origin)
    }

    /// The point with these local coordinates.
    #[must_use]
    pub fn to_world(&self, local: DVec3) -> DVec3 {
        self.rotation * local + self.origin
    }

    /// The frame turned half round about its normal.
    #[must_use]
    pub(crate) fn turned(&self) -> Self {
        let DMat3 { x_axis, y_axis, z_axis } = self.rotation;
        Self { origin: self.origin, rotation: DMat3::from_cols(-x_axis, -y_axis, z_axis) }
    }
}

/// A seam between two panels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seam {
    /// The two panels; the seam runs counterclockwise around the first.
    pub panels: [usize; 2],
    /// The edge of the design it lies on.
    pub(crate) edge: usize,
}

/// Points of the design with their unit normals.
#[derive(Clone, Debug, Default)]
pub(crate) struct Samples {
    pub(crate) points: Vec<DVec3>,
    pub(crate) normals: Vec<DVec3>,
}

/// The panels of a surface, ready to be fitted.
///
/// # Example
/// ```
/// use paneling::{Layout, PanelSet, Pattern};
/// let surface = fixtures::surfaces::Shape::Saddle.surface(8, 8, 4, 4);
/// let layout = Layout::generate(Pattern::Quad, 4, 3, [false, false])?;
/// let panels = PanelSet::new(&surface, &layout)?;
/// // Between four by three panels there are 3 · 3 + 4 · 2 seams.
/// assert_eq!((panels.len(), panels.seams().len()), (12, 17));
/// # Ok::<(), paneling::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct PanelSet {
    /// Samples of panel `p` are `starts[p]..starts[p + 1]`: along the border, halfway in, middle.
    pub(crate) samples: Samples,
    pub(crate) starts: Vec<usize>,
    /// How many of a panel's samples lie on its border.
    border_counts: Vec<usize>,
    /// Samples of edge `e` are `SEAM_SAMPLES * e..`.
    pub(crate) edges: Samples,
    pub(crate) seams: Vec<Seam>,
    /// Principal frames at the middles of the panels.
    pub(crate) frames: Vec<Pose>,
    /// Mean and Gaussian curvature at the middles of the panels.
    pub(crate) curvatures: Vec<[f64; 2]>,
    /// Typical distance of a sample from the middle of its panel, in model units.
    pub(crate) size: f64,
    /// Size of the design and diagonal of the bounding box of all samples, in model units.
    pub(crate) extent: f64,
    pub(crate) diagonal: f64,
    /// Places of the panels' middles in the domain.
    pub(crate) middles: Vec<[f64; 2]>,
    /// Corners of the panels in the domain.
    pub(crate) corners: Vec<Vec<[f64; 2]>>,
    /// The same panels at the origin, where they were cut, and where that is in the model.
    pub(crate) at_origin: Option<(Arc<PanelSet>, DVec3)>,
}

/// An edge of the layout, as its first panel sees it.
struct Edge {
    from: [f64; 2],
    to: [f64; 2],
    panels: [Option<usize>; 2],
}

impl PanelSet {
    /// Samples the panels of `layout` on `surface`.
    ///
    /// # Errors
    /// [`Error::Singular`] where the surface has no normal, [`Error::Creased`] where it has two,
    /// [`Error::Size`] for one without extent.
    pub fn new(surface: &BsplineSurface, layout: &Layout) -> Result<Self, Error> {
        let (centred, center) = Self::centred(surface, layout)?;
        Ok(centred.placed(center))
    }

    /// The panels back where they stand in the model.
    pub(crate) fn placed(self, center: DVec3) -> Self {
        let at_origin = Some((Arc::new(self.clone()), center));
        Self { at_origin, ..self.translated(center) }
    }

    /// The panels moved to the origin, and by what they have been moved away from.
    pub(crate) fn centred(
        surface: &BsplineSurface,
        layout: &Layout,
    ) -> Result<(Self, DVec3), Error> {
        if let Some(crease) = surface.sharpest_crease(None) {
            return Err(Error::Creased { crease });
        }
        let place = surface.normalization()?;
        let centred = Self::cut(&surface.translated(-place.center()), place.size(), layout)?;
        Ok((centred, place.center()))
    }

    /// The panels of a surface of the size `extent`.
    fn cut(surface: &BsplineSurface, extent: f64, layout: &Layout) -> Result<Self, Error> {
        let (edges, uses) = edges_of(layout.panels());
        let (start_u, end_u) = surface.knots_u().domain();
        let (start_v, end_v) = surface.knots_v().domain();
        let domain =
            |[s, t]: [f64; 2]| [start_u + s * (end_u - start_u), start_v + t * (end_v - start_v)];
        let lerp = |a: [f64; 2], b: [f64; 2], t: f64| [0, 1].map(|k| a[k] + t * (b[k] - a[k]));
        let along: Vec<[f64; 2]> = edges
            .iter()
            .flat_map(|e| {
                (0..SEAM_SAMPLES)
                    .map(|k| domain(lerp(e.from, e.to, k as f64 / (SEAM_SAMPLES - 1) as f64)))
            })
            .collect();
        let panel_of_edge = |k: usize| edges[k / SEAM_SAMPLES].panels[0].unwrap_or(0);
        let edge_samples = sample(surface, &along, panel_of_edge)?;
        // Inner samples: corners and middles of the edges drawn halfway to the middle.
        let mut inner = Vec::new();
        let mut inner_panel = Vec::new();
        let mut middles = Vec::with_capacity(layout.len());
        for (p, panel) in layout.panels().iter().enumerate() {
            let middle = centroid(panel);
            for (k, corner) in panel.iter().enumerate() {
                let next = panel[(k + 1) % panel.len()].uv;
                inner.push(domain(lerp(corner.uv, middle, 0.5)));
                inner.push(domain(lerp(lerp(corner.uv, next, 0.5), middle, 0.5)));
                inner_panel.extend([p, p]);
            }
            inner.push(domain(middle));
            inner_panel.push(p);
            middles.push(domain(middle));
        }
        let inner_samples = sample(surface, &inner, |k| inner_panel[k])?;
        let mut samples = Samples::default();
        let mut starts = vec![0];
        let mut border_counts = Vec::with_capacity(layout.len());
        let mut next_inner = 0;
        for (panel, uses) in layout.panels().iter().zip(&uses) {
            for &(edge, is_first) in uses {
                // Every edge without its last point, which is the next edge's first.
                for k in 0..SEAM_SAMPLES - 1 {
                    let k = if is_first { k } else { SEAM_SAMPLES - 1 - k };
                    samples.points.push(edge_samples.points[edge * SEAM_SAMPLES + k]);
                    samples.normals.push(edge_samples.normals[edge * SEAM_SAMPLES + k]);
                }
            }
            border_counts.push(panel.len() * (SEAM_SAMPLES - 1));
            let count = 2 * panel.len() + 1;
            let range = next_inner..next_inner + count;
            samples.points.extend_from_slice(&inner_samples.points[range.clone()]);
            samples.normals.extend_from_slice(&inner_samples.normals[range]);
            next_inner += count;
            starts.push(samples.points.len());
        }
        let (frames, curvatures) = frames_at(surface, &middles)?;
        let mut distances: Vec<f64> = (0..layout.len())
            .flat_map(|p| (starts[p]..starts[p + 1]).map(move |s| (p, s)))
            .map(|(p, s)| samples.points[s].distance(frames[p].origin))
            .collect();
        let middle = distances.len() / 2;
        let size = *distances.select_nth_unstable_by(middle, f64::total_cmp).1;
        let diagonal =
            BoundingBox::of(samples.points.iter().copied()).map_or(0.0, BoundingBox::diagonal);
        let seams = edges
            .iter()
            .enumerate()
            .filter_map(|(edge, e)| match e.panels {
                [Some(a), Some(b)] => Some(Seam { panels: [a, b], edge }),
                _ => None,
            })
            .collect();
        let corners =
            layout.panels().iter().map(|p| p.iter().map(|c| domain(c.uv)).collect()).collect();
        Ok(Self {
            samples,
            starts,
            border_counts,
            edges: edge_samples,
            seams,
            frames,
            curvatures,
            size,
            extent,
            diagonal,
            middles,
            corners,
            at_origin: None,
        })
    }

    /// The same panels with all lengths times `factor`.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        let mut scaled = self.clone();
        for p in scaled.samples.points.iter_mut().chain(&mut scaled.edges.points) {
            *p *= factor;
        }
        scaled.frames.iter_mut().for_each(|f| f.origin *= factor);
        for [h, k] in &mut scaled.curvatures {
            *h /= factor;
            *k /= factor * factor;
        }
        scaled.size *= factor;
        scaled.extent *= factor;
        scaled.diagonal *= factor;
        scaled
    }

    /// The same panels somewhere else.
    pub(crate) fn translated(mut self, by: DVec3) -> Self {
        self.samples.points.iter_mut().chain(&mut self.edges.points).for_each(|p| *p += by);
        self.frames.iter_mut().for_each(|f| f.origin += by);
        self
    }

    /// Number of panels.
    #[must_use]
    pub fn len(&self) -> usize {
        self.frames.len()
    }

    /// Whether there are no panels; never so.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.frames.is_empty()
    }

    /// The seams between panels.
    #[must_use]
    pub fn seams(&self) -> &[Seam] {
        &self.seams
    }

    /// Mean and Gaussian curvature at the middle of each panel, in 1/length and 1/length².
    #[must_use]
    pub fn curvatures(&self) -> &[[f64; 2]] {
        &self.curvatures
    }

    /// Diagonal of the bounding box of all samples.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.diagonal
    }

    /// Size of the design: diameter of the smallest ball around its check grid.
    #[must_use]
    pub fn extent(&self) -> f64 {
        self.extent
    }

    /// The middle of each panel in the domain of the surface.
    #[must_use]
    pub fn middles(&self) -> &[[f64; 2]] {
        &self.middles
    }

    /// Corners of a panel in the domain of the surface, counterclockwise; beyond the period in a
    /// panel that crosses the seam of a closed surface.
    #[must_use]
    pub fn corners(&self, panel: usize) -> &[[f64; 2]] {
        &self.corners[panel]
    }

    /// Points of the design along the border of a panel, counterclockwise.
    #[must_use]
    pub fn border(&self, panel: usize) -> &[DVec3] {
        let start = self.starts[panel];
        &self.samples.points[start..start + self.border_counts[panel]]
    }

    /// Area of the polygon through the samples of a panel's border, seen along the normal at its
    /// middle.
    #[must_use]
    pub fn area(&self, panel: usize) -> f64 {
        let border = self.border(panel);
        let middle = self.frames[panel].origin;
        let next = border.iter().cycle().skip(1);
        let sum = |(a, b): (&DVec3, &DVec3)| (*a - middle).cross(*b - middle);
        0.5 * border.iter().zip(next).map(sum).sum::<DVec3>().length()
    }

    /// Length and breadth of a panel: of the smallest rectangle around its border with a side along
    /// one of the chords of its sides, seen along the normal at its middle.
    #[must_use]
    pub fn breadths(&self, panel: usize) -> [f64; 2] {
        let border = self.border(panel);
        let Pose { origin, rotation } = &self.frames[panel];
        let flat: Vec<_> = border
            .iter()
            .map(|x| {
                let d = *x - *origin;
                [d.dot(rotation.x_axis), d.dot(rotation.y_axis)]
            })
            .collect();
        let per_side = SEAM_SAMPLES - 1;
        let rectangle = |side: usize| {
            let (a, b) = (flat[per_side * side], flat[per_side * (side + 1) % flat.len()]);
            let (x, y) = (b[0] - a[0], b[1] - a[1]);
            let length = x.hypot(y);
            let range = |of: &dyn Fn(&[f64; 2]) -> f64| {
                let values = flat.iter().map(of);
                let start = [f64::INFINITY, f64::NEG_INFINITY];
                let [low, high] = values.fold(start, |[l, h], v| [l.min(v), h.max(v)]);
                (high - low) / length
            };
            let along = range(&|p| p[0] * x + p[1] * y);
            let across = range(&|p| p[1] * x - p[0] * y);
            [along.max(across), along.min(across)]
        };
        let smaller = |a: [f64; 2], b: [f64; 2]| if b[0] * b[1] < a[0] * a[1] { b } else { a };
        (0..flat.len() / per_side).map(rectangle).reduce(smaller).unwrap_or([0.0; 2])
    }

    /// The points of the design a seam is measured at.
    #[must_use]
    pub fn seam_points(&self, seam: &Seam) -> &[DVec3] {
        &self.edges.points[seam.edge * SEAM_SAMPLES..(seam.edge + 1) * SEAM_SAMPLES]
    }

    /// For every panel the seams around it, and which of their two panels it is.
    pub(crate) fn incident_seams(&self) -> Vec<Vec<(usize, usize)>> {
        let mut incident = vec![Vec::new(); self.len()];
        for (s, seam) in self.seams.iter().enumerate() {
            for (side, &p) in seam.panels.iter().enumerate() {
                incident[p].push((s, side));
            }
        }
        incident
    }

    /// Points and normals of a panel's samples.
    pub(crate) fn panel_samples(&self, panel: usize) -> (&[DVec3], &[DVec3]) {
        let range = self.starts[panel]..self.starts[panel + 1];
        (&self.samples.points[range.clone()], &self.samples.normals[range])
    }

    /// Points and normals of the samples along an edge.
    pub(crate) fn edge_samples(&self, edge: usize) -> (&[DVec3], &[DVec3]) {
        let range = edge * SEAM_SAMPLES..(edge + 1) * SEAM_SAMPLES;
        (&self.edges.points[range.clone()], &self.edges.normals[range])
    }
}

fn centroid(panel: &[Corner]) -> [f64; 2] {
    let n = panel.len() as f64;
    [0, 1].map(|k| panel.iter().map(|c| c.uv[k]).sum::<f64>() / n)
}

/// Edges in the order in which panels first use them, and for every panel the edges around it
/// with the mark whether it is the edge's first panel.
fn edges_of(panels: &[Vec<Corner>]) -> (Vec<Edge>, Vec<Vec<(usize, bool)>>) {
    let mut by_vertices: HashMap<(usize, usize), usize> = HashMap::new();
    let mut edges: Vec<Edge> = Vec::new();
    let mut uses = Vec::with_capacity(panels.len());
    for (p, panel) in panels.iter().enumerate() {
        let around = (0..panel.len()).map(|k| {
            let (a, b) = (panel[k], panel[(k + 1) % panel.len()]);
            if let Some(&edge) = by_vertices.get(&(b.vertex, a.vertex)) {
                edges[edge].panels[1] = Some(p);
                (edge, false)
            } else {
                by_vertices.insert((a.vertex, b.vertex), edges.len());
                edges.push(Edge { from: a.uv, to: b.uv, panels: [Some(p), None] });
                (edges.len() - 1, true)
            }
        });
        let around = around.collect();
        uses.push(around);
    }
    (edges, uses)
}

fn sample(
    surface: &BsplineSurface,
    parameters: &[[f64; 2]],
    panel: impl Fn(usize) -> usize,
) -> Result<Samples, Error> {
    let jets = surface.jets(parameters, 1);
    let poles = surface.pole_sides(None);
    let mut samples = Samples::default();
    for (k, jet) in jets.iter().enumerate() {
        let singular =
            || Error::Singular { panel: panel(k), u: parameters[k][0], v: parameters[k][1] };
        // On a pole collapsed to rounding only the normal is noise.
        if surface.is_on_pole(&poles, parameters[k]) {
            return Err(singular());
        }
        let normal = jet.normal().map_err(|_| singular())?;
        samples.points.push(jet.position());
        samples.normals.push(normal);
    }
    Ok(samples)
}

type Frames = (Vec<Pose>, Vec<[f64; 2]>);

fn frames_at(surface: &BsplineSurface, middles: &[[f64; 2]]) -> Result<Frames, Error> {
    let jets = surface.jets(middles, 2);
    let frame = |jet: &SurfaceJet| {
        let (first, second) = (jet.first_form(), jet.second_form()?);
        let principal = principal_curvatures(first, second)?;
        let normal = jet.normal()?;
        let x = jet.tangent(principal.direction1);
        let rotation = DMat3::from_cols(x, normal.cross(x), normal);
        let pose = Pose { origin: jet.position(), rotation };
        let (k1, k2) = (principal.k1, principal.k2);
        Ok::<_, geom_core::CurvatureError>((pose, [0.5 * (k1 + k2), k1 * k2]))
    };
    let all: Vec<_> = jets.par_iter().map(frame).collect();
    let mut frames = Vec::with_capacity(all.len());
    let mut curvatures = Vec::with_capacity(all.len());
    for (panel, result) in all.into_iter().enumerate() {
        let [u, v] = middles[panel];
        let (pose, curvature) = result.map_err(|_| Error::Singular { panel, u, v })?;
        frames.push(pose);
        curvatures.push(curvature);
    }
    Ok((frames, curvatures))
}
