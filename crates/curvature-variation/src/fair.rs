//! Fairing a subdivision surface: levels, symmetry, constraints, report.

use crate::constraints::{
    Constraints, boundary_band, linear_rows, pulled_places, pulls, refine_fixed,
};
use crate::descent::{Level, Method};
use crate::evaluator::{EnergyTable, SurfaceEnergy, Workspace, flatten, unflatten};
use crate::freedom::Freedom;
use crate::functional::{Energy, Functional};
use crate::metric::MetricAssembly;
use crate::rules::Quadrature;
use crate::symmetry::SymmetryGroup;
use geom_core::{DMat3, DVec3, MeshError, PolyMesh, VertexId};
use gp_solver::{SolverError, Status};
use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;
use std::time::Instant;
use subdiv_catmull_clark::{
    Blend, Creases, INFINITE_SHARPNESS, SubdivisionError, SubdivisionSurface, refine,
    refinements_needed,
};

/// Which symmetries of the input are kept.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SymmetryMode {
    /// All that the mesh has; just one fundamental domain is then evaluated.
    #[default]
    Auto,
    /// None.
    None,
    /// Those with these matrices (row by row), of the symmetries about the mesh's centre.
    Declared(Vec<[[f64; 3]; 3]>),
}

/// Settings of [`fair`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct FairOptions {
    /// What is minimised.
    pub energy: Energy,
    /// Refinements after the first minimisation, each followed by another.
    pub levels: usize,
    /// Steps per level at most.
    pub iterations: usize,
    /// How a level is minimised.
    pub method: Method,
    /// How extraordinary vertices are repaired.
    pub blend: Blend,
    /// Rings of patches a smooth blend covers, where there is room; `None` for as many as
    /// [`SubdivisionSurface::with_rings`] finds best.
    pub blend_rings: Option<usize>,
    /// Gauss points while minimising.
    pub quadrature: Quadrature,
    /// A level has converged when a round of 40 steps (or 20 of them in a row) lowers the energy by
    /// `≤ tolerance · |E|`.
    pub tolerance: f64,
    /// Which symmetries are kept.
    pub symmetry: SymmetryMode,
}

impl Default for FairOptions {
    fn default() -> Self {
        Self {
            energy: Energy::default(),
            levels: 2,
            iterations: 2000,
            method: Method::default(),
            blend: Blend::default(),
            blend_rings: None,
            quadrature: Quadrature::NORMAL,
            tolerance: 1e-5,
            symmetry: SymmetryMode::default(),
        }
    }
}

impl FairOptions {
    /// The surface of a mesh with the blends these options ask for.
    pub(crate) fn surface_of(
        &self,
        mesh: &PolyMesh,
        creases: &Creases,
    ) -> Result<SubdivisionSurface, SubdivisionError> {
        SubdivisionSurface::with_rings(mesh, creases, self.blend, self.blend_rings)
    }
}

