//! What a command hands back: files still in memory, numbers, and a summary.

use crate::choice::Choice;
use crate::failure::{Failure, twice};
use crate::stdout::{self, STDOUT};
use exchange::Model;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// How a command ended. Commands that do not iterate always converge.
pub(crate) use gp_solver::Status;

/// The result of a command. Nothing is on disk yet: all files are written together at the end,
/// or none of them.
#[derive(Debug)]
pub(crate) struct Outcome {
    pub(crate) status: Status,
    pub(crate) iterations: usize,
    /// The main input as the user named it.
    pub(crate) input: Option<PathBuf>,
    /// Result files with their bytes, `-o` outputs first.
    pub(crate) files: Vec<(PathBuf, Vec<u8>)>,
    /// Report, figures and systems, which are written of a failed result too.
    pub(crate) pages: Vec<(PathBuf, Vec<u8>)>,
    /// The checkpoint, the only file besides the metrics that an interrupted run writes.
    pub(crate) checkpoint: Option<(PathBuf, Vec<u8>)>,
    /// The `metrics` object, keys as documented.
    pub(crate) metrics: serde_json::Value,
    /// Lines for people, with units.
    pub(crate) summary: Vec<String>,
    /// What the user should know although there is a result.
    pub(crate) warnings: Vec<String>,
    /// Whether another status than `converged` exits with code 3.
    pub(crate) require_converged: bool,
    /// Whether the files of a failed result are written.
    pub(crate) keep_failed: bool,
    /// Whether a file is not what a run says of it, which exits with code 1.
    pub(crate) differs: bool,
}

impl Outcome {
    /// An outcome without files, numbers or words.
    pub(crate) fn new(status: Status, iterations: usize) -> Self {
        Self {
            status,
            iterations,
            input: None,
            files: Vec::new(),
            pages: Vec::new(),
            checkpoint: None,
            metrics: serde_json::json!({}),
            summary: Vec::new(),
            warnings: Vec::new(),
            require_converged: false,
            keep_failed: false,
            differs: false,
        }
    }

    /// Names the input.
    pub(crate) fn with_input(mut self, path: &Path) -> Self {
        self.input = Some(path.to_path_buf());
        self
    }

    /// Sets the `metrics` object from a struct with documented field names.
    pub(crate) fn with_metrics<T: Serialize>(mut self, metrics: &T) -> Result<Self, Failure> {
        self.metrics = serde_json::to_value(metrics).map_err(Failure::other)?;
        Ok(self)
    }

    /// Adds a file with this content; the extension chooses the format.
    pub(crate) fn add_model(&mut self, path: PathBuf, model: &Model) -> Result<(), Failure> {
        let bytes = exchange::encode_model(&path, model).map_err(|e| Failure::input(&path, e))?;
        if let Some(lost) = model.unit.lost_in(&exchange::extension_of(&path))
            && !self.warnings.contains(&lost)
        {
            self.warnings.push(lost);
        }
        self.files.push((path, bytes));
        Ok(())
    }

    /// The bytes of the metrics file.
    pub(crate) fn metrics_file(
        &self,
        command: &str,
        seconds: f64,
        threads: usize,
        choice: &Choice,
    ) -> Vec<u8> {
        let file = MetricsFile {
            schema: 1,
            command,
            status: self.status.as_str(),
            iterations: self.iterations,
            seconds,
            threads,
            choice,
            input: self.input.as_deref().map(|p| p.display().to_string()),
            outputs: self.written().map(|(path, _)| path.display().to_string()).collect(),
            metrics: &self.metrics,
        };
        // Plain structs, strings and numbers: this cannot fail.
        let mut bytes = serde_json::to_vec_pretty(&file).unwrap_or_default();
        bytes.push(b'\n');
        bytes
    }

    /// Writes all files, or none of them if `is_stopped` says so meanwhile; then what goes to
    /// standard output. Returns whether they were written.
    pub(crate) fn write_files(
        &self,
        metrics: Option<(PathBuf, Vec<u8>)>,
        is_stopped: &dyn Fn() -> bool,
    ) -> Result<bool, Failure> {
        let (streams, files): (Vec<_>, Vec<_>) = self
            .written()
            .chain(metrics.as_ref())
            .map(|(path, bytes)| (path.as_path(), bytes.as_slice()))
            .partition(|(path, _)| *path == Path::new(STDOUT));
        for (k, (path, _)) in files.iter().enumerate() {
            let same = |(other, _): &&(&Path, &[u8])| exchange::is_same_file(path, other);
            if let Some((other, _)) = files[..k].iter().find(same) {
                return Err(twice(path, other));
            }
        }
        if !exchange::write_files_unless(&files, is_stopped).map_err(Failure::usage)? {
            return Ok(false);
        }
        streams.iter().try_for_each(|(_, bytes)| stdout::write(bytes))?;
        Ok(true)
    }

    /// What is written of a result with this status.
    pub(crate) fn written(&self) -> impl Iterator<Item = &(PathBuf, Vec<u8>)> {
        let nothing: &[(PathBuf, Vec<u8>)] = &[];
        let (files, pages) = match self.status {
            Status::Interrupted => (nothing, nothing),
            Status::Failed if !self.keep_failed => (nothing, &self.pages[..]),
            _ => (&self.files[..], &self.pages[..]),
        };
        files.iter().chain(pages).chain(&self.checkpoint)
    }
}

#[derive(Serialize)]
struct MetricsFile<'a> {
    schema: u32,
    command: &'a str,
    status: &'static str,
    iterations: usize,
    seconds: f64,
    threads: usize,
    #[serde(flatten)]
    choice: &'a Choice,
    input: Option<String>,
    outputs: Vec<String>,
    metrics: &'a serde_json::Value,
}
