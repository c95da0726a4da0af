//! The report as plain data.

use serde_json::{Map, Value};

use crate::{EnergyHistory, Histogram, RelationCurve, SeamTable, SurfaceView};

/// Everything a command has to tell, as plain data.
///
/// All of it is optional: what is not there is not shown. The bytes of [`Report::to_html`] depend
/// on nothing but this record; what changes from run to run stands in one JSON block of the page.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Report {
    /// Heading.
    pub title: String,
    /// The command as it was typed; it stands with [`Report::run`], since paths and thread counts in
    /// it change from run to run.
    pub command_line: String,
    /// How it ended, such as `converged`; empty for commands that do not iterate.
    pub status: String,
    /// Unit of length of the model, such as `m`; empty if it is not known.
    pub length_unit: String,
    /// What the reader should know before trusting the result.
    pub warnings: Vec<String>,
    /// Stages of the work; the last one is shown first.
    pub stages: Vec<SurfaceView>,
    /// Curves drawn over the curvature diagram.
    pub relations: Vec<RelationCurve>,
    /// Histograms, in the order they are shown.
    pub histograms: Vec<Histogram>,
    /// Energies per iteration.
    pub energies: Option<EnergyHistory>,
    /// The worst seams.
    pub seams: Option<SeamTable>,
    /// Options in force, name and value.
    pub options: Vec<(String, String)>,
    /// The `metrics` object of `--metrics`. Keys that change from run to run (`ms_*`, `seconds`,
    /// `threads`, `peak_memory_mb`) are shown with [`Report::run`].
    pub metrics: Map<String, Value>,
    /// What changes from run to run: timings, number of threads. Kept in one JSON block of the
    /// page, so that two reports can be compared without it.
    pub run: Map<String, Value>,
}

impl Report {
    /// An empty report.
    pub fn new(title: impl Into<String>, command_line: impl Into<String>) -> Self {
        Self { title: title.into(), command_line: command_line.into(), ..Self::default() }
    }

    /// Adds a row to the table of options.
    pub fn option(&mut self, name: &str, value: impl std::fmt::Display) {
        self.options.push((name.to_owned(), value.to_string()));
    }

    /// Metrics that are the same in every run, and those that are not (with `run`).
    pub(crate) fn split_metrics(&self) -> (Map<String, Value>, Map<String, Value>) {
        let mut run = self.run.clone();
        let metrics = without_run_keys(&self.metrics, "", &mut run);
        (metrics, run)
    }
}

/// Copies `from` except for what changes from run to run, which goes to `run` by its dotted path.
fn without_run_keys(
    from: &Map<String, Value>,
    path: &str,
    run: &mut Map<String, Value>,
) -> Map<String, Value> {
    let mut kept = Map::new();
    for (key, value) in from {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        if changes_from_run_to_run(key) {
            run.insert(path, value.clone());
        } else if let Value::Object(inner) = value {
            kept.insert(key.clone(), Value::Object(without_run_keys(inner, &path, run)));
        } else {
            kept.insert(key.clone(), value.clone());
        }
    }
    kept
}

fn changes_from_run_to_run(key: &str) -> bool {
    key.starts_with("ms_") || matches!(key, "seconds" | "threads" | "peak_memory_mb")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn timings_leave_the_metrics() {
        let metrics = json!({"a": 1, "ms_per_iteration": 3.5, "grid": {"b": 2, "seconds": 1}});
        let metrics = metrics.as_object().unwrap().clone();
        let report = Report { metrics, ..Report::default() };
        let (kept, run) = report.split_metrics();
        assert_eq!(Value::Object(kept), json!({"a": 1, "grid": {"b": 2}}));
        assert_eq!(Value::Object(run), json!({"ms_per_iteration": 3.5, "grid.seconds": 1}));
    }
}
