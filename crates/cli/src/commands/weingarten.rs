//! `umbilic weingarten SURFACE -o OUT`.

use crate::args::{ConfigArgs, EndingArgs, OutputArgs, ReportArgs, SystemArgs};
use crate::checkpoints::CheckpointArgs;
use crate::context::Context;
use crate::failure::Failure;
use crate::input_file::{SurfaceArgs, read_other_surface, read_surface};
use crate::option_flags::{OptionFlags, refused};
use crate::outcome::{Outcome, Status};
use crate::report_support;
use crate::report_support::weingarten::weingarten_report;
use crate::watch::Watch;
use bspline::{BsplineSurface, Flaw, FlawKind, Trim};
use exchange::{LengthUnit, Model, NamedSurface};
use gp_solver::{Counts, OptionValue, SolverError};
use serde::Serialize;
use std::path::PathBuf;
use weingarten::{
    Border, Error, HeldCorner, Input, Metrics, Options, RelationLocus, RelationMiss, Solution,
    fitted_curve, solve, suited_levels,
};

/// Arguments of `weingarten`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  umbilic weingarten fixtures/roof.ron -o roof.step --iterations 20
  umbilic weingarten fixtures/roof.ron -o roof.step -o roof.glb \\
      --levels 10x8,14x10,18x14,25x18 --metrics roof.json
A relation `curve` takes its control points from a file too: --relation curve=FILE.ron.")]
pub(crate) struct Weingarten {
    /// File with a B-spline surface (RON, STEP, 3DM)
    input: PathBuf,
    #[command(flatten)]
    surface: SurfaceArgs,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    options: OptionFlags<Options>,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    checkpoint: CheckpointArgs,
    /// Begin at this result of before: same terms and reference, fresh damping
    #[arg(long, value_name = "RESULT")]
    start: Option<PathBuf>,
    /// Write the relation found, as control points (H, K) of a curve to edit and give back by
    /// --relation curve=FILE.ron
    #[arg(long, value_name = "FILE.ron")]
    write_relation: Option<PathBuf>,
    #[command(flatten)]
    ending: EndingArgs,
    #[command(flatten)]
    report: ReportArgs,
    #[command(flatten)]
    system: SystemArgs,
}

impl Weingarten {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.output.check()?;
        self.report.check()?;
        let mut options = self.options.options(&self.config)?;
        options.check().map_err(|e| self.options.refused(&self.config, e))?;
        let mut watch = Watch::new(context, "optimising")
            .of(&self.input)
            .with_checkpoints(&self.checkpoint)?
            .with_systems(self.system.dump_system.as_deref())?;
        let (model, named) = read_surface(context, &self.input, &self.surface)?;
        let is_chosen = self.options.is_chosen("levels");
        if is_chosen {
            let levels = suited_levels(&named.surface);
            options.levels = levels.map_err(|e| refused::<Options>(&self.input, e))?.into();
        }
        context.afford(options.cost(&named.surface), "levels")?;
        let start = self.start.as_deref().map(read_other_surface).transpose()?;
        let mut input = Input::within(&named.surface, named.trim.as_ref());
        if let Some(start) = &start {
            input = input.starting_from(start);
        }
        let solution = solve(input, &options, &mut watch).map_err(|e| match e {
            Error::Solver(e @ SolverError::ForeignCheckpoint { .. }) => watch.foreign(&e),
            e @ Error::OtherDomain => {
                refused::<Options>(self.start.as_deref().unwrap_or(&self.input), e)
            }
            e => refused::<Options>(&self.input, e),
        })?;
        let mut outcome = outcome(&solution, &options, &model.unit)?.with_input(&self.input);
        if is_chosen {
            let nets: Vec<String> = options.levels.iter().map(ToString::to_string).collect();
            outcome.summary.push(format!("  levels chosen        {}", nets.join(", ")));
        }
        outcome.warnings.extend(start.and_then(|s| refit_warning(&s, &options, &named.surface)));
        outcome.warnings.extend(model.warnings);
        self.ending.apply(&mut outcome);
        if !watch.finish(&mut outcome) {
            return Ok(outcome);
        }
        let relation_file = match self.write_relation {
            Some(path) => Some((path, relation_file(&solution, named.trim.as_ref())?)),
            None => None,
        };
        let report = match self.report.wanted() {
            true => {
                let unit = model.unit.to_string();
                Some(weingarten_report(&named, &solution, &options, &unit)?)
            }
            false => None,
        };
        // The trim bounds the same parameters; its curves in space follow the surface.
        let trim = named.trim.map(|trim| trim.without_edges());
        let result = NamedSurface { surface: solution.result, trim, ..named };
        let result = Model { unit: model.unit, surfaces: vec![result], ..Model::default() };
        for path in self.output.output {
            outcome.add_model(path, &result)?;
        }
        outcome.files.extend(relation_file);
        if let Some(report) = report {
            report_support::add_files(&mut outcome, &self.report, context, report)?;
        }
        Ok(outcome)
    }
}

