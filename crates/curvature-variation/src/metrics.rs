//! What is to be said about a faired surface.

use std::collections::BTreeMap;
use std::fmt;
use std::time::Instant;

use geom_core::{BoundingBox, DVec3, FaceId, Normalization, PolyMesh};
use gp_solver::{Observer, StageReport, Status};
use serde::Serialize;
use subdiv_catmull_clark::{Creases, SubdivisionSurface};

use crate::evaluator::{EnergyTable, SurfaceEnergy, Workspace, flatten};
use crate::functional::{Energy, Functional};
use crate::grounds::skip_boundary;
use crate::input::Input;
use crate::options::Options;
use crate::rules::Quadrature;
use crate::splines::SplinePatches;
use crate::torus::fitted_torus;

/// Relative quadrature gap above which a result does not count as converged: the control mesh has
/// folded up between the quadrature points.
const LARGEST_GAP: f64 = 0.01;
/// Differences of an energy below this are rounding errors: a flat sheet has no other energy.
const NO_ENERGY: f64 = 1e-9;
/// Distance of a fitted spline patch from the surface that is worth a warning, as a share of the
/// bounding box' diagonal.
const FITTED_TOLERANCE: f64 = 1e-4;

/// The numbers of a fairing, under the names of the metrics file.
///
/// # Example
/// ```
/// use curvature_variation::{Input, Options, solve};
/// let torus = Input::from(fixtures::quad_graphs::torus(6, 5, 1.0, 0.3));
/// let energy = "bending".parse()?;
/// let options = Options { energy, levels: 0, iterations: 5, ..Options::default() };
/// let metrics = solve(&torus, &options, &mut ())?.metrics;
/// assert!(metrics.energy_final < metrics.energy_initial);
/// // The total curvature of a torus is 0, whatever its shape.
/// assert!(metrics.gauss_bonnet_residual.is_some_and(|r| r < 0.01));
/// assert_eq!((metrics.vertices, metrics.patches), (30, 30));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Metrics {
    /// All functionals of the result by the fine quadrature.
    pub energies: BTreeMap<&'static str, f64>,
    /// Relative difference of the energy between the quadrature used and the fine one.
    pub quadrature_gap: f64,
    /// `|∫K − 2πχ| / ∫|K|` of the result; none for an open surface and one with sharp edges.
    pub gauss_bonnet_residual: Option<f64>,
    /// The minimised energy before anything moved.
    pub energy_initial: f64,
    /// The minimised energy of the result, by the fine quadrature.
    pub energy_final: f64,
    /// Norm of the gradient at the end, in the metric of the method.
    pub gradient_norm: f64,
    /// Ratio of the radii of the nearest torus, for closed surfaces of genus 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torus_ratio: Option<f64>,
    /// Root mean square distance of the limit points from that torus.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub torus_fit_rms: Option<f64>,
    /// Control vertices of the result.
    pub vertices: usize,
    /// Patches of the result.
    pub patches: usize,
    /// Least and largest number of rings that smooth blends cover.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub blend_rings: Option<[usize; 2]>,
    /// Mean of the control vertices.
    pub vertex_centroid: [f64; 3],
    /// `none`, or `some` if the surface has creases, which files do not hold.
    pub creases: &'static str,
    /// What [`Self::energies`] are of: `all` patches, or the `inner` ones, without those at a clamped
    /// boundary.
    pub energies_of: &'static str,
    /// Patches are plain if no vertex of the boundary or of another valence than 4 is within so many
    /// rings of them: bi-cubic B-splines on their 16 control points; none with creases.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plain_rings: Option<usize>,
    /// How many patches are plain.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plain_patches: Option<usize>,
    /// All functionals of these patches alone, by the normal quadrature: what can be recomputed from
    /// the control mesh without the blends.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plain_energies: Option<BTreeMap<&'static str, f64>>,
    /// Milliseconds of one energy and gradient of the whole result, the least of three.
    pub ms_per_gradient: f64,
    /// Peak resident memory in MB, for the program to fill in.
    pub peak_memory_mb: Option<f64>,
    /// How many spline patches are fitted, see [`crate::Solution::add_splines`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fitted_patches: Option<usize>,
    /// Largest distance of a fitted patch from the surface.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fitted_deviation_max: Option<f64>,
    /// All functionals, measured on the spline patches as they are written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub written_energies: Option<BTreeMap<&'static str, f64>>,
}

