//! Libraries name fields of options; only the command line speaks of flags and of its own name.

use super::tokens::{tokens_and_texts, without_tests};

/// Looks at the texts of one source, `shown` is its path from the root.
pub(crate) fn check(shown: &str, text: &str, faults: &mut Vec<String>) {
    let Some(name) = shown.strip_prefix("crates/").and_then(|s| s.split('/').next()) else {
        return;
    };
    if name == "cli" || !shown.contains("/src/") {
        return;
    }
    for word in strays(text) {
        faults.push(format!("{shown}: a text names {word}; name the field of the options"));
    }
}

/// Flags and the program's name in string literals outside of tests.
fn strays(text: &str) -> Vec<String> {
    let all = tokens_and_texts(text);
    let (kept, _) = without_tests(&all);
    let literals = kept.into_iter().filter(|token| token.contains('"'));
    let words =
        literals.flat_map(|l| l.split(|c: char| c.is_whitespace() || "\"`;,()".contains(c)));
    let is_flag = |w: &str| {
        let name = w.strip_prefix("--").unwrap_or_default();
        name.len() > 1 && name.chars().all(|c| c.is_ascii_lowercase() || c == '-' || c == '=')
    };
    words.filter(|w| is_flag(w) || *w == "umbilic").map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flags_in_texts_are_found() {
        assert_eq!(strays(r#"f("use --levels 3 or umbilic hnet")"#), ["--levels", "umbilic"]);
        assert!(strays(r#"f("a -- b", "x--"); // --levels"#).is_empty());
    }
}
