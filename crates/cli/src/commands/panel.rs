//! `umbilic panel SURFACE -o OUT`.

use crate::args::{ConfigArgs, EndingArgs, ReportArgs, check_output_path};
use crate::checkpoints::CheckpointArgs;
use crate::context::Context;
use crate::failure::Failure;
use crate::input_file::{SurfaceArgs, read_other_surface, read_surface};
use crate::option_flags::{OptionFlags, list, refused};
use crate::outcome::{Outcome, Status};
use crate::panel_files::{PANEL_OUTPUTS, encode};
use crate::report_support;
use crate::report_support::panels::paneling_report;
use crate::trade_offs::{DEGREES, TradeOffs};
use crate::watch::Watch;
use bspline::BsplineSurface;
use exchange::LengthUnit;
use gp_solver::{Counts, SolverError};
use paneling::{
    Error, Input, Layout, MoldType, Options, Paneling, PriceList, Solution, solve, trade_off,
};
use std::path::{Path, PathBuf};

/// Control nets a surface is optimised at for a trade-off, one after the other.
pub(super) const WEINGARTEN_LEVELS: [(usize, usize); 4] = [(10, 8), (14, 10), (18, 14), (25, 18)];

/// Arguments of `panel`.
#[derive(Debug, clap::Args)]
#[command(
    after_help = "Example: umbilic panel fixtures/roof.ron --panels 30x30 --k 3 -o panels.glb -o panels.csv -o molds.step"
)]
pub(crate) struct Panel {
    /// File with a B-spline surface
    input: PathBuf,
    #[command(flatten)]
    surface: SurfaceArgs,
    /// Where to write (repeatable): panels as glb or obj, molds as step, both as 3dm with a layer
    /// per mold, a table of the panels as csv or ron, flat outlines of panels on planar and
    /// cylindrical molds as svg or dxf
    #[arg(short, long = "output", value_name = "FILE", required_unless_present = "trade_off")]
    output: Vec<PathBuf>,
    /// Molds and cost for kinks of 1 to 0.05 degrees, of the surface and of its Weingarten version
    /// (or of the surface in AFTER); -o takes the table as csv
    #[arg(long, value_name = "AFTER", num_args = 0..=1, require_equals = true)]
    trade_off: Option<Option<PathBuf>>,
    #[command(flatten)]
    options: OptionFlags<Options>,
    /// Prices of molds and panels by type (RON)
    #[arg(long, value_name = "FILE.ron")]
    prices: Option<PathBuf>,
    #[command(flatten)]
    config: ConfigArgs,
    #[command(flatten)]
    checkpoint: CheckpointArgs,
    #[command(flatten)]
    ending: EndingArgs,
    #[command(flatten)]
    report: ReportArgs,
}

/// The layout of a file, or the pattern the options ask for.
fn layout(
    file: Option<&Path>,
    options: &Options,
    surface: &BsplineSurface,
) -> Result<Option<Layout>, Failure> {
    let Some(path) = file else { return Ok(None) };
    if options.panels.is_some() {
        return Err(Failure::usage(
            "--panels has no meaning with a layout file; drop one of the two",
        ));
    }
    let layout = layout_file(path)?;
    let even = options.equal_arc_length;
    Ok(Some(if even { layout.with_equal_arc_length(surface) } else { layout }))
}

fn layout_file(path: &Path) -> Result<Layout, Failure> {
    let model = exchange::read_model(path).map_err(|e| Failure::input(path, e))?;
    let mesh = model.meshes.iter().find(|m| !m.faces.is_empty()).ok_or_else(|| {
        Failure::input(path, "no faces; a layout is a polygon mesh over the unit square")
    })?;
    let vertices: Vec<[f64; 3]> = mesh.positions.iter().map(|p| p.to_array()).collect();
    let faces: Vec<Vec<usize>> =
        mesh.faces.iter().map(|f| f.iter().map(|v| *v as usize).collect()).collect();
    Layout::from_polygons(&vertices, &faces).map_err(|e| Failure::input(path, e))
}

