//! The whole run: scale, levels, solve, measure.

use std::ops::ControlFlow;

use bspline::{BsplineSurface, Flaw};
use gp_solver::{
    Checkpoint, Extra, Fingerprint, Observer, Problem, Progress, Run, RunReport, Stage,
    StageReport, Status, System,
};

use crate::best::{Best, Judge};
use crate::corners::{HeldCorner, held_corners};
use crate::error::Error;
use crate::field::Sample;
use crate::input::Input;
use crate::level::Level;
use crate::locus::RelationLocus;
use crate::metrics::{Meter, Metrics};
use crate::miss::RelationMiss;
use crate::options::{Formulation, Options};
use crate::prepare::prepared;
use crate::schedule::Schedule;
use crate::stall::Recent;
use crate::target::Target;
use crate::variables::{coordinates, scaled};

/// Over how many last steps it is told what they changed.
const LAST_STEPS: usize = 10;
/// The name of the method in checkpoints.
const METHOD: &str = "weingarten";

/// An optimised surface with what is to be said about it.
///
/// # Example
/// ```
/// use weingarten::{Options, Status, solve};
/// let roof = fixtures::surfaces::Shape::Roof.surface(8, 7, 4, 4);
/// let options = Options { iterations: 3, ..Options::default() };
/// let solution = solve(&roof, &options, &mut ())?;
/// assert_eq!(solution.report.status, Status::IterationLimit);
/// assert_eq!((solution.result.n_u(), solution.samples), (8, [16, 14]));
/// // What the steps did, term by term.
/// let history = &solution.report.stages[0].solver.history;
/// assert_eq!(history.len(), 4);
/// assert!(history[3].energy < history[0].energy);
/// # Ok::<(), weingarten::Error>(())
/// ```
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
    /// How far the result is from the relation asked for, and where most.
    pub miss: Option<RelationMiss>,
    /// Corners that keep a mean curvature asked for from being reached while the border is held.
    pub held_corners: Vec<HeldCorner>,
    /// What the solver did: a stage per level, named after its net.
    pub report: RunReport,
    /// Samples in u and v of the last level.
    pub samples: [usize; 2],
    /// Working lengths per length of the model: the scale [`Metrics::relation_rms`] is measured on.
    pub working_scale: f64,
    /// Standard deviations of `H` and `K` at the start, on the working scale, if there is a
    /// relation: distances from fitted lines and curves are in units of them.
    pub relation_scale: Option<[f64; 2]>,
    /// Where the result is torn or folded between the samples, checked on a grid ten times as dense;
    /// the status of the report is [`Status::Failed`] then.
    pub flaws: Vec<Flaw>,
    /// How many steps before the end, ten at most, and what the metrics were there; none where the
    /// run ended otherwise than by the number of steps.
    pub earlier: Option<(usize, Metrics)>,
    target: Option<Target>,
}

impl Solution {
    /// How far places with these mean and Gaussian curvatures, in units of the model, are from the relation
    /// asked for, as a share of the size of the curvatures (of the input's spread for curves and fitted
    /// lines, which are fitted to these places). `None` if there is no relation, or a curvature is not
    /// finite.
    ///
    /// # Panics
    /// If there are not as many of the one as of the other.
    ///
    /// # Example
    /// ```
    /// use weingarten::{Options, Relation, solve};
    /// let saddle = fixtures::surfaces::Shape::Saddle.surface(8, 8, 4, 4);
    /// let options = Options { relation: Relation::Minimal, ..Options::default() };
    /// let solution = solve(&saddle, &options, &mut ())?;
    /// let misses = solution.relation_misses(&[0.0, 0.1], &[-1.0, -1.0]).expect("a relation");
    /// assert!(misses[0] == 0.0 && misses[1] > 0.0);
    /// # Ok::<(), weingarten::Error>(())
    /// ```
    #[must_use]
    pub fn relation_misses(&self, h: &[f64], k: &[f64]) -> Option<Vec<f64>> {
        assert_eq!(h.len(), k.len(), "as many mean as Gaussian curvatures");
        let target = self.target.as_ref()?;
        let unit = self.working_scale;
        let place = |(h, k): (&f64, &f64)| Sample::of_curvatures(h / unit, k / (unit * unit));
        let places: Vec<Sample> = h.iter().zip(k).map(place).collect();
        let is_finite = places.iter().all(|s| s.jet.h.is_finite() && s.jet.k.is_finite());
        let natural = target.natural();
        is_finite.then(|| target.distances(&places).iter().map(|d| d.abs() / natural).collect())
    }
}

