//! Every block is named in a test of its derivatives.

use super::family::sources;
use super::tokens::{tokens, without_tests};
use crate::shell::{Outcome, read, root};
use std::collections::BTreeSet;

/// Compares the blocks of all crates with the tests that check derivatives.
pub(crate) fn check(faults: &mut Vec<String>) -> Outcome {
    let folder = root().join("crates");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut crates: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
    crates.sort();
    let mut untested = BTreeSet::new();
    for path in crates {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let (mut blocks, mut tested) = (BTreeSet::new(), BTreeSet::new());
        for file in sources(&path.join("src"))?.into_iter().chain(sources(&path.join("tests"))?) {
            let text = read(&file)?;
            let is_test = file.starts_with(path.join("tests")) || file.ends_with("tests.rs");
            let all = tokens(&text);
            let (kept, _) = without_tests(&all);
            if !is_test {
                blocks.extend(implementors(&kept));
            }
            // Doc examples count too: they run.
            if text.contains("check_jacobian") || text.contains("check_gradient") {
                tested.extend(text.split(|c: char| !c.is_alphanumeric()).map(str::to_owned));
            }
        }
        let missing = blocks.into_iter().filter(|block| !tested.contains(block));
        untested.extend(missing.map(|block| format!("{name}: {block}")));
    }
    let fault = |block| format!("{block} is in no test with check_jacobian or check_gradient");
    faults.extend(untested.into_iter().map(fault));
    Ok(())
}

/// Names behind `ResidualBlock for` and `EnergyBlock for`.
fn implementors(tokens: &[&str]) -> Vec<String> {
    let is_block = |w: &&[&str]| matches!(w[0], "ResidualBlock" | "EnergyBlock") && w[1] == "for";
    let names = tokens.windows(3).filter(is_block).map(|w| w[2]);
    names.filter(|name| name.starts_with(char::is_uppercase)).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn implementors_are_named_types() {
        let text = "impl ResidualBlock for Edges<'_> {} impl<T> EnergyBlock for &mut T {}";
        assert_eq!(implementors(&tokens(text)), ["Edges"]);
    }
}
