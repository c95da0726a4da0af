//! A surface sampled for looking at: curvatures, their variation, umbilics.

use geom_core::{DVec3, PolyMesh, SurfaceJet, ThirdOrder, UmbilicKind, principal_curvatures};
use rayon::prelude::*;
use subdiv_catmull_clark::{Patch, SubdivisionSurface};

/// Derivatives next to an extraordinary corner are taken at least this far from it.
const CORNER: f64 = 2e-3;

/// An umbilic and its kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Umbilic {
    /// Where it is, to the accuracy of the sampling.
    pub position: DVec3,
    /// Pattern of the curvature lines around it.
    pub kind: UmbilicKind,
}

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
    umbilics: Vec<Umbilic>,
}

impl SurfaceSamples {
    /// Samples every patch at `side × side` points (at least 2).
    #[must_use]
    pub fn new(mesh: &PolyMesh, surface: &SubdivisionSurface, side: usize) -> Self {
        let side = side.max(2);
        let patches: Vec<PatchSamples> = surface
            .patches()
            .par_iter()
            .map(|patch| sample_patch(mesh, surface, patch, side))
            .collect();
        let mut out = Self::default();
        for patch in &patches {
            out.push(patch, side);
        }
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
        self.umbilics.extend_from_slice(&patch.umbilics);
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

/// The jet at a point of a patch, next to an extraordinary corner for the corner itself.
pub(crate) fn jet_at(
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
    patch: &Patch,
    u: f64,
    v: f64,
) -> SurfaceJet {
    let jet = surface.evaluate(mesh.positions(), patch, u, v);
    let regular = surface.b_spline_grid(patch.basis).is_some();
    let inner = |t: f64| t.clamp(CORNER, 1.0 - CORNER);
    if regular || (inner(u) == u || inner(v) == v) {
        return jet;
    }
    let mut beside = surface.evaluate(mesh.positions(), patch, inner(u), inner(v));
    beside.derivatives[0] = jet.position();
    beside
}

fn sample_patch(
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
    patch: &Patch,
    side: usize,
) -> PatchSamples {
    let at = |i: usize| i as f64 / (side - 1) as f64;
    let mut points = Vec::with_capacity(side * side);
    let mut directions = Vec::with_capacity(side * side);
    for k in 0..side * side {
        let jet = jet_at(mesh, surface, patch, at(k / side), at(k % side));
        let shape = ThirdOrder::new(&jet).ok();
        let principal =
            jet.second_form().and_then(|second| principal_curvatures(jet.first_form(), second));
        points.push((jet.position(), shape, principal.map_or([f64::NAN; 2], |p| [p.k1, p.k2])));
        directions.push(shape.map(|s| first_direction(&s)));
    }
    let mut umbilics = Vec::new();
    for i in 1..side {
        for j in 1..side {
            let corners =
                [(i - 1) * side + j - 1, i * side + j - 1, i * side + j, (i - 1) * side + j];
            let index = corners
                .iter()
                .map(|&k| points[k].1.zip(directions[k]))
                .collect::<Option<Vec<_>>>()
                .map_or(0, |around| half_turns(&around));
            if index.abs() == 1 {
                let (u, v) = (at(i) - 0.5 * at(1), at(j) - 0.5 * at(1));
                let jet = jet_at(mesh, surface, patch, u, v);
                if let Ok(shape) = ThirdOrder::new(&jet) {
                    // The winding number tells a star; the third order tells lemon from monstar.
                    let kind = match (index, shape.umbilic_kind()) {
                        (-1, _) => UmbilicKind::Star,
                        (_, UmbilicKind::Monstar) => UmbilicKind::Monstar,
                        _ => UmbilicKind::Lemon,
                    };
                    umbilics.push(Umbilic { position: jet.position(), kind });
                }
            }
        }
    }
    PatchSamples { points, umbilics }
}

// Unit vector of the first principal direction.
fn first_direction(shape: &ThirdOrder) -> DVec3 {
    let [l, m, q] = shape.second;
    let angle = 0.5 * (2.0 * m).atan2(l - q);
    angle.cos() * shape.e1 + angle.sin() * shape.e2
}

/// Half-turns of the principal direction around a cell.
fn half_turns(around: &[(ThirdOrder, DVec3)]) -> i32 {
    let mut total = 0.0;
    for k in 0..4 {
        let (shape, here) = &around[k];
        let (_, next) = &around[(k + 1) % 4];
        let normal = shape.e1.cross(shape.e2);
        let next = next.reject_from(normal);
        let aligned = if next.dot(*here) < 0.0 { -next } else { next };
        total += here.cross(aligned).dot(normal).atan2(here.dot(aligned));
    }
    (total / std::f64::consts::PI).round() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use subdiv_catmull_clark::{Blend, Creases, refine};

    #[test]
    fn an_ellipsoid_has_four_lemons() {
        let mesh = fixtures::quad_graphs::ellipsoid(6, DVec3::new(1.0, 1.4, 2.0));
        let fine = refine(&mesh, &Creases::none()).unwrap();
        let surface = SubdivisionSurface::new(&fine.mesh, &fine.creases, Blend::Smooth).unwrap();
        let samples = SurfaceSamples::new(&fine.mesh, &surface, 4);
        assert_eq!(samples.positions.len(), fine.mesh.face_count() * 16);
        // The indices of all umbilics sum up to the Euler characteristic.
        let index: i32 =
            samples.umbilics.iter().map(|u| if u.kind == UmbilicKind::Star { -1 } else { 1 }).sum();
        assert_eq!(index, 4);
        for umbilic in &samples.umbilics {
            // The true ones lie in the plane of the longest and the shortest axis.
            if samples.umbilics.len() == 4 {
                assert!(umbilic.position.y.abs() < 0.15, "{umbilic:?}");
                assert_eq!(umbilic.kind, UmbilicKind::Lemon);
            }
        }
    }
}
