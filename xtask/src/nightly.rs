//! `cargo xtask nightly`: what takes too long for every change, with a table of what was run.

use crate::shell::{Outcome, build_umbilic, cargo, check, root, target, umbilic, write};
use crate::{bench, fuzz, judges};
use serde_json::Value;
use std::fmt::Write;
use std::path::Path;
use std::time::Instant;

/// Seconds every fuzz target gets.
const FUZZ_SECONDS: &str = "120";
/// A converged result that is started again may lower its energy by this share at most.
const RESTART_GAIN: f64 = 0.01;

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
    step("converged results started again (fair)", &|| restarts());
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

/// Meshes and energies that are faired and then faired again from their result.
const FAIRED: &[(&str, &str)] = &[
    ("fixtures/quads/torus-thin.obj", "mehlum_tarrou"),
    ("fixtures/quads/lamp-shade.obj", "mehlum_tarrou"),
    ("fixtures/quads/vase.obj", "f1"),
    ("fixtures/quads/cube.obj", "mvs"),
    ("fixtures/quads/theta-4.obj", "bending"),
];

/// A result that says `converged`, by any method, is started again for as many steps, and may not
/// become better by more than one per cent.
fn restarts() -> Outcome<String> {
    let folder = target().join("nightly");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut converged = 0;
    let mut faults = Vec::new();
    for (mesh, energy) in FAIRED {
        for method in ["lagged-gauss-newton", "gauss-newton", "sobolev", "lbfgs"] {
            let first = fair(&folder, mesh, energy, method, "first")?;
            if first.0 != "converged" {
                continue;
            }
            converged += 1;
            let result = folder.join("first.obj").display().to_string();
            let again = fair(&folder, &result, energy, "lagged-gauss-newton", "again")?;
            let gain = (first.1 - again.1) / first.1.abs().max(f64::MIN_POSITIVE);
            println!("{mesh} {energy} {method}: {:e}, again {:e}", first.1, again.1);
            if gain > RESTART_GAIN && first.1 > 1e-9 {
                faults.push(format!("{mesh} {energy} {method} gains {:.1} %", 100.0 * gain));
            }
        }
    }
    if faults.is_empty() {
        Ok(format!("{converged} converged runs"))
    } else {
        Err(faults.join("; "))
    }
}

/// Status and final energy of a run without refinement.
fn fair(
    folder: &Path,
    mesh: &str,
    energy: &str,
    method: &str,
    name: &str,
) -> Outcome<(String, f64)> {
    let (out, metrics) = (folder.join(format!("{name}.obj")), folder.join("metrics.json"));
    let mut command = umbilic();
    command.args(["fair", mesh, "--levels", "0", "--energy", energy, "--method", method, "-q"]);
    command.arg("-o").arg(&out).arg("--metrics").arg(&metrics);
    check(command)?;
    let text = crate::shell::read(&metrics)?;
    let json: Value = serde_json::from_str(&text).map_err(|e| format!("metrics: {e}"))?;
    let status = json["status"].as_str().unwrap_or_default().to_owned();
    Ok((status, json["metrics"]["energy_final"].as_f64().unwrap_or(f64::NAN)))
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
