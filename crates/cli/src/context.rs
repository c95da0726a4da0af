//! What every command is given: verbosity, threads, Ctrl-C, a progress bar.

use crate::args::GlobalArgs;
use crate::failure::Failure;
use crate::interrupt::Interrupt;
use geom_core::{Budget, Cost};
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
    /// What a run may take; nothing is checked with `--force`.
    budget: Option<Budget>,
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
        let budget = match total_memory() {
            Some(memory) if !global.force => Some(Budget::of_machine(memory, threads)),
            _ => None,
        };
        Ok(Self { threads, interrupt, input_format, quiet: global.quiet, budget })
    }

    /// Refuses a run that would exceed the machine, in the name of the option that asks for it.
    pub(crate) fn afford(&self, cost: Cost, option: &'static str) -> Result<(), Failure> {
        let checked = self.budget.map_or(Ok(()), |budget| budget.check(cost, option));
        checked.map_err(|e| {
            let message = e.to_string().replace(&format!("`{option}`"), &flag_name(option));
            Failure::usage(format!("{message}, or go on with --force"))
        })
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