/// Why a surface cannot be faired.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum FairError {
    #[error(
        "all {faces} faces are triangles; turn the mesh into quads first, or start from a coarse quad mesh of the same topology"
    )]
    Triangles { faces: usize },
    #[error("vertex {vertex} belongs to no face; remove it")]
    IsolatedVertex { vertex: usize },
    #[error("the mesh has {components} separate parts; fair each of them on its own")]
    Disconnected { components: usize },
    #[error("all {vertices} vertices are fixed; free some of them")]
    NothingFree { vertices: usize },
    #[error("constraints name vertex {vertex}, but there are only {count}")]
    NoSuchVertex { vertex: usize, count: usize },
    #[error(
        "{energy} changes with the size of the surface, which is free: it would shrink to a point or grow for ever; fix some vertices or limit points, or use scale-invariant terms alone"
    )]
    ScaleFree { energy: String },
    #[error("vertex {vertex} is pulled with weight {weight}; give a number from 0 up")]
    Weight { vertex: u32, weight: f64 },
    #[error("the energy has no term with a weight other than zero")]
    NoEnergy,
    #[error("the energy is not finite at the start; the control mesh has folds or collapsed faces")]
    Singular,
    #[error(
        "{energy} has no minimum: it fell to {value:.1e} and the surface tore; raise the negative weights"
    )]
    Unbounded { energy: String, value: f64 },
    #[error(
        "{energy} has no minimum here: the surface tore while it was minimised; add bending or fix more vertices"
    )]
    Torn { energy: String },
    #[error(
        "--levels {levels} would make about {vertices} vertices; at most {limit} are supported"
    )]
    TooManyLevels { levels: usize, vertices: usize, limit: usize },
    #[error("mesh {member} of the family has other faces than the input; move its vertices only")]
    OtherFaces { member: usize },
    #[error(transparent)]
    Mesh(#[from] MeshError),
    #[error(transparent)]
    Subdivision(#[from] SubdivisionError),
    #[error(transparent)]
    Solver(#[from] SolverError),
}

/// Vertices a level may have.
const MAX_VERTICES: usize = 400_000;
/// How many times the initial energy below zero an energy counts as having no minimum.
const UNBOUNDED: f64 = 1e6;
/// Gauss-Newton steps that open a level: the first, and the later ones.
const FIRST_NEWTON_STEPS: usize = 25;
const LATER_NEWTON_STEPS: usize = 4;

/// Relative quadrature gap above which a result does not count as converged: the control mesh has
/// folded up between the quadrature points.
const LARGEST_GAP: f64 = 0.01;
/// Differences of an energy below this are rounding errors: a flat sheet has no other energy.
const NO_ENERGY: f64 = 1e-9;

/// How much larger the tolerance of the levels before the last two is.
const COARSE_TOLERANCE: f64 = 100.0;

/// What happened on one level.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelReport {
    /// Control vertices.
    pub vertices: usize,
    /// Patches, and how many of them are evaluated thanks to symmetry.
    pub patches: usize,
    /// Patches of the fundamental domain.
    pub evaluated_patches: usize,
    /// Unknowns.
    pub unknowns: usize,
    /// Order of the symmetry group that was used.
    pub symmetries: usize,
    /// How the level ended.
    pub status: Status,
    /// Steps taken.
    pub iterations: usize,
    /// Energies and gradients computed.
    pub evaluations: usize,
    /// Factorisations of a metric.
    pub factorizations: usize,
    /// Stored values of the factor.
    pub factor_len: usize,
    /// The energy with the pulls of [`Constraints::weights`] before.
    pub initial_energy: f64,
    /// The same of the result.
    pub final_energy: f64,
    /// The same of all steps.
    pub history: Vec<f64>,
    /// Seconds, tables and symmetry search included.
    pub seconds: f64,
}

/// What [`fair`] did.
#[derive(Clone, Debug, PartialEq)]
pub struct FairReport {
    /// How the last level ended; `Stalled` in place of `Converged` if the quadrature gap is above
    /// 1 %.
    pub status: Status,
    /// Steps on all levels.
    pub iterations: usize,
    /// Every level.
    pub levels: Vec<LevelReport>,
    /// All functionals on the first level's mesh before anything moved.
    pub before: EnergyTable,
    /// All functionals of the result, by the fine quadrature.
    pub after: EnergyTable,
    /// The minimised energy before.
    pub energy_initial: f64,
    /// The minimised energy of the result, by the fine quadrature.
    pub energy_final: f64,
    /// Relative difference of the energy between the quadrature used and the fine one.
    pub quadrature_gap: f64,
    /// `|∫K − 2πχ| / ∫|K|` of the result; NaN for an open surface and one with sharp
    /// edges.
    pub gauss_bonnet_residual: f64,
    /// Norm of the gradient at the end, in the metric of the method.
    pub gradient_norm: f64,
    /// Seconds of one energy and gradient of the whole result, the least of three.
    pub seconds_per_gradient: f64,
    /// Limit for vanishing mesh size by Richardson's extrapolation of the last two levels, whose
    /// errors are in ratio 4.
    pub extrapolated: Option<f64>,
}

/// A faired surface.
#[derive(Clone, Debug)]
pub struct Fairing {
    /// The first level's control mesh before anything moved: quads, refined as far as needed.
    pub initial: PolyMesh,
    /// Its surface.
    pub initial_surface: SubdivisionSurface,
    /// The control mesh of the result.
    pub mesh: PolyMesh,
    /// The creases of the result.
    pub creases: Creases,
    /// The surface of the result.
    pub surface: SubdivisionSurface,
    /// What happened.
    pub report: FairReport,
}

/// What an observer sees after every step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FairProgress {
    /// Level, from 0.
    pub level: usize,
    /// Levels in all.
    pub levels: usize,
    /// Vertices of the level.
    pub vertices: usize,
    /// Step on this level.
    pub iteration: usize,
    /// Energy.
    pub energy: f64,
}

