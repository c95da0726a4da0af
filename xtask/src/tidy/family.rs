//! Every method is one family: variables, blocks and a schedule, all public, on the one solver.

use super::tokens::{tokens, without_tests};
use crate::shell::{Outcome, read, root};
use std::path::{Path, PathBuf};

/// The methods.
const METHODS: &[&str] =
    &["weingarten", "hyperbolic-nets", "curvature-variation", "asymptotic-bezier", "paneling"];

/// What the front page of a method exports.
const EXPORTS: &[&str] =
    &["Error", "Options", "Solution", "blocks", "problem", "solve", "solve_with", "variables"];

/// Names that belong to a loop of steps, which only the solver has.
const STEPPING: &[&str] = &[
    "BandCholesky",
    "MultifrontalCholesky",
    "SparseCholesky",
    "damped_step",
    "projection_step",
    "stepped_into",
];

/// Looks at the methods.
pub(crate) fn check(faults: &mut Vec<String>) -> Outcome {
    for method in METHODS {
        let folder = root().join("crates").join(method);
        if !read(&folder.join("Cargo.toml"))?.contains("\ngp-solver") {
            faults.push(format!("{method} does not depend on gp-solver"));
        }
        let front = read(&folder.join("src/lib.rs"))?;
        let words = tokens(&front);
        for name in EXPORTS.iter().filter(|name| !words.contains(name)) {
            faults.push(format!("{method} does not export `{name}` at its root"));
        }
        for path in sources(&folder.join("src"))? {
            if path.ends_with("tests.rs") {
                continue;
            }
            let text = read(&path)?;
            let shown = path.strip_prefix(root()).unwrap_or(&path).display().to_string();
            faults.extend(
                steps(&text).map(|name| format!("{shown}: {name} is the solver's to call")),
            );
        }
    }
    Ok(())
}

/// Names of stepping that a source uses outside of its tests.
fn steps(text: &str) -> impl Iterator<Item = &'static str> {
    let all = tokens(text);
    let (kept, _) = without_tests(&all);
    let used: Vec<&'static str> =
        STEPPING.iter().filter(|name| kept.contains(name)).copied().collect();
    used.into_iter()
}

/// All Rust files below a folder.
pub(crate) fn sources(folder: &Path) -> Outcome<Vec<PathBuf>> {
    let mut found = Vec::new();
    let mut open = vec![folder.to_path_buf()];
    while let Some(folder) = open.pop() {
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        for path in entries.flatten().map(|entry| entry.path()) {
            if path.is_dir() {
                open.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stepping_is_found_outside_of_tests() {
        let text = "fn a() { system.projection_step(1.0); } #[cfg(test)] mod t { SparseCholesky }";
        assert_eq!(steps(text).collect::<Vec<_>>(), ["projection_step"]);
    }
}
