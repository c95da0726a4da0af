//! A subdivision surface as B-spline surfaces, for CAD.

use bspline::{
    BsplineSurface, Degree, FitError, KnotError, KnotVector, SplineError, fit_curve, fit_surface,
};
use geom_core::{DVec3, FaceId, Normalization, PolyMesh};
use rayon::prelude::*;
use std::collections::BTreeMap;
use subdiv_catmull_clark::{BasisId, JetWeights, SubdivisionSurface};

const DEGREE: usize = 3;
/// The knots of a fitted spline halve their distance to a corner that may be extraordinary this
/// often: the surface is smooth there, but its parametrisation behaves like a power of the
/// distance.
const OCTAVES: i32 = 8;
/// Spans between a knot and the one at half its distance.
const SPANS_PER_OCTAVE: u32 = 4;
/// Spans of a fitted spline of a patch that is smooth everywhere.
const SMOOTH_SPANS: usize = 8;
/// Parameters per control point and direction at which the distance to the surface is taken.
const CHECKS: usize = 2;

/// One spline surface per face of the control mesh, see [`spline_patches`].
#[derive(Clone, Debug)]
pub struct SplinePatches {
    /// The surfaces with their faces, in the order of the faces.
    pub surfaces: Vec<(FaceId, BsplineSurface)>,
    /// How many of them are fitted; the others are exact.
    pub fitted: usize,
    /// Largest distance of a fitted surface from the true one at the same parameters, over a grid
    /// of twice as many points as there are control points in each direction.
    pub max_deviation: f64,
}