impl Metrics {
    /// The numbers of a surface in normalised coordinates as those of the model.
    pub(crate) fn restore(&mut self, place: Normalization) {
        let unit = place.scale().recip();
        for table in std::iter::once(&mut self.energies).chain(&mut self.plain_energies) {
            for functional in Functional::ALL {
                if let Some(value) = table.get_mut(functional.name()) {
                    *value *= unit.powi(functional.length_power());
                }
            }
        }
        self.torus_fit_rms = self.torus_fit_rms.map(|rms| rms * unit);
        let centroid = place.restore(DVec3::from_array(self.vertex_centroid));
        self.vertex_centroid = centroid.to_array();
    }
}

/// What the user should know although there is a result.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Warning {
    /// The energy is not that of the surface to 1 %: the control mesh is too coarse.
    QuadratureGap {
        /// Relative difference of the energy between two quadratures.
        gap: f64,
    },
    /// Spline patches stand off the surface by more than a ten-thousandth of its size.
    FittedPatches {
        /// Largest distance.
        deviation: f64,
    },
    /// An energy of the written spline patches is not that of the surface.
    WrittenEnergy {
        /// The one that differs most.
        functional: Functional,
        /// Of the surface.
        reported: f64,
        /// Of the patches.
        written: f64,
    },
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::QuadratureGap { gap } => write!(
                f,
                "the energy changes by {:.1} % with a finer quadrature; add a level",
                100.0 * gap
            ),
            Self::FittedPatches { deviation } => write!(
                f,
                "fitted spline patches are up to {deviation:.1e} off the surface; add a level"
            ),
            Self::WrittenEnergy { functional, reported, written } => write!(
                f,
                "the spline patches are not as fair as the surface: {functional} is \
                 {written:.2} on them and {reported:.2} on it; take the control mesh where \
                 third derivatives count"
            ),
        }
    }
}

impl SplinePatches {
    /// The warning these patches of the surface of `mesh` deserve.
    #[must_use]
    pub fn warning(&self, mesh: &PolyMesh) -> Option<Warning> {
        let bounds = BoundingBox::of(mesh.positions().iter().copied());
        let size = bounds.map_or(0.0, BoundingBox::diagonal);
        let deviation = self.max_deviation;
        (deviation > FITTED_TOLERANCE * size).then_some(Warning::FittedPatches { deviation })
    }
}

/// What is measured, with the control mesh of the first level before anything moved.
pub(crate) struct Meter<'m> {
    pub(crate) options: &'m Options,
    /// Whether the quads at the boundary are left out of the energy.
    pub(crate) clamps: bool,
    /// Whether limit points are pulled: the levels' energies are not the surface's then.
    pub(crate) pulls: bool,
}

/// A result measured.
pub(crate) struct Measured {
    pub(crate) status: Status,
    pub(crate) after: EnergyTable,
    pub(crate) metrics: Metrics,
    pub(crate) extrapolated: Option<f64>,
    pub(crate) warnings: Vec<Warning>,
}

