//! Ctrl-C: the command is asked to stop, and ended if it does not within a moment.
//!
//! Solvers ask between steps and inside long loops whether to stop, and then end with something to
//! tell. What does not ask (reading, analysis, export), or asks too late, is ended from a thread of
//! its own. Either way no result is written, the checkpoint and the metrics are, and the exit code
//! is [`INTERRUPTED`]. Another Ctrl-C ends the program on the spot.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use gp_solver::Checkpoint;

use crate::checkpoints::Kept;
use crate::choice::Choice;
use crate::failure::{Failure, INTERRUPTED, say};
use crate::outcome::{Outcome, Status};

/// How long a solver may take to stop by itself.
const GRACE: Duration = Duration::from_millis(400);

/// Whether the user has pressed Ctrl-C, and what there is to write then.
#[derive(Debug)]
pub(crate) struct Interrupt {
    is_wanted: AtomicBool,
    /// Whether a solver asks.
    is_heeded: AtomicBool,
    /// Steps that solvers have shown.
    steps: AtomicUsize,
    desk: Mutex<Desk>,
}

/// What is known of a run before it begins.
#[derive(Debug)]
pub(crate) struct Run {
    pub(crate) command: &'static str,
    pub(crate) begin: Instant,
    pub(crate) threads: usize,
    pub(crate) choice: Choice,
    pub(crate) metrics: Option<PathBuf>,
    pub(crate) quiet: bool,
}

/// What is written when a run ends. Whoever writes files holds the desk meanwhile, so that nobody
/// ends the program between two of them.
#[derive(Debug, Default)]
pub(crate) struct Desk {
    run: Option<Run>,
    input: Option<PathBuf>,
    kept: Option<Kept>,
    /// Why a checkpoint could not be written on the way.
    trouble: Option<String>,
}

impl Interrupt {
    /// Listens from here on.
    pub(crate) fn listen() -> Result<Arc<Self>, Failure> {
        let interrupt = Arc::new(Self {
            is_wanted: AtomicBool::new(false),
            is_heeded: AtomicBool::new(false),
            steps: AtomicUsize::new(0),
            desk: Mutex::default(),
        });
        let shared = Arc::clone(&interrupt);
        ctrlc::set_handler(move || shared.pressed())
            .map_err(|e| Failure::other(format!("cannot listen for Ctrl-C: {e}")))?;
        Ok(interrupt)
    }

    fn pressed(self: &Arc<Self>) {
        if self.is_wanted.swap(true, Ordering::SeqCst) {
            std::process::exit(i32::from(INTERRUPTED));
        }
        let shared = Arc::clone(self);
        // Not here: another Ctrl-C is to be heard meanwhile.
        std::thread::spawn(move || {
            if shared.is_heeded.load(Ordering::SeqCst) {
                std::thread::sleep(GRACE);
            }
            shared.end()
        });
    }

    /// Ends the program as soon as nobody writes.
    fn end(&self) -> ! {
        let desk = self.desk();
        let mut outcome = Outcome::new(Status::Interrupted, self.steps.load(Ordering::SeqCst));
        outcome.input.clone_from(&desk.input);
        outcome.checkpoint = desk.checkpoint();
        let metrics = desk.metrics_of(&outcome);
        if std::io::stderr().is_terminal() {
            // Away from what the terminal shows of the key and of a progress bar.
            eprintln!();
        }
        let code = match outcome.write_files(metrics, &|| false) {
            Ok(_) => {
                desk.part(&outcome);
                INTERRUPTED
            }
            Err(failure) => {
                say(&failure.to_string());
                failure.code()
            }
        };
        std::process::exit(i32::from(code))
    }

    /// Whether the user has pressed Ctrl-C; who asks is given time to end by itself.
    pub(crate) fn is_wanted_by_solver(&self) -> bool {
        self.is_heeded.store(true, Ordering::SeqCst);
        self.is_wanted()
    }

    /// Whether the user has pressed Ctrl-C.
    pub(crate) fn is_wanted(&self) -> bool {
        self.is_wanted.load(Ordering::SeqCst)
    }

    /// No solver asks any more. One that has been told to stop keeps its time.
    pub(crate) fn unheeded(&self) {
        if !self.is_wanted() {
            self.is_heeded.store(false, Ordering::SeqCst);
        }
    }

    /// Counts a step.
    pub(crate) fn count(&self) {
        self.steps.fetch_add(1, Ordering::SeqCst);
    }

    /// A run begins.
    pub(crate) fn begin(&self, run: Run) {
        self.desk().run = Some(run);
    }

    /// What the run reads, and where it keeps its states.
    pub(crate) fn open(&self, input: Option<&Path>, kept: Option<Kept>) {
        let mut desk = self.desk();
        desk.input = input.map(Path::to_path_buf);
        desk.kept = kept;
    }

    /// Keeps a state, and writes it if it is time.
    pub(crate) fn keep(&self, state: Checkpoint) {
        let mut desk = self.desk();
        let is_due = desk.kept.as_mut().is_some_and(|kept| kept.take(state));
        let file = if is_due { desk.checkpoint() } else { None };
        if let Some((path, bytes)) = file
            && let Err(error) = exchange::write_files(&[(&path, &bytes)])
        {
            desk.trouble = Some(error.to_string());
        }
    }

    /// What is to be written; nobody ends the program while it is held.
    pub(crate) fn desk(&self) -> MutexGuard<'_, Desk> {
        self.desk.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Desk {
    /// The checkpoint as a file.
    pub(crate) fn checkpoint(&self) -> Option<(PathBuf, Vec<u8>)> {
        self.kept.as_ref().and_then(Kept::file)
    }

    /// Why a checkpoint could not be written on the way.
    pub(crate) fn trouble(&self) -> Option<&str> {
        self.trouble.as_deref()
    }

    /// The metrics file of an outcome, if it is asked for.
    pub(crate) fn metrics_of(&self, outcome: &Outcome) -> Option<(PathBuf, Vec<u8>)> {
        let run = self.run.as_ref()?;
        let path = run.metrics.clone()?;
        let seconds = run.begin.elapsed().as_secs_f64();
        Some((path, outcome.metrics_file(run.command, seconds, run.threads, &run.choice)))
    }

    /// Says that the run was interrupted, and how it goes on.
    pub(crate) fn part(&self, outcome: &Outcome) {
        if self.run.as_ref().is_some_and(|run| run.quiet) {
            return;
        }
        match &outcome.checkpoint {
            Some((path, _)) => {
                say(&format!("interrupted; it goes on with --resume {}", path.display()));
            }
            None => say("interrupted"),
        }
    }
}