impl Panel {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        self.check_outputs()?;
        self.report.check()?;
        let options = self.options.options(&self.config)?;
        options.check().map_err(|e| self.options.refused(&self.config, e))?;
        let mut watch =
            Watch::new(context, "panelling").of(&self.input).with_checkpoints(&self.checkpoint)?;
        let (model, named) = read_surface(context, &self.input, &self.surface)?;
        let unit = model.unit;
        let layout = layout(self.options.file("layout"), &options, &named.surface)?;
        let prices = match &self.prices {
            None => PriceList::counting_molds(),
            Some(path) => exchange::read_ron(path).map_err(|e| Failure::input(path, e))?,
        };
        let mut input = Input::from(&named.surface).with_prices(prices);
        if let Some(layout) = &layout {
            input = input.with_layout(layout);
        }
        if let Some(after) = &self.trade_off {
            let sides = (&named.surface, after.as_deref());
            return self.trade_off(context, sides, &input, &options, &unit, watch);
        }
        context.afford(input.cost(&options), "panels")?;
        let solution = solve(input, &options, &mut watch).map_err(|e| match (e, &self.prices) {
            (Error::Solver(e @ SolverError::ForeignCheckpoint { .. }), _) => watch.foreign(&e),
            (e @ (Error::NoPrice { .. } | Error::BadPrice { .. }), Some(prices)) => {
                refused::<Options>(prices, e)
            }
            (e, _) => refused::<Options>(&self.input, e),
        })?;
        let (paneling, set) = (&solution.result, &solution.panels);
        let mut outcome = Outcome::new(solution.report.status, paneling.iterations())
            .with_input(&self.input)
            .with_metrics(&solution.metrics)?;
        outcome.warnings = model.warnings;
        self.ending.apply(&mut outcome);
        outcome.summary = summary(&solution, &unit);
        if !watch.finish(&mut outcome) {
            return Ok(outcome);
        }
        for path in self.output {
            let sheet = options.sheet.map(|s| [s.width, s.height]);
            let files = encode(&path, set, paneling, &unit, sheet)?;
            if ["svg", "dxf"].contains(&exchange::extension_of(&path).as_str()) {
                outcome.warnings.extend(not_unrolled(paneling, &path));
            }
            outcome.files.extend(files);
        }
        if self.report.wanted() {
            let bounds = [options.max_kink_deg, options.max_gap];
            let mut report = paneling_report(set, paneling, bounds, &unit.to_string())?;
            report.option("panels", paneling.labels.len());
            report.option("molds", paneling.molds.len());
            list(&mut report, &options, &["panels", "molds"]);
            if let Some(path) = &self.prices {
                report.option("prices", path.display());
            }
            report_support::add_files(&mut outcome, &self.report, context, report)?;
        }
        Ok(outcome)
    }

    /// Molds and cost against tolerance, before and after.
    fn trade_off(
        &self,
        context: &Context,
        (before, after): (&BsplineSurface, Option<&Path>),
        input: &Input<'_>,
        options: &Options,
        unit: &LengthUnit,
        mut watch: Watch<'_>,
    ) -> Result<Outcome, Failure> {
        if let Some(path) = self.output.iter().find(|p| exchange::extension_of(p) != "csv") {
            return Err(Failure::input(path, "the table of a trade-off is written as csv"));
        }
        context.afford(input.cost(options), "panels")?;
        let after = match after {
            Some(path) => read_other_surface(path)?,
            None => {
                let levels = WEINGARTEN_LEVELS.map(|(u, v)| Counts { u, v }).to_vec().into();
                let options = weingarten::Options { levels, ..Default::default() };
                let solution = weingarten::solve(before, &options, &mut watch);
                solution.map_err(|e| refused::<weingarten::Options>(&self.input, e))?.result
            }
        };
        let options = Options { compare_grid: false, ..options.clone() };
        let failed = |e| refused::<Options>(&self.input, e);
        let first = trade_off(input.clone(), &options, &DEGREES, &mut watch).map_err(failed)?;
        let other = input.clone().with_surface(&after);
        let second = trade_off(other, &options, &DEGREES, &mut watch).map_err(failed)?;
        let is_whole = second.len() == DEGREES.len();
        let status = if is_whole { Status::Converged } else { Status::Interrupted };
        let table = TradeOffs::new([before, &after], [first, second]);
        let mut outcome = Outcome::new(status, 0).with_input(&self.input).with_metrics(&table)?;
        outcome.summary = table.summary(unit);
        if watch.finish(&mut outcome) {
            let files = self.output.iter().map(|p| (p.clone(), table.csv(unit).into_bytes()));
            outcome.files.extend(files);
        }
        Ok(outcome)
    }

    fn check_outputs(&self) -> Result<(), Failure> {
        for (k, path) in self.output.iter().enumerate() {
            if self.output[..k].contains(path) {
                let message = format!("{}: named twice as an output; drop one", path.display());
                return Err(Failure::usage(message));
            }
            let extension = exchange::extension_of(path);
            if !PANEL_OUTPUTS.contains(&extension.as_str()) {
                return Err(Failure::input(
                    path,
                    "panels are written as glb or obj, their table as csv or ron, molds as step, both as 3dm, flat outlines as svg or dxf",
                ));
            }
            check_output_path(path)?;
        }
        Ok(())
    }
}

