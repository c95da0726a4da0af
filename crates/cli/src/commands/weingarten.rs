//! `umbilic weingarten SURFACE -o OUT`.

use crate::args::{
    CheckpointArgs, ConfigArgs, ConvergedArgs, Counts, OutputArgs, ReportArgs, check_output_path,
};
use crate::context::Context;
use crate::failure::Failure;
use crate::layered;
use crate::outcome::Outcome;
use crate::report_support;
use crate::report_support::weingarten::weingarten_report;
use crate::surface_file::read_surface;
use bspline::BsplineSurface;
use exchange::{LengthUnit, Model};
use serde::{Deserialize, Deserializer, Serialize};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use weingarten::{
    Border, Checkpoint, Formulation, Move, Optimized, Relation, Weights, WeingartenOptions,
    optimize_observed,
};

/// Arguments of `weingarten`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Examples:
  umbilic weingarten fixtures/roof.ron -o roof.step --iterations 20
  umbilic weingarten fixtures/roof.ron -o roof.step -o roof.glb \\
      --levels 10x8,14x10,18x14,25x18 --metrics roof.json")]
pub(crate) struct Weingarten {
    /// File with one B-spline surface (RON, STEP)
    input: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
    #[command(flatten)]
    settings: Settings,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    checkpoint: CheckpointArgs,
    #[command(flatten)]
    converged: ConvergedArgs,
    #[command(flatten)]
    report: ReportArgs,
}

/// Options of the method, from flags or the configuration file.
#[derive(Clone, Debug, Default, clap::Args, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Settings {
    /// Control nets to refit and optimise at in turn, as in 10x8,14x10,18x14,25x18 (default: the
    /// input's net)
    #[arg(long, value_name = "UxV,...")]
    levels: Option<Levels>,
    /// Steps per level [default: 10]
    #[arg(long, value_name = "N")]
    iterations: Option<usize>,
    /// Samples in u and v [default: twice the net]
    #[arg(long, value_name = "UxV")]
    samples: Option<Counts>,
    /// Eliminated unknowns with damped steps, or the published guided projection [default: reduced]
    #[arg(long, value_enum)]
    formulation: Option<FormulationName>,
    /// Whether the border moves freely, glides on its own curve, or stays [default: free]
    #[arg(long, value_enum)]
    border: Option<BorderName>,
    /// Curvature relation: linear[=a,b,c] (aH+bK+c=0), minimal, cmc[=H], developable, gauss=K,
    /// ratio=R (k1 = R k2), curve[=FILE.ron] (default: any relation)
    #[arg(long, value_name = "RELATION")]
    relation: Option<RelationName>,
    /// Weight of the isoline alignment, or of the relation asked for
    #[arg(long, value_name = "W")]
    alignment: Option<f64>,
    /// Weight of the closeness to the input
    #[arg(long, value_name = "W")]
    closeness: Option<f64>,
    /// Weight of the preservation of edge and diagonal lengths of the control net
    #[arg(long, value_name = "W")]
    shape: Option<f64>,
    /// Weight of the fairness of the displacement
    #[arg(long, value_name = "W")]
    fairness: Option<f64>,
    /// Weight of geodesic parallelism of the curvature isolines
    #[arg(long, value_name = "W")]
    parallel: Option<f64>,
    /// Move a control point first (indices from 0; repeatable)
    #[arg(long = "move", value_name = "I,J,DX,DY,DZ", allow_hyphen_values = true)]
    #[serde(rename = "move")]
    moves: Option<Vec<MoveText>>,
}

layered!(Settings {
    levels,
    iterations,
    samples,
    formulation,
    border,
    relation,
    alignment,
    closeness,
    shape,
    fairness,
    parallel,
    moves,
});

impl Weingarten {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.output.check()?;
        self.report.check()?;
        if let Some(path) = &self.checkpoint.checkpoint {
            check_output_path(path)?;
        }
        let options = self.settings.over(self.config.load()?).options()?;
        let (model, named) = read_surface(&self.input)?;
        let resume = self.checkpoint.resume.as_deref().map(read_checkpoint).transpose()?;
        let run = run(&named.surface, &options, resume.as_ref(), context)
            .map_err(|e| Failure::input(&self.input, e))?;
        let mut outcome = run.outcome(&model.unit)?.with_input(&self.input);
        outcome.warnings = model.warnings;
        outcome.require_converged = self.converged.require_converged;
        let report = match self.report.wanted() {
            true => {
                let unit = model.unit.to_string();
                Some(weingarten_report(&named.surface, &run.optimized, &options, &unit)?)
            }
            false => None,
        };
        let result = Model::of_surface(&named.name, run.optimized.surface, model.unit);
        for path in self.output.output {
            let bytes =
                exchange::encode_model(&path, &result).map_err(|e| Failure::input(&path, e))?;
            outcome.files.push((path, bytes));
        }
        if let (Some(path), Some(state)) = (self.checkpoint.checkpoint, run.checkpoint) {
            let bytes = serde_json::to_vec(&state).map_err(Failure::other)?;
            outcome.checkpoint = Some((path, bytes));
        }
        if let Some(report) = report {
            report_support::add_files(&mut outcome, &self.report, context, report)?;
        }
        Ok(outcome)
    }
}