/// Optimises a surface (`&BsplineSurface`, or an [`Input`]) towards a Weingarten surface near to
/// it.
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
/// let options = Options { iterations: 20, ..Options::default() };
/// let solution = solve(&surface, &options, &mut ())?;
/// assert!(solution.metrics.alignment_rms < 0.1 * solution.before.alignment_rms);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn solve<'a>(
    input: impl Into<Input<'a>>,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    solve_with(input, options, &mut |_, _, _| Ok(()), observer)
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
pub fn solve_with<'a>(
    input: impl Into<Input<'a>>,
    options: &Options,
    extra: &mut Extra<'_, Error>,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    let given = input.into();
    let place = given.surface.normalization()?;
    let centred = given.surface.translated(-place.center());
    let input = Input { surface: &centred, ..given };
    if let Some(start) = given.start {
        if options.formulation == Formulation::Lifted {
            return Err(Error::NeedsReduced { what: "a start" });
        }
        check_domain(given.surface, start)?;
    }
    let schedule = Schedule::new(input, &place, options)?;
    let fingerprint = fingerprint(given, options);
    let resume = observer.resume();
    if let Some(checkpoint) = &resume {
        checkpoint.check(METHOD, fingerprint)?;
    }
    let first = resume.as_ref().map_or(0, |c| c.stage);
    let mut steps = match &resume {
        Some(checkpoint) => checkpoint.counts("steps")?.first().map_or(0, |n| *n as usize),
        None => 0,
    };
    let mut stages: Vec<StageReport> = Vec::new();
    let mut done: Option<(Level, BsplineSurface)> = None;
    let mut earlier: Option<(usize, Vec<f64>)> = None;
    let mut has_gone_astray = false;
    for number in first..schedule.len() {
        let level = schedule.level(number)?;
        let resumed = resume.as_ref().filter(|c| c.stage == number);
        let origin = match (&done, resumed) {
            (_, Some(checkpoint)) => checkpoint.numbers("start", level.unknowns())?.to_vec(),
            (None, None) => coordinates(&level.reference),
            (Some((_, working)), None) => {
                level.bordered(options.border, coordinates(&level.refitted(working)?))
            }
        };
        // The terms are those of the reference, wherever the run begins.
        let begin = match (number, given.start) {
            (0, Some(start)) => level.bordered(options.border, level.started(start, &place)?),
            _ => origin.clone(),
        };
        let solved = prepared(&level, options, &origin, &begin, extra)?;
        // By what the energy has beside the relation or the alignment, an iterate may be better although
        // these are worse.
        let is_judged = options.formulation == Formulation::Reduced
            && options.parallel == 0.0
            && !solved.has_extra;
        let judge = is_judged.then(|| Judge::new(&level, resumed.and_then(best_of)));
        let system = System::new(solved.problem, solved.options.factorization)?;
        let mut run = Run::new(system, &solved.x, &solved.options)?;
        if let Some(checkpoint) = resumed {
            run.resume(checkpoint)?;
        }
        let mut watch = Watch {
            observer,
            stage: &level.stage,
            start: &origin,
            steps,
            fingerprint,
            earlier: None,
            recent: level
                .recent(options)
                .resumed(resumed.and_then(|checkpoint| checkpoint.numbers.get("recent"))),
            has_stalled: false,
            judge,
        };
        let mut status = run.go_on(&level.stage, &mut watch)?;
        if watch.has_stalled {
            status = Status::Stalled;
        }
        earlier = watch.earlier.filter(|_| status == Status::IterationLimit);
        steps += run.iterations();
        stages.push(StageReport { stage: level.stage.clone(), solver: run.report(status) });
        let last = &run.x()[..level.unknowns()];
        let judge = watch.judge.filter(|_| status != Status::Interrupted);
        let better = judge.and_then(|judge| judge.other_than(run.iterations(), last));
        has_gone_astray = better.is_some() && level.target().is_some();
        let working = level.surface(better.as_deref().unwrap_or(last))?;
        done = Some((level, working));
        if status == Status::Interrupted {
            break;
        }
    }
    let Some((level, working)) = done else {
        let what = "a run with more levels".to_owned();
        return Err(gp_solver::SolverError::ForeignCheckpoint { what }.into());
    };
    let report = RunReport { iterations: steps, ..RunReport::of_stages(stages) };
    // A net nothing has moved is the input itself, to the last bit.
    let is_input = steps == 0 && options.levels.is_empty() && options.moves.is_empty();
    let working = if is_input { None } else { Some(&working) };
    let finished = finish(
        input,
        place.size(),
        options,
        schedule.target(),
        &level,
        working,
        earlier,
        has_gone_astray,
        report,
    )?;
    let result =
        if is_input { given.surface.clone() } else { finished.result.translated(place.center()) };
    Ok(Solution { result, ..finished })
}

