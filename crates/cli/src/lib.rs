//! The `umbilic` command: it parses, reads, calls one library function, writes and prints.
//!
//! A library only so that man pages and shell completions can be made from [`command`]
//! (`cargo xtask dist`).
#![allow(clippy::print_stdout, reason = "a command line tool prints")]

mod args;
mod checkpoints;
mod choice;
mod commands;
mod config;
mod context;
mod failure;
mod input_file;
mod interrupt;
mod limits;
mod net_files;
mod net_report;
mod option_flags;
mod outcome;
mod panel_files;
mod paths;
mod report_support;
mod stdout;
mod trade_offs;
mod watch;
mod written;

use clap::{CommandFactory, FromArgMatches, Parser};
use context::Context;
use failure::{DEFECT, FAILED, Failure, INTERRUPTED, NOT_CONVERGED, OK, USAGE, say};
use outcome::{Outcome, Status};
use paths::Paths;
use std::io::Write;
use std::process::ExitCode;
use std::time::Instant;

/// Design surfaces that can be built.
#[derive(Debug, Parser)]
#[command(name = "umbilic", version, about, arg_required_else_help = true)]
struct Cli {
    #[command(flatten)]
    global: args::GlobalArgs,
    #[command(subcommand)]
    command: commands::Command,
}

/// The command line as clap knows it.
#[must_use]
pub fn command() -> clap::Command {
    Cli::command()
}

/// Runs the program with the arguments of this process; the exit codes are those of the README.
#[must_use]
pub fn main() -> ExitCode {
    // A panic is a defect of ours: it ends with one sentence and exit code 1, never with a trace.
    std::panic::set_hook(Box::new(|info| {
        let place = info.location().map(|l| format!(" at {}:{}", l.file(), l.line()));
        let what = info.payload_as_str().unwrap_or("no message");
        say(&format!("internal error{}: {what}; please report this", place.unwrap_or_default()));
    }));
    let code = std::panic::catch_unwind(start).unwrap_or(DEFECT);
    ExitCode::from(code)
}

fn start() -> u8 {
    let parsed = Cli::command().try_get_matches().and_then(|matches| {
        Ok((Paths::of(&Cli::command(), &matches), Cli::from_arg_matches(&matches)?))
    });
    let (paths, cli) = match parsed {
        Ok(parsed) => parsed,
        Err(error) => {
            // `--help` and `--version` come here too; clap prints them to stdout.
            let printed = error.print();
            if error.use_stderr() {
                return USAGE;
            }
            return match stdout::judged(printed) {
                Ok(()) => OK,
                Err(failure) => {
                    say(&failure.to_string());
                    failure.code()
                }
            };
        }
    };
    let result = paths
        .check()
        .and_then(|()| limits::heed_file_size())
        .and_then(|()| Context::new(&cli.global))
        .and_then(|context| run(&cli.global, &paths, &context, cli.command));
    result.unwrap_or_else(|failure| {
        say(&failure.to_string());
        failure.code()
    })
}

fn run(
    global: &args::GlobalArgs,
    paths: &Paths,
    context: &Context,
    command: commands::Command,
) -> Result<u8, Failure> {
    let begin = Instant::now();
    if let Some(path) = &global.metrics {
        args::check_output_path(path)?;
    }
    context.interrupt.begin(interrupt::Run {
        command: command.name(),
        begin,
        threads: context.threads,
        choice: paths.choice.clone(),
        metrics: global.metrics.clone(),
        quiet: global.quiet,
    });
    let outcome = command.run(context)?;
    write(outcome, paths, &context.interrupt, global.quiet)
}

/// Writes and prints what a command has found, or what there is of it after Ctrl-C.
fn write(
    mut outcome: Outcome,
    paths: &Paths,
    interrupt: &interrupt::Interrupt,
    quiet: bool,
) -> Result<u8, Failure> {
    // From here on this thread ends the program.
    let desk = interrupt.desk();
    outcome.checkpoint = desk.checkpoint();
    outcome.warnings.extend(desk.trouble().map(|t| format!("no checkpoint on the way: {t}")));
    for warning in &outcome.warnings {
        say(&format!("warning: {warning}"));
    }
    if interrupt.is_wanted() {
        outcome.status = Status::Interrupted;
    }
    paths.check_results(&outcome)?;
    paths.make_folders(&outcome)?;
    let is_over = outcome.status == Status::Interrupted;
    let is_stopped = || !is_over && interrupt.is_wanted();
    if !outcome.write_files(desk.metrics_of(&outcome), &is_stopped)? {
        outcome.status = Status::Interrupted;
        outcome.write_files(desk.metrics_of(&outcome), &|| false)?;
    }
    if !quiet {
        let summary: String = outcome.summary.iter().map(|line| format!("{line}\n")).collect();
        if paths.use_stdout() {
            // Standard output holds a result; people read the rest beside it.
            let _ = std::io::stderr().lock().write_all(summary.as_bytes());
        } else {
            stdout::write(summary.as_bytes())?;
        }
    }
    if outcome.status == Status::Interrupted {
        desk.part(&outcome);
    }
    // Never given back: nobody is to end the program after this.
    std::mem::forget(desk);
    Ok(exit_code(&outcome))
}

fn exit_code(outcome: &Outcome) -> u8 {
    match outcome.status {
        _ if outcome.differs => DEFECT,
        Status::Interrupted => INTERRUPTED,
        Status::Converged => OK,
        Status::Failed => FAILED,
        _ if outcome.require_converged => NOT_CONVERGED,
        _ => OK,
    }
}
