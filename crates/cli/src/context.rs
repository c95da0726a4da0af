//! What every command is given: verbosity, threads, the interrupt flag, a progress bar.

use crate::args::GlobalArgs;
use crate::failure::{Failure, INTERRUPTED};
use exchange::Model;
use geom_core::{Budget, Cost};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Set up once, before the command runs.
#[derive(Debug)]
pub(crate) struct Context {
    /// Threads of the global rayon pool.
    pub(crate) threads: usize,
    quiet: bool,
    /// Whether corners of meshes that coincide are welded.
    weld: bool,
    /// What a run may take; nothing is checked with `--force`.
    budget: Option<Budget>,
    interrupt: Arc<AtomicBool>,
    /// Whether somebody will act on the interrupt flag: a solver that asks for it between steps,
    /// or `main` while it writes.
    heeded: Arc<AtomicBool>,
}

impl Context {
    /// Starts the thread pool, logging, and the Ctrl-C handler.
    pub(crate) fn new(global: &GlobalArgs) -> Result<Self, Failure> {
        start_logging(global.verbose);
        let mut pool = rayon::ThreadPoolBuilder::new();
        if let Some(threads) = global.threads {
            pool = pool.num_threads(threads.get());
        }
        pool.build_global().map_err(|e| Failure::other(format!("cannot start threads: {e}")))?;
        let interrupt = Arc::new(AtomicBool::new(false));
        let heeded = Arc::new(AtomicBool::new(false));
        let (flag, listener) = (Arc::clone(&interrupt), Arc::clone(&heeded));
        // The first Ctrl-C asks the solver to stop and write its checkpoint, the second one ends;
        // so does the first one where no solver has begun to ask, for nothing is written yet.
        let handler = move || {
            if flag.swap(true, Ordering::SeqCst) || !listener.load(Ordering::SeqCst) {
                std::process::exit(i32::from(INTERRUPTED));
            }
        };
        ctrlc::set_handler(handler)
            .map_err(|e| Failure::other(format!("cannot listen for Ctrl-C: {e}")))?;
        let threads = rayon::current_num_threads();
        let budget = match total_memory() {
            Some(memory) if !global.force => Some(Budget::of_machine(memory, threads)),
            _ => None,
        };
        let (quiet, weld) = (global.quiet, !global.no_weld);
        Ok(Self { threads, quiet, weld, budget, interrupt, heeded })
    }

    /// The content of a file, with its meshes welded and oriented; what was done is among the
    /// warnings.
    pub(crate) fn read_model(&self, path: &Path) -> Result<Model, Failure> {
        let mut model = exchange::read_model(path).map_err(|e| Failure::input(path, e))?;
        model.mend(self.weld);
        Ok(model)
    }

    /// Refuses a run that would exceed the machine, in the name of the option that asks for it.
    pub(crate) fn afford(&self, cost: Cost, option: &'static str) -> Result<(), Failure> {
        let checked = self.budget.map_or(Ok(()), |budget| budget.check(cost, option));
        checked.map_err(|e| {
            let message = e.to_string().replace(&format!("`{option}`"), &flag_name(option));
            Failure::usage(format!("{message}, or go on with --force"))
        })
    }

    /// Whether the user pressed Ctrl-C: the callback of every solver asks.
    pub(crate) fn interrupted(&self) -> bool {
        self.heeded.store(true, Ordering::SeqCst);
        self.interrupt.load(Ordering::SeqCst)
    }

    /// From here on Ctrl-C waits until the files are written, which takes a moment only; then no
    /// temporary file is left behind.
    pub(crate) fn begin_writing(&self) {
        self.heeded.store(true, Ordering::SeqCst);
    }

    /// A progress bar of `steps` steps on stderr; invisible unless stderr is a terminal.
    pub(crate) fn progress(&self, label: &'static str, steps: usize) -> Progress {
        let visible = !self.quiet && std::io::stderr().is_terminal();
        let target =
            if visible { ProgressDrawTarget::stderr() } else { ProgressDrawTarget::hidden() };
        let bar = ProgressBar::with_draw_target(Some(steps as u64), target);
        let style = ProgressStyle::with_template("{prefix} {wide_bar} {pos}/{len} {msg}");
        bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
        bar.set_prefix(label);
        Progress(bar)
    }
}

fn flag_name(option: &str) -> String {
    format!("--{}", option.replace('_', "-"))
}

/// Memory of the machine in bytes, where the system tells.
fn total_memory() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find(|line| line.starts_with("MemTotal:"))?;
    let kilobytes: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes * 1024)
}

/// A progress bar that vanishes when dropped.
#[derive(Debug)]
pub(crate) struct Progress(ProgressBar);

impl Progress {
    /// `done` steps are done; `message` tells the current energies.
    pub(crate) fn at(&self, done: usize, message: impl Into<String>) {
        self.0.set_position(done as u64);
        self.0.set_message(message.into());
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

fn start_logging(verbose: u8) {
    let level = match verbose {
        0 => return,
        1 => tracing::Level::INFO,
        2 => tracing::Level::DEBUG,
        _ => tracing::Level::TRACE,
    };
    // An error here means that logging is already on, which only happens in tests.
    let _ = tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .try_init();
}
