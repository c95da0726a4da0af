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
use crate::watch::Watch;
use bspline::BsplineSurface;
use exchange::{LengthUnit, Model};
use gp_solver::Counts;
use paneling::{Clustering, Error, Options, PanelSet, Paneling, Quality, solve};
use report::Report;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// The built-in input.
pub(super) const ROOF: &str = include_str!("../../../../fixtures/roof.ron");
/// Control nets the roof is optimised at, one after the other.
const LEVELS: [(usize, usize); 4] = [(10, 8), (14, 10), (18, 14), (25, 18)];
/// Panels in u and v.
const PANELS: (usize, usize) = (30, 30);
/// k √N molds for N panels.
const K: f64 = 3.0;
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
        let options = weingarten::Options { levels, ..Default::default() };
        let mut watch = Watch::new(context, "optimising");
        let solution =
            weingarten::solve(&named.surface, &options, &mut watch).map_err(Failure::other)?;
        let mut outcome = outcome(&solution, &options, &model.unit)?;
        if !watch.finish(&mut outcome) {
            return Ok(outcome);
        }
        let cut = Panelings::new(&named.surface, &solution.result)?;
        cut.measure(&mut outcome)?;
        let head = "a roof of 14 x 14 control points, made a Weingarten surface at four levels:";
        outcome.summary.insert(0, head.to_owned());
        outcome.summary.extend(cut.summary());

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
            outcome.files.extend(cut.encode(path, &model.unit)?);
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
    before: (PanelSet, Paneling),
    /// Assigned by cost on the roof before.
    cost_driven: Paneling,
    after: (PanelSet, Paneling),
}

impl Panelings {
    fn new(before: &BsplineSurface, after: &BsplineSurface) -> Result<Self, Failure> {
        let (u, v) = PANELS;
        let options = Options {
            panels: Some(Counts { u, v }),
            k: Some(K),
            compare_grid: false,
            ..Options::default()
        };
        let by_cost = Options { clustering: Clustering::Cover, ..options.clone() };
        let cut = |surface: &BsplineSurface| {
            let solution = solve(surface, &options, &mut ())?;
            Ok((solution.panels, solution.result))
        };
        let (before, after) = rayon::join(|| cut(before), || cut(after));
        let (before, after) = (before.map_err(failed)?, after.map_err(failed)?);
        let cost_driven = solve(&before.0, &by_cost, &mut ()).map_err(failed)?.result;
        Ok(Self { before, cost_driven, after })
    }

    /// Name, panels and paneling of each, in the order they are shown.
    fn all(&self) -> [(&'static str, &PanelSet, &Paneling); 3] {
        [
            ("before", &self.before.0, &self.before.1),
            ("before, by cost", &self.before.0, &self.cost_driven),
            ("after", &self.after.0, &self.after.1),
        ]
    }

    fn measure(&self, outcome: &mut Outcome) -> Result<(), Failure> {
        let keys = ["panels_before", "panels_before_cost_driven", "panels_after"];
        for (key, (_, set, paneling)) in keys.into_iter().zip(self.all()) {
            let quality = Quality::new(set, paneling);
            outcome.metrics[key] = serde_json::to_value(quality).map_err(Failure::other)?;
        }
        Ok(())
    }

    fn summary(&self) -> Vec<String> {
        let [before, by_cost, after] = self.all().map(|(_, s, p)| Quality::new(s, p));
        let kinks = |q: &Quality| {
            let Quality { kink_median_deg: median, kink_p95_deg: most, .. } = q;
            format!("half of the kinks below {median:.3}°, 95 % below {most:.3}°")
        };
        vec![
            format!("{} panels on {} molds each time:", after.panels, after.molds),
            format!("  before               {}", kinks(&before)),
            format!("  before, by cost      {}", kinks(&by_cost)),
            format!("  after                {}", kinks(&after)),
        ]
    }

    /// Adds the panels, the histograms and the worst seams to the page.
    fn describe(&self, report: &mut Report) -> Result<(), Failure> {
        let unit = report.length_unit.clone();
        let (set, paneling) = &self.after;
        report.title = "A roof made a Weingarten surface and cut into panels".to_owned();
        let (first_set, first) = &self.before;
        report.stages.push(panel_view("panels before", first_set, first, &unit)?);
        report.stages.push(panel_view("panels after", set, paneling, &unit)?);
        let series = self.all().map(|(name, _, paneling)| (name, paneling));
        report.histograms.push(kink_histogram(&series, None));
        report.histograms.push(gap_histogram(&series, None, &unit));
        report.seams = Some(seam_table("panels after", set, paneling, [None, None], &unit));
        report.option("panels", format!("{}x{}", PANELS.0, PANELS.1));
        report.option("molds", paneling.molds.len());
        Ok(())
    }

    fn encode(&self, path: &Path, unit: &LengthUnit) -> Result<Vec<(PathBuf, Vec<u8>)>, Failure> {
        let (set, paneling) = &self.after;
        encode(path, set, paneling, unit, None)
    }
}

/// The built-in roof can always be cut; if not, the slip is ours.
fn failed(error: Error) -> Failure {
    Failure::other(format!("the built-in roof cannot be cut into panels: {error}"))
}
