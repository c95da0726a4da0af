//! What a filled patch is worth, measured on the surface itself.

use geom_core::DVec3;

use crate::boundary::four_curves::PatchBoundary;
use crate::error::Place;
use crate::patch::intersect::self_intersections;
use crate::patch::surface::{BasisTable, Patch};
use crate::warning::Warning;
use crate::watch::Stop;

/// Samples along each boundary curve.
const BOUNDARY_SAMPLES: usize = 201;
/// Samples of the inner grid in each direction.
const GRID_SAMPLES: usize = 81;
/// Cells of the triangulation that is searched for self-intersections.
const INTERSECTION_CELLS: usize = 36;
/// Torsion is not evaluated this close to an inflection, where it is a quotient of zeros.
const INFLECTION_GAP: f64 = 0.02;

/// Measurements of one patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchCheck {
    /// Largest normal curvature of the boundary curves, times the size of the patch.
    pub normal_curvature: f64,
    /// Largest `|K + τ²|` on the curved boundaries (Beltrami and Enneper), in 1/length².
    pub torsion_defect: f64,
    /// Least sine between the parameter lines on the boundary.
    pub boundary_sine: f64,
    /// Least sine between the parameter lines on the whole patch.
    pub sine: f64,
    /// Least cosine between the normals of neighbouring samples of the 81 × 81 grid.
    pub normal_step: f64,
    /// Share of the grid with `K > 0`.
    pub positive_gauss: f64,
    /// Least and greatest Gaussian curvature on the grid.
    pub gaussian: [f64; 2],
    /// Least and greatest mean curvature on the grid.
    pub mean: [f64; 2],
    /// Pairs of triangles of a 36 × 36 triangulation that cross.
    pub self_intersections: usize,
}

impl PatchCheck {
    /// Measures `patch` against the boundary it was filled from.
    #[must_use]
    pub fn new(patch: &Patch, boundary: &PatchBoundary) -> Self {
        Self::measured(patch, boundary, &Stop::default())
    }

    /// The same; the numbers mean nothing once `stop` is set.
    pub(crate) fn measured(patch: &Patch, boundary: &PatchBoundary, stop: &Stop) -> Self {
        let mut check = Self {
            normal_curvature: 0.0,
            torsion_defect: 0.0,
            boundary_sine: f64::INFINITY,
            sine: f64::INFINITY,
            normal_step: 1.0,
            positive_gauss: 0.0,
            gaussian: [f64::INFINITY, f64::NEG_INFINITY],
            mean: [f64::INFINITY, f64::NEG_INFINITY],
            self_intersections: self_intersections(patch, INTERSECTION_CELLS, stop),
        };
        if !stop.is_set() {
            check.measure_boundary(patch, boundary);
            check.measure_grid(patch);
        }
        check
    }

    fn measure_boundary(&mut self, patch: &Patch, boundary: &PatchBoundary) {
        let along = BasisTable::uniform(patch.degree(), BOUNDARY_SAMPLES);
        let ends = BasisTable::new(patch.degree(), &[0.0, 1.0]);
        let size = patch.size();
        for i in 0..4 {
            let end = usize::from(i >= 2);
            let table = crate::curve::bezier::JetTable::new(&boundary.curves[i]);
            for k in 0..BOUNDARY_SAMPLES {
                let t = along.parameters[k];
                let mut jet = Default::default();
                if i == 0 || i == 2 {
                    patch.jet_at(&along, k, &ends, end, &mut jet);
                } else {
                    patch.jet_at(&ends, end, &along, k, &mut jet);
                }
                let [l, _, n] = jet.second_form();
                let normal_curvature = if i == 0 || i == 2 {
                    l / jet.u.length_squared()
                } else {
                    n / jet.v.length_squared()
                };
                // `max` would drop a NaN; a NaN must show.
                self.normal_curvature = worse(self.normal_curvature, normal_curvature.abs() * size);
                self.boundary_sine = -worse(-self.boundary_sine, -jet.sine());
                let near = |t0: &f64| (t - t0).abs() < INFLECTION_GAP;
                let known = boundary.curves[i].normals().is_some()
                    || !boundary.lines[i] && !boundary.inflections[i].iter().any(near);
                if known {
                    let tau = table.torsion(t, &table.at(t));
                    let defect = (jet.gaussian_curvature() + tau * tau).abs();
                    self.torsion_defect = worse(self.torsion_defect, defect);
                }
            }
        }
    }

    fn measure_grid(&mut self, patch: &Patch) {
        let table = BasisTable::uniform(patch.degree(), GRID_SAMPLES);
        let mut above: Vec<DVec3> = Vec::new();
        let mut row: Vec<DVec3> = Vec::with_capacity(GRID_SAMPLES);
        let mut curvatures = Vec::with_capacity(GRID_SAMPLES * GRID_SAMPLES);
        for iu in 0..GRID_SAMPLES {
            row.clear();
            patch.jets_row(&table, iu, &table, |iv, jet| {
                let normal = jet.normal();
                let length = normal.length();
                let n = normal / length;
                self.sine = -worse(-self.sine, -length / (jet.u.length() * jet.v.length()));
                let (l, m, q) = (jet.uu.dot(n), jet.uv.dot(n), jet.vv.dot(n));
                let (e, f, g) = (jet.u.dot(jet.u), jet.u.dot(jet.v), jet.v.dot(jet.v));
                let area = length * length;
                let k = (l * q - m * m) / area;
                let h = (e * q - 2.0 * f * m + g * l) / (2.0 * area);
                curvatures.push(k);
                self.gaussian = [self.gaussian[0].min(k), self.gaussian[1].max(k)];
                self.mean = [self.mean[0].min(h), self.mean[1].max(h)];
                for neighbour in row.last().into_iter().chain(above.get(iv)) {
                    self.normal_step = -worse(-self.normal_step, -neighbour.dot(n));
                }
                row.push(n);
            });
            std::mem::swap(&mut above, &mut row);
        }
        // Rounding noise around zero is not positive curvature.
        let noise = 1e-9 * self.gaussian[0].abs().max(self.gaussian[1].abs());
        let positive = curvatures.iter().filter(|k| **k > noise).count();
        self.positive_gauss = positive as f64 / curvatures.len() as f64;
    }

    /// The warnings these measurements deserve.
    #[must_use]
    pub fn warnings(&self, place: Place, min_sine: f64) -> Vec<Warning> {
        let mut out = Vec::new();
        if self.positive_gauss > 0.0 {
            let percent = 100.0 * self.positive_gauss;
            out.push(Warning::PositiveGauss { place, percent });
        }
        if self.self_intersections > 0 {
            let pairs = self.self_intersections;
            out.push(Warning::SelfIntersection { place, pairs });
        }
        if !(self.normal_step > 0.0) {
            let degrees = self.normal_step.clamp(-1.0, 1.0).acos().to_degrees();
            out.push(Warning::NormalFlip { place, degrees });
        }
        if !(self.sine >= min_sine) {
            out.push(Warning::LowSine { place, sine: self.sine });
        }
        out
    }
}

/// The larger value, or NaN if either is.
fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}
