//! What every command is given: verbosity, threads, Ctrl-C, a progress bar.

use crate::args::GlobalArgs;
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Arc;

/// Set up once, before the command runs.
#[derive(Debug)]
pub(crate) struct Context {
    /// Threads of the global rayon pool.
    pub(crate) threads: usize,
    /// Ctrl-C.
    pub(crate) interrupt: Arc<Interrupt>,
    /// The format of the input, if it is said.
    pub(crate) input_format: Option<String>,
    quiet: bool,
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
        let interrupt = Interrupt::listen()?;
        let (threads, input_format) = (rayon::current_num_threads(), global.input_format.clone());
        Ok(Self { threads, interrupt, input_format, quiet: global.quiet })
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
