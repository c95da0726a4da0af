//! One level: its surface, symmetries, unknowns and metric, minimised.

use std::ops::ControlFlow;
use std::time::Instant;

use geom_core::{DMat3, PolyMesh};
use gp_solver::{
    Checkpoint, Extra, Observer, Problem, Progress, Report, SolverError, Stage, StageReport, Status,
};
use subdiv_catmull_clark::SubdivisionSurface;

use crate::descent::{Conditioned, LevelEnergy, Plan, State, minimise};
use crate::error::Error;
use crate::evaluator::{SurfaceEnergy, flatten, unflatten};
use crate::freedom::Freedom;
use crate::functional::Energy;
use crate::grounds::{Grounds, OwnWeights, skip_boundary};
use crate::input::Input;
use crate::limits::{Condition, Pull, conditions, linear_rows, pulls};
use crate::metric::MetricAssembly;
use crate::options::{Method, Symmetry};
use crate::schedule::{Control, effort};
use crate::symmetry::SymmetryGroup;
use crate::variables::{control_points, fixed_vertices};

/// How many times the initial energy below zero an energy counts as having no minimum.
const UNBOUNDED: f64 = 1e6;
/// An energy below this share of the start's has vanished.
const VANISHED: f64 = 1e-12;
/// How often a level that has stopped gaining, but not for want of something to gain, goes on.
const CERTIFICATES: usize = 40;

/// What a level was made of, beside what its [`StageReport`] says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LevelNumbers {
    /// Control vertices.
    pub vertices: usize,
    /// Patches.
    pub patches: usize,
    /// Patches of the fundamental domain: those that are evaluated.
    pub evaluated_patches: usize,
    /// Order of the symmetry group that was used.
    pub symmetries: usize,
    /// Stored values of the factor.
    pub factor_len: usize,
}

/// Where a level begins.
pub(crate) struct Begin<'b> {
    pub(crate) stage: &'b Stage,
    /// Goes on from here.
    pub(crate) resumed: Option<&'b Checkpoint>,
    /// Adds to the checkpoints what the run knows.
    pub(crate) frame: &'b dyn Fn(Checkpoint) -> Checkpoint,
}

/// What the caller added to a level.
struct Added {
    /// Blocks on the control points.
    blocks: Option<Problem<'static>>,
    weights: OwnWeights,
    /// Fixed coordinates, three per vertex.
    fixed: Vec<bool>,
}

