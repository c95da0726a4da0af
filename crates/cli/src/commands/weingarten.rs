//! `umbilic weingarten SURFACE -o OUT`.

use crate::args::{CheckpointArgs, ConfigArgs, ConvergedArgs, OutputArgs, ReportArgs, SystemArgs};
use crate::context::Context;
use crate::failure::Failure;
use crate::option_flags::{OptionFlags, refused};
use crate::outcome::Outcome;
use crate::report_support;
use crate::report_support::weingarten::weingarten_report;
use crate::surface_file::read_surface;
use crate::watch::Watch;
use exchange::{LengthUnit, Model};
use gp_solver::OptionValue;
use serde::Serialize;
use std::path::PathBuf;
use weingarten::{Metrics, Options, RelationLocus, Solution, solve};

/// Arguments of `weingarten`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  umbilic weingarten fixtures/roof.ron -o roof.step --iterations 20
  umbilic weingarten fixtures/roof.ron -o roof.step -o roof.glb \\
      --levels 10x8,14x10,18x14,25x18 --metrics roof.json
A relation `curve` takes its control points from a file too: --relation curve=FILE.ron.")]
pub(crate) struct Weingarten {
    /// File with one B-spline surface (RON, STEP)
    input: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    options: OptionFlags<Options>,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    checkpoint: CheckpointArgs,
    #[command(flatten)]
    converged: ConvergedArgs,
    #[command(flatten)]
    report: ReportArgs,
    #[command(flatten)]
    system: SystemArgs,
}

impl Weingarten {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.output.check()?;
        self.report.check()?;
        let options = self.options.options(&self.config)?;
        options.check().map_err(|e| self.options.refused(&self.config, e))?;
        let (model, named) = read_surface(&self.input)?;
        let mut watch = Watch::new(context, "optimising")
            .with_checkpoints(&self.checkpoint)?
            .with_systems(self.system.dump_system.as_deref())?;
        let solution = solve(&named.surface, &options, &mut watch)
            .map_err(|e| refused::<Options>(&self.input, e))?;
        let mut outcome = outcome(&solution, &options, &model.unit)?.with_input(&self.input);
        watch.finish(&mut outcome)?;
        outcome.warnings = model.warnings;
        outcome.require_converged = self.converged.require_converged;
        let report = match self.report.wanted() {
            true => {
                let unit = model.unit.to_string();
                Some(weingarten_report(&named.surface, &solution, &options, &unit)?)
            }
            false => None,
        };
        let result = Model::of_surface(&named.name, solution.result, model.unit);
        for path in self.output.output {
            let bytes =
                exchange::encode_model(&path, &result).map_err(|e| Failure::input(&path, e))?;
            outcome.files.push((path, bytes));
        }
        if let Some(report) = report {
            report_support::add_files(&mut outcome, &self.report, context, report)?;
        }
        Ok(outcome)
    }
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
        ms_per_iteration: report.ms_per_iteration(),
        factorizations: report.factorizations(),
    })?;
    outcome.summary = summary(solution, unit);
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
    /// Standard deviations of H and K at the start on that scale, which distances from fitted lines
    /// and curves are measured in.
    #[serde(skip_serializing_if = "Option::is_none")]
    relation_scale: Option<[f64; 2]>,
    /// `a H + b K + c = 0` in units of the model, where the relation is a line.
    #[serde(skip_serializing_if = "Option::is_none")]
    relation_line: Option<Line>,
    ms_per_iteration: f64,
    factorizations: usize,
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

fn summary(solution: &Solution, unit: &LengthUnit) -> Vec<String> {
    let Solution { result: surface, before, metrics: after, report, .. } = solution;
    let mut lines = vec![format!(
        "{} x {} control points, {} steps, {}",
        surface.n_u(),
        surface.n_v(),
        report.iterations,
        report.status.as_str().replace('_', " "),
    )];
    lines.push(format!(
        "  curvature diagram    {:.6} of its box (before {:.6})",
        after.diagram_area, before.diagram_area
    ));
    lines.push(format!(
        "  isoline alignment    {:.6} rms sine (before {:.6})",
        after.alignment_rms, before.alignment_rms
    ));
    if after.relation_rms > 0.0 {
        lines.push(format!(
            "  curvature relation   {:.6} rms (before {:.6})",
            after.relation_rms, before.relation_rms
        ));
    }
    lines.push(format!(
        "  deviation            mean {:.4} %, max {:.4} %, border {:.4} % of the diagonal",
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
