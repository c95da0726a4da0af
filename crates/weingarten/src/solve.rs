//! The whole run: scale, levels, solve, measure.

use std::ops::ControlFlow;

use bspline::BsplineSurface;
use gp_solver::{
    Checkpoint, Extra, Fingerprint, Observer, Problem, Progress, Run, RunReport, Stage,
    StageReport, Status, System,
};

use crate::error::Error;
use crate::level::Level;
use crate::locus::RelationLocus;
use crate::metrics::{Meter, Metrics};
use crate::options::Options;
use crate::prepare::prepared;
use crate::sampled::SampledSurface;
use crate::schedule::Schedule;
use crate::target::Target;
use crate::variables::{coordinates, scaled};

/// The name of the method in checkpoints.
const METHOD: &str = "weingarten";

/// An optimised surface with what is to be said about it.
#[derive(Clone, Debug)]
pub struct Solution {
    /// The surface, in units of the model.
    pub result: BsplineSurface,
    /// How Weingarten the input is, with the samples of the last level.
    pub before: Metrics,
    /// How Weingarten the result is.
    pub metrics: Metrics,
    /// Where the relation asked for holds in the curvature diagram, with the coefficients it ended
    /// with; none for [`crate::Relation::Free`].
    pub relation: Option<RelationLocus>,
    /// What the solver did: a stage per level, named after its net.
    pub report: RunReport,
    /// Samples in u and v of the last level.
    pub samples: [usize; 2],
    /// Working lengths per length of the model: the scale [`Metrics::relation_rms`] is measured on.
    pub working_scale: f64,
    /// Standard deviations of `H` and `K` at the start, on the working scale, if there is a
    /// relation: distances from fitted lines and curves are in units of them.
    pub relation_scale: Option<[f64; 2]>,
}

/// Optimises `surface` towards a Weingarten surface near to it.
///
/// # Errors
/// [`Error`] for what cannot be attempted. Not converging is a [`Status`] of the report.
///
/// # Example
/// ```
/// use bspline::{BsplineSurface, Degree, KnotVector};
/// use geom_core::DVec3;
/// use weingarten::{Options, solve};
/// let knots = KnotVector::clamped_uniform(Degree::new(4)?, 8)?;
/// let point = |i: usize, j: usize| {
///     let (x, y) = (i as f64 / 7.0, j as f64 / 7.0);
///     DVec3::new(x, y, 0.4 * x * x + 0.3 * x * y * y - 0.2 * y * y)
/// };
/// let net = (0..64).map(|k| point(k / 8, k % 8)).collect();
/// let surface = BsplineSurface::new(knots.clone(), knots, net, None)?;
/// let solution = solve(&surface, &Options::default(), &mut ())?;
/// assert!(solution.metrics.alignment_rms < 0.1 * solution.before.alignment_rms);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve(
    surface: &BsplineSurface,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    solve_with(surface, options, &mut |_, _, _| Ok(()), observer)
}

/// As [`solve`], with blocks of one's own: `extra` is called whenever a level has built its problem
/// and may add to it, weigh its blocks or take some out. Unknowns are the control points (group
/// [`crate::CONTROL_POINTS`]) in the coordinates of the [`Stage`].
///
/// # Errors
/// As [`solve`], and whatever `extra` returns.
///
/// # Example
/// Keep one control point where it is:
/// ```
/// use gp_solver::{Closeness, Problem, Stage, Variables};
/// use weingarten::{Options, solve_with};
/// let roof = fixtures::surfaces::Shape::Roof.surface(8, 7, 4, 4);
/// let mut hold = |_: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
///     let points = variables.group(weingarten::CONTROL_POINTS)?;
///     problem.variables_mut().fix(points, 24);
///     Ok(())
/// };
/// let solution = solve_with(&roof, &Options::default(), &mut hold, &mut ())?;
/// let moved = roof.control_points()[24].distance(solution.result.control_points()[24]);
/// assert!(moved < 1e-12);
/// # Ok::<(), weingarten::Error>(())
/// ```
pub fn solve_with(
    surface: &BsplineSurface,
    options: &Options,
    extra: &mut Extra<'_, Error>,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    let schedule = Schedule::new(surface, options)?;
    let fingerprint = fingerprint(surface, options);
    let resume = observer.resume();
    if let Some(checkpoint) = &resume {
        checkpoint.check(METHOD, fingerprint)?;
    }
    let first = resume.as_ref().map_or(0, |c| c.stage);
    let mut stages: Vec<StageReport> = Vec::new();
    let mut done: Option<(Level, SampledSurface, BsplineSurface)> = None;
    for number in first..schedule.len() {
        let level = schedule.level(number)?;
        let resumed = resume.as_ref().filter(|c| c.stage == number);
        let origin = match (&done, resumed) {
            (_, Some(checkpoint)) => checkpoint.numbers("start", level.unknowns())?.to_vec(),
            (None, None) => coordinates(&level.reference),
            (Some((.., working)), None) => coordinates(&level.refitted(working)?),
        };
        let solved = prepared(&level, options, &origin, extra)?;
        let system = System::new(solved.problem, solved.options.factorization)?;
        let mut run = Run::new(system, &solved.x, &solved.options)?;
        if let Some(checkpoint) = resumed {
            run.resume(checkpoint)?;
        }
        let mut watch = Watch { observer, stage: &level.stage, start: &origin, fingerprint };
        let status = run.go_on(&level.stage, &mut watch)?;
        let working = level.surface(&run.x()[..level.unknowns()])?;
        stages.push(StageReport { stage: level.stage.clone(), solver: run.report(status) });
        let start = level.sampled(&origin)?;
        done = Some((level, start, working));
        if status == Status::Interrupted {
            break;
        }
    }
    let Some((level, start, working)) = done else {
        let what = "a run with more levels".to_owned();
        return Err(gp_solver::SolverError::ForeignCheckpoint { what }.into());
    };
    finish(surface, options, &level, &start, &working, stages)
}