impl Meter<'_> {
    /// All energies of a surface; `None` once `stop` says so.
    pub(crate) fn energies(
        &self,
        mesh: &PolyMesh,
        surface: &SubdivisionSurface,
        quadrature: Quadrature,
        stop: &mut dyn FnMut() -> bool,
    ) -> Option<EnergyTable> {
        energies(mesh, surface, self.clamps, quadrature, stop)
    }

    /// Measures the result of `stages`; once the observer asks to stop, the rest is left unknown
    /// and the status is `Interrupted`.
    pub(crate) fn measure(
        &self,
        mesh: &PolyMesh,
        creases: &Creases,
        surface: &SubdivisionSurface,
        before: &EnergyTable,
        stages: &[StageReport],
        observer: &mut dyn Observer,
    ) -> Measured {
        let energy = &self.options.energy;
        let last = stages.last().map(|s| &s.solver);
        let mut out = Measured {
            status: last.map_or(Status::Interrupted, |l| l.status),
            after: EnergyTable::unknown(),
            metrics: Metrics {
                energies: BTreeMap::new(),
                quadrature_gap: f64::NAN,
                gauss_bonnet_residual: None,
                energy_initial: before.total(energy),
                energy_final: f64::NAN,
                gradient_norm: last.map_or(f64::NAN, |l| l.gradient_norm),
                torus_ratio: None,
                torus_fit_rms: None,
                vertices: mesh.vertex_count(),
                patches: mesh.face_count(),
                blend_rings: surface.blend_rings(),
                vertex_centroid: centroid(mesh),
                creases: if creases.is_empty() { "none" } else { "some" },
                energies_of: if self.clamps { "inner" } else { "all" },
                plain_rings: None,
                plain_patches: None,
                plain_energies: None,
                ms_per_gradient: f64::NAN,
                peak_memory_mb: None,
                fitted_patches: None,
                fitted_deviation_max: None,
                written_energies: None,
            },
            extrapolated: None,
            warnings: Vec::new(),
        };
        let stop = &mut || observer.stop_requested();
        if self.fill(&mut out, mesh, creases, surface, stages, stop).is_none() {
            out.status = Status::Interrupted;
        }
        out.metrics.energies = out.after.by_name();
        out
    }

    /// `None` once `stop` says so.
    fn fill(
        &self,
        out: &mut Measured,
        mesh: &PolyMesh,
        creases: &Creases,
        surface: &SubdivisionSurface,
        stages: &[StageReport],
        stop: &mut dyn FnMut() -> bool,
    ) -> Option<()> {
        let energy = &self.options.energy;
        let coarse = self.energies(mesh, surface, self.options.quadrature, stop)?;
        out.after = self.energies(mesh, surface, Quadrature::FINE, stop)?;
        let energy_final = out.after.total(energy);
        let difference = (coarse.total(energy) - energy_final).abs();
        let gap = if difference == 0.0 { 0.0 } else { difference / energy_final.abs() };
        (out.metrics.energy_final, out.metrics.quadrature_gap) = (energy_final, gap);
        if out.status == Status::Converged && gap > LARGEST_GAP && difference > NO_ENERGY {
            // What was minimised is not the surface's energy then.
            out.status = Status::Stalled;
        }
        if gap > LARGEST_GAP {
            out.warnings.push(Warning::QuadratureGap { gap });
        }
        out.extrapolated = match stages {
            [.., a, b] if out.status != Status::Interrupted && !self.pulls => {
                Some(energy_final - (a.solver.final_energy - b.solver.final_energy) / 3.0)
            }
            _ => None,
        };
        // A sharp edge holds curvature that the patches do not have.
        if !Input::has_sharp_edges(mesh, creases) {
            let residual = gauss_bonnet_residual(mesh, surface, stop)?;
            out.metrics.gauss_bonnet_residual = residual.is_finite().then_some(residual);
        }
        if creases.is_empty() {
            let rings = surface.blend_rings().map_or(1, |[_, most]| most);
            let plain = plain_patches(mesh, rings);
            let count = plain.iter().filter(|c| **c > 0).count();
            (out.metrics.plain_rings, out.metrics.plain_patches) = (Some(rings), Some(count));
            if count > 0 {
                let evaluator = SurfaceEnergy::with_multiplicities(
                    surface,
                    mesh.vertex_count(),
                    Quadrature::NORMAL,
                    &plain,
                );
                let (x, mut work) = (flatten(mesh.positions()), Workspace::default());
                let table = evaluator.table_until(&x, &mut work, stop)?;
                out.metrics.plain_energies = Some(table.by_name());
            }
        }
        out.metrics.ms_per_gradient = 1e3 * self.seconds_per_gradient(mesh, surface, stop)?;
        if stop() {
            return None;
        }
        if let Some((torus, rms)) = fitted_torus(mesh, surface) {
            out.metrics.torus_ratio = Some(torus.ratio());
            out.metrics.torus_fit_rms = Some(rms);
        }
        (!stop()).then_some(())
    }

    fn seconds_per_gradient(
        &self,
        mesh: &PolyMesh,
        surface: &SubdivisionSurface,
        stop: &mut dyn FnMut() -> bool,
    ) -> Option<f64> {
        let options = self.options;
        let evaluator = SurfaceEnergy::new(surface, mesh.vertex_count(), options.quadrature);
        let x = flatten(mesh.positions());
        let (mut work, mut gradient) = (Workspace::default(), vec![0.0; x.len()]);
        let mut least = f64::INFINITY;
        for _ in 0..3 {
            if stop() {
                return None;
            }
            let begin = Instant::now();
            evaluator.gradient(&options.energy, &x, None, &mut work, &mut gradient);
            least = least.min(begin.elapsed().as_secs_f64());
        }
        Some(least)
    }
}