/// The control points of the curve the curvature diagram of the result follows, or was asked to.
fn relation_file(solution: &Solution, trim: Option<&Trim>) -> Result<Vec<u8>, Failure> {
    let control = match &solution.relation {
        Some(RelationLocus::Curve { control, .. }) => Some(control.clone()),
        _ => fitted_curve(Input::within(&solution.result, trim)).map_err(Failure::other)?,
    };
    let control = control.ok_or_else(|| {
        Failure::other("both curvatures are constant: there is no curve to write")
    })?;
    let points: Vec<String> =
        control.iter().map(|[h, k]| format!("    ({h:?}, {k:?}),\n")).collect();
    Ok(format!("[\n{}]\n", points.concat()).into_bytes())
}

/// Status, metrics and summary.
pub(crate) fn outcome(
    solution: &Solution,
    options: &Options,
    unit: &LengthUnit,
) -> Result<Outcome, Failure> {
    let report = &solution.report;
    let mut outcome = Outcome::new(report.status, report.iterations).with_metrics(&Numbers {
        metrics: &solution.metrics,
        variables: report.variables(),
        control_points: solution.result.control_points().len(),
        samples: solution.samples[0] * solution.samples[1],
        samples_u: solution.samples[0],
        samples_v: solution.samples[1],
        relation: options.relation.print().unwrap_or_default(),
        working_scale: solution.working_scale,
        relation_scale: solution.relation_scale,
        relation_line: solution.relation.as_ref().and_then(line),
        relation_miss: solution.miss.as_ref().map(Miss::of),
        held_corners: solution.held_corners.iter().map(|c| (c.u, c.v)).collect(),
        flaws: solution.flaws.len(),
        flaws_at: solution.flaws.iter().map(|f| (f.kind.as_str(), f.u, f.v)).collect(),
        ms_per_iteration: report.ms_per_iteration(),
        factorizations: report.factorizations(),
    })?;
    outcome.summary = summary(solution, unit);
    outcome.warnings.extend(flaw_warning(&solution.flaws));
    outcome.warnings.extend(miss_warning(solution));
    // A soft border gives way where it must.
    let is_soft = matches!(options.border, Border::Soft(_));
    if !(is_soft && solution.miss.is_some_and(|miss| miss.is_held())) {
        outcome.warnings.extend(corner_warning(&solution.held_corners, unit));
    }
    Ok(outcome)
}

/// The `metrics` object: what is measured on the surface, then what the solver did.
#[derive(Serialize)]
struct Numbers<'a> {
    #[serde(flatten)]
    metrics: &'a Metrics,
    variables: usize,
    control_points: usize,
    samples: usize,
    samples_u: usize,
    samples_v: usize,
    /// The relation asked for, as in options.
    relation: String,
    /// Lengths `relation_rms` is measured in per length of the model.
    working_scale: f64,
    /// Standard deviations of H and K of the input on that scale, which distances from fitted lines
    /// and curves are measured in.
    #[serde(skip_serializing_if = "Option::is_none")]
    relation_scale: Option<[f64; 2]>,
    /// `a H + b K + c = 0` in units of the model, where the relation is a line.
    #[serde(skip_serializing_if = "Option::is_none")]
    relation_line: Option<Line>,
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    relation_miss: Option<Miss>,
    /// Corners where the held border alone decides the mean curvature, as another than asked for.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    held_corners: Vec<(f64, f64)>,
    /// Check points where the result folds, has a spike or is not finite, and where.
    flaws: usize,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    flaws_at: Vec<(&'static str, f64, f64)>,
    ms_per_iteration: f64,
    factorizations: usize,
}

/// How far the result is from the relation: in percent of the curvatures, area-weighted without the
/// corners, and at its worst.
#[derive(Serialize)]
struct Miss {
    relation_miss_percent: f64,
    relation_inner_rms: f64,
    relation_worst: f64,
    relation_worst_at: [f64; 2],
}

impl Miss {
    fn of(miss: &RelationMiss) -> Self {
        Self {
            relation_miss_percent: 100.0 * miss.share,
            relation_inner_rms: miss.inner_rms,
            relation_worst: miss.worst,
            relation_worst_at: miss.worst_at,
        }
    }
}

