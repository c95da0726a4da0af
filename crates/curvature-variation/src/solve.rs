//! The whole run: levels, symmetry, constraints, measures.

use gp_solver::{Checkpoint, Extra, Observer, Problem, RunReport, Stage, Status};

use crate::checkpoint::{METHOD, levels_of, stage_name, with_levels};
use crate::error::Error;
use crate::evaluator::{EnergyTable, unflatten};
use crate::family;
use crate::functional::Functional;
use crate::grounds::Grounds;
use crate::input::Input;
use crate::level::{Begin, LevelNumbers, solve_level};
use crate::limits::{conditions, pulled_places, pulls};
use crate::metrics::{Measured, Meter};
use crate::options::Options;
use crate::placed::Placed;
use crate::schedule::Control;
use crate::solution::Solution;
use crate::variables::{control_points, fixed_vertices};

/// Minimises a curvature functional of the Catmull-Clark surface of a mesh of quads or n-gons.
///
/// The mesh is refined until all faces are quads with regular rings around extraordinary
/// vertices, minimised, refined and minimised again `levels` times. The result keeps the input's
/// place and, where nothing holds it, the input's area; it is faired around the origin and about one
/// unit large, so that neither its place nor its unit matters. With further members the fairest mesh of
/// their family is found instead, see [`Input::members`].
///
/// Checkpoints are offered at the start of every level, after every Gauss-Newton step and after every
/// round of L-BFGS (every step in a family); a resumed run ends with the same bytes.
///
/// # Errors
/// [`Error`] for what cannot be attempted. Ending early is a [`Status`] of the report.
///
/// # Example
/// ```
/// use curvature_variation::{Input, Options, solve};
/// let options = Options { energy: "bending".parse()?, levels: 0, ..Options::default() };
/// let torus = Input::from(fixtures::quad_graphs::torus(10, 8, 1.0, 0.5));
/// let solution = solve(&torus, &options, &mut ())?;
/// // The Clifford torus has bending energy 8 π².
/// assert!((solution.metrics.energy_final - 78.957).abs() < 0.5);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve(
    input: &Input,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    run(input, options, None, observer)
}

/// As [`solve`], with blocks of one's own: `extra` is called whenever a level has built its problem
/// and may add to it, weigh its blocks, take some out or fix unknowns. Unknowns are the control
/// points (group [`crate::CONTROL_POINTS`]) of the level's mesh, whose first vertices are those of
/// the level before; or the shares of a family (group [`crate::SHARES`]).
///
/// Added blocks join the minimisation with energy, gradient and Gauss-Newton matrix. They are not
/// looked at for symmetry, so none is kept where there are some.
///
/// # Errors
/// As [`solve`], and whatever `extra` returns.
///
/// # Example
/// Pull a vertex outwards:
/// ```
/// use curvature_variation::{CONTROL_POINTS, Input, Options, solve_with};
/// use curvature_variation::blocks::PulledPoints;
/// use geom_core::DVec3;
/// use gp_solver::{Problem, Stage, Variables};
/// let options = Options { levels: 0, iterations: 20, ..Options::default() };
/// let torus = fixtures::quad_graphs::torus(10, 8, 1.0, 0.5);
/// let place = 1.5 * torus.positions()[0];
/// let mut pull = |stage: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
///     let mut block = PulledPoints::new(variables.group(CONTROL_POINTS)?);
///     block.pull(&[(0, 1.0)], stage.place(place.to_array()).into(), 1e5);
///     problem.add(block);
///     Ok(())
/// };
/// let solution = solve_with(&Input::from(torus), &options, &mut pull, &mut ())?;
/// assert!(solution.result.positions()[0].distance(place) < 0.1);
/// # Ok::<(), curvature_variation::Error>(())
/// ```
pub fn solve_with(
    input: &Input,
    options: &Options,
    extra: &mut Extra<'_, Error>,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    run(input, options, Some(extra), observer)
}

/// The problem of the first level, made of the crate's [`blocks`](crate::blocks): pinned limits are
/// penalties in it, and no symmetry is kept. Of a family it is that of the shares.
///
/// # Errors
/// As [`solve`].
///
/// ```
/// use curvature_variation::{CONTROL_POINTS, Input, Options, problem};
/// let torus = Input::from(fixtures::quad_graphs::torus(6, 5, 1.0, 0.5));
/// let problem = problem(&torus, &Options::default())?;
/// assert_eq!(problem.variables().group(CONTROL_POINTS)?.len(), 30);
/// assert_eq!(problem.blocks().map(|(_, name)| name).collect::<Vec<_>>(), ["surface energy"]);
/// # Ok::<(), curvature_variation::Error>(())
/// ```
pub fn problem(input: &Input, options: &Options) -> Result<Problem<'static>, Error> {
    input.check(options)?;
    let Placed { input, options, .. } = &Placed::new(input, options)?;
    if !input.members.is_empty() {
        return family::problem(input, options);
    }
    let control = Control::first(input, options)?;
    let (grounds, ..) = grounds(input, options, &control, &mut ())?;
    let Control { mesh, creases, fixed } = &control;
    let surface = options.surface_of(mesh, creases)?;
    let fixed = fixed_vertices(mesh, fixed, grounds.constraints.clamp_boundary);
    let pulls = pulls(&grounds.places, mesh, &surface);
    let pins = conditions(&grounds.constraints, mesh, &surface);
    Ok(grounds.problem(mesh, &surface, control_points(&fixed), &pulls, &pins)?.0)
}

