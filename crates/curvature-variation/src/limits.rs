//! What is asked of single limit points and tangent planes, as combinations of control points.

use geom_core::{DVec3, PolyMesh, VertexId};
use subdiv_catmull_clark::{SubdivisionSurface, limit_frames};

use crate::constraints::Constraints;
use crate::freedom::Freedom;

/// A limit point that is pulled to a place: the energy gains `factor · |point − place|²`.
#[derive(Clone, Debug, PartialEq)]
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

/// A linear condition on the control points: `Σ weight · (direction · p) = target`.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Condition {
    pub(crate) weights: Vec<(u32, f64)>,
    pub(crate) direction: DVec3,
    pub(crate) target: f64,
}

/// The conditions of pinned limit points and tangent planes.
pub(crate) fn conditions(
    constraints: &Constraints,
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
) -> Vec<Condition> {
    if constraints.limit_points.is_empty() && constraints.tangent_planes.is_empty() {
        return Vec::new();
    }
    let frames = limit_frames(mesh, surface);
    let positions = mesh.positions();
    let mut out = Vec::new();
    for &(v, place) in &constraints.limit_points {
        if let Some(frame) = &frames[VertexId(v).index()] {
            let place = place.map_or_else(|| frame.point(positions), DVec3::from_array);
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let weights = frame.position.clone();
                out.push(Condition { weights, direction: axis, target: axis.dot(place) });
            }
        }
    }
    for &(v, normal) in &constraints.tangent_planes {
        if let Some(frame) = &frames[VertexId(v).index()] {
            let normal = normal.map_or_else(|| frame.normal(positions), DVec3::from_array);
            for tangent in &frame.tangents {
                let weights = tangent.clone();
                out.push(Condition { weights, direction: normal, target: 0.0 });
            }
        }
    }
    out
}

/// One linear condition on the unknowns, `row · y = target`, as a dense row.
#[derive(Clone, Debug)]
pub(crate) struct LinearRow {
    pub(crate) row: Vec<f64>,
    pub(crate) target: f64,
}

/// The conditions on the unknowns; those that no unknown feels are left out.
pub(crate) fn linear_rows(
    conditions: &[Condition],
    freedom: &Freedom,
    points: usize,
) -> Vec<LinearRow> {
    let mut rows = Vec::new();
    for Condition { weights, direction, target } in conditions {
        let mut gradient = vec![0.0; 3 * points];
        for &(v, w) in weights {
            for (c, d) in direction.to_array().into_iter().enumerate() {
                gradient[3 * v as usize + c] += w * d;
            }
        }
        let mut row = vec![0.0; freedom.len()];
        freedom.pull_back(&gradient, &mut row);
        // What the fixed part contributes: the functional at y = 0.
        let mut base = vec![0.0; 3 * points];
        freedom.expand(&vec![0.0; freedom.len()], &mut base);
        let offset: f64 = gradient.iter().zip(&base).map(|(g, x)| g * x).sum();
        if row.iter().any(|&w| w != 0.0) {
            rows.push(LinearRow { row, target: target - offset });
        }
    }
    rows
}
