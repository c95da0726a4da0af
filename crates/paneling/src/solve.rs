//! The whole run: cut, group, fit, close the seams, measure.

use crate::error::Error;
use crate::fit::alternation;
use crate::input::Input;
use crate::layout::panels::PanelSet;
use crate::metrics::{Metrics, Quality};
use crate::options::{Clustering, Options};
use crate::paneling::Paneling;
use crate::pulse::Pulse;
use crate::seam::general::SeamProblem;
use crate::seam::unknowns::Weights;
use crate::search::attempt::Found;
use crate::search::course::{Course, bare};
use crate::search::site::Site;
use gp_solver::{
    Extra, IterationRecord, Observer, Problem, Report, RunReport, Stage, StageReport, Status,
    Timings,
};

/// Panels on molds with what is to be said about them.
///
/// # Example
/// ```
/// use paneling::{Counts, Options, solve};
/// let surface = fixtures::surfaces::Shape::Saddle.surface(8, 8, 4, 4);
/// let panels = Some(Counts { u: 4, v: 3 });
/// let options = Options { panels, molds: Some(3), ..Options::default() };
/// let solution = solve(&surface, &options, &mut ())?;
/// assert_eq!((solution.panels.len(), solution.result.molds.len()), (12, 3));
/// // Panel 5 lies on this mold.
/// assert!(solution.result.labels[5] < 3);
/// # Ok::<(), paneling::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Solution {
    /// The panels on their molds, in units of the model.
    pub result: Paneling,
    /// The panels of the design they stand for.
    pub panels: PanelSet,
    /// The numbers it is judged by.
    pub metrics: Metrics,
    /// The published grid clustering with as many molds, where it was compared with.
    pub grid: Option<Paneling>,
    /// How it went: the stages `fit` and `seams` of the result.
    ///
    /// [`Converged`](Status::Converged) if every seam and panel is within the bounds, or without bounds if the
    /// last step lowered the energy by less than its stop rule asks; else
    /// [`Infeasible`](Status::Infeasible) under bounds, [`Stalled`](Status::Stalled) if no step
    /// lowers the energy any more, and [`IterationLimit`](Status::IterationLimit).
    pub report: RunReport,
    /// How many fits were judged.
    pub fits: usize,
}

/// Finds molds and poses for the panels of a surface.
///
/// The observer is shown every round and every seam step, with an empty `x` and no gradient norm,
/// and offered a checkpoint after each.
///
/// # Errors
/// [`Error`] for what cannot be attempted. Not converging, and bounds that are not met, are a
/// [`Status`] of the report.
///
/// # Example
/// ```
/// use paneling::{Counts, Options, solve};
/// let surface = fixtures::surfaces::Shape::Saddle.surface(10, 10, 4, 4);
/// let options = Options { panels: Some(Counts { u: 8, v: 8 }), ..Options::default() };
/// let solution = solve(&surface, &options, &mut ())?;
/// assert_eq!((solution.metrics.quality.panels, solution.metrics.quality.molds), (64, 24));
/// assert!(solution.metrics.quality.kink_median_deg < 0.4);
/// # Ok::<(), paneling::Error>(())
/// ```
pub fn solve<'a>(
    input: impl Into<Input<'a>>,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    run(&input.into(), options, None, observer)
}

/// As [`solve`], with blocks of one's own: `extra` is called whenever a seam step has built its
/// problem and may add to it, weigh its blocks, take some out or fix unknowns. Unknowns are the
/// poses and molds (groups [`POSES`](crate::blocks::POSES), [`MOLDS`](crate::blocks::MOLDS)) with
/// lengths in the unit of the [`Stage`], the panel size.
///
/// Where `extra` changes nothing, seam steps are those of [`solve`]. Otherwise they are steps of
/// Levenberg-Marquardt on the problem, which forms and factors its matrix: fine for some hundred
/// panels, and with gp-solver's feature `sparse` for some thousand.
///
/// # Errors
/// As [`solve`], and whatever `extra` returns.
///
/// # Example
/// Keep the first mold without twist:
/// ```
/// use gp_solver::{Closeness, Problem, Stage, Variables};
/// use paneling::{Counts, Options, blocks, solve_with};
/// let surface = fixtures::surfaces::Shape::Saddle.surface(10, 10, 4, 4);
/// let options = Options { panels: Some(Counts { u: 5, v: 5 }), molds: Some(3), ..Options::default() };
/// let mut keep = |_: &Stage, variables: &Variables, problem: &mut Problem<'_>| {
///     let twist = variables.group(blocks::MOLDS)?.column(0, 1);
///     let mut weights = vec![0.0; variables.len()];
///     weights[twist] = 1e4;
///     problem.add(Closeness::new("no twist", vec![0.0; variables.len()], weights));
///     Ok(())
/// };
/// let solution = solve_with(&surface, &options, &mut keep, &mut ())?;
/// assert!(solution.result.molds[0].parameters[1].abs() < 1e-6);
/// # Ok::<(), paneling::Error>(())
/// ```
pub fn solve_with<'a>(
    input: impl Into<Input<'a>>,
    options: &Options,
    extra: &mut Extra<'_, Error>,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    run(&input.into(), options, Some(extra), observer)
}

