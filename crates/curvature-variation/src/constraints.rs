//! What stays where it is while a surface is faired.

use crate::freedom::Freedom;
use geom_core::{DVec3, PolyMesh, VertexId};
use serde::{Deserialize, Serialize};
use subdiv_catmull_clark::{Stencils, SubdivisionSurface, limit_frames};

/// Constraints of a fairing, by vertex numbers of the input mesh.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Constraints {
    /// Control vertices that do not move. On finer levels the vertex itself and all new vertices
    /// that depend on fixed ones alone stay fixed.
    pub vertices: Vec<u32>,
    /// Vertices whose limit points are pinned, each to a place or, with `None`, to where it is.
    pub limit_points: Vec<(u32, Option<[f64; 3]>)>,
    /// Vertices whose limit tangent planes are pinned, each by its normal or, with `None`, as it
    /// is.
    pub tangent_planes: Vec<(u32, Option<[f64; 3]>)>,
    /// Vertices whose limit points are pulled to where they are: the energy gains
    /// `weight · distance² / A`, `A` the area of the input, so that a weight means the same at any
    /// size of the model.
    pub weights: Vec<(u32, f64)>,
    /// Fixes the boundary and the two rings next to it on every level, which keeps position,
    /// tangents and curvatures along the boundary (Joshi 2008, sec. 8), and leaves the quads at
    /// the boundary out of the energy.
    pub clamp_boundary: bool,
}

impl Constraints {
    /// Whether nothing holds the surface in place.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Whether points or planes of the limit surface are asked for, exactly or by weights.
    pub(crate) fn concern_limits(&self) -> bool {
        !(self.limit_points.is_empty() && self.tangent_planes.is_empty() && self.weights.is_empty())
    }

    /// The largest vertex number used.
    pub(crate) fn largest_vertex(&self) -> Option<u32> {
        let lists = self.limit_points.iter().chain(&self.tangent_planes).map(|p| p.0);
        let weighted = self.weights.iter().map(|w| w.0);
        self.vertices.iter().copied().chain(lists).chain(weighted).max()
    }
}

/// The boundary and `rings` rings of vertices next to it.
pub(crate) fn boundary_band(mesh: &PolyMesh, rings: usize) -> Vec<bool> {
    let mut band: Vec<bool> = mesh.vertices().map(|v| mesh.is_boundary_vertex(v)).collect();
    for _ in 0..rings {
        let before = band.clone();
        for f in mesh.faces() {
            if mesh.face_vertices(f).any(|v| before[v.index()]) {
                mesh.face_vertices(f).for_each(|v| band[v.index()] = true);
            }
        }
    }
    band
}

/// The fixed vertices of a refined mesh.
pub(crate) fn refine_fixed(fixed: &[bool], stencils: &Stencils) -> Vec<bool> {
    (0..stencils.rows())
        .map(|i| {
            fixed.get(i).copied().unwrap_or(false)
                || stencils.row(i).0.iter().all(|&v| fixed[v as usize])
        })
        .collect()
}

/// A limit point that is pulled to a place: the energy gains `factor · |point − place|²`.
#[derive(Clone, Debug)]
pub(crate) struct Pull {
    /// The limit point as a combination of control points.
    pub(crate) stencil: Vec<(u32, f64)>,
    pub(crate) place: DVec3,
    pub(crate) factor: f64,
}

impl Pull {
    fn offset(&self, x: &[f64]) -> DVec3 {
        let point = |v: u32| DVec3::from_slice(&x[3 * v as usize..]);
        self.stencil.iter().map(|&(v, w)| w * point(v)).sum::<DVec3>() - self.place
    }

    /// The energy gained at control points `x`.
    pub(crate) fn energy(&self, x: &[f64]) -> f64 {
        self.factor * self.offset(x).length_squared()
    }

    /// The same; adds its gradient.
    pub(crate) fn add_gradient(&self, x: &[f64], gradient: &mut [f64]) -> f64 {
        let offset = self.offset(x);
        for &(v, w) in &self.stencil {
            for (c, d) in offset.to_array().into_iter().enumerate() {
                gradient[3 * v as usize + c] += 2.0 * self.factor * w * d;
            }
        }
        self.factor * offset.length_squared()
    }
}

/// Places and weights of the pulled limit points of the input surface.
pub(crate) fn pulled_places(
    constraints: &Constraints,
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
    area: f64,
) -> Vec<(u32, DVec3, f64)> {
    if constraints.weights.is_empty() {
        return Vec::new();
    }
    let frames = limit_frames(mesh, surface);
    let pulled = |&(v, weight): &(u32, f64)| {
        let frame = frames[VertexId(v).index()].as_ref()?;
        Some((v, frame.point(mesh.positions()), weight / area))
    };
    constraints.weights.iter().filter_map(pulled).collect()
}

/// The pulls on one level; vertices keep their numbers when a mesh is refined.
pub(crate) fn pulls(
    places: &[(u32, DVec3, f64)],
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
) -> Vec<Pull> {
    if places.is_empty() {
        return Vec::new();
    }
    let frames = limit_frames(mesh, surface);
    let pull = |&(v, place, factor): &(u32, DVec3, f64)| {
        let stencil = frames[VertexId(v).index()].as_ref()?.position.clone();
        Some(Pull { stencil, place, factor })
    };
    places.iter().filter_map(pull).collect()
}

/// One linear condition on the unknowns, `row · y = target`, as a dense row.
#[derive(Clone, Debug)]
pub(crate) struct LinearRow {
    pub(crate) row: Vec<f64>,
    pub(crate) target: f64,
}

/// The conditions of pinned limit points and tangent planes.
pub(crate) fn linear_rows(
    constraints: &Constraints,
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
    freedom: &Freedom,
) -> Vec<LinearRow> {
    if constraints.limit_points.is_empty() && constraints.tangent_planes.is_empty() {
        return Vec::new();
    }
    let frames = limit_frames(mesh, surface);
    let positions = mesh.positions();
    let mut rows = Vec::new();
    // A functional of the control points along one direction, as a row on the unknowns.
    let mut push = |weights: &[(u32, f64)], direction: DVec3, target: f64| {
        let mut gradient = vec![0.0; 3 * positions.len()];
        for &(v, w) in weights {
            for (c, d) in direction.to_array().into_iter().enumerate() {
                gradient[3 * v as usize + c] += w * d;
            }
        }
        let mut row = vec![0.0; freedom.len()];
        freedom.pull_back(&gradient, &mut row);
        // What the fixed part contributes: the functional at y = 0.
        let mut base = vec![0.0; 3 * positions.len()];
        freedom.expand(&vec![0.0; freedom.len()], &mut base);
        let offset: f64 = gradient.iter().zip(&base).map(|(g, x)| g * x).sum();
        if row.iter().any(|&w| w != 0.0) {
            rows.push(LinearRow { row, target: target - offset });
        }
    };
    for &(v, place) in &constraints.limit_points {
        if let Some(frame) = &frames[VertexId(v).index()] {
            let place = place.map_or_else(|| frame.point(positions), DVec3::from_array);
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                push(&frame.position, axis, axis.dot(place));
            }
        }
    }
    for &(v, normal) in &constraints.tangent_planes {
        if let Some(frame) = &frames[VertexId(v).index()] {
            let normal = normal.map_or_else(|| frame.normal(positions), DVec3::from_array);
            for tangent in &frame.tangents {
                push(tangent, normal, 0.0);
            }
        }
    }
    rows
}