/// Minimises a curvature functional of the Catmull-Clark surface of a mesh of quads or n-gons.
///
/// The mesh is refined until all faces are quads with regular rings around extraordinary
/// vertices, minimised, refined and minimised again `levels` times. The result keeps the input's
/// place and, where nothing holds it, the input's area.
///
/// # Errors
/// [`FairError`] for what cannot be attempted. Ending early is a status of the report.
pub fn fair(
    mesh: &PolyMesh,
    creases: &Creases,
    constraints: &Constraints,
    options: &FairOptions,
    mut observer: impl FnMut(&FairProgress) -> ControlFlow<()>,
) -> Result<Fairing, FairError> {
    check_input(mesh, constraints, options)?;
    let mut fixed = vec![false; mesh.vertex_count()];
    constraints.vertices.iter().for_each(|&v| fixed[v as usize] = true);
    let (mut mesh, mut creases) = (mesh.clone(), creases.clone());
    for _ in 0..refinements_needed(&mesh, &creases) {
        let fine = refine(&mesh, &creases)?;
        fixed = refine_fixed(&fixed, &fine.stencils);
        (mesh, creases) = (fine.mesh, fine.creases);
    }
    let estimate = mesh.vertex_count() << (2 * options.levels.min(16));
    if estimate > MAX_VERTICES {
        let (levels, vertices, limit) = (options.levels, estimate, MAX_VERTICES);
        return Err(FairError::TooManyLevels { levels, vertices, limit });
    }
    let (initial, initial_creases) = (mesh.clone(), creases.clone());
    // Made anew at the end: no need to keep it while factors take most of the memory.
    let (before, area, places) = {
        let surface = options.surface_of(&initial, &creases)?;
        let before = energies(&initial, &surface, constraints, options.quadrature);
        let area = before.get(Functional::Area);
        let places = pulled_places(constraints, &initial, &surface, area);
        (before, area, places)
    };
    let mut levels = Vec::new();
    let mut gradient_norm = f64::NAN;
    let mut interrupted = false;
    for level in 0..=options.levels {
        if level > 0 {
            if interrupted {
                break;
            }
            let fine = refine(&mesh, &creases)?;
            fixed = refine_fixed(&fixed, &fine.stencils);
            (mesh, creases) = (fine.mesh, fine.creases);
        }
        let vertices = mesh.vertex_count();
        let mut watch = |iteration: usize, energy: f64| {
            observer(&FairProgress {
                level,
                levels: options.levels + 1,
                vertices,
                iteration,
                energy,
            })
        };
        let (report, norm) = minimise_level(
            &mut mesh,
            &creases,
            &fixed,
            constraints,
            &places,
            options,
            level,
            area,
            &mut watch,
        )?;
        interrupted = report.status == Status::Interrupted;
        gradient_norm = norm;
        levels.push(report);
    }
    let surface = options.surface_of(&mesh, &creases)?;
    let mut report = finished(&mesh, &surface, constraints, options, before, levels, gradient_norm);
    let sharp = |h| creases.sharpness(mesh.origin(h), mesh.target(h)) == INFINITE_SHARPNESS;
    if mesh.edges().any(sharp) {
        // A sharp edge holds curvature that the patches do not have.
        report.gauss_bonnet_residual = f64::NAN;
    }
    let initial_surface = options.surface_of(&initial, &initial_creases)?;
    Ok(Fairing { initial, initial_surface, mesh, creases, surface, report })
}

/// The report of a minimisation: all energies of the result, and what checks them.
pub(crate) fn finished(
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
    constraints: &Constraints,
    options: &FairOptions,
    before: EnergyTable,
    levels: Vec<LevelReport>,
    gradient_norm: f64,
) -> FairReport {
    let coarse = energies(mesh, surface, constraints, options.quadrature);
    let after = energies(mesh, surface, constraints, Quadrature::FINE);
    let energy_final = after.total(&options.energy);
    let difference = (coarse.total(&options.energy) - energy_final).abs();
    let quadrature_gap = if difference == 0.0 { 0.0 } else { difference / energy_final.abs() };
    let status = match levels.last().map_or(Status::Interrupted, |l| l.status) {
        // What was minimised is not the surface's energy then.
        Status::Converged if quadrature_gap > LARGEST_GAP && difference > NO_ENERGY => {
            Status::Stalled
        }
        status => status,
    };
    let extrapolated = match &levels[..] {
        [.., a, b] if status != Status::Interrupted && constraints.weights.is_empty() => {
            Some(energy_final - (a.final_energy - b.final_energy) / 3.0)
        }
        _ => None,
    };
    FairReport {
        status,
        iterations: levels.iter().map(|l| l.iterations).sum(),
        energy_initial: before.total(&options.energy),
        energy_final,
        quadrature_gap,
        gauss_bonnet_residual: gauss_bonnet_residual(mesh, surface),
        gradient_norm,
        seconds_per_gradient: time_gradient(mesh, surface, options),
        extrapolated,
        before,
        after,
        levels,
    }
}

