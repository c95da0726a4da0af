//! `umbilic convert IN OUT`.

use crate::args::{ReportArgs, check_output_path};
use crate::context::Context;
use crate::failure::Failure;
use crate::outcome::{Outcome, Status};
use crate::report_support;
use exchange::Model;
use serde::Serialize;
use std::path::PathBuf;

/// Arguments of `convert`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: umbilic convert fixtures/roof.ron roof.step")]
pub(crate) struct Convert {
    /// File to read
    input: PathBuf,
    /// File to write; the extension chooses the format
    output: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
}

impl Convert {
    pub(crate) fn run(self, context: &Context) -> Result<Outcome, Failure> {
        exchange::check_format(&self.output).map_err(|e| Failure::input(&self.output, e))?;
        check_output_path(&self.output)?;
        self.report.check()?;
        let model =
            exchange::read_model(&self.input).map_err(|e| Failure::input(&self.input, e))?;
        let bytes = exchange::encode_model(&self.output, &model)
            .map_err(|e| Failure::input(&self.output, e))?;
        let mut outcome = Outcome::new(Status::Converged, 0)
            .with_input(&self.input)
            .with_metrics(&ConvertMetrics::new(&model))?;
        outcome.warnings.clone_from(&model.warnings);
        outcome.files.push((self.output, bytes));
        if self.report.wanted() {
            let mut report = report_support::new("Content of a file");
            report_support::add_model(&mut report, &model)?;
            report_support::add_files(&mut outcome, &self.report, context, report)?;
        }
        Ok(outcome)
    }
}

/// The `metrics` object: what the input holds, and the mean of its control points if it has
/// surfaces, else of its vertices.
#[derive(Serialize)]
struct ConvertMetrics {
    surfaces: usize,
    control_points: usize,
    vertices: usize,
    faces: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    centroid: Option<[f64; 3]>,
}

impl ConvertMetrics {
    fn new(model: &Model) -> Self {
        Self {
            surfaces: model.surfaces.len(),
            control_points: model.surfaces.iter().map(|s| s.surface.control_points().len()).sum(),
            vertices: model.meshes.iter().map(|m| m.positions.len()).sum(),
            faces: model.meshes.iter().map(|m| m.faces.len()).sum(),
            centroid: model.centroid().map(|c| c.to_array()),
        }
    }
}
