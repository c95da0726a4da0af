//! A surface sampled for looking at: curvatures, their variation, umbilics.

use crate::umbilics::{DirectionField, Umbilic};
use geom_core::{DVec3, PolyMesh, SurfaceJet, ThirdOrder, principal_curvatures};
use rayon::prelude::*;
use subdiv_catmull_clark::{BasisId, JetWeights, Patch, SubdivisionSurface};

/// Derivatives next to an extraordinary corner are taken at least this far from it.
const CORNER: f64 = 2e-3;

/// Samples on a grid per patch, as one triangle mesh.
#[derive(Clone, Debug, Default)]
pub struct SurfaceSamples {
    /// Points on the surface.
    pub positions: Vec<DVec3>,
    /// Unit normals.
    pub normals: Vec<DVec3>,
    /// Triangles.
    pub triangles: Vec<[u32; 3]>,
    /// Mean curvature, in 1/length.
    pub mean_curvature: Vec<f64>,
    /// Gaussian curvature, in 1/length².
    pub gaussian_curvature: Vec<f64>,
    /// Larger principal curvature.
    pub k1: Vec<f64>,
    /// Smaller principal curvature.
    pub k2: Vec<f64>,
    /// Root mean square of `κ_n'` over all directions, `√((F1² + F3²)/2)`, in 1/length².
    pub curvature_variation: Vec<f64>,
    /// Strokes along the direction in which the first harmonic of `κ_n'` is largest, in proportion
    /// to `F1`.
    pub f1_strokes: Vec<[DVec3; 2]>,
    /// Three strokes along the directions in which the third harmonic is largest, in proportion to
    /// `F3`.
    pub f3_strokes: Vec<[DVec3; 2]>,
    /// Umbilics.
    pub umbilics: Vec<Umbilic>,
}

struct PatchSamples {
    points: Vec<(DVec3, Option<ThirdOrder>, [f64; 2])>,
}

impl SurfaceSamples {
    /// Samples every patch at `side × side` points (at least 2).
    #[must_use]
    pub fn new(mesh: &PolyMesh, surface: &SubdivisionSurface, side: usize) -> Self {
        let side = side.max(2);
        let positions = surface.control_points(mesh.positions());
        let at = |i: usize| i as f64 / (side - 1) as f64;
        let parameters = (0..side * side).map(|k| [at(k / side), at(k % side)]).collect();
        let table = JetTable::new(surface, parameters);
        let patches: Vec<PatchSamples> = surface
            .patches()
            .par_iter()
            .map(|patch| sample_patch(&positions, &table, patch))
            .collect();
        let mut out = Self::default();
        for patch in &patches {
            out.push(patch, side);
        }
        let mut directions = DirectionField::new(mesh, side);
        for (patch, samples) in surface.patches().iter().zip(&patches) {
            for (k, (position, shape, _)) in samples.points.iter().enumerate() {
                if let Some(shape) = shape {
                    directions.insert(patch, (k / side, k % side), *position, shape);
                }
            }
        }
        out.umbilics = directions.umbilics(surface.patches(), |patch, u, v| {
            let jet = jet_at(&positions, surface, &surface.patches()[patch], u, v);
            Some((jet.position(), ThirdOrder::new(&jet).ok()?))
        });
        let length = 0.8 * mesh.mean_edge_length();
        out.add_strokes(&patches, side, length);
        out
    }

    fn push(&mut self, patch: &PatchSamples, side: usize) {
        let base = self.positions.len() as u32;
        for (position, shape, [k1, k2]) in &patch.points {
            self.positions.push(*position);
            let normal = shape.as_ref().map_or(DVec3::Z, |s| s.e1.cross(s.e2));
            self.normals.push(normal);
            let value = |f: &dyn Fn(&ThirdOrder) -> f64| shape.as_ref().map_or(f64::NAN, f);
            self.mean_curvature.push(value(&ThirdOrder::mean_curvature));
            self.gaussian_curvature.push(value(&ThirdOrder::gaussian_curvature));
            self.k1.push(*k1);
            self.k2.push(*k2);
            self.curvature_variation
                .push(value(&|s| (0.5 * (s.f1() * s.f1() + s.f3() * s.f3())).sqrt()));
        }
        for i in 1..side {
            for j in 1..side {
                let d = base + (i * side + j) as u32;
                let (c, b) = (d - 1, d - side as u32);
                self.triangles.push([b - 1, c, d]);
                self.triangles.push([b - 1, d, b]);
            }
        }
    }