pub(crate) fn check_input(
    mesh: &PolyMesh,
    constraints: &Constraints,
    options: &FairOptions,
) -> Result<(), FairError> {
    if mesh.faces().all(|f| mesh.face_degree(f) == 3) {
        return Err(FairError::Triangles { faces: mesh.face_count() });
    }
    if let Some(v) = mesh.vertices().find(|&v| mesh.outgoing(v).is_none()) {
        return Err(FairError::IsolatedVertex { vertex: v.index() });
    }
    let (_, components) = mesh.components();
    if components > 1 {
        return Err(FairError::Disconnected { components });
    }
    if let Some(v) = constraints.largest_vertex()
        && v as usize >= mesh.vertex_count()
    {
        let (vertex, count) = (v as usize, mesh.vertex_count());
        return Err(FairError::NoSuchVertex { vertex, count });
    }
    if let Some(&(vertex, weight)) =
        constraints.weights.iter().find(|w| !(w.1 >= 0.0 && w.1.is_finite()))
    {
        return Err(FairError::Weight { vertex, weight });
    }
    let energy = &options.energy;
    if energy.terms.iter().all(|t| t.0 == 0.0) {
        return Err(FairError::NoEnergy);
    }
    let held = !constraints.vertices.is_empty()
        || constraints.limit_points.len() + constraints.weights.len() > 1
        || (constraints.clamp_boundary && !mesh.boundary_loops().is_empty());
    if !energy.is_scale_invariant() && !held {
        return Err(FairError::ScaleFree { energy: energy.to_string() });
    }
    Ok(())
}

fn minimise_level(
    mesh: &mut PolyMesh,
    creases: &Creases,
    fixed: &[bool],
    constraints: &Constraints,
    places: &[(u32, DVec3, f64)],
    options: &FairOptions,
    level: usize,
    area: f64,
    observer: &mut dyn FnMut(usize, f64) -> ControlFlow<()>,
) -> Result<(LevelReport, f64), FairError> {
    let begin = Instant::now();
    let mut fixed = fixed.to_vec();
    if constraints.clamp_boundary {
        let band = boundary_band(mesh, 2);
        fixed.iter_mut().zip(band).for_each(|(f, b)| *f |= b);
    }
    if fixed.iter().all(|&f| f) {
        return Err(FairError::NothingFree { vertices: mesh.vertex_count() });
    }
    let surface = options.surface_of(mesh, creases)?;
    let pinned = constraints.concern_limits();
    // Conditions on the limit surface are not checked for symmetry, so they switch it off.
    let group = match &options.symmetry {
        _ if pinned => SymmetryGroup::trivial(mesh),
        SymmetryMode::None => SymmetryGroup::trivial(mesh),
        SymmetryMode::Auto => SymmetryGroup::detect(mesh).keeping(&fixed),
        SymmetryMode::Declared(rows) => {
            let matrices: Vec<DMat3> =
                rows.iter().map(|m| DMat3::from_cols_array_2d(m).transpose()).collect();
            SymmetryGroup::detect(mesh).restricted_to(&matrices).keeping(&fixed)
        }
    }
    .keeping_creases(mesh, creases);
    let freedom = Freedom::new(mesh.positions(), &fixed, &group);
    let mut multiplicities = group.face_multiplicities();
    if constraints.clamp_boundary {
        skip_boundary(mesh, &mut multiplicities);
    }
    let evaluator = SurfaceEnergy::with_multiplicities(
        &surface,
        mesh.vertex_count(),
        options.quadrature,
        &multiplicities,
    );
    let rows = linear_rows(constraints, mesh, &surface, &freedom);
    let pulls = pulls(places, mesh, &surface);
    let metric = match options.method {
        Method::Lbfgs if rows.is_empty() => None,
        _ => Some(MetricAssembly::new(&surface, &evaluator, &freedom, &pulls)?),
    };
    let factor_len = metric.as_ref().map_or(0, MetricAssembly::factor_len);
    let x = flatten(mesh.positions());
    let scale_free = options.energy.is_scale_invariant() && !pinned && !fixed.iter().any(|&f| f);
    let mut state = Level {
        evaluator: &evaluator,
        freedom: &freedom,
        energy: &options.energy,
        metric,
        rows,
        pulls,
        scale_free,
        barrier: 0.0,
        y: freedom.restrict(&x),
        x,
        work: Workspace::default(),
    };
    state.meet_conditions()?;
    let initial_energy = state.energy();
    if !initial_energy.is_finite() {
        return Err(FairError::Singular);
    }
    let newton_steps = if level == 0 { FIRST_NEWTON_STEPS } else { LATER_NEWTON_STEPS };
    // The next level moves the surface more than the last steps here would. The one before the last
    // is driven on: Richardson's extrapolation stands on its energy.
    let coarse = level + 1 < options.levels;
    let tolerance = if coarse { COARSE_TOLERANCE } else { 1.0 } * options.tolerance;
    let descent =
        state.minimise(options.method, options.iterations, newton_steps, tolerance, observer);
    let descent = match descent {
        // Past all damping the Hessian is no longer finite.
        Err(SolverError::NotPositiveDefinite { .. }) => {
            return Err(FairError::Torn { energy: options.energy.to_string() });
        }
        other => other?,
    };
    freedom.expand(&state.y, &mut state.x);
    if scale_free {
        // Back to the size of the input, about the same centre.
        let scale = (area / evaluator.area(&state.x, &mut state.work)).sqrt();
        state.y.iter_mut().for_each(|y| *y *= scale);
    }
    let final_energy = state.energy();
    // The functionals but `gaussian` and `mean_curvature` are at least zero, so that only negative
    // weights reach down here.
    if final_energy.is_nan() || final_energy < -UNBOUNDED * (1.0 + initial_energy.abs()) {
        let energy = options.energy.to_string();
        return Err(FairError::Unbounded { energy, value: final_energy });
    }
    mesh.positions_mut().copy_from_slice(&unflatten(&state.x));
    let report = LevelReport {
        vertices: mesh.vertex_count(),
        patches: mesh.face_count(),
        evaluated_patches: evaluator.patch_count(),
        unknowns: freedom.len(),
        symmetries: group.elements.len(),
        status: descent.status,
        iterations: descent.iterations,
        evaluations: descent.evaluations,
        factorizations: descent.factorizations,
        factor_len,
        initial_energy,
        final_energy,
        history: descent.history,
        seconds: begin.elapsed().as_secs_f64(),
    };
    Ok((report, descent.gradient_norm))
}