/// What to say if some panels are not in a drawing of flat outlines.
fn not_unrolled(paneling: &Paneling, path: &Path) -> Option<String> {
    let is_curved = |m: &&usize| !paneling.molds[**m].kind.is_developable();
    let missing = paneling.labels.iter().filter(is_curved).count();
    (missing > 0).then(|| {
        format!(
            "{}: {missing} of {} panels are on molds that cannot be unrolled and are not drawn",
            path.display(),
            paneling.labels.len()
        )
    })
}

/// The bound on the distance from the design, if there is one.
fn allowed(solution: &Solution, unit: &LengthUnit) -> String {
    solution.metrics.max_deviation.map_or_else(String::new, |most| {
        let percent = 100.0 * most / solution.panels.extent();
        format!(", {percent:.3} % allowed ({most:.3} {unit})")
    })
}

fn summary(solution: &Solution, unit: &LengthUnit) -> Vec<String> {
    let (paneling, metrics) = (&solution.result, &solution.metrics);
    let quality = &metrics.quality;
    let mut lines = vec![
        format!("{} panels on {} molds, cost {:.2}", quality.panels, quality.molds, metrics.cost),
        format!(
            "  kinks: median {:.4}°, 95 % below {:.4}°, largest {:.4}°",
            quality.kink_median_deg, quality.kink_p95_deg, quality.kink_max_deg
        ),
        format!(
            "  gaps: median {:.3e}, 95 % below {:.3e}, largest {:.3e} {unit}",
            quality.gap_median, quality.gap_p95, quality.gap_max
        ),
        format!(
            "  design met within {:.5} % of the size{}",
            quality.deviation_max_percent,
            allowed(solution, unit)
        ),
    ];
    let counts = MoldType::ALL.map(|t| (t, paneling.molds.iter().filter(|m| m.kind == t).count()));
    let used: Vec<String> = counts
        .iter()
        .filter(|(_, n)| *n > 0)
        .map(|(kind, n)| format!("{n} {}", kind.name()))
        .collect();
    lines.push(format!("  molds by type: {}", used.join(", ")));
    if solution.report.status == Status::Infeasible {
        let excess = metrics.worst_excess.unwrap_or(f64::INFINITY);
        lines.push(format!(
            "  the bounds are not met: the worst seam or panel is {excess:.2} times beyond them"
        ));
    }
    for s in paneling.measures.worst_kinks(3) {
        let seam = &paneling.measures.seams[s];
        let ([a, b], kink) = (seam.panels, seam.max_kink().to_degrees());
        lines.push(format!("  worst seam: panels {a} and {b}, kink {kink:.4}°"));
    }
    lines
}