fn centroid(mesh: &PolyMesh) -> [f64; 3] {
    let sum: DVec3 = mesh.positions().iter().sum();
    (sum / mesh.vertex_count().max(1) as f64).to_array()
}

/// 1 for every face with no vertex of the boundary or of another valence than 4 within `rings` rings
/// of faces, 0 for the others.
fn plain_patches(mesh: &PolyMesh, rings: usize) -> Vec<u32> {
    let is_special = |v| mesh.is_boundary_vertex(v) || mesh.valence(v) != 4;
    let mut reached: Vec<bool> = mesh.vertices().map(is_special).collect();
    let mut plain = vec![1; mesh.face_count()];
    for _ in 0..rings.max(1) {
        let touched: Vec<FaceId> = mesh
            .faces()
            .filter(|f| plain[f.index()] > 0)
            .filter(|f| mesh.face_vertices(*f).any(|v| reached[v.index()]))
            .collect();
        for f in touched {
            plain[f.index()] = 0;
            mesh.face_vertices(f).for_each(|v| reached[v.index()] = true);
        }
    }
    plain
}

/// All energies of a surface, without the quads at the boundary if it is clamped; `None` once `stop`
/// says so.
pub(crate) fn energies(
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
    clamps: bool,
    quadrature: Quadrature,
    stop: &mut dyn FnMut() -> bool,
) -> Option<EnergyTable> {
    let mut counts = vec![1; mesh.face_count()];
    if clamps {
        skip_boundary(mesh, &mut counts);
    }
    if stop() {
        return None;
    }
    SurfaceEnergy::with_multiplicities(surface, mesh.vertex_count(), quadrature, &counts)
        .table_until(&flatten(mesh.positions()), &mut Workspace::default(), stop)
}

/// `|∫K dA − 2πχ| / ∫|K| dA` by the fine quadrature; NaN for an open surface; `None` once `stop`
/// says so.
pub(crate) fn gauss_bonnet_residual(
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
    stop: &mut dyn FnMut() -> bool,
) -> Option<f64> {
    if !mesh.boundary_loops().is_empty() {
        return Some(f64::NAN);
    }
    if stop() {
        return None;
    }
    let evaluator = SurfaceEnergy::new(surface, mesh.vertex_count(), Quadrature::FINE);
    let x = flatten(mesh.positions());
    let mut work = Workspace::default();
    let energy = Energy::from_functional(Functional::Gaussian);
    let total = evaluator.energy(&energy, &x, &mut work);
    if stop() {
        return None;
    }
    let want = std::f64::consts::TAU * mesh.euler_characteristic() as f64;
    Some((total - want).abs() / evaluator.absolute_gaussian(&x, &mut work))
}
