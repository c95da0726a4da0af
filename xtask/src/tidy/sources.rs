//! Length, unfinished ends and citations of a source.

use std::collections::BTreeSet;

/// A file longer than this is about more than one thing.
const LONGEST_FILE: usize = 700;

/// Looks at one source; `references` is the list of what may be cited.
pub(crate) fn check(shown: &str, text: &str, references: &str, faults: &mut Vec<String>) {
    let lines = text.lines().count();
    if lines > LONGEST_FILE {
        faults.push(format!(
            "{shown}: {lines} lines; a file is about one thing ({LONGEST_FILE} at most)"
        ));
    }
    for marker in ["todo!(", "unimplemented!("] {
        // This file names them and leaves nothing open.
        if text.contains(marker) && !shown.ends_with("tidy/sources.rs") {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn citations_are_found_with_author_and_year() {
        let found = citations("as in [Pellis et al. 2021, Eq. 5] and et al. again");
        assert_eq!(found.into_iter().collect::<Vec<_>>(), [("Pellis".into(), "2021".into())]);
    }
}
