//! Arrows between crates only go down.

use crate::shell::{Outcome, read, root};
use std::collections::BTreeSet;

/// What each crate may depend on inside the workspace (dev-dependencies aside).
const ALLOWED: &[(&str, &[&str])] = &[
    ("numerics", &[]),
    ("geom-core", &["numerics"]),
    ("gp-solver", &["numerics"]),
    ("bspline", &["geom-core", "numerics"]),
    ("subdiv-catmull-clark", &["geom-core", "numerics"]),
    ("weingarten", &["bspline", "geom-core", "gp-solver", "numerics"]),
    ("paneling", &["bspline", "geom-core", "gp-solver", "numerics"]),
    ("hyperbolic-nets", &["bspline", "geom-core", "gp-solver", "numerics"]),
    ("asymptotic-bezier", &["bspline", "geom-core", "gp-solver", "numerics"]),
    (
        "curvature-variation",
        &["subdiv-catmull-clark", "bspline", "geom-core", "gp-solver", "numerics"],
    ),
    ("quad-remesh", &["bspline", "geom-core", "gp-solver", "numerics"]),
    ("exchange", &["bspline", "geom-core", "numerics", "subdiv-catmull-clark"]),
    ("report", &["bspline", "geom-core", "numerics", "subdiv-catmull-clark"]),
    ("workflows", &["bspline", "geom-core", "gp-solver", "hyperbolic-nets", "quad-remesh"]),
    ("fixtures", &["bspline", "geom-core", "subdiv-catmull-clark"]),
    // By a path of its own: neither what makes the surfaces nor what solves for them.
    ("verify", &[]),
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
    "numerics",
    "paneling",
    "quad-remesh",
    "report",
    "subdiv-catmull-clark",
    "verify",
    "weingarten",
    "workflows",
];

/// Compares the dependencies of every crate with those it may have.
pub(crate) fn check(faults: &mut Vec<String>) -> Outcome {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_normal_dependencies_count() {
        let manifest = "[package]\nname = \"a\"\n\n[dependencies]\nb.workspace = true\nc = \"1\"\n\n[dev-dependencies]\nd = \"1\"\n";
        assert_eq!(normal_dependencies(manifest).collect::<Vec<_>>(), ["b", "c"]);
    }
}