/// The problem of the first level, at its start.
///
/// # Errors
/// As [`solve`].
pub fn problem(surface: &BsplineSurface, options: &Options) -> Result<Problem<'static>, Error> {
    let level = Schedule::new(surface, options)?.level(0)?;
    let origin = coordinates(&level.reference);
    Ok(prepared(&level, options, &origin, &mut |_, _, _| Ok(()))?.problem)
}

/// Back to the model's units, measured and put together.
fn finish(
    input: &BsplineSurface,
    options: &Options,
    level: &Level,
    start: &SampledSurface,
    working: &BsplineSurface,
    stages: Vec<StageReport>,
) -> Result<Solution, Error> {
    let report = RunReport::of_stages(stages);
    // A net nothing has moved is the input itself, to the last bit.
    let is_input = report.iterations == 0 && options.levels.is_empty() && options.moves.is_empty();
    let result = if is_input { input.clone() } else { scaled(working, 1.0 / level.stage.unit)? };
    let target = level.target(options, start);
    let samples = [level.grid.u.len(), level.grid.v.len()];
    let meter = Meter::new(input, samples, level.stage.unit);
    Ok(Solution {
        before: meter.measure(input, target.as_ref()),
        metrics: meter.measure(&result, target.as_ref()),
        relation: target.as_ref().map(|target| meter.locus(&result, target)),
        report,
        result,
        samples,
        working_scale: level.stage.unit,
        relation_scale: target.as_ref().map(Target::deviation),
    })
}

/// Of everything a run depends on. More steps are no other run: a finished one may be taken further.
fn fingerprint(surface: &BsplineSurface, options: &Options) -> u64 {
    let mut of = Fingerprint::new();
    for point in surface.control_points() {
        of = of.numbers(&point.to_array());
    }
    of = of.numbers(surface.knots_u().knots()).numbers(surface.knots_v().knots());
    if let Some(weights) = surface.weights() {
        of = of.numbers(weights);
    }
    let options = Options { iterations: 0, ..options.clone() };
    of.text(&format!("{options:?}")).finish()
}

/// Shows a level to the observer of the run.
struct Watch<'o> {
    observer: &'o mut dyn Observer,
    stage: &'o Stage,
    start: &'o [f64],
    fingerprint: u64,
}

impl Observer for Watch<'_> {
    fn step(&mut self, progress: &Progress<'_>) -> ControlFlow<()> {
        // Control points only: auxiliary variables of the lifted formulation stay behind.
        let x = &progress.x[..self.start.len()];
        self.observer.step(&Progress { x, ..*progress })
    }

    fn stop_requested(&mut self) -> bool {
        self.observer.stop_requested()
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        let (stage, start, fingerprint) = (self.stage.number, self.start, self.fingerprint);
        self.observer.checkpoint(&|| {
            let state = state().with_numbers("start", start);
            Checkpoint { method: METHOD.to_owned(), fingerprint, stage, ..state }
        });
    }
}