#[derive(Serialize)]
struct Line {
    a: f64,
    b: f64,
    c: f64,
}

fn line(locus: &RelationLocus) -> Option<Line> {
    match *locus {
        RelationLocus::Line { a, b, c } => Some(Line { a, b, c }),
        _ => None,
    }
}

/// How the run ended, in words. Steps that were asked for and made are no cause for alarm.
fn ending(solution: &Solution) -> String {
    let (after, status) = (&solution.metrics, solution.report.status);
    match (&solution.earlier, status) {
        (Some((steps, earlier)), Status::IterationLimit) if earlier.diagram_area > 0.0 => {
            let change = 100.0 * (after.diagram_area / earlier.diagram_area - 1.0);
            format!("as asked for; the last {steps} changed the diagram by {change:.1} %")
        }
        _ => status.as_str().replace('_', " "),
    }
}

/// A start that is not on the first net is refitted to it, which is seldom what was meant.
fn refit_warning(
    start: &BsplineSurface,
    options: &Options,
    input: &BsplineSurface,
) -> Option<String> {
    let own = Counts { u: start.n_u(), v: start.n_v() };
    let given = Counts { u: input.n_u(), v: input.n_v() };
    let first = options.levels.first().copied().unwrap_or(given);
    (own != first).then(|| {
        format!("the start has {own} control points and was refitted to {first}; name its own net first with --levels {own} to go on from it")
    })
}

/// What is wrong with the result, and what to do about it.
fn flaw_warning(flaws: &[Flaw]) -> Option<String> {
    let first = flaws.first()?;
    let what = match first.kind {
        FlawKind::Fold => "folds back on itself",
        FlawKind::NotFinite => "is not finite",
        _ => "has a spike or a tear",
    };
    Some(format!(
        "the result {what} between its samples, first at u = {:.6}, v = {:.6} ({} places in all); ask for more samples, a larger fairness or closeness, or fewer steps, or look at it with --keep-failed",
        first.u,
        first.v,
        flaws.len()
    ))
}

/// Why a run that got no further is no surface with the relation asked for.
fn miss_warning(solution: &Solution) -> Option<String> {
    let miss = solution.miss.filter(|miss| !miss.is_held())?;
    (solution.report.status == Status::Stalled).then(|| {
        format!(
            "no surface with this relation was found near the input: the nearest misses it by {:.1} % of the curvatures in the mean; leave the border free, lower --closeness, ask for something nearer, or split the surface",
            100.0 * miss.share
        )
    })
}

/// What a held border makes impossible.
fn corner_warning(corners: &[HeldCorner], unit: &LengthUnit) -> Option<String> {
    let first = corners.first()?;
    let more = match corners.len() {
        1 => String::new(),
        n => format!(" (and in {} more corners)", n - 1),
    };
    Some(format!(
        "the border curves meet nearly at a right angle at u = {}, v = {}{more}, where they make the mean curvature {:.4} 1/{unit}, not {:.4}: near there the relation hardly holds while the border is held",
        first.u, first.v, first.mean_curvature, first.wanted
    ))
}

fn summary(solution: &Solution, unit: &LengthUnit) -> Vec<String> {
    let Solution { result: surface, before, metrics: after, report, .. } = solution;
    let mut lines = vec![format!(
        "{} x {} control points, {} steps, {}",
        surface.n_u(),
        surface.n_v(),
        report.iterations,
        ending(solution),
    )];
    lines.push(format!(
        "  curvature diagram    {:.6} of its box (before {:.6})",
        after.diagram_area, before.diagram_area
    ));
    lines.push(format!(
        "  isoline alignment    {:.6} rms sine (before {:.6})",
        after.alignment_rms, before.alignment_rms
    ));
    if let Some(miss) = &solution.miss {
        lines.push(format!(
            "  curvature relation   {:.6} rms (before {:.6}), missed by {:.2} %, most at u = {:.4}, v = {:.4}",
            after.relation_rms,
            before.relation_rms,
            100.0 * miss.share,
            miss.worst_at[0],
            miss.worst_at[1],
        ));
    }
    lines.push(format!(
        "  deviation            mean {:.4} %, max {:.4} %, border {:.4} % of the size",
        after.deviation_mean_percent,
        after.deviation_max_percent,
        after.boundary_deviation_max_percent
    ));
    lines.push(format!(
        "  mean curvature       {:.6} to {:.6} 1/{unit}",
        after.mean_curvature_min, after.mean_curvature_max
    ));
    lines.push(format!(
        "  Gaussian curvature   {:.6} to {:.6} 1/{unit}²",
        after.gaussian_curvature_min, after.gaussian_curvature_max
    ));
    lines
}
