//! RON as every file of ours is written: options without `Some`, readable layout, typed errors.

use crate::error::{ReadError, clip};
use crate::files::read_text;
use ron::extensions::Extensions;
use ron::ser::PrettyConfig;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Deepest nesting a reader follows.
pub(crate) const MAX_DEPTH: usize = 64;

/// A value from RON text; an `Option` stands without `Some`, and every number is finite.
///
/// # Errors
/// [`ReadError::Text`] with the line at fault.
pub fn from_ron<T: DeserializeOwned>(text: &str) -> Result<T, ReadError> {
    let value = parsed(text)?;
    check_finite(text, false)?;
    Ok(value)
}

/// A value from a RON file in which `inf` has a meaning.
///
/// # Errors
/// As [`read_ron`], but for that word.
pub fn read_ron_with_infinity<T: DeserializeOwned>(path: &Path) -> Result<T, ReadError> {
    let text = read_text(path)?;
    let value = parsed(&text)?;
    check_finite(&text, true)?;
    Ok(value)
}

fn parsed<T: DeserializeOwned>(text: &str) -> Result<T, ReadError> {
    ron::Options::default()
        .with_default_extension(Extensions::IMPLICIT_SOME)
        .with_recursion_limit(MAX_DEPTH)
        .from_str(text)
        .map_err(ReadError::from)
}

/// A value from a RON file.
///
/// # Errors
/// As [`read_text`] and [`from_ron`].
pub fn read_ron<T: DeserializeOwned>(path: &Path) -> Result<T, ReadError> {
    from_ron(&read_text(path)?)
}

/// RON text that [`from_ron`] reads back to the same value, floats to the last bit.
///
/// # Errors
/// [`ron::Error`] for types RON cannot express.
pub fn to_ron<T: Serialize>(value: &T) -> Result<String, ron::Error> {
    // Rows of numbers stay on one line each.
    let layout = PrettyConfig::new().indentor("  ").depth_limit(4).compact_arrays(false);
    let options = ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME);
    let mut text = options.to_string_pretty(value, layout)?;
    text.push('\n');
    Ok(text)
}

/// Refuses `NaN`, `inf` and numbers beyond what 64 bits hold, outside of strings and comments, in a
/// text that is RON.
fn check_finite(text: &str, allows_inf: bool) -> Result<(), ReadError> {
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let length = match first {
            '/' => comment(rest),
            '"' => string(rest),
            'r' if rest[1..].starts_with(['"', '#']) => raw_string(rest),
            '\'' => character(rest),
            _ if is_of_word(first) => {
                let length = rest.find(|c| !is_of_word(c)).unwrap_or(rest.len());
                let word = &rest[..length];
                // A key of a struct is no number, whatever it is called.
                let is_key = rest[length..].trim_start().starts_with(':')
                    && word.starts_with(|c: char| c.is_alphabetic());
                if !is_key && !is_finite(word, allows_inf) {
                    let before = &text[..text.len() - rest.len()];
                    let line = before.matches('\n').count() + 1;
                    let column = before.chars().rev().take_while(|c| *c != '\n').count() + 1;
                    let what = format!("column {column}: `{}` is not a finite number", clip(word));
                    return Err(ReadError::text(line, what, "write finite numbers"));
                }
                length
            }
            other => other.len_utf8(),
        };
        rest = &rest[length..];
    }
    Ok(())
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || matches!(c, '_' | '+' | '-' | '.')
}

fn is_finite(word: &str, allows_inf: bool) -> bool {
    let size = word.trim_start_matches(['+', '-']);
    if matches!(size, "inf" | "inff32" | "inff64") {
        return allows_inf;
    }
    if matches!(size, "NaN" | "NaNf32" | "NaNf64") {
        return false;
    }
    let is_number = size.starts_with(|c: char| c.is_ascii_digit() || c == '.');
    let plain = size.trim_end_matches("f64").trim_end_matches("f32").replace('_', "");
    !is_number || plain.parse::<f64>().map_or(true, f64::is_finite)
}

/// Length of a comment, or of a slash alone.
fn comment(rest: &str) -> usize {
    if rest.starts_with("//") {
        return rest.find('\n').unwrap_or(rest.len());
    }
    if !rest.starts_with("/*") {
        return 1;
    }
    let (mut at, mut depth) = (2, 1);
    while depth > 0 {
        let Some(next) = rest[at..].find("*/") else { return rest.len() };
        depth += rest[at..at + next].matches("/*").count();
        depth -= 1;
        at += next + 2;
    }
    at
}

