//! No file speaks of the machine it was written on.

/// Looks for machine paths and registries in one file.
pub(crate) fn check(shown: &str, text: &str, faults: &mut Vec<String>) {
    // In pieces, so that the list does not find itself.
    let stray =
        [["/ro", "ot/"], ["/ho", "me/"], ["/wo", "rk/"], ["crates", ".io"], ["static.", "crates"]];
    for word in stray.map(|parts| parts.concat()) {
        if let Some(line) = text.lines().position(|line| line.contains(&word)) {
            faults.push(format!("{shown}:{}: names {word}", line + 1));
        }
    }
}