/// Minimises on one level and moves the control mesh; `None` if it was stopped before it began.
///
/// # Errors
/// [`Error`] for what cannot be attempted.
pub(crate) fn solve_level(
    grounds: &Grounds<'_>,
    input: &Input,
    control: &mut Control,
    begin: &Begin<'_>,
    extra: Option<&mut Extra<'_, Error>>,
    observer: &mut dyn Observer,
) -> Result<Option<(StageReport, LevelNumbers)>, Error> {
    let clock = Instant::now();
    let Control { mesh, creases, fixed } = control;
    let (options, constraints) = (grounds.options, &grounds.constraints);
    let fixed = fixed_vertices(mesh, fixed, constraints.clamp_boundary);
    let surface = options.surface_of(mesh, creases)?;
    let pulls = pulls(&grounds.places, mesh, &surface);
    let pins = conditions(constraints, mesh, &surface);
    let added = added(grounds, mesh, &surface, &fixed, &pulls, &pins, begin.stage, extra)?;
    let is_extended = added.blocks.is_some() || added.fixed.chunks(3).any(|f| f != [f[0]; 3]);
    let fixed: Vec<bool> = added.fixed.chunks(3).map(|f| f.iter().all(|&f| f)).collect();
    if fixed.iter().all(|&f| f) {
        return Err(Error::NothingFree { vertices: mesh.vertex_count() });
    }
    let is_held = added.fixed.iter().any(|&f| f) || added.blocks.is_some();
    input.check_scale(&options.energy, constraints.clamp_boundary, is_held)?;
    if observer.stop_requested() {
        return Ok(None);
    }
    let pinned = constraints.concern_limits();
    let stop = &mut || observer.stop_requested();
    // Conditions on the limit surface and blocks of the caller's are not checked for symmetry, so
    // they switch it off.
    let group = match (grounds.symmetries, options.symmetry) {
        _ if pinned || is_extended => SymmetryGroup::trivial(mesh),
        (Some(rows), _) => {
            let matrices: Vec<DMat3> =
                rows.iter().map(|m| DMat3::from_cols_array_2d(m).transpose()).collect();
            SymmetryGroup::detect(mesh, stop).restricted_to(&matrices).keeping(&fixed)
        }
        (None, Symmetry::None) => SymmetryGroup::trivial(mesh),
        (None, Symmetry::Auto) => SymmetryGroup::detect(mesh, stop).keeping(&fixed),
    }
    .keeping_creases(mesh, creases);
    let freedom = if is_extended {
        Freedom::of_coordinates(mesh.positions(), &added.fixed)
    } else {
        Freedom::new(mesh.positions(), &fixed, &group)
    };
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
    if observer.stop_requested() {
        return Ok(None);
    }
    let (energy, pulls) = weighted(&options.energy, pulls, added.weights);
    let pins = if added.weights.pins > 0.0 { &pins[..] } else { &[] };
    let rows = linear_rows(pins, &freedom, mesh.vertex_count());
    let metric = match options.method {
        Method::Lbfgs if rows.is_empty() => None,
        _ => Some(MetricAssembly::new(
            &surface,
            &evaluator,
            &freedom,
            &pulls,
            added.blocks.as_ref(),
        )?),
    };
    let numbers = LevelNumbers {
        vertices: mesh.vertex_count(),
        patches: mesh.face_count(),
        evaluated_patches: evaluator.patch_count(),
        symmetries: group.elements.len(),
        factor_len: metric.as_ref().map_or(0, MetricAssembly::factor_len),
    };
    let x = flatten(mesh.positions());
    let y = freedom.restrict(&x);
    let is_scale_free = options.energy.is_scale_invariant() && !pinned && !is_held;
    let mut level = LevelEnergy::new(&evaluator, &freedom, &energy, x);
    (level.pulls, level.extra, level.scale_free) = (pulls, added.blocks, is_scale_free);
    let mut level = Conditioned::new(level, metric, rows);
    let start = flatten(mesh.positions());
    let (x, frame) = (start.clone(), begin.frame);
    let mut watch =
        Watch { observer, freedom: &freedom, x, start: &start, initial_energy: f64::NAN, frame };
    let mut state = State::new(y);
    let resumed = begin.resumed.map(|c| State::resumed(c, freedom.len())).transpose()?.flatten();
    let initial_energy = match (resumed, begin.resumed) {
        (Some(resumed), Some(checkpoint)) => {
            state = resumed;
            checkpoint.numbers("initial_energy", 1)?[0]
        }
        _ => {
            level.meet_conditions(&mut state.y, &mut watch)?;
            level.energy.energy(&state.y)
        }
    };
    if !initial_energy.is_finite() {
        return Err(Error::Singular);
    }
    let (newton_steps, tolerance) = effort(begin.stage.number, options);
    let plan =
        Plan { method: options.method, iterations: options.iterations, newton_steps, tolerance };
    let shown = watch.begin(&state, begin.stage, &plan, initial_energy);
    let mut report = if shown.is_break() {
        Report { status: Status::Interrupted, ..state.report.clone() }
    } else {
        watch.initial_energy = initial_energy;
        // Converged is only what a Gauss-Newton step, whatever the method was, cannot better by more
        // than the tolerance either; where it can, the run goes on from there.
        for certificates in 0.. {
            let ended = minimise(&mut level, &plan, &mut state, begin.stage, &mut watch);
            match ended {
                // Past all damping the Hessian is no longer finite.
                Err(SolverError::NotPositiveDefinite { .. }) => {
                    return Err(Error::Torn { energy: options.energy.to_string() });
                }
                other => other?,
            }
            let is_last = begin.stage.number + 1 == begin.stage.count;
            if !is_last || state.report.status != Status::Converged {
                break;
            }
            level.with_metric(|of| {
                MetricAssembly::new(&surface, &evaluator, &freedom, &of.pulls, of.extra.as_ref())
            })?;
            let energy = level.energy.energy(&state.y).abs();
            match level.left(&state.y, tolerance, &mut watch)? {
                // Stopped while it was looked at: the result stands, its status is not proven.
                None => state.report.status = Status::Interrupted,
                Some(left) if left.gain <= tolerance * energy => {}
                // Energies that have all but vanished have nothing to gain.
                Some(_) if energy <= VANISHED * initial_energy.abs() => {}
                Some(left)
                    if certificates < CERTIFICATES && state.report.iterations < plan.iterations =>
                {
                    state.go_on(left, &plan);
                    continue;
                }
                Some(_) => state.report.status = Status::Stalled,
            }
            break;
        }
        state.report.clone()
    };
    let y = &mut state.y;
    if is_scale_free {
        // Back to the size of the input, about the same centre.
        let scale = (grounds.area / level.energy.area(y)).sqrt();
        y.iter_mut().for_each(|y| *y *= scale);
    }
    let final_energy = level.energy.energy(y);
    // The functionals but `gaussian` and `mean_curvature` are at least zero, so that only negative
    // weights reach down here.
    if final_energy.is_nan() || final_energy < -UNBOUNDED * (1.0 + initial_energy.abs()) {
        let energy = options.energy.to_string();
        return Err(Error::Unbounded { energy, value: final_energy });
    }
    let moved = unflatten(level.energy.control_points(y));
    mesh.positions_mut().copy_from_slice(&moved);
    (report.initial_energy, report.final_energy) = (initial_energy, final_energy);
    report.timings.total = clock.elapsed();
    Ok(Some((StageReport { stage: begin.stage.clone(), solver: report }, numbers)))
}