fn string(rest: &str) -> usize {
    let mut is_escaped = false;
    let end = rest[1..].find(|c| {
        let ends = c == '"' && !is_escaped;
        is_escaped = c == '\\' && !is_escaped;
        ends
    });
    end.map_or(rest.len(), |end| end + 2)
}

fn raw_string(rest: &str) -> usize {
    let hashes = rest[1..].len() - rest[1..].trim_start_matches('#').len();
    if !rest[1 + hashes..].starts_with('"') {
        return 1;
    }
    let close = format!("\"{}", "#".repeat(hashes));
    let start = 2 + hashes;
    rest[start..].find(&close).map_or(rest.len(), |end| start + end + close.len())
}

/// Length of a character in quotes.
fn character(rest: &str) -> usize {
    let start = if rest[1..].starts_with('\\') { 3 } else { 1 };
    rest.get(start..).and_then(|tail| tail.find('\'')).map_or(rest.len(), |end| start + end + 1)
}

impl From<ron::error::SpannedError> for ReadError {
    fn from(error: ron::error::SpannedError) -> Self {
        let what = match &error.code {
            ron::Error::ExceededRecursionLimit => {
                format!("the nesting is deeper than {MAX_DEPTH}")
            }
            code => code.to_string(),
        };
        let start = error.span.start;
        let mend = "see docs/formats.md for the fields this file may have";
        Self::text(start.line, format!("column {}: {what}", start.col), mend)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, Serialize, serde::Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Sample {
        name: Option<String>,
        rows: Vec<(f64, f64, f64)>,
    }

    #[test]
    fn values_come_back_bit_equal() {
        let rows = vec![(0.1, -1.0 / 3.0, 1e-310), (f64::MAX, 5e-324, -0.0)];
        let sample = Sample { name: Some("a".into()), rows };
        let text = to_ron(&sample).unwrap();
        assert_eq!(from_ron::<Sample>(&text).unwrap(), sample);
    }

    #[test]
    fn numbers_are_finite_wherever_they_stand() {
        let rows = |x: &str| format!("(\n  rows: [(0, 1, 2),\n    (1, {x}, 2)],\n)");
        for bad in ["NaN", "inf", "-inf", "+inf", "1e400", "-1e999", "1_0e308", "1e309f64"] {
            let error = from_ron::<Sample>(&rows(bad)).unwrap_err().to_string();
            let word = bad.trim_start_matches('+');
            let is_named = error.starts_with("line 3: column 9: `") && error.contains(word);
            assert!(is_named, "{bad}: {error}");
        }
        for good in ["1e308", "-5e-324", "31", "1_000.5"] {
            assert!(from_ron::<Sample>(&rows(good)).is_ok(), "{good}");
        }
        let words = "(name: \"inf \\\" NaN\", // inf\n /* NaN /* inf */ inf */ rows: [])";
        assert_eq!(from_ron::<Sample>(words).unwrap().name.as_deref(), Some("inf \" NaN"));
        assert!(from_ron::<Sample>("(name: r#\"a\" inf\"#, rows: [])").is_ok());
        let any = "{'\\'': (inf: 1), 'x': (nan: 2)}";
        assert!(from_ron::<ron::Value>(any).is_ok());
        assert!(from_ron::<ron::Value>("{'x': inf}").is_err());
    }

    #[test]
    fn infinity_is_read_where_it_has_a_meaning() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("creases.ron");
        let read = |text: &str| {
            std::fs::write(&file, text).unwrap();
            read_ron_with_infinity::<Vec<f64>>(&file)
        };
        assert_eq!(read("[inf, 1]").unwrap(), [f64::INFINITY, 1.0]);
        assert!(read("[1e400]").is_err() && read("[NaN]").is_err());
    }

    #[test]
    fn errors_name_the_line() {
        let error = from_ron::<Sample>("(\n name: \"a\",\n row: [],\n)").unwrap_err();
        assert!(error.to_string().starts_with("line 3: column"), "{error}");
        let deep = "[".repeat(100_000);
        let error = from_ron::<Vec<ron::Value>>(&deep).unwrap_err();
        assert!(error.to_string().contains("nesting"), "{error}");
    }
}
