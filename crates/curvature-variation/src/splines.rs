//! A subdivision surface as B-spline surfaces, for CAD.

use crate::straightened::Straightened;
use bspline::{BsplineSurface, Degree, FitError, KnotError, KnotVector, SplineError, fit_surface};
use geom_core::{DVec3, FaceId, Normalization, PolyMesh};
use rayon::prelude::*;
use std::collections::BTreeMap;
use subdiv_catmull_clark::{BasisId, JetWeights, SubdivisionSurface};

/// Degree of the patches that are exact, and of those at creases.
const CUBIC: usize = 3;
/// Degree of the patches of a blend: third derivatives of a cubic are constant on every span, so
/// that its energies of third order would be those of ripples.
const QUINTIC: usize = 5;
/// Spans in each direction of a patch of a blend of several rings, and of one ring.
const SPANS: [usize; 2] = [8, 16];
/// The knots of a patch at a crease halve their distance to a corner that may be extraordinary this
/// often: the surface is smooth there, but its parametrisation behaves like a power of the
/// distance.
const OCTAVES: i32 = 8;
/// Spans between a knot and the one at half its distance.
const SPANS_PER_OCTAVE: u32 = 4;
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
/// Bi-cubic patches are given exactly, as Bézier patches. The patches of a blend become quintic
/// splines over equal spans through the points at their Greville parameters; at the vertex in
/// parameters that run evenly along the edges of the sector in the characteristic map, in which the
/// patch is as smooth as the surface is. Two neighbours interpolate the same points of their common
/// edge with the same knots, and the outer edges of a blend are cubic, which interpolation
/// reproduces; so there are no gaps between the surfaces. A patch at a semi-sharp crease is a
/// bi-cubic spline with knots that crowd together towards its corners, four spans to an octave.
///
/// # Errors
/// [`SplinePatchError`] if a control point is not finite.
pub fn spline_patches(
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
) -> Result<SplinePatches, SplinePatchError> {
    let bezier_knots = KnotVector::clamped_uniform(Degree::new(CUBIC)?, CUBIC + 1)?;
    let mut rules: BTreeMap<BasisId, FittedRule> = BTreeMap::new();
    for patch in surface.patches() {
        if surface.b_spline_grid(patch.basis).is_none() && !rules.contains_key(&patch.basis) {
            let valence = mesh.valence(mesh.origin(patch.corner));
            rules.insert(patch.basis, FittedRule::new(surface, patch.basis, valence)?);
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
}

impl FittedRule {
    /// Of the patches of a basis whose corner at `(0, 0)` has `valence` edges.
    pub(crate) fn new(
        surface: &SubdivisionSurface,
        basis: BasisId,
        valence: usize,
    ) -> Result<Self, SplinePatchError> {
        let at_vertex = surface.is_blended(basis);
        let knots = if at_vertex || surface.is_smooth(basis) {
            let spans = SPANS[usize::from(!surface.is_wide(basis))];
            KnotVector::clamped_uniform(Degree::new(QUINTIC)?, QUINTIC + spans)?
        } else {
            // Any corner of a patch at a crease can be extraordinary.
            let mut inner = graded_breaks();
            inner.retain(|&t| t <= 0.5);
            let mirrored: Vec<f64> =
                inner.iter().rev().filter(|&&t| t < 0.5).map(|t| 1.0 - t).collect();
            inner.extend(mirrored);
            let mut knots = vec![0.0; CUBIC + 1];
            knots.extend(inner);
            knots.extend([1.0; CUBIC + 1]);
            KnotVector::new(Degree::new(CUBIC)?, knots)?
        };
        let nodes = knots.greville_points();
        let checks = knots.uniform_parameters(CHECKS * knots.control_count());
        let straightened = at_vertex.then(|| Straightened::new(valence));
        let weights = |t: &[f64]| -> Vec<JetWeights> {
            let at = |u: f64, v: f64| {
                let place = straightened.as_ref().map_or([u, v], |map| map.parameters([u, v]));
                surface.weights(basis, place[0], place[1])
            };
            t.par_iter()
                .flat_map_iter(|&u| t.iter().map(move |&v| (u, v)))
                .map(|(u, v)| at(u, v))
                .collect()
        };
        let (at_nodes, at_checks) = (weights(&nodes), weights(&checks));
        Ok(Self { knots, nodes, checks, at_nodes, at_checks })
    }

    pub(crate) fn fit(
        &self,
        control: &dyn Fn(usize) -> DVec3,
    ) -> Result<(BsplineSurface, f64), FitError> {
        let point = |weights: &JetWeights| -> DVec3 {
            weights.row(0).iter().enumerate().map(|(k, &w)| w * control(k)).sum()
        };
        let points: Vec<DVec3> = self.at_nodes.iter().map(point).collect();
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
            let jet = |face: FaceId, from: geom_core::VertexId, t: f64| {
                let mut at = surface.patches()[face.index()].corner;
                let mut k = 0;
                while mesh.origin(at) != from {
                    at = mesh.next(at);
                    k += 1;
                }
                let (a, b): ((f64, f64), (f64, f64)) = (corners[k], corners[(k + 1) % 4]);
                let (u, v) = (a.0 + t * (b.0 - a.0), a.1 + t * (b.1 - a.1));
                splines.surfaces[face.index()].1.jet(u, v, 1)
            };
            let kink = if blend == Blend::Smooth { 1e-4 } else { 0.1 };
            for h in mesh.edges() {
                let (f, g) = (mesh.face(h).unwrap(), mesh.face(mesh.twin(h)).unwrap());
                for t in [0.0, 0.013, 0.3, 0.77, 1.0] {
                    let (p, q) = (jet(f, mesh.origin(h), t), jet(g, mesh.target(h), 1.0 - t));
                    let gap = p.position().distance(q.position());
                    assert!(gap < 1e-10, "{blend:?} {gap}");
                    let [m, n] = [p, q].map(|jet| jet.d(1, 0).cross(jet.d(0, 1)));
                    assert!(m.angle_between(n) < kink, "{blend:?} {}", m.angle_between(n));
                }
            }
        }
    }
}
