//! Flags that several commands share. A command flattens those it honours, and no others: a flag
//! whose feature is not there is an unknown flag.

use crate::failure::Failure;
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Honoured by every command.
#[derive(Debug, clap::Args)]
pub(crate) struct GlobalArgs {
    /// Write status and measured numbers to this JSON file
    #[arg(long, value_name = "FILE.json", global = true)]
    pub(crate) metrics: Option<PathBuf>,
    /// Number of threads (default: one per core); results do not depend on it
    #[arg(long, value_name = "N", global = true)]
    pub(crate) threads: Option<NonZeroUsize>,
    /// Print no summary and no progress
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    /// Log to stderr; twice for more
    #[arg(short, long, action = clap::ArgAction::Count, global = true)]
    pub(crate) verbose: u8,
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
    /// Write a report with a 3D view that opens offline
    #[arg(long, value_name = "FILE.html")]
    pub(crate) report: Option<PathBuf>,
    /// Write plots (SVG) and pictures (PNG) into this existing folder
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
            Some(folder) => check_output_path(&folder.join("figure.svg")),
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

/// `--checkpoint` and `--resume`, for solvers that can be continued.
#[derive(Debug, clap::Args)]
pub(crate) struct CheckpointArgs {
    /// Write the state of the solver here when it ends or is interrupted
    #[arg(long, value_name = "FILE")]
    pub(crate) checkpoint: Option<PathBuf>,
    /// Continue from a checkpoint
    #[arg(long, value_name = "FILE")]
    pub(crate) resume: Option<PathBuf>,
}

/// `--dump-system`, for methods that linearise.
#[derive(Debug, clap::Args)]
pub(crate) struct SystemArgs {
    /// Write the linearised system of every stage into this existing folder (Matrix Market)
    #[arg(long, value_name = "DIR")]
    pub(crate) dump_system: Option<PathBuf>,
}

/// `--require-converged`, for iterative commands.
#[derive(Debug, clap::Args)]
pub(crate) struct ConvergedArgs {
    /// Exit with code 3 unless the status is `converged`
    #[arg(long)]
    pub(crate) require_converged: bool,
}

/// Whether a file could be written at `path`: its folder is there and takes files.
pub(crate) fn check_output_path(path: &Path) -> Result<(), Failure> {
    exchange::check_writable(path).map_err(|e| Failure::input(path, e))
}

/// Two counts written `25x18`: the one along u, then the one along v.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Counts {
    pub(crate) u: usize,
    pub(crate) v: usize,
}

impl FromStr for Counts {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once(['x', 'X']);
        let counts =
            parts.and_then(|(u, v)| Some((u.trim().parse().ok()?, v.trim().parse().ok()?)));
        match counts {
            Some((u, v)) if u > 0 && v > 0 => Ok(Self { u, v }),
            _ => Err(format!(
                "`{text}` is not of the form UxV with two positive counts, as in 25x18"
            )),
        }
    }
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.u, self.v)
    }
}

impl<'de> Deserialize<'de> for Counts {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

/// Width and height of a sheet in model units, written `3x1.5`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SheetSize(pub(crate) [f64; 2]);

impl FromStr for SheetSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let size = text.split_once(['x', 'X']).and_then(|(width, height)| {
            Some([width.trim().parse::<f64>().ok()?, height.trim().parse().ok()?])
        });
        match size {
            Some(size) if size.iter().all(|s| *s > 0.0 && s.is_finite()) => Ok(Self(size)),
            _ => Err(format!(
                "`{text}` is not of the form WxH with two positive lengths, as in 3x1.5"
            )),
        }
    }
}

impl<'de> Deserialize<'de> for SheetSize {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        String::deserialize(deserializer)?.parse().map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_two_positive_numbers() {
        assert_eq!("25x18".parse(), Ok(Counts { u: 25, v: 18 }));
        for bad in ["25", "25x", "0x4", "-1x3", "4x4x4", "axb", ""] {
            assert!(bad.parse::<Counts>().is_err(), "{bad}");
        }
    }

    #[test]
    fn sheets_have_two_positive_sides() {
        assert_eq!("3x1.5".parse(), Ok(SheetSize([3.0, 1.5])));
        for bad in ["3", "3x", "0x4", "-1x3", "3x4x5", "infx2", "NaNx1", ""] {
            assert!(bad.parse::<SheetSize>().is_err(), "{bad}");
        }
    }
}
