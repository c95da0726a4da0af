//! `cargo xtask nightly`: what takes too long for every change, with a table of what was run.

use crate::shell::{Outcome, build_umbilic, cargo, check, root, write};
use crate::{attack, bench, fuzz, judges, restarts};
use std::fmt::Write;
use std::time::Instant;

/// Seconds every fuzz target gets.
const FUZZ_SECONDS: &str = "120";

/// One line of the table.
struct Line {
    what: &'static str,
    seconds: f64,
    outcome: Outcome<String>,
}

/// Runs everything, writes `docs/nightly.md`, and fails if anything did.
pub(crate) fn run() -> Outcome {
    build_umbilic()?;
    let mut lines = Vec::new();
    let mut step = |what: &'static str, work: &dyn Fn() -> Outcome<String>| {
        println!("== {what}");
        let begin = Instant::now();
        let outcome = work();
        let seconds = begin.elapsed().as_secs_f64();
        println!("== {what}: {} in {seconds:.0} s", told(&outcome));
        lines.push(Line { what, seconds, outcome });
    };
    step("converged results started again", &|| restarts::run());
    step("hostile files, options and moments", &|| attack::run("600", "2"));
    step("independent programs read what we write", &|| judges::run().map(|()| String::new()));
    step("tests that measure time", &|| {
        let test = ["test", "--workspace", "--quiet", "--", "--ignored"];
        check(cargo(&test)).map(|()| String::new())
    });
    step("the solver on the public test sets", &|| bench::proof().map(|()| String::new()));
    step("coverage-guided fuzzing of readers and solver", &|| {
        fuzz::run(FUZZ_SECONDS, &[]).map(|()| format!("{FUZZ_SECONDS} s a target"))
    });
    write(&root().join("docs/nightly.md"), &page(&lines))?;
    let failed: Vec<&str> =
        lines.iter().filter(|l| l.outcome.is_err()).map(|line| line.what).collect();
    if failed.is_empty() { Ok(()) } else { Err(format!("failed: {}", failed.join(", "))) }
}

fn told(outcome: &Outcome<String>) -> String {
    match outcome {
        Ok(note) if note.is_empty() => "passed".to_owned(),
        Ok(note) => format!("passed ({note})"),
        Err(message) => format!("failed: {}", message.replace(['\n', '|'], " ")),
    }
}

fn page(lines: &[Line]) -> String {
    let mut text = "# What `cargo xtask nightly` found\n\
        Written by the command itself; a line for what it ran last.\n\n\
        | what | outcome | seconds |\n|---|---|---|\n"
        .to_owned();
    for Line { what, seconds, outcome } in lines {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "| {what} | {} | {seconds:.0} |", told(outcome));
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_has_a_line_for_what_was_run() {
        let lines = [
            Line { what: "a", seconds: 1.2, outcome: Ok(String::new()) },
            Line { what: "b", seconds: 60.0, outcome: Err("x | y".to_owned()) },
        ];
        assert!(page(&lines).ends_with("| a | passed | 1 |\n| b | failed: x   y | 60 |\n"));
    }
}
