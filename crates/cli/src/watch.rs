//! What the command line does while a method runs: a progress bar, Ctrl-C, checkpoints, and the
//! linearised systems of `--dump-system`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use gp_solver::{Checkpoint, Observer, Progress, SolverError};

use crate::args::check_output_folder;
use crate::checkpoints::{CheckpointArgs, Resumed};
use crate::context::{self, Context};
use crate::failure::Failure;
use crate::outcome::{Outcome, Status};

/// Steps of the progress bar: the share of the run that is done, in thousandths.
const BAR: usize = 1000;

/// Watches a run for the command line. While there is one, Ctrl-C gives solvers time to end by
/// themselves.
pub(crate) struct Watch<'c> {
    context: &'c Context,
    bar: context::Progress,
    input: Option<PathBuf>,
    is_kept: bool,
    resumed: Option<Resumed>,
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
            input: None,
            is_kept: false,
            resumed: None,
            dump: None,
            systems: Vec::new(),
        }
    }

    /// Names the main input, for the metrics of a run that is ended early.
    pub(crate) fn of(mut self, input: &Path) -> Self {
        self.input = Some(input.to_path_buf());
        self.context.interrupt.open(Some(input), None);
        self
    }

    /// Keeps and resumes checkpoints as asked for.
    pub(crate) fn with_checkpoints(mut self, args: &CheckpointArgs) -> Result<Self, Failure> {
        let (kept, resumed) = args.open()?;
        self.is_kept = kept.is_some();
        self.resumed = resumed;
        self.context.interrupt.open(self.input.as_deref(), kept);
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

    /// What a solver says of the checkpoint it was to go on from.
    pub(crate) fn foreign(&self, error: &SolverError) -> Failure {
        match &self.resumed {
            Some(resumed) => resumed.refused(error),
            None => Failure::other(error),
        }
    }

    /// The solver has ended: hands the systems to the outcome. Returns whether it ran to its end, so
    /// that there are files to make.
    pub(crate) fn finish(mut self, outcome: &mut Outcome) -> bool {
        outcome.pages.append(&mut self.systems);
        outcome.status != Status::Interrupted
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
        } else {
            self.context.interrupt.count();
        }
        if self.stop_requested() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn stop_requested(&mut self) -> bool {
        self.context.interrupt.is_wanted_by_solver()
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        if self.is_kept {
            self.context.interrupt.keep(state());
        }
    }

    fn resume(&mut self) -> Option<Checkpoint> {
        self.resumed.as_mut().and_then(Resumed::state)
    }
}

impl Drop for Watch<'_> {
    fn drop(&mut self) {
        self.context.interrupt.unheeded();
    }
}