/// The problem of the first level, at its start.
///
/// # Errors
/// As [`solve`].
///
/// # Example
/// ```
/// use weingarten::{CONTROL_POINTS, Options, problem};
/// let roof = fixtures::surfaces::Shape::Roof.surface(8, 7, 4, 4);
/// let problem = problem(&roof, &Options::default())?;
/// assert_eq!(problem.variables().group(CONTROL_POINTS)?.shape(), [8, 7]);
/// assert!(problem.blocks().any(|(_, name)| name == "alignment"));
/// # Ok::<(), weingarten::Error>(())
/// ```
pub fn problem<'a>(
    input: impl Into<Input<'a>>,
    options: &Options,
) -> Result<Problem<'static>, Error> {
    let given = input.into();
    let place = given.surface.normalization()?;
    let centred = given.surface.translated(-place.center());
    let level = Schedule::new(Input { surface: &centred, ..given }, &place, options)?.level(0)?;
    let origin = coordinates(&level.reference);
    Ok(prepared(&level, options, &origin, &origin, &mut |_, _, _| Ok(()))?.problem)
}

/// Back to the model's units, but still centred, measured and put together. Curvatures are measured
/// here because far from the origin rounding would eat their derivatives.
fn finish(
    input: Input<'_>,
    size: f64,
    options: &Options,
    target: Option<&Target>,
    level: &Level,
    working: Option<&BsplineSurface>,
    earlier: Option<(usize, Vec<f64>)>,
    has_gone_astray: bool,
    mut report: RunReport,
) -> Result<Solution, Error> {
    let result = match working {
        Some(working) => scaled(working, 1.0 / level.stage.unit)?,
        None => input.surface.clone(),
    };
    let samples = [level.grid.u.len(), level.grid.v.len()];
    let mut flaws =
        if report.iterations > 0 { result.flaws_against(input.surface) } else { Vec::new() };
    if let Some(trim) = input.trim {
        flaws.retain(|flaw| trim.contains(flaw.u, flaw.v));
    }
    let meter = Meter::new(input, size, samples, level.stage.unit);
    let earlier = match earlier {
        Some((steps, x)) => {
            let surface = scaled(&level.surface(&x)?, 1.0 / level.stage.unit)?;
            Some((steps, meter.measure(&surface, target)))
        }
        None => None,
    };
    let miss = target.map(|target| meter.miss(&result, target));
    report.status = verdict(report.status, !flaws.is_empty(), has_gone_astray, miss.as_ref());
    let unit = level.stage.unit;
    let held_corners = target
        .map(|target| held_corners(input.surface, options.border, target, unit))
        .unwrap_or_default();
    Ok(Solution {
        miss,
        held_corners,
        target: target.cloned(),
        before: meter.measure(input.surface, target),
        metrics: meter.measure(&result, target),
        relation: target.map(|target| meter.locus(&result, target)),
        report,
        earlier,
        result,
        samples,
        flaws,
        working_scale: level.stage.unit,
        relation_scale: target.map(Target::deviation),
    })
}

/// The status of a run that ended with `ended`: torn results are none, and where the relation asked for
/// does not hold, the best surface near to the input has been found and not the one wanted.
fn verdict(
    ended: Status,
    is_torn: bool,
    has_gone_astray: bool,
    miss: Option<&RelationMiss>,
) -> Status {
    let is_missed = miss.is_some_and(|miss| !miss.is_held());
    match ended {
        Status::Interrupted => ended,
        _ if is_torn => Status::Failed,
        Status::Converged if is_missed => Status::Stalled,
        // The last steps only led away.
        Status::IterationLimit if is_missed && has_gone_astray => Status::Stalled,
        _ => ended,
    }
}