    /// Strokes at the patches' centres; the longest has the given length.
    fn add_strokes(&mut self, patches: &[PatchSamples], side: usize, length: f64) {
        let centres: Vec<(DVec3, &ThirdOrder)> = patches
            .iter()
            .filter_map(|p| {
                let (position, shape, _) = &p.points[(side / 2) * side + side / 2];
                Some((*position, shape.as_ref()?))
            })
            .collect();
        let largest = centres.iter().map(|(_, s)| s.f1().max(s.f3())).fold(0.0, f64::max);
        if !(largest > 0.0) {
            return;
        }
        for (position, shape) in centres {
            let stroke = |angle: f64, amplitude: f64| {
                let (sin, cos) = angle.sin_cos();
                let direction = cos * shape.e1 + sin * shape.e2;
                [position, position + length * amplitude / largest * direction]
            };
            self.f1_strokes.push(stroke(-shape.alpha(), shape.f1()));
            for k in 0..3 {
                let turn = std::f64::consts::TAU / 3.0 * f64::from(k);
                let angle = turn - shape.alpha() - shape.beta();
                self.f3_strokes.push(stroke(angle, shape.f3()));
            }
        }
    }
}

/// The jet at a point of a patch from all control points, next to an extraordinary corner for the
/// corner itself.
pub(crate) fn jet_at(
    positions: &[DVec3],
    surface: &SubdivisionSurface,
    patch: &Patch,
    u: f64,
    v: f64,
) -> SurfaceJet {
    Place::new(surface, patch.basis, u, v).jet(positions, surface, patch)
}

/// The weights of a point of a basis' patches.
struct Place {
    weights: JetWeights,
    /// Those beside an extraordinary corner, for the derivatives.
    beside: Option<JetWeights>,
}

impl Place {
    fn new(surface: &SubdivisionSurface, basis: BasisId, u: f64, v: f64) -> Self {
        let inner = |t: f64| t.clamp(CORNER, 1.0 - CORNER);
        let sound = surface.is_smooth(basis) || inner(u) == u || inner(v) == v;
        let beside = (!sound).then(|| surface.weights(basis, inner(u), inner(v)));
        Self { weights: surface.weights(basis, u, v), beside }
    }

    fn jet(&self, positions: &[DVec3], surface: &SubdivisionSurface, patch: &Patch) -> SurfaceJet {
        let jet = surface.apply(&self.weights, positions, patch);
        let Some(beside) = &self.beside else { return jet };
        let mut beside = surface.apply(beside, positions, patch);
        beside.derivatives[0] = jet.position();
        beside
    }
}

/// Jets of all patches at the same parameters; bases that many patches share have their weights
/// evaluated once.
pub(crate) struct JetTable<'s> {
    surface: &'s SubdivisionSurface,
    parameters: Vec<[f64; 2]>,
    by_basis: Vec<Vec<Place>>,
}

impl<'s> JetTable<'s> {
    /// From so many patches on a basis is worth its memory.
    const SHARED: usize = 8;

    pub(crate) fn new(surface: &'s SubdivisionSurface, parameters: Vec<[f64; 2]>) -> Self {
        let mut uses = vec![0; surface.basis_count()];
        surface.patches().iter().for_each(|patch| uses[patch.basis.0] += 1);
        let by_basis = uses
            .par_iter()
            .enumerate()
            .map(|(basis, &count)| match count {
                Self::SHARED.. => parameters
                    .par_iter()
                    .map(|&[u, v]| Place::new(surface, BasisId(basis), u, v))
                    .collect(),
                _ => Vec::new(),
            })
            .collect();
        Self { surface, parameters, by_basis }
    }

