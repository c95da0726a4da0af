//! `cargo xtask bench`: run the benches and write down what they measured.

use crate::shell::{Outcome, cargo, check, read, root, target, write};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

const BEGIN: &str = "<!-- measured: begin -->";
const END: &str = "<!-- measured: end -->";

/// Runs `cargo bench` (for the packages named, or all) and rewrites the table of
/// `docs/benchmarks.md`: what was recorded there becomes "before".
pub(crate) fn run(packages: &[&str]) -> Outcome {
    let mut arguments = vec!["bench"];
    if packages.is_empty() {
        arguments.push("--workspace");
    }
    for package in packages {
        arguments.extend(["--package", package]);
    }
    check(cargo(&arguments))?;
    let page = root().join("docs/benchmarks.md");
    let text = read(&page)?;
    let measured = collect(&root().join("target/criterion"))?;
    write(&page, &with_table(&text, &measured, &machine())?)
}

/// Runs the solver on the public test sets and writes the table to `docs/solver-proof.md`.
pub(crate) fn proof() -> Outcome {
    // With the features of the whole workspace, so that no dependency is compiled twice.
    check(cargo(&["build", "--release", "--workspace", "--example", "proof", "--quiet"]))?;
    let mut run = Command::new(target().join("release/examples/proof"));
    run.current_dir(root()).arg(machine());
    let output = run.output().map_err(|e| format!("the proof could not start: {e}"))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(format!("the proof ended with {}: {said}", output.status));
    }
    write(&root().join("docs/solver-proof.md"), &String::from_utf8_lossy(&output.stdout))
}

/// Median time of every bench that has run, in seconds, by its name.
fn collect(folder: &Path) -> Outcome<BTreeMap<String, f64>> {
    let mut found = BTreeMap::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(folder) = open.pop() {
        let entries =
            std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        let folders: Vec<PathBuf> =
            entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()).collect();
        let new = folder.join("new");
        if new.join("estimates.json").is_file() {
            let estimates = json(&new.join("estimates.json"))?;
            let benchmark = json(&new.join("benchmark.json"))?;
            let name = benchmark.get("full_id").and_then(Value::as_str);
            let median = estimates.pointer("/median/point_estimate").and_then(Value::as_f64);
            if let (Some(name), Some(nanoseconds)) = (name, median) {
                found.insert(name.to_owned(), nanoseconds * 1e-9);
            }
        } else {
            open.extend(folders);
        }
    }
    Ok(found)
}

fn json(path: &Path) -> Outcome<Value> {
    serde_json::from_str(&read(path)?).map_err(|e| format!("{}: {e}", path.display()))
}

/// The page with its table replaced; rows of benches that did not run now are kept.
fn with_table(page: &str, measured: &BTreeMap<String, f64>, machine: &str) -> Outcome<String> {
    let begin = page.find(BEGIN).ok_or("docs/benchmarks.md has lost its `measured: begin` mark")?;
    let end = page.find(END).ok_or("docs/benchmarks.md has lost its `measured: end` mark")?;
    let mut rows: BTreeMap<String, [String; 3]> = BTreeMap::new();
    for line in page[begin..end].lines().filter(|line| line.starts_with("| `")) {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        if let [name, before, after, machine] = cells[..] {
            let cells = [before, after, machine].map(str::to_owned);
            rows.insert(name.trim_matches('`').to_owned(), cells);
        }
    }
    for (name, seconds) in measured {
        let before = rows.get(name).map_or_else(|| "—".to_owned(), |row| row[1].clone());
        rows.insert(name.clone(), [before, in_words(*seconds), machine.to_owned()]);
    }
    let mut table = format!("{BEGIN}\n| bench | before | after | machine |\n|---|---|---|---|\n");
    for (name, [before, after, machine]) in &rows {
        table.push_str(&format!("| `{name}` | {before} | {after} | {machine} |\n"));
    }
    Ok(format!("{}{table}{}", &page[..begin], &page[end..]))
}

fn in_words(seconds: f64) -> String {
    match seconds {
        s if s >= 1.0 => format!("{s:.2} s"),
        s if s >= 1e-3 => format!("{:.2} ms", s * 1e3),
        s if s >= 1e-6 => format!("{:.2} µs", s * 1e6),
        s => format!("{:.1} ns", s * 1e9),
    }
}

/// Processor and number of cores.
fn machine() -> String {
    let cpu = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let model = cpu.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or(": unknown");
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    format!("{}, {cores} cores", model.trim_start_matches([' ', '\t', ':']))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_last_measurement_becomes_before() {
        let page = format!("text\n{BEGIN}\n{END}\nmore");
        let once = with_table(&page, &BTreeMap::from([("a/1".into(), 2e-3)]), "m").unwrap();
        let twice = with_table(&once, &BTreeMap::from([("a/1".into(), 1e-3)]), "m").unwrap();
        assert!(twice.contains("| `a/1` | 2.00 ms | 1.00 ms | m |"), "{twice}");
        assert!(twice.starts_with("text\n") && twice.ends_with("\nmore"));
    }
}