/// The problem of the first seam step, and the unknowns where it starts: the rows whose normal
/// equations [`solve`] solves without forming them.
///
/// # Errors
/// As [`solve`].
///
/// # Example
/// ```
/// use paneling::{Counts, Options, problem};
/// let surface = fixtures::surfaces::Shape::Saddle.surface(8, 8, 4, 4);
/// let panels = Some(Counts { u: 4, v: 3 });
/// let options = Options { panels, molds: Some(3), ..Options::default() };
/// let (problem, start) = problem(&surface, &options)?;
/// assert_eq!(problem.unknowns(), start.len());
/// // Six numbers place a panel.
/// assert_eq!(problem.variables().group(paneling::blocks::POSES).map(|g| g.width()), Ok(6));
/// # Ok::<(), paneling::Error>(())
/// ```
pub fn problem<'a>(
    input: impl Into<Input<'a>>,
    options: &Options,
) -> Result<(Problem<'static>, Vec<f64>), Error> {
    let input = input.into();
    let (panels, _) = input.centred(options)?;
    let site = Site::new(&panels, &input.prices, options)?;
    let mut nobody = ();
    let pulse = Pulse::new(&mut nobody);
    let fit = match Course::new(&site, &pulse)? {
        Some(mut course) => course.first_fit(&pulse),
        None => None,
    };
    let fit = fit.unwrap_or_else(|| bare(&site).fit);
    let weights = Weights::even(&site.set);
    let SeamProblem { assembly, problem } = SeamProblem::new(site.seams(&weights, false), &fit)?;
    Ok((problem, assembly.start()))
}

fn run(
    input: &Input<'_>,
    options: &Options,
    extra: Option<&mut Extra<'_, Error>>,
    observer: &mut dyn Observer,
) -> Result<Solution, Error> {
    options.check()?;
    let (panels, center) = input.centred(options)?;
    let site = Site::new(&panels, &input.prices, options)?;
    let pulse = Pulse::new(observer);
    let (fits, found, grid, is_done) = match Course::new(&site, &pulse)? {
        Some(mut course) => {
            let is_done = course.run(extra, &pulse)?.is_some();
            let fits = course.fits;
            let (found, grid) = course.into_results();
            (fits, found, grid, is_done)
        }
        None => (0, bare(&site), None, false),
    };
    let has_bounds = site.bounds().is_some();
    let status = if is_done { ending(&found, has_bounds, &site) } else { Status::Interrupted };
    let report = report(&site, &found, status);
    let worst_excess = has_bounds.then_some(found.excess.worst());
    let max_deviation = site.bounds().and_then(|b| b.max_deviation).map(|d| d * panels.size);
    drop(site);
    let result = Paneling::new(&panels, found);
    let grid = grid.map(|grid| Paneling::new(&panels, grid));
    let of_grid = match options.clustering {
        Clustering::Grid if options.compare_grid => Some(&result),
        _ => grid.as_ref(),
    };
    let metrics = Metrics {
        quality: Quality::new(&panels, &result),
        cost: result.cost(&panels, &input.prices),
        blank_area: result.blanks(&panels).iter().sum(),
        panel_area: (0..panels.len()).map(|p| panels.area(p)).sum(),
        worst_excess,
        max_deviation,
        grid: of_grid.map(|grid| Quality::new(&panels, grid)),
    };
    // Measured where rounding is small, then moved to where the design stands.
    let back = |paneling: Paneling| paneling.translated(center);
    let (result, grid, panels) = (back(result), grid.map(back), panels.placed(center));
    Ok(Solution { result, panels, metrics, grid, report, fits })
}

/// How a run that was not interrupted ended.
fn ending(found: &Found, has_bounds: bool, site: &Site<'_>) -> Status {
    if has_bounds {
        return if found.excess.is_within() { Status::Converged } else { Status::Infeasible };
    }
    let (history, stall, end) = if found.seam_history.is_empty() {
        (&found.fit_history, alternation::STALL, Status::IterationLimit)
    } else {
        (&found.seam_history, site.seam.stall, found.seams)
    };
    match history[..] {
        [.., before, after] if after < (1.0 - stall) * before => end,
        _ => Status::Converged,
    }
}

/// What was done for the result: its fit and its seam steps.
fn report(site: &Site<'_>, found: &Found, status: Status) -> RunReport {
    let parameters: usize = found.fit.molds.iter().map(|m| m.kind.parameter_count()).sum();
    let variables = 6 * site.set.len() + parameters;
    let rows_of_samples = 3 * site.set.samples.points.len();
    let rows_of_seams = 3 * crate::layout::panels::SEAM_SAMPLES * site.set.seams.len();
    let of = |name: &str, number, history: Vec<f64>, rows| {
        let stage = Stage::new(name, number, 2).at([0.0; 3], site.unit);
        StageReport { stage, solver: stage_report(history, status, [variables, rows]) }
    };
    let fit = [found.start].into_iter().chain(found.fit_history.iter().copied()).collect();
    let mut stages = vec![of("fit", 0, fit, rows_of_samples)];
    if !found.seam_history.is_empty() {
        stages.push(of("seams", 1, found.seam_history.clone(), rows_of_samples + rows_of_seams));
    }
    RunReport { status, ..RunReport::of_stages(stages) }
}

/// The report of a stage that lowered the energy step by step. Neither a matrix nor a gradient of
/// all unknowns is formed.
fn stage_report(history: Vec<f64>, status: Status, [variables, rows]: [usize; 2]) -> Report {
    let record = |k: usize| IterationRecord {
        energy: history[k],
        terms: Vec::new(),
        decrease: if k > 0 { history[k - 1] - history[k] } else { 0.0 },
        damping: f64::NAN,
        step_norm: f64::NAN,
        gradient_norm: f64::NAN,
        factorizations: 0,
    };
    Report {
        status,
        iterations: history.len() - 1,
        initial_energy: history[0],
        final_energy: history[history.len() - 1],
        terms: Vec::new(),
        history: (0..history.len()).map(record).collect(),
        factorizations: 0,
        evaluations: 0,
        gradient_norm: f64::NAN,
        damping: f64::NAN,
        variables,
        rows,
        timings: Timings::default(),
    }
}
