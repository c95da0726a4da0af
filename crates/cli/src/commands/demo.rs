//! `umbilic demo [DIR]`.

use crate::args::ReportArgs;
use crate::choice::Choice;
use crate::commands::weingarten::outcome;
use crate::context::Context;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::panel_files::encode;
use crate::report_support;
use crate::report_support::panels::{gap_histogram, kink_histogram, panel_view, seam_table};
use crate::report_support::weingarten::weingarten_report;
use crate::trade_offs::{DEGREES, TradeOffs};
use crate::watch::Watch;
use bspline::BsplineSurface;
use exchange::Model;
use gp_solver::Counts;
use paneling::{Error, Options, Quality, Solution, TradeOff, solve, trade_off};
use report::Report;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

/// The built-in input: the roof of a hall of 60 by 40 metres.
pub(super) const ROOF: &str = include_str!("../../../../fixtures/hall.ron");
/// Control nets the roof is optimised at, one after the other, and steps at each.
const LEVELS: [(usize, usize); 4] = [(10, 8), (14, 10), (18, 14), (25, 18)];
const ITERATIONS: usize = 12;
/// The roof keeps its shape better than with the usual weight, and takes hardly more molds.
const CLOSENESS: f64 = 3.0;
/// Panels in u and v, of about 2.5 by 2.5 metres.
const PANELS: (usize, usize) = (24, 16);
/// Kinks that are told, in degrees: glass takes half a degree, metal a quarter.
const TOLD: [f64; 3] = [1.0, 0.5, 0.25];
/// What the panels that are written keep.
const WRITTEN: f64 = 0.25;
/// How long is looked for molds without `--full`.
const EFFORT: f64 = 0.5;
/// What is written to the folder; the first two are geometry of the optimised roof, the next three
/// its panels, their table and the molds.
const FILES: [&str; 7] = [
    "surface.step",
    "surface.glb",
    "panels.glb",
    "panels.csv",
    "molds.step",
    "report.html",
    "metrics.json",
];

/// Arguments of `demo`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: umbilic demo")]
pub(crate) struct Demo {
    /// Folder to write to; it is made if it does not exist
    #[arg(default_value = "umbilic-demo")]
    folder: PathBuf,
    /// More tolerances, and a longer search for molds
    #[arg(long)]
    full: bool,
}

impl Demo {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        let begin = Instant::now();
        std::fs::create_dir_all(&self.folder).map_err(|e| {
            Failure::input(&self.folder, format!("the folder cannot be made: {e}; name another"))
        })?;
        let paths = FILES.map(|n| self.folder.join(n));
        for path in &paths {
            crate::args::check_output_path(path)?;
        }
        let [step, glb, panels_glb, panels_csv, molds, page, metrics] = &paths;
        let model = exchange::read_scene(ROOF).map_err(Failure::other)?;
        let Some(named) = model.surfaces.first() else {
            return Err(Failure::other("the built-in roof has no surface"));
        };
        let levels = LEVELS.map(|(u, v)| Counts { u, v }).to_vec().into();
        let options = weingarten::Options {
            levels,
            iterations: ITERATIONS,
            closeness: CLOSENESS,
            ..Default::default()
        };
        let mut watch = Watch::new(context, "optimising");
        let solution =
            weingarten::solve(&named.surface, &options, &mut watch).map_err(Failure::other)?;
        let mut outcome = outcome(&solution, &options, &model.unit)?;
        if !watch.finish(&mut outcome) {
            return Ok(outcome);
        }
        let cut = Panelings::new(&named.surface, &solution.result, self.full)?;
        cut.measure(&mut outcome)?;
        let head = "the roof of a hall, 60 x 40 m, made a Weingarten surface at four levels:";
        outcome.summary.insert(0, head.to_owned());
        let size = cut.after.panels.extent();
        let [mean, most] =
            [solution.metrics.deviation_mean_percent, solution.metrics.deviation_max_percent]
                .map(|percent| 0.01 * percent * size);
        outcome.summary.push(format!(
            "  so the roof moves by {mean:.2} {unit} in the mean and by {most:.2} {unit} at most",
            unit = model.unit
        ));
        outcome.summary.push(format!("{} x {} panels of about 2.5 m;", PANELS.0, PANELS.1));
        outcome.summary.extend(cut.table.summary(&model.unit));
        outcome.summary.push(cut.saving());

