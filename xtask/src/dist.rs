//! `cargo xtask dist`: man pages and shell completions of the command line tool.

use crate::shell::{Outcome, cargo, check, root, target};
use std::process::Command;

/// Writes `target/dist/man` and `target/dist/completions`.
pub(crate) fn run() -> Outcome {
    // With the features of the whole workspace, so that no dependency is compiled twice.
    check(cargo(&["build", "--workspace", "--example", "dist", "--quiet"]))?;
    let mut dist = Command::new(target().join("debug/examples/dist"));
    dist.current_dir(root()).arg(target().join("dist"));
    check(dist)
}