/// Why there are no splines for a surface.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages are those of the sources")]
pub enum SplinePatchError {
    #[error(transparent)]
    Knots(#[from] KnotError),
    #[error(transparent)]
    Spline(#[from] SplineError),
    #[error("a patch cannot be turned into a spline: {0}")]
    Fit(#[from] FitError),
}

/// Turns every patch into a spline surface over the unit square.
///
/// Bi-cubic patches are given exactly, as Bézier patches. A patch at an extraordinary vertex or a
/// semi-sharp crease is no polynomial; it becomes a bi-cubic spline through the points at the
/// Greville parameters of knots that crowd together towards the vertex, four spans to an octave.
/// The other patches of a blend of several rings are smooth, and eight equal spans do. Two
/// neighbours interpolate the same points of their common edge with the same knots, but for those of
/// a patch at the vertex which it shares with a smooth one: there it takes over the other's edge,
/// whose knots are among its own. The outer edges of a blend are cubic, which interpolation
/// reproduces; so there are no gaps between the surfaces.
///
/// # Errors
/// [`SplinePatchError`] if a control point is not finite.
pub fn spline_patches(
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
) -> Result<SplinePatches, SplinePatchError> {
    let degree = Degree::new(DEGREE)?;
    let bezier_knots = KnotVector::clamped_uniform(degree, 4)?;
    let mut rules: BTreeMap<BasisId, FittedRule> = BTreeMap::new();
    for patch in surface.patches() {
        if surface.b_spline_grid(patch.basis).is_none() && !rules.contains_key(&patch.basis) {
            rules.insert(patch.basis, FittedRule::new(surface, patch.basis)?);
        }
    }
    // Far from the origin fits and distances would lose digits.
    let origin = Normalization::of(mesh.positions()).map_or(DVec3::ZERO, |place| place.center());
    let positions: Vec<DVec3> = mesh.positions().iter().map(|&p| p - origin).collect();
    let controls = surface.control_points(&positions);
    let patches: Vec<(FaceId, BsplineSurface, Option<f64>)> = surface
        .patches()
        .par_iter()
        .map(|patch| {
            if let Some(points) = surface.bezier(&positions, patch) {
                let points = points.into_iter().flatten().collect();
                let knots = bezier_knots.clone();
                let exact = BsplineSurface::new(knots.clone(), knots, points, None)?;
                return Ok((patch.face, exact, None));
            }
            let control = |k: usize| controls[patch.controls[k] as usize];
            let (fitted, deviation) = rules[&patch.basis].fit(&control)?;
            Ok((patch.face, fitted, Some(deviation)))
        })
        .collect::<Result<_, SplinePatchError>>()?;
    let deviations = patches.iter().filter_map(|p| p.2);
    Ok(SplinePatches {
        fitted: deviations.clone().count(),
        max_deviation: deviations.fold(0.0, f64::max),
        surfaces: patches.into_iter().map(|p| (p.0, p.1.translated(origin))).collect(),
    })
}

/// Where the patches of one basis are interpolated and checked.
pub(crate) struct FittedRule {
    knots: KnotVector,
    nodes: Vec<f64>,
    checks: Vec<f64>,
    at_nodes: Vec<JetWeights>,
    at_checks: Vec<JetWeights>,
    edges: Option<OuterEdges>,
}

/// The edges `u = 1` and `v = 1` of a patch at the vertex of a blend of several rings.
struct OuterEdges {
    knots: KnotVector,
    nodes: Vec<f64>,
    at_nodes: [Vec<JetWeights>; 2],
}

impl OuterEdges {
    fn new(surface: &SubdivisionSurface, basis: BasisId) -> Result<Self, SplinePatchError> {
        let knots = smooth_knots()?;
        let nodes = knots.greville_points();
        let at_nodes = [
            nodes.iter().map(|&t| surface.weights(basis, 1.0, t)).collect(),
            nodes.iter().map(|&t| surface.weights(basis, t, 1.0)).collect(),
        ];
        Ok(Self { knots, nodes, at_nodes })
    }
}

fn smooth_knots() -> Result<KnotVector, KnotError> {
    KnotVector::clamped_uniform(Degree::new(DEGREE)?, DEGREE + SMOOTH_SPANS)
}

impl FittedRule {
    pub(crate) fn new(
        surface: &SubdivisionSurface,
        basis: BasisId,
    ) -> Result<Self, SplinePatchError> {
        let edges = if surface.is_wide(basis) && !surface.is_smooth(basis) {
            Some(OuterEdges::new(surface, basis)?)
        } else {
            None
        };
        let knots = if surface.is_smooth(basis) {
            smooth_knots()?
        } else {
            let mut inner = graded_breaks();
            if !surface.is_blended(basis) {
                // Any corner of a patch at a crease can be extraordinary.
                inner.retain(|&t| t <= 0.5);
                let mirrored: Vec<f64> =
                    inner.iter().rev().filter(|&&t| t < 0.5).map(|t| 1.0 - t).collect();
                inner.extend(mirrored);
            }
            let mut knots = vec![0.0; DEGREE + 1];
            knots.extend(inner);
            knots.extend([1.0; DEGREE + 1]);
            KnotVector::new(Degree::new(DEGREE)?, knots)?
        };
        let nodes = knots.greville_points();
        let checks = knots.uniform_parameters(CHECKS * knots.control_count());
        let weights = |t: &[f64]| -> Vec<JetWeights> {
            t.par_iter()
                .flat_map_iter(|&u| t.iter().map(move |&v| surface.weights(basis, u, v)))
                .collect()
        };
        let (at_nodes, at_checks) = (weights(&nodes), weights(&checks));
        Ok(Self { knots, nodes, checks, at_nodes, at_checks, edges })
    }

    pub(crate) fn fit(
        &self,
        control: &dyn Fn(usize) -> DVec3,
    ) -> Result<(BsplineSurface, f64), FitError> {
        let point = |weights: &JetWeights| -> DVec3 {
            weights.row(0).iter().enumerate().map(|(k, &w)| w * control(k)).sum()
        };
        let mut points: Vec<DVec3> = self.at_nodes.iter().map(point).collect();
        if let Some(edges) = &self.edges {
            let count = self.nodes.len();
            for (along_v, weights) in edges.at_nodes.iter().enumerate() {
                let on_edge: Vec<DVec3> = weights.iter().map(point).collect();
                let curve = fit_curve(&edges.knots, &edges.nodes, &on_edge)?;
                for (k, &t) in self.nodes.iter().enumerate() {
                    let place =
                        if along_v == 0 { (count - 1) * count + k } else { k * count + count - 1 };
                    points[place] = curve.point(t);
                }
            }
        }
        let fitted = fit_surface(&self.knots, &self.knots, &self.nodes, &self.nodes, &points)?;
        let got = fitted.point_grid(&self.checks, &self.checks);
        let distance = |(weights, got): (&JetWeights, &DVec3)| point(weights).distance(*got);
        let deviation = self.at_checks.iter().zip(&got).map(distance).fold(0.0, f64::max);
        Ok((fitted, deviation))
    }
}

/// Knots inside the unit interval, graded towards 0.
fn graded_breaks() -> Vec<f64> {
    let octave = |k: i32| {
        let from = 0.5_f64.powi(k + 1);
        let step = from / f64::from(SPANS_PER_OCTAVE);
        (0..SPANS_PER_OCTAVE).map(move |i| from + step * f64::from(i))
    };
    (0..OCTAVES).rev().flat_map(octave).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixtures::quad_graphs;
    use subdiv_catmull_clark::{Blend, Creases, refine};

    #[test]
    fn patches_have_no_gaps_and_stay_near() {
        for blend in [Blend::Smooth, Blend::Flat] {
            let mesh = refine(&quad_graphs::theta_graph(3), &Creases::none()).unwrap().mesh;
            let surface = SubdivisionSurface::new(&mesh, &Creases::none(), blend).unwrap();
            let splines = spline_patches(&mesh, &surface).unwrap();
            assert_eq!(splines.surfaces.len(), mesh.face_count());
            // Two rings around each vertex of the theta graph's four.
            let patches = if blend == Blend::Smooth { 4 * 6 * 4 } else { 4 * 6 };
            assert_eq!(splines.fitted, patches);
            let size = mesh.mean_edge_length();
            let bound = if blend == Blend::Smooth { 2e-5 } else { 2e-3 };
            assert!(splines.max_deviation < bound * size, "{blend:?}: {}", splines.max_deviation);
            // Every edge of the mesh, from the surfaces on both of its sides.
            let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
            let edge = |face: FaceId, from: geom_core::VertexId, t: f64| {
                let mut at = surface.patches()[face.index()].corner;
                let mut k = 0;
                while mesh.origin(at) != from {
                    at = mesh.next(at);
                    k += 1;
                }
                let (a, b): ((f64, f64), (f64, f64)) = (corners[k], corners[(k + 1) % 4]);
                let (u, v) = (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1));
                splines.surfaces[face.index()].1.point(u, v)
            };
            for h in mesh.edges() {
                let (f, g) = (mesh.face(h).unwrap(), mesh.face(mesh.twin(h)).unwrap());
                for t in [0.0, 0.013, 0.3, 0.77, 1.0] {
                    let (p, q) = (edge(f, mesh.origin(h), t), edge(g, mesh.target(h), 1.0 - t));
                    assert!(p.distance(q) < 1e-10, "{blend:?} {}", p.distance(q));
                }
            }
        }
    }
}
