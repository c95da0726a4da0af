//! Flags that several commands share. A command flattens those it honours, and no others: a flag
//! whose feature is not there is an unknown flag.

use crate::failure::Failure;
use crate::outcome::Outcome;
use crate::stdout::STDOUT;
use geom_core::Budget;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

/// Honoured by every command.
#[derive(Debug, clap::Args)]
pub(crate) struct GlobalArgs {
    /// Write status and measured numbers to this JSON file, `-` for standard output
    #[arg(long, value_name = "FILE.json", global = true)]
    pub(crate) metrics: Option<PathBuf>,
    /// Number of threads (default: one per core); results do not depend on it
    #[arg(long, value_name = "N", global = true, value_parser = threads)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Run even if the estimate exceeds the memory of the machine or an hour
    #[arg(long, global = true)]
    pub(crate) force: bool,
    /// Read the input as this format (ron, step, 3dm, obj, ply, off, stl, glb, json), whatever its
    /// name and content say; an input `-` is standard input
    #[arg(long, value_name = "FORMAT", global = true)]
    pub(crate) input_format: Option<String>,
    /// Print no summary and no progress
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    /// Log to stderr; twice for more
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    pub(crate) verbose: u8,
}

fn threads(text: &str) -> Result<NonZeroUsize, String> {
    match text.parse() {
        Ok(n @ 1..=Budget::MOST_THREADS) => Ok(NonZeroUsize::new(n).unwrap_or(NonZeroUsize::MIN)),
        _ => Err(format!("give a number from 1 to {}", Budget::MOST_THREADS)),
    }
}

/// `-o`, for commands that write geometry.
#[derive(Debug, clap::Args)]
pub(crate) struct OutputArgs {
    /// Where to write; the extension chooses the format (repeatable)
    #[arg(short, long = "output", value_name = "FILE", required = true)]
    pub(crate) output: Vec<PathBuf>,
}

impl OutputArgs {
    /// Refuses early what could not be written at the end: called before any work is done.
    pub(crate) fn check(&self) -> Result<(), Failure> {
        for (k, path) in self.output.iter().enumerate() {
            if self.output[..k].contains(path) {
                return Err(Failure::usage(format!(
                    "{}: named twice as an output; drop one",
                    path.display()
                )));
            }
            exchange::check_format(path).map_err(|e| Failure::input(path, e))?;
            check_output_path(path)?;
        }
        Ok(())
    }
}

/// `--report` and `--figures`, for commands that make them.
#[derive(Debug, clap::Args)]
pub(crate) struct ReportArgs {
    /// Write a report with a 3D view that opens offline; `-` for standard output
    #[arg(long, value_name = "FILE.html")]
    pub(crate) report: Option<PathBuf>,
    /// Write plots (SVG) and pictures (PNG) into this folder, which is made if need be
    #[arg(long, value_name = "DIR")]
    pub(crate) figures: Option<PathBuf>,
}

impl ReportArgs {
    /// As [`OutputArgs::check`].
    pub(crate) fn check(&self) -> Result<(), Failure> {
        if let Some(path) = &self.report {
            check_output_path(path)?;
        }
        match &self.figures {
            Some(folder) => check_output_folder(folder),
            None => Ok(()),
        }
    }
}

/// `--config`, for commands with method options.
#[derive(Debug, clap::Args)]
pub(crate) struct ConfigArgs {
    /// Read options from this RON file; flags override it
    #[arg(long, value_name = "FILE.ron")]
    pub(crate) config: Option<PathBuf>,
}

/// `--dump-system`, for methods that linearise.
#[derive(Debug, clap::Args)]
pub(crate) struct SystemArgs {
    /// Write the linearised system of every stage into this folder (Matrix Market),
    /// which is made if need be
    #[arg(long, value_name = "DIR")]
    pub(crate) dump_system: Option<PathBuf>,
}

/// What is to become of results that are not as wished, for iterative commands.
#[derive(Debug, clap::Args)]
pub(crate) struct EndingArgs {
    /// Exit with code 3 unless the status is `converged`
    #[arg(long)]
    require_converged: bool,
    /// Write the model files of a result with the status `failed` too
    #[arg(long)]
    keep_failed: bool,
}

impl EndingArgs {
    /// Tells the outcome.
    pub(crate) fn apply(&self, outcome: &mut Outcome) {
        outcome.require_converged = self.require_converged;
        outcome.keep_failed = self.keep_failed;
    }
}

/// Whether a file could be written at `path`: its folder is there and takes files.
pub(crate) fn check_output_path(path: &Path) -> Result<(), Failure> {
    if path == Path::new(STDOUT) {
        return Ok(());
    }
    exchange::check_writable(path).map_err(|e| Failure::input(path, e))
}

/// Whether files could be written into this folder, which may have to be made first.
pub(crate) fn check_output_folder(folder: &Path) -> Result<(), Failure> {
    exchange::check_folder(folder).map_err(|e| Failure::input(folder, e))
}