fn run(
    input: &Input,
    options: &Options,
    extra: Option<&mut Extra<'_, Error>>,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    input.check(options)?;
    let placed = Placed::new(input, options)?;
    placed.back(if input.members.is_empty() {
        fair(&placed, extra, observer)
    } else {
        family::solve(&placed, extra, observer)
    })
}

/// What all levels share, with the energies before anything moved.
fn grounds<'i>(
    input: &'i Input,
    options: &'i Options,
    control: &Control,
    observer: &mut dyn Observer,
) -> Result<(Grounds<'i>, EnergyTable), Error> {
    let constraints = input.constraints(options);
    let surface = options.surface_of(&control.mesh, &control.creases)?;
    let meter = meter(input, options);
    let stop = &mut || observer.stop_requested();
    let before = meter
        .energies(&control.mesh, &surface, options.quadrature, stop)
        .unwrap_or_else(EnergyTable::unknown);
    let area = before.get(Functional::Area);
    let places = pulled_places(&constraints, &control.mesh, &surface, area);
    let symmetries = input.symmetries.as_deref();
    Ok((Grounds { options, constraints, symmetries, area, places }, before))
}

fn meter<'o>(input: &Input, options: &'o Options) -> Meter<'o> {
    let clamps = input.constraints(options).clamp_boundary;
    Meter { options, clamps, pulls: !input.constraints.weights.is_empty() }
}

fn fair(
    placed: &Placed<'_>,
    mut extra: Option<&mut Extra<'_, Error>>,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    let Placed { input, options, .. } = placed;
    let fingerprint = input.fingerprint(options);
    let resume = observer.resume();
    if let Some(checkpoint) = &resume {
        checkpoint.check(METHOD, fingerprint)?;
    }
    let mut control = Control::first(input, options)?;
    let (grounds, before) = grounds(input, options, &control, observer)?;
    let count = options.levels + 1;
    let (mut stages, mut numbers): (Vec<_>, Vec<LevelNumbers>) = match &resume {
        Some(checkpoint) => levels_of(checkpoint, count)?,
        None => (Vec::new(), Vec::new()),
    };
    let first = stages.len();
    let mut is_stopped = observer.stop_requested();
    for level in 0..count {
        if is_stopped {
            break;
        }
        if level > 0 {
            control.refine()?;
        }
        if level < first {
            continue;
        }
        let resumed = resume.as_ref().filter(|c| c.stage == level);
        if let Some(checkpoint) = resumed {
            let start = checkpoint.numbers("start", 3 * control.mesh.vertex_count())?;
            control.mesh.positions_mut().copy_from_slice(&unflatten(start));
        }
        let name = stage_name(control.mesh.vertex_count());
        let stage = placed.stage(Stage::new(name, level, count));
        let frame = |state: Checkpoint| {
            let state = Checkpoint { method: METHOD.to_owned(), fingerprint, ..state };
            with_levels(state, &stages, &numbers)
        };
        let begin = Begin { stage: &stage, resumed, frame: &frame };
        let more = extra.as_deref_mut();
        match solve_level(&grounds, input, &mut control, &begin, more, observer)? {
            Some((report, level)) => {
                is_stopped = report.solver.status == Status::Interrupted;
                stages.push(report);
                numbers.push(level);
            }
            None => is_stopped = true,
        }
    }
    let Control { mesh, creases, .. } = control;
    // Made anew: no need to keep it while factors take most of the memory.
    let Control { mesh: initial, creases: initial_creases, .. } = Control::first(input, options)?;
    let surface = options.surface_of(&mesh, &creases)?;
    let measured =
        meter(input, options).measure(&mesh, &creases, &surface, &before, &stages, observer);
    let Measured { mut status, after, metrics, extrapolated, warnings } = measured;
    if is_stopped {
        status = Status::Interrupted;
    }
    Ok(Solution {
        initial_surface: options.surface_of(&initial, &initial_creases)?,
        initial,
        result: mesh,
        creases,
        surface,
        before,
        after,
        metrics,
        extrapolated,
        warnings,
        report: RunReport { status, ..RunReport::of_stages(stages) },
        levels: numbers,
        clamps: meter(input, options).clamps,
    })
}