/// Lets the caller add to the level's problem.
fn added(
    grounds: &Grounds<'_>,
    mesh: &PolyMesh,
    surface: &SubdivisionSurface,
    fixed: &[bool],
    pulls: &[Pull],
    pins: &[Condition],
    stage: &Stage,
    extra: Option<&mut Extra<'_, Error>>,
) -> Result<Added, Error> {
    let Some(extra) = extra else {
        let fixed = fixed.iter().flat_map(|&f| [f; 3]).collect();
        return Ok(Added { blocks: None, weights: OwnWeights::UNCHANGED, fixed });
    };
    let unknowns = control_points(fixed);
    let variables = unknowns.0.clone();
    let (mut problem, own) = grounds.problem(mesh, surface, unknowns, pulls, pins)?;
    extra(stage, &variables, &mut problem)?;
    let weights = own.take_out(&mut problem)?;
    problem.check()?;
    let fixed = problem.variables().fixed().to_vec();
    let has_blocks = problem.blocks().next().is_some();
    Ok(Added { blocks: has_blocks.then_some(problem), weights, fixed })
}

/// Energy and pulls with the weights a caller gave their blocks.
fn weighted(energy: &Energy, mut pulls: Vec<Pull>, weights: OwnWeights) -> (Energy, Vec<Pull>) {
    let terms = energy.terms.iter().map(|&(weight, term)| (weights.energy * weight, term));
    // Rows are weighed before they are squared.
    pulls.iter_mut().for_each(|pull| pull.factor *= weights.pulls * weights.pulls);
    (Energy { terms: terms.collect() }, pulls)
}

/// Shows a level to the observer of the run, by its control points.
struct Watch<'w> {
    observer: &'w mut dyn Observer,
    freedom: &'w Freedom,
    x: Vec<f64>,
    /// Control points at the start of the level.
    start: &'w [f64],
    initial_energy: f64,
    frame: &'w dyn Fn(Checkpoint) -> Checkpoint,
}

impl Watch<'_> {
    /// Shows where the level begins.
    fn begin(&mut self, state: &State, stage: &Stage, plan: &Plan, energy: f64) -> ControlFlow<()> {
        if state.report.iterations == 0 {
            self.checkpoint(&|| Checkpoint::new("", 0, stage.number, 0));
        }
        self.step(&Progress {
            stage,
            iteration: state.report.iterations,
            max_iterations: plan.iterations,
            energy,
            gradient_norm: state.report.gradient_norm,
            x: &state.y,
            system: None,
        })
    }
}

impl Observer for Watch<'_> {
    fn step(&mut self, progress: &Progress<'_>) -> ControlFlow<()> {
        self.freedom.expand(progress.x, &mut self.x);
        self.observer.step(&Progress { x: &self.x, ..*progress })
    }

    fn stop_requested(&mut self) -> bool {
        self.observer.stop_requested()
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        let Self { observer, start, initial_energy, frame, .. } = self;
        observer.checkpoint(&|| {
            let state = state().with_numbers("start", start);
            // There is none before the first step.
            let is_known = initial_energy.is_finite();
            let state = if is_known {
                state.with_numbers("initial_energy", &[*initial_energy])
            } else {
                state
            };
            frame(state)
        });
    }
}
