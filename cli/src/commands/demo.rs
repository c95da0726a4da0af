//! `umbilic demo [DIR]`.

use crate::args::ReportArgs;
use crate::commands::weingarten::run;
use crate::context::Context;
use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::report_support;
use crate::report_support::weingarten::weingarten_report;
use exchange::Model;
use std::path::PathBuf;
use std::time::Instant;
use weingarten::WeingartenOptions;

/// The built-in input.
const ROOF: &str = include_str!("../../../fixtures/roof.ron");
/// Control nets the roof is optimised at, one after the other.
const LEVELS: [(usize, usize); 4] = [(10, 8), (14, 10), (18, 14), (25, 18)];

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
        let paths = ["surface.step", "surface.glb", "metrics.json", "report.html"]
            .map(|n| self.folder.join(n));
        for path in &paths {
            crate::args::check_output_path(path)?;
        }
        let model = exchange::read_scene(ROOF).map_err(Failure::other)?;
        let Some(named) = model.surfaces.first() else {
            return Err(Failure::other("the built-in roof has no surface"));
        };
        let options = WeingartenOptions { levels: LEVELS.to_vec(), ..Default::default() };
        let run = run(&named.surface, &options, None, context).map_err(Failure::other)?;
        let mut outcome = run.outcome(&model.unit)?;
        let unit = model.unit.to_string();
        let report = weingarten_report(&named.surface, &run.optimized, &options, &unit)?;
        let result = Model::of_surface("roof", run.optimized.surface, model.unit);
        for path in &paths[..2] {
            let bytes =
                exchange::encode_model(path, &result).map_err(|e| Failure::input(path, e))?;
            outcome.files.push((path.clone(), bytes));
        }
        let page = ReportArgs { report: Some(paths[3].clone()), figures: None };
        report_support::add_files(&mut outcome, &page, context, report)?;
        let seconds = begin.elapsed().as_secs_f64();
        let metrics = outcome.metrics_file("demo", seconds, context.threads);
        outcome.files.push((paths[2].clone(), metrics));
        let head = "a roof of 14 x 14 control points, made a Weingarten surface at four levels:";
        outcome.summary.insert(0, head.to_owned());
        let written: Vec<String> = paths.iter().map(|p| p.display().to_string()).collect();
        outcome.summary.push(format!("written: {}", written.join(", ")));
        Ok(outcome)
    }
}