fn skip_boundary(mesh: &PolyMesh, multiplicities: &mut [u32]) {
    for f in mesh.faces() {
        if mesh.face_vertices(f).any(|v: VertexId| mesh.is_boundary_vertex(v)) {
            multiplicities[f.index()] = 0;
        }
    }
}

pub(crate) fn energies(
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
    constraints: &Constraints,
    quadrature: Quadrature,
) -> EnergyTable {
    let mut multiplicities = vec![1; mesh.face_count()];
    if constraints.clamp_boundary {
        skip_boundary(mesh, &mut multiplicities);
    }
    SurfaceEnergy::with_multiplicities(surface, mesh.vertex_count(), quadrature, &multiplicities)
        .table(&flatten(mesh.positions()), &mut Workspace::default())
}

fn time_gradient(mesh: &PolyMesh, surface: &SubdivisionSurface, options: &FairOptions) -> f64 {
    let evaluator = SurfaceEnergy::new(surface, mesh.vertex_count(), options.quadrature);
    let x = flatten(mesh.positions());
    let (mut work, mut gradient) = (Workspace::default(), vec![0.0; x.len()]);
    let run = |_| {
        let begin = Instant::now();
        evaluator.gradient(&options.energy, &x, None, &mut work, &mut gradient);
        begin.elapsed().as_secs_f64()
    };
    (0..3).map(run).fold(f64::INFINITY, f64::min)
}

/// `|∫K dA − 2πχ| / ∫|K| dA` by the fine quadrature; NaN for an open surface.
pub(crate) fn gauss_bonnet_residual(mesh: &PolyMesh, surface: &SubdivisionSurface) -> f64 {
    if !mesh.boundary_loops().is_empty() {
        return f64::NAN;
    }
    let evaluator = SurfaceEnergy::new(surface, mesh.vertex_count(), Quadrature::FINE);
    let x = flatten(mesh.positions());
    let mut work = Workspace::default();
    let energy = Energy::from_functional(Functional::Gaussian);
    let total = evaluator.energy(&energy, &x, &mut work);
    let want = std::f64::consts::TAU * mesh.euler_characteristic() as f64;
    (total - want).abs() / evaluator.absolute_gaussian(&x, &mut work)
}
