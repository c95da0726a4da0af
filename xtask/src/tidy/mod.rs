//! `cargo xtask tidy`: rules that no compiler checks.

use crate::shell::{Outcome, read, root};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// What each crate may depend on inside the workspace (dev-dependencies aside).
const ALLOWED: &[(&str, &[&str])] = &[
    ("geom-core", &[]),
    ("gp-solver", &[]),
    ("bspline", &["geom-core"]),
    ("subdiv-catmull-clark", &["geom-core"]),
    ("weingarten", &["bspline", "geom-core", "gp-solver"]),
    ("paneling", &["bspline", "geom-core", "gp-solver"]),
    ("hyperbolic-nets", &["bspline", "geom-core", "gp-solver"]),
    ("asymptotic-bezier", &["bspline", "geom-core", "gp-solver"]),
    ("curvature-variation", &["subdiv-catmull-clark", "bspline", "geom-core", "gp-solver"]),
    ("exchange", &["bspline", "geom-core", "subdiv-catmull-clark"]),
    ("report", &["bspline", "geom-core", "subdiv-catmull-clark"]),
    ("fixtures", &["bspline", "geom-core", "subdiv-catmull-clark"]),
    ("cli", EVERYTHING),
];

/// What the command line may depend on.
const EVERYTHING: &[&str] = &[
    "asymptotic-bezier",
    "bspline",
    "curvature-variation",
    "exchange",
    "fixtures",
    "geom-core",
    "gp-solver",
    "hyperbolic-nets",
    "paneling",
    "report",
    "subdiv-catmull-clark",
    "weingarten",
];

/// A file longer than this is about more than one thing.
const LONGEST_FILE: usize = 700;

/// Checks the whole tree and lists every fault.
pub(crate) fn run() -> Outcome {
    let mut faults = Vec::new();
    dependency_directions(&mut faults)?;
    let references = read(&root().join("docs/references.md"))?;
    for path in tracked_text_files()? {
        let text = read(&path)?;
        let shown = path.strip_prefix(root()).unwrap_or(&path).display().to_string();
        if path.extension().is_some_and(|e| e == "rs") {
            sources(&shown, &text, &references, &mut faults);
        }
        stray_words(&shown, &text, &mut faults);
    }
    for fault in &faults {
        println!("  {fault}");
    }
    if faults.is_empty() { Ok(()) } else { Err(format!("{} faults", faults.len())) }
}

fn dependency_directions(faults: &mut Vec<String>) -> Outcome {
    let names: BTreeSet<&str> = ALLOWED.iter().map(|(name, _)| *name).collect();
    let folder = root().join("crates");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let crates = entries.flatten().map(|entry| entry.path());
    for path in crates.chain([root().join("fixtures")]) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let Some((_, allowed)) = ALLOWED.iter().find(|(known, _)| *known == name) else {
            faults.push(format!("{name}: unknown to tidy; say what it may depend on"));
            continue;
        };
        let manifest = read(&path.join("Cargo.toml"))?;
        for dependency in normal_dependencies(&manifest) {
            if names.contains(dependency) && !allowed.contains(&dependency) {
                faults.push(format!("{name} may not depend on {dependency}"));
            }
        }
    }
    Ok(())
}

/// Names under `[dependencies]` of a manifest.
fn normal_dependencies(manifest: &str) -> impl Iterator<Item = &str> {
    let lines = manifest.lines().skip_while(|line| *line != "[dependencies]").skip(1);
    lines
        .take_while(|line| !line.starts_with('['))
        .filter_map(|line| line.split(['.', ' ', '=']).next().filter(|name| !name.is_empty()))
}

/// Text files that git tracks, or would track.
fn tracked_text_files() -> Outcome<Vec<PathBuf>> {
    let mut git = std::process::Command::new("git");
    git.current_dir(root()).args(["ls-files", "--cached", "--others", "--exclude-standard"]);
    let output = git.output().map_err(|e| format!("git could not start: {e}"))?;
    let list = String::from_utf8_lossy(&output.stdout).into_owned();
    let is_text = |path: &Path| {
        let extension = path.extension().map(|e| e.to_string_lossy().into_owned());
        matches!(
            extension.as_deref(),
            Some("rs" | "md" | "toml" | "ron" | "js" | "html" | "css" | "glsl" | "py" | "sh")
        )
    };
    let paths = list.lines().map(|line| root().join(line));
    Ok(paths.filter(|path| is_text(path) && path.is_file()).collect())
}

fn sources(shown: &str, text: &str, references: &str, faults: &mut Vec<String>) {
    let lines = text.lines().count();
    if lines > LONGEST_FILE {
        faults.push(format!(
            "{shown}: {lines} lines; a file is about one thing ({LONGEST_FILE} at most)"
        ));
    }
    for marker in ["todo!(", "unimplemented!("] {
        // Spelt in two parts so that this file does not accuse itself.
        if text.contains(marker) && !shown.ends_with("tidy.rs") {
            faults.push(format!("{shown}: {marker}…) is left"));
        }
    }
    for (author, year) in citations(text) {
        let listed = references.lines().any(|line| line.contains(&author) && line.contains(&year));
        if !listed {
            faults.push(format!("{shown}: {author} {year} is not in docs/references.md"));
        }
    }
}

/// Citations of the forms `Pellis et al. 2021`: first author and year.
fn citations(text: &str) -> BTreeSet<(String, String)> {
    let mut found = BTreeSet::new();
    for (at, _) in text.match_indices(" et al. ") {
        let author = text[..at].rsplit(|c: char| !c.is_alphabetic()).next().unwrap_or_default();
        let year: String = text[at + " et al. ".len()..].chars().take(4).collect();
        let is_year = year.len() == 4 && year.chars().all(|c| c.is_ascii_digit());
        if !author.is_empty() && is_year {
            found.insert((author.to_owned(), year));
        }
    }
    found
}

fn stray_words(shown: &str, text: &str, faults: &mut Vec<String>) {
    // In pieces, so that the list does not find itself.
    let stray =
        [["/ro", "ot/"], ["/ho", "me/"], ["/wo", "rk/"], ["crates", ".io"], ["static.", "crates"]];
    for word in stray.map(|parts| parts.concat()) {
        if let Some(line) = text.lines().position(|line| line.contains(&word)) {
            faults.push(format!("{shown}:{}: names {word}", line + 1));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn citations_are_found_with_author_and_year() {
        let found = citations("as in [Pellis et al. 2021, Eq. 5] and et al. again");
        assert_eq!(found.into_iter().collect::<Vec<_>>(), [("Pellis".into(), "2021".into())]);
    }

    #[test]
    fn only_normal_dependencies_count() {
        let manifest = "[package]\nname = \"a\"\n\n[dependencies]\nb.workspace = true\nc = \"1\"\n\n[dev-dependencies]\nd = \"1\"\n";
        assert_eq!(normal_dependencies(manifest).collect::<Vec<_>>(), ["b", "c"]);
    }
}
