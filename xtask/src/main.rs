//! Chores of the workspace: `cargo xtask <chore>`.
#![allow(clippy::print_stdout, reason = "chores talk to the person who runs them")]

mod attack;
mod bench;
mod ci;
mod dist;
mod fuzz;
mod judges;
mod nightly;
mod regress;
mod restarts;
mod scene;
mod shell;
mod tidy;

use std::process::ExitCode;

const HELP: &str = "\
cargo xtask <chore>

  ci                       what CI runs: fmt, clippy, tests, doc tests, docs, tidy, regress
  tidy                     arrows between crates, circles of files, cited papers, stray paths, sizes
  regress [NAME…]          run the scenes under fixtures/regress (all, or those named)
  regress --bless NAME     rewrite the CloseTo values of one scene (never a bound)
  judges                   let independent programs read what we write, where they are installed
  bench [PACKAGE…]         run the benches and record them in docs/benchmarks.md
  dist                     man pages and shell completions into target/dist
  attack SECONDS [SEED]    throw hostile files, options and moments at the commands
  fuzz SECONDS [TARGET…]   fuzz the readers and the solver, each for so long
  nightly                  what takes too long for every change; writes docs/nightly.md
  bench --proof            run the solver on the public test sets, write docs/solver-proof.md
";

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let outcome = match arguments.as_slice() {
        ["ci"] => ci::run(),
        ["tidy"] => tidy::run(),
        ["regress", "--bless", name] => regress::bless(name),
        ["regress", names @ ..] => regress::run(names).map(|_| ()),
        ["judges"] => judges::run(),
        ["bench", "--proof"] => bench::proof(),
        ["nightly"] => nightly::run(),
        ["dist"] => dist::run(),
        ["attack", seconds] => attack::run(seconds, "1").map(|told| println!("{told}")),
        ["attack", seconds, seed] => attack::run(seconds, seed).map(|told| println!("{told}")),
        ["fuzz", seconds, targets @ ..] => fuzz::run(seconds, targets),
        ["bench", packages @ ..] => bench::run(packages),
        _ => {
            println!("{HELP}");
            return if arguments.is_empty() { ExitCode::SUCCESS } else { ExitCode::from(2) };
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("xtask: {message}");
            ExitCode::FAILURE
        }
    }
}
