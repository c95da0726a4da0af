//! `cargo xtask ci`: everything a change must pass.

use crate::shell::{Outcome, cargo, check, is_installed, root};
use crate::{attack, regress, tidy};
use std::io::{BufRead, BufReader};
use std::process::{Command, Stdio};
use std::thread;
use std::time::Instant;

/// How long the commands are attacked, and which attacks that are.
const ATTACK_SECONDS: &str = "120";
const ATTACK_SEED: &str = "1";

/// Runs every check in turn, stops at the first that fails, and ends with the list of what was skipped.
pub(crate) fn run() -> Outcome {
    let mut skipped = Vec::new();
    step("fmt", || check(cargo(&["fmt", "--all", "--check"])))?;
    step("clippy", || {
        check(cargo(&["clippy", "--workspace", "--all-targets", "--quiet", "--", "-D", "warnings"]))
    })?;
    step("tests and doc tests", || tests(&mut skipped))?;
    step("docs", || {
        let mut docs = cargo(&["doc", "--workspace", "--no-deps", "--quiet"]);
        docs.env("RUSTDOCFLAGS", "-D warnings");
        check(docs)
    })?;
    step("weingarten for the web", || wasm(&mut skipped))?;
    step("tidy", tidy::run)?;
    // Attacks are processes of milliseconds and waits, which leave most of the machine to the scenes.
    step("regress, with attacks beside it", || {
        let told = thread::scope(|scope| {
            let attacks = scope.spawn(|| attack::run(ATTACK_SECONDS, ATTACK_SEED));
            skipped.extend(regress::run(&[])?);
            attacks.join().unwrap_or_else(|_| Err("the attacks could not be made".to_owned()))
        })?;
        println!("attacks: {told}");
        Ok(())
    })?;
    if is_installed("cargo-deny") {
        step("licences and bans", || {
            check(cargo(&["deny", "--offline", "check", "licenses", "bans"]))
        })?;
    } else {
        skipped.push("licences and bans: cargo-deny is not installed".to_owned());
    }
    println!("\nskipped: {}", if skipped.is_empty() { "nothing" } else { "" });
    for line in &skipped {
        println!("  {line}");
    }
    println!("ci: all green");
    Ok(())
}

fn step(name: &str, work: impl FnOnce() -> Outcome) -> Outcome {
    println!("== {name}");
    let start = Instant::now();
    work().map_err(|message| format!("{name}: {message}"))?;
    println!("== {name}: passed in {:.0} s", start.elapsed().as_secs_f64());
    Ok(())
}

/// Builds the crate that runs in a page for WebAssembly, where that target can be had.
fn wasm(skipped: &mut Vec<String>) -> Outcome {
    const TARGET: &str = "wasm32-unknown-unknown";
    let added = Command::new("rustup").current_dir(root()).args(["target", "add", TARGET]).output();
    if !added.is_ok_and(|output| output.status.success()) {
        skipped.push(format!("weingarten for the web: rustup cannot add the target {TARGET}"));
        return Ok(());
    }
    let build = ["build", "--quiet", "-p", "weingarten", "--no-default-features"];
    let mut build = cargo(&[&build[..], &["--target", TARGET]].concat());
    // Nothing runs it here; whether it builds is all that is asked.
    build.env("CARGO_PROFILE_DEV_OPT_LEVEL", "0");
    check(build)
}

/// Runs all tests, passes on what matters of their output, and collects the names of skipped ones.
fn tests(skipped: &mut Vec<String>) -> Outcome {
    let mut command =
        cargo(&["test", "--workspace", "--no-fail-fast", "--quiet", "--", "--show-output"]);
    // The same random cases every time, so that a red run can be repeated; a text that differs from
    // its snapshot is an error, never a new snapshot.
    command.env("PROPTEST_RNG_SEED", "1").env("INSTA_UPDATE", "no");
    command.stdout(Stdio::piped()).current_dir(root());
    let mut child = command.spawn().map_err(|e| format!("cargo test could not start: {e}"))?;
    let output = child.stdout.take().ok_or("cargo test has no output")?;
    let mut log = String::new();
    for line in BufReader::new(output).lines() {
        let line = line.map_err(|e| format!("output of cargo test: {e}"))?;
        if let Some(at) = line.find("SKIPPED ") {
            skipped.push(line[at + "SKIPPED ".len()..].to_owned());
        }
        if line.starts_with("test result") || line.starts_with("running ") {
            println!("{line}");
        }
        log.push_str(&line);
        log.push('\n');
    }
    let status = child.wait().map_err(|e| format!("cargo test: {e}"))?;
    if status.success() {
        return Ok(());
    }
    println!("{}", failures(&log));
    Err(format!("cargo test failed ({status})"))
}

/// The parts of a test log that tell what failed.
fn failures(log: &str) -> String {
    let mut kept = String::new();
    let mut inside = false;
    for line in log.lines() {
        match line {
            "failures:" => inside = true,
            "successes:" => inside = false,
            _ if line.starts_with("test result") => inside = false,
            _ => {}
        }
        if inside || line.contains("panicked at") {
            kept.push_str(line);
            kept.push('\n');
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::failures;

    #[test]
    fn failures_are_cut_out_of_the_log() {
        let log =
            "successes:\nnoise\nfailures:\n---- a stdout ----\nboom\ntest result: FAILED\nmore";
        assert_eq!(failures(log), "failures:\n---- a stdout ----\nboom\n");
    }
}