    /// The jet of a patch at parameter pair `k`.
    pub(crate) fn jet(&self, positions: &[DVec3], patch: &Patch, k: usize) -> SurfaceJet {
        match self.by_basis[patch.basis.0].get(k) {
            Some(place) => place.jet(positions, self.surface, patch),
            None => {
                let [u, v] = self.parameters[k];
                jet_at(positions, self.surface, patch, u, v)
            }
        }
    }
}

fn sample_patch(positions: &[DVec3], table: &JetTable<'_>, patch: &Patch) -> PatchSamples {
    let count = table.parameters.len();
    let mut points = Vec::with_capacity(count);
    for k in 0..count {
        let jet = table.jet(positions, patch, k);
        let shape = ThirdOrder::new(&jet).ok();
        let principal =
            jet.second_form().and_then(|second| principal_curvatures(jet.first_form(), second));
        points.push((jet.position(), shape, principal.map_or([f64::NAN; 2], |p| [p.k1, p.k2])));
    }
    PatchSamples { points }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::UmbilicKind;
    use subdiv_catmull_clark::{Blend, Creases, refine};

    fn umbilics(mesh: &PolyMesh, refinements: usize, side: usize) -> Vec<Umbilic> {
        let fine = (0..refinements)
            .fold(mesh.clone(), |mesh, _| refine(&mesh, &Creases::none()).unwrap().mesh);
        let surface = SubdivisionSurface::new(&fine, &Creases::none(), Blend::Smooth).unwrap();
        let samples = SurfaceSamples::new(&fine, &surface, side);
        assert_eq!(samples.positions.len(), fine.face_count() * side * side);
        let half_turns: i32 = samples.umbilics.iter().map(|u| u.half_turns).sum();
        assert_eq!(half_turns as isize, 2 * mesh.euler_characteristic() as isize, "Poincaré-Hopf");
        samples.umbilics
    }

    #[test]
    fn an_ellipsoid_has_four_lemons() {
        let [a, b, c] = [1.0_f64, 1.4, 2.0];
        // In the plane of the longest and the shortest axis, at the heights of the closed form.
        let x = a * ((b * b - a * a) / (c * c - a * a)).sqrt();
        let z = c * ((c * c - b * b) / (c * c - a * a)).sqrt();
        for (n, side) in [(6, 4), (12, 4), (12, 9)] {
            let mesh = fixtures::quad_graphs::ellipsoid(n, DVec3::new(a, b, c));
            let found = umbilics(&mesh, 1, side);
            assert_eq!(found.len(), 4, "{found:?}");
            for umbilic in &found {
                assert_eq!(umbilic.kind, Some(UmbilicKind::Lemon));
                let near = umbilic.position.abs().distance(DVec3::new(x, 0.0, z));
                assert!(near < if n == 12 { 0.12 } else { 0.2 }, "{umbilic:?}: {near}");
            }
        }
    }

    #[test]
    fn a_torus_has_no_umbilic() {
        for (nu, nv) in [(24, 12), (13, 9)] {
            assert_eq!(umbilics(&fixtures::quad_graphs::torus(nu, nv, 1.0, 0.4), 0, 4), []);
        }
    }

    #[test]
    fn indices_sum_to_the_euler_characteristic() {
        // Symmetry puts umbilics of several orders on samples and extraordinary vertices; a sphere
        // is nothing but umbilics.
        use fixtures::quad_graphs as graphs;
        let sphere = graphs::ellipsoid(4, DVec3::ONE);
        for mesh in [graphs::theta_graph(3), graphs::theta_graph(4), graphs::cube_graph(), sphere] {
            for side in [2, 3, 5] {
                umbilics(&mesh, 1, side);
            }
        }
    }
}