fn read_checkpoint(path: &Path) -> Result<Checkpoint, Failure> {
    let text = exchange::read_text(path).map_err(|e| Failure::input(path, e))?;
    serde_json::from_str(&text).map_err(|e| {
        Failure::input(path, format!("{e}; give a file that --checkpoint has written"))
    })
}

/// An optimised surface with the state to go on from.
pub(crate) struct Run {
    pub(crate) optimized: Optimized,
    checkpoint: Option<Checkpoint>,
}

/// Optimises with a progress bar; Ctrl-C stops.
pub(crate) fn run(
    surface: &BsplineSurface,
    options: &WeingartenOptions,
    resume: Option<&Checkpoint>,
    context: &Context,
) -> Result<Run, weingarten::WeingartenError> {
    let levels = options.levels.len().max(1);
    let bar = context.progress("optimising", levels * options.iterations);
    let mut checkpoint = None;
    let optimized = optimize_observed(surface, options, resume, |progress| {
        let done = progress.level * options.iterations + progress.iteration;
        bar.at(done, format!("energy {:.3e}", progress.energy));
        checkpoint = Some(progress.checkpoint());
        if context.interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })?;
    Ok(Run { optimized, checkpoint })
}

impl Run {
    /// Status, metrics and summary.
    pub(crate) fn outcome(&self, unit: &LengthUnit) -> Result<Outcome, Failure> {
        let report = &self.optimized.report;
        let mut outcome = Outcome::new(report.status, report.iterations)
            .with_metrics(&MetricsObject::new(&self.optimized))?;
        outcome.summary = self.summary(unit);
        Ok(outcome)
    }

    fn summary(&self, unit: &LengthUnit) -> Vec<String> {
        let Optimized { surface, before, after, report, .. } = &self.optimized;
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
}

/// The `metrics` object.
#[derive(Serialize)]
struct MetricsObject {
    alignment_rms: f64,
    diagram_area: f64,
    deviation_mean_percent: f64,
    deviation_max_percent: f64,
    boundary_deviation_max_percent: f64,
    mean_curvature_min: f64,
    mean_curvature_max: f64,
    gaussian_curvature_min: f64,
    gaussian_curvature_max: f64,
    relation_rms: f64,
    variables: usize,
    control_points: usize,
    samples: usize,
    ms_per_iteration: f64,
    factorizations: usize,
}

impl MetricsObject {
    fn new(optimized: &Optimized) -> Self {
        let Optimized { surface, after, report, .. } = optimized;
        let samples = report.levels.last().map_or(0, |l| l.samples.0 * l.samples.1);
        Self {
            alignment_rms: after.alignment_rms,
            diagram_area: after.diagram_area,
            deviation_mean_percent: after.deviation_mean_percent,
            deviation_max_percent: after.deviation_max_percent,
            boundary_deviation_max_percent: after.boundary_deviation_max_percent,
            mean_curvature_min: after.mean_curvature_min,
            mean_curvature_max: after.mean_curvature_max,
            gaussian_curvature_min: after.gaussian_curvature_min,
            gaussian_curvature_max: after.gaussian_curvature_max,
            relation_rms: after.relation_rms,
            variables: report.variables(),
            control_points: surface.control_points().len(),
            samples,
            ms_per_iteration: report.ms_per_iteration(),
            factorizations: report.factorizations(),
        }
    }
}

impl Settings {
    /// The options of the library.
    pub(crate) fn options(self) -> Result<WeingartenOptions, Failure> {
        let defaults = WeingartenOptions::default();
        Ok(WeingartenOptions {
            levels: self.levels.map_or(defaults.levels, |l| l.0),
            iterations: self.iterations.unwrap_or(defaults.iterations),
            samples: self.samples.map(|s| (s.u, s.v)),
            formulation: self.formulation.map_or(defaults.formulation, FormulationName::value),
            border: self.border.map_or(defaults.border, BorderName::value),
            relation: self.relation.map_or(Ok(defaults.relation), RelationName::value)?,
            weights: Weights {
                alignment: self.alignment,
                closeness: self.closeness,
                shape: self.shape,
                fairness: self.fairness,
                parallel: self.parallel,
            },
            moves: self.moves.unwrap_or_default().into_iter().map(|m| m.0).collect(),
        })
    }
}

/// `--formulation`.
#[derive(Clone, Copy, Debug, clap::ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum FormulationName {
    Reduced,
    Lifted,
}

impl FormulationName {
    fn value(self) -> Formulation {
        match self {
            Self::Reduced => Formulation::Reduced,
            Self::Lifted => Formulation::Lifted,
        }
    }
}

