//! `--checkpoint`, `--checkpoint-every`, `--resume`: the one home of states that are kept and taken
//! up again.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use gp_solver::{Checkpoint, SolverError};

use crate::args::check_output_path;
use crate::failure::Failure;

/// Flags of solvers that can be continued.
#[derive(Debug, clap::Args)]
pub(crate) struct CheckpointArgs {
    /// Write the state of the solver here when it ends or is interrupted (Ctrl-C)
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Write the checkpoint also after every N steps
    #[arg(long, value_name = "N", requires = "checkpoint")]
    checkpoint_every: Option<NonZeroUsize>,
    /// Continue from a checkpoint of the same input and options; the result has the same bytes as
    /// without the interruption
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
}

impl CheckpointArgs {
    /// Where states are kept, checked, and the one to go on from.
    pub(crate) fn open(&self) -> Result<(Option<Kept>, Option<Resumed>), Failure> {
        if let Some(path) = &self.checkpoint {
            check_output_path(path)?;
        }
        let resumed = self.resume.as_deref().map(Resumed::read).transpose()?;
        let kept = self.checkpoint.as_ref().map(|path| Kept {
            path: path.clone(),
            every: self.checkpoint_every,
            // What is interrupted before it has come further is where it was.
            state: resumed.as_ref().and_then(|r| r.state.clone()),
            offers: 0,
        });
        Ok((kept, resumed))
    }
}

/// The last state of a run, and the file it goes to.
#[derive(Debug)]
pub(crate) struct Kept {
    path: PathBuf,
    every: Option<NonZeroUsize>,
    state: Option<Checkpoint>,
    offers: usize,
}

impl Kept {
    /// Keeps a state; returns whether it is one to write at once.
    pub(crate) fn take(&mut self, state: Checkpoint) -> bool {
        self.state = Some(state);
        self.offers += 1;
        self.every.is_some_and(|every| self.offers.is_multiple_of(every.get()))
    }

    /// The file, `null` in it if there was nothing to keep: who resumes from that starts over. It
    /// does not replace a file that is there.
    pub(crate) fn file(&self) -> Option<(PathBuf, Vec<u8>)> {
        if self.state.is_none() && self.path.exists() {
            return None;
        }
        // Strings and numbers: this cannot fail.
        let bytes = serde_json::to_vec(&self.state).unwrap_or_default();
        Some((self.path.clone(), bytes))
    }
}

/// A file to go on from.
#[derive(Debug)]
pub(crate) struct Resumed {
    path: PathBuf,
    /// None where the run was interrupted before it had done anything.
    state: Option<Checkpoint>,
}

impl Resumed {
    fn read(path: &Path) -> Result<Self, Failure> {
        let text = exchange::read_text(path).map_err(|e| Failure::input(path, e))?;
        let state = serde_json::from_str(&text).map_err(|e| {
            Failure::input(path, format!("{e}; give a file that --checkpoint has written"))
        })?;
        Ok(Self { path: path.to_path_buf(), state })
    }

    /// The state, once.
    pub(crate) fn state(&mut self) -> Option<Checkpoint> {
        self.state.take()
    }

    /// What a solver says of the file.
    pub(crate) fn refused(&self, error: &SolverError) -> Failure {
        Failure::input(&self.path, error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_written_every_so_many_steps() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state.json");
        let every = NonZeroUsize::new(3);
        let mut kept = Kept { path: path.clone(), every, state: None, offers: 0 };
        assert_eq!(kept.file(), Some((path.clone(), b"null".to_vec())));
        let state = |k| Checkpoint::new("weingarten", 7, 0, k);
        let due: Vec<bool> = (0..7).map(|k| kept.take(state(k))).collect();
        assert_eq!(due, [false, false, true, false, false, true, false]);
        std::fs::write(&path, kept.file().unwrap().1).unwrap();
        assert_eq!(Resumed::read(&path).unwrap().state(), Some(state(6)));
        // Nothing to keep is no reason to replace what is there.
        let nothing = Kept { state: None, ..kept };
        assert_eq!(nothing.file(), None);
        std::fs::write(&path, "null").unwrap();
        assert_eq!(Resumed::read(&path).unwrap().state(), None);
        std::fs::write(&path, "{}").unwrap();
        let said = Resumed::read(&path).unwrap_err().to_string();
        assert!(said.contains("state.json: missing field"), "{said}");
        assert!(said.ends_with("give a file that --checkpoint has written"), "{said}");
    }
}
