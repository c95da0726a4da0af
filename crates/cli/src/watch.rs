//! What the command line does while a method runs: a progress bar, Ctrl-C, checkpoints, and the
//! linearised systems of `--dump-system`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use gp_solver::{Checkpoint, Observer, Progress};

use crate::args::{CheckpointArgs, check_output_folder, check_output_path};
use crate::context::{self, Context};
use crate::failure::Failure;
use crate::outcome::Outcome;

/// Steps of the progress bar: the share of the run that is done, in thousandths.
const BAR: usize = 1000;

/// Watches a run for the command line.
pub(crate) struct Watch<'c> {
    context: &'c Context,
    bar: context::Progress,
    keep: Option<PathBuf>,
    state: Option<Checkpoint>,
    resume: Option<Checkpoint>,
    dump: Option<PathBuf>,
    systems: Vec<(PathBuf, Vec<u8>)>,
}

impl<'c> Watch<'c> {
    /// Shows a bar with this label; keeps no checkpoint.
    pub(crate) fn new(context: &'c Context, label: &'static str) -> Self {
        let bar = context.progress(label, BAR);
        Self {
            context,
            bar,
            keep: None,
            state: None,
            resume: None,
            dump: None,
            systems: Vec::new(),
        }
    }

    /// Keeps and resumes checkpoints as asked for.
    pub(crate) fn with_checkpoints(mut self, args: &CheckpointArgs) -> Result<Self, Failure> {
        if let Some(path) = &args.checkpoint {
            check_output_path(path)?;
        }
        self.keep.clone_from(&args.checkpoint);
        self.resume = args.resume.as_deref().map(read_checkpoint).transpose()?;
        Ok(self)
    }

    /// Writes the system every stage begins with into this folder.
    pub(crate) fn with_systems(mut self, folder: Option<&Path>) -> Result<Self, Failure> {
        if let Some(folder) = folder {
            check_output_folder(folder)?;
        }
        self.dump = folder.map(Path::to_path_buf);
        Ok(self)
    }

    /// Hands the last checkpoint and the systems to the outcome.
    pub(crate) fn finish(self, outcome: &mut Outcome) -> Result<(), Failure> {
        outcome.files.extend(self.systems);
        if let (Some(path), Some(state)) = (self.keep, self.state) {
            let bytes = serde_json::to_vec(&state).map_err(Failure::other)?;
            outcome.checkpoint = Some((path, bytes));
        }
        Ok(())
    }

    fn dump(&mut self, progress: &Progress<'_>) {
        let (Some(folder), Some(system)) = (&self.dump, progress.system) else { return };
        let Ok(files) = system.matrix_market() else { return };
        let number = progress.stage.number;
        self.systems.extend(
            files
                .into_iter()
                .map(|(name, bytes)| (folder.join(format!("stage-{number}-{name}")), bytes)),
        );
    }
}

impl Observer for Watch<'_> {
    fn step(&mut self, progress: &Progress<'_>) -> ControlFlow<()> {
        let done = (progress.share() * BAR as f64) as usize;
        self.bar.at(done, format!("{}: energy {:.3e}", progress.stage.name, progress.energy));
        if progress.iteration == 0 {
            self.dump(progress);
        }
        if self.context.interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn stop_requested(&mut self) -> bool {
        self.context.interrupted()
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        if self.keep.is_some() {
            self.state = Some(state());
        }
    }

    fn resume(&mut self) -> Option<Checkpoint> {
        self.resume.take()
    }
}

fn read_checkpoint(path: &Path) -> Result<Checkpoint, Failure> {
    let text = exchange::read_text(path).map_err(|e| Failure::input(path, e))?;
    serde_json::from_str(&text).map_err(|e| {
        Failure::input(path, format!("{e}; give a file that --checkpoint has written"))
    })
}