        let unit = model.unit.to_string();
        let mut report = weingarten_report(named, &solution, &options, &unit)?;
        cut.describe(&mut report)?;
        let result = Model::of_surface("roof", solution.result, model.unit.clone());
        for path in [step, glb] {
            let bytes =
                exchange::encode_model(path, &result).map_err(|e| Failure::input(path, e))?;
            outcome.files.push((path.clone(), bytes));
        }
        for path in [panels_glb, panels_csv, molds] {
            let (set, paneling) = (&cut.after.panels, &cut.after.result);
            outcome.files.extend(encode(path, set, paneling, &model.unit, None)?);
        }
        let pages = ReportArgs { report: Some(page.clone()), figures: None };
        report_support::add_files(&mut outcome, &pages, context, report)?;
        let seconds = begin.elapsed().as_secs_f64();
        let file = outcome.metrics_file("demo", seconds, context.threads, &Choice::default());
        outcome.files.push((metrics.clone(), file));
        let written: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
        outcome.summary.push(format!("written: {}", written.join(", ")));
        Ok(outcome)
    }
}

/// The roof cut into panels before and after its optimisation.
struct Panelings {
    table: TradeOffs,
    /// Within the bound that is written.
    after: Arc<Solution>,
    /// The roof before on as many molds.
    before: Solution,
}

impl Panelings {
    fn new(before: &BsplineSurface, after: &BsplineSurface, full: bool) -> Result<Self, Failure> {
        let (u, v) = PANELS;
        let options = Options {
            panels: Some(Counts { u, v }),
            compare_grid: false,
            effort: if full { 1.0 } else { EFFORT },
            ..Options::default()
        };
        let degrees = if full { &DEGREES[..] } else { &TOLD[..] };
        let of = |surface: &BsplineSurface| trade_off(surface, &options, degrees, &mut ());
        let (first, second) = rayon::join(|| of(before), || of(after));
        let (first, second) = (first.map_err(failed)?, second.map_err(failed)?);
        let written = |row: &&TradeOff| row.max_kink_deg == WRITTEN;
        let Some(row) = second.iter().find(written) else {
            return Err(Failure::other("the bound that is written was not tried"));
        };
        let chosen = Arc::clone(&row.solution);
        let same = Options { molds: Some(row.molds), ..options.clone() };
        let same = solve(before, &same, &mut ()).map_err(failed)?;
        let table = TradeOffs::new([before, after], [first, second]);
        Ok(Self { table, after: chosen, before: same })
    }

    /// Name and paneling of each, in the order they are shown.
    fn all(&self) -> [(&'static str, &Solution); 2] {
        [("before", &self.before), ("after", &self.after)]
    }

    fn measure(&self, outcome: &mut Outcome) -> Result<(), Failure> {
        for (key, solution) in ["panels_before", "panels_after"].into_iter().zip(self.all()) {
            let quality = Quality::new(&solution.1.panels, &solution.1.result);
            outcome.metrics[key] = serde_json::to_value(quality).map_err(Failure::other)?;
        }
        outcome.metrics["tolerances"] =
            serde_json::to_value(&self.table).map_err(Failure::other)?;
        Ok(())
    }

    /// The saving in one sentence.
    fn saving(&self) -> String {
        let [before, after] = self.table.molds(WRITTEN).unwrap_or([0; 2]);
        let kink = self.before.metrics.quality.kink_max_deg;
        format!(
            "if every mold costs the same, those for kinks of {WRITTEN}° cost {:.0} % less (of the \
             molds found: a longer search, --full, finds fewer before); on as few molds the roof \
             before has kinks of {kink:.2}°",
            100.0 * (1.0 - after as f64 / before.max(1) as f64)
        )
    }

    /// Adds the panels, the histograms and the worst seams to the page.
    fn describe(&self, report: &mut Report) -> Result<(), Failure> {
        let unit = report.length_unit.clone();
        report.title =
            "The roof of a hall made a Weingarten surface and cut into panels".to_owned();
        for (name, Solution { panels, result, .. }) in self.all() {
            report.stages.push(panel_view(&format!("panels {name}"), panels, result, &unit)?);
        }
        let series = self.all().map(|(name, solution)| (name, &solution.result));
        report.histograms.push(kink_histogram(&series, Some(WRITTEN)));
        report.histograms.push(gap_histogram(&series, None, &unit));
        let (set, paneling) = (&self.after.panels, &self.after.result);
        let bounds = [Some(WRITTEN), None];
        report.seams = Some(seam_table("panels after", set, paneling, bounds, &unit));
        report.option("panels", format!("{}x{}", PANELS.0, PANELS.1));
        report.option("molds", paneling.molds.len());
        Ok(())
    }
}

/// The built-in roof can always be cut; if not, the slip is ours.
fn failed(error: Error) -> Failure {
    Failure::other(format!("the built-in roof cannot be cut into panels: {error}"))
}
