//! `cargo xtask tidy`: rules that no compiler checks.

mod blocks;
mod callers;
mod circles;
mod dependencies;
mod family;
mod flags;
mod numerics;
mod sources;
mod stray_words;
mod tokens;

use crate::shell::{Outcome, read, root};
use std::path::{Path, PathBuf};

/// Checks the whole tree and lists every fault.
pub(crate) fn run() -> Outcome {
    let mut faults = Vec::new();
    dependencies::check(&mut faults)?;
    circles::check(&mut faults)?;
    family::check(&mut faults)?;
    blocks::check(&mut faults)?;
    callers::check(&mut faults)?;
    let references = read(&root().join("docs/references.md"))?;
    for path in tracked_text_files()? {
        let text = read(&path)?;
        let shown = path.strip_prefix(root()).unwrap_or(&path).display().to_string();
        if path.extension().is_some_and(|e| e == "rs") {
            sources::check(&shown, &text, &references, &mut faults);
            numerics::check(&shown, &text, &mut faults);
            flags::check(&shown, &text, &mut faults);
        }
        stray_words::check(&shown, &text, &mut faults);
    }
    for fault in &faults {
        println!("  {fault}");
    }
    if faults.is_empty() { Ok(()) } else { Err(format!("{} faults", faults.len())) }
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