/// `--border`.
#[derive(Clone, Copy, Debug, clap::ValueEnum, Deserialize)]
#[serde(rename_all = "snake_case")]
enum BorderName {
    Free,
    Glide,
    Fixed,
}

impl BorderName {
    fn value(self) -> Border {
        match self {
            Self::Free => Border::Free,
            Self::Glide => Border::Glide,
            Self::Fixed => Border::Fixed,
        }
    }
}

/// `--levels`.
#[derive(Clone, Debug, PartialEq)]
struct Levels(Vec<(usize, usize)>);

impl FromStr for Levels {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let counts = text.split(',').map(|level| level.trim().parse::<Counts>());
        Ok(Self(counts.map(|c| c.map(|c| (c.u, c.v))).collect::<Result<_, _>>()?))
    }
}

/// `--relation`.
#[derive(Clone, Debug, PartialEq)]
enum RelationName {
    Known(Relation),
    CurveFile(PathBuf),
}

impl FromStr for RelationName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = match text.split_once('=') {
            Some((name, value)) => (name.trim(), Some(value)),
            None => (text.trim(), None),
        };
        let numbers = |n: usize| -> Result<Vec<f64>, String> {
            let parts: Vec<&str> = value.unwrap_or_default().split(',').collect();
            let parsed: Result<Vec<f64>, _> = parts.iter().map(|p| p.trim().parse()).collect();
            match parsed {
                Ok(numbers) if numbers.len() == n => Ok(numbers),
                _ => Err(format!("`{text}` needs {n} number(s) after {name}=")),
            }
        };
        let relation = match (name, value.is_some()) {
            ("linear", false) => Relation::LinearFit,
            ("linear", true) => {
                let c = numbers(3)?;
                Relation::Linear(c[0], c[1], c[2])
            }
            ("minimal", false) => Relation::Minimal,
            ("cmc", false) => Relation::ConstantMeanFit,
            ("cmc", true) => Relation::ConstantMean(numbers(1)?[0]),
            ("developable", false) => Relation::Developable,
            ("gauss", true) => Relation::ConstantGauss(numbers(1)?[0]),
            ("ratio", true) => Relation::Ratio(numbers(1)?[0]),
            ("curve", false) => Relation::CurveFit,
            ("curve", true) => {
                return Ok(Self::CurveFile(PathBuf::from(value.unwrap_or_default())));
            }
            _ => {
                return Err(format!(
                    "`{text}` is none of linear[=a,b,c], minimal, cmc[=H], developable, gauss=K, \
                     ratio=R, curve[=FILE.ron]"
                ));
            }
        };
        Ok(Self::Known(relation))
    }
}

impl RelationName {
    fn value(self) -> Result<Relation, Failure> {
        match self {
            Self::Known(relation) => Ok(relation),
            Self::CurveFile(path) => {
                let points: Vec<(f64, f64)> =
                    exchange::read_ron(&path).map_err(|e| Failure::input(&path, e))?;
                Ok(Relation::Curve(points.into_iter().map(|(h, k)| [h, k]).collect()))
            }
        }
    }
}

/// `--move`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct MoveText(Move);

impl FromStr for MoveText {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        let parsed = (|| {
            let &[i, j, x, y, z] = parts.as_slice() else { return None };
            let by = [x.parse().ok()?, y.parse().ok()?, z.parse().ok()?];
            Some(Self(Move { i: i.parse().ok()?, j: j.parse().ok()?, by }))
        })();
        parsed.ok_or_else(|| format!("`{text}` is not of the form i,j,dx,dy,dz, as in 3,4,0,0,0.1"))
    }
}

/// In the configuration file these are written as on the command line.
macro_rules! deserialize_from_text {
    ($($name:ident),*) => {
        $(impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
            }
        })*
    };
}

deserialize_from_text!(Levels, RelationName, MoveText);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relations_are_parsed() {
        let known = |r| Ok(RelationName::Known(r));
        assert_eq!("minimal".parse(), known(Relation::Minimal));
        assert_eq!("cmc=-0.5".parse(), known(Relation::ConstantMean(-0.5)));
        assert_eq!("linear=1,2,3".parse(), known(Relation::Linear(1.0, 2.0, 3.0)));
        assert_eq!("curve".parse(), known(Relation::CurveFit));
        for bad in ["", "gauss", "linear=1,2", "cmc=x", "minimal=1", "ratio"] {
            assert!(bad.parse::<RelationName>().is_err(), "{bad}");
        }
    }

    #[test]
    fn moves_and_levels_are_parsed() {
        let want = Move { i: 3, j: 4, by: [0.0, -1.5, 2.0] };
        assert_eq!("3,4,0,-1.5,2".parse(), Ok(MoveText(want)));
        assert!("3,4,0".parse::<MoveText>().is_err());
        assert_eq!("10x8,14x10".parse(), Ok(Levels(vec![(10, 8), (14, 10)])));
        assert!("10x8,".parse::<Levels>().is_err());
    }
}