/// A start is compared with its reference parameter by parameter.
fn check_domain(surface: &BsplineSurface, start: &BsplineSurface) -> Result<(), Error> {
    let of = |s: &BsplineSurface| [s.knots_u().domain(), s.knots_v().domain()];
    let closed = |s: &BsplineSurface| [s.knots_u().is_periodic(), s.knots_v().is_periodic()];
    if of(surface) == of(start) && closed(surface) == closed(start) {
        return Ok(());
    }
    Err(Error::OtherDomain)
}

/// Of everything a run depends on. More steps are no other run: a finished one may be taken further.
fn fingerprint(input: Input<'_>, options: &Options) -> u64 {
    let surface = input.surface;
    let mut of = Fingerprint::new();
    for point in surface.control_points() {
        of = of.numbers(&point.to_array());
    }
    of = of.counts([surface.n_u() as u64, surface.n_v() as u64]);
    of = of.numbers(surface.knots_u().knots()).numbers(surface.knots_v().knots());
    if let Some(weights) = surface.weights() {
        of = of.numbers(weights);
    }
    for made in input.trim.iter().flat_map(|trim| trim.loops()) {
        for curve in made.curves().iter().map(|c| &c.parameters) {
            of = of.numbers(curve.knots().knots());
            for point in curve.control_points() {
                of = of.numbers(&point.to_array());
            }
            of = of.numbers(curve.weights().unwrap_or_default());
        }
    }
    for point in input.start.iter().flat_map(|start| start.control_points()) {
        of = of.numbers(&point.to_array());
    }
    let options = Options { iterations: 0, ..options.clone() };
    of.text(&format!("{options:?}")).finish()
}

/// Shows a level to the observer of the run.
struct Watch<'o> {
    observer: &'o mut dyn Observer,
    stage: &'o Stage,
    start: &'o [f64],
    /// Steps of the levels that are done.
    steps: usize,
    fingerprint: u64,
    /// The control points some steps before the last one allowed, and how many.
    earlier: Option<(usize, Vec<f64>)>,
    recent: Recent,
    has_stalled: bool,
    judge: Option<Judge>,
}

/// The best iterate a checkpoint knows of.
fn best_of(checkpoint: &Checkpoint) -> Option<Best> {
    let numbers = |name: &str| checkpoint.numbers.get(name);
    let &[value, measure] = numbers("best_value")?.as_slice() else { return None };
    let iteration = *checkpoint.counts.get("best_iteration")?.first()? as usize;
    Some(Best { value, x: numbers("best")?.clone(), progress: (iteration, measure) })
}

impl Observer for Watch<'_> {
    fn step(&mut self, progress: &Progress<'_>) -> ControlFlow<()> {
        // Control points only: auxiliary variables of the lifted formulation stay behind.
        let x = &progress.x[..self.start.len()];
        let left = progress.max_iterations.saturating_sub(progress.iteration);
        if left > 0 && (self.earlier.is_none() || left >= LAST_STEPS) {
            self.earlier = Some((left, x.to_vec()));
        }
        if let Some(judge) = &mut self.judge {
            judge.see(progress.iteration, false, x);
        }
        let answer = self.observer.step(&Progress { x, ..*progress });
        let is_stuck = self.judge.as_ref().is_some_and(|j| j.has_stalled(progress.iteration));
        let is_flat = self.recent.has_stalled(progress);
        self.has_stalled = answer.is_continue() && (is_stuck || is_flat);
        if self.has_stalled { ControlFlow::Break(()) } else { answer }
    }

    fn stop_requested(&mut self) -> bool {
        self.observer.stop_requested()
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        let (stage, start, fingerprint) = (self.stage.number, self.start, self.fingerprint);
        let steps = [self.steps as u64];
        let recent = self.recent.energies();
        let best = self.judge.as_ref().and_then(Judge::best);
        self.observer.checkpoint(&|| {
            let state = state().with_numbers("start", start).with_counts("steps", &steps);
            let mut state = state.with_numbers("recent", recent);
            if let Some(best) = best {
                let (iteration, measure) = best.progress;
                state = state
                    .with_numbers("best", &best.x)
                    .with_numbers("best_value", &[best.value, measure])
                    .with_counts("best_iteration", &[iteration as u64]);
            }
            Checkpoint { method: METHOD.to_owned(), fingerprint, stage, ..state }
        });
    }
}
