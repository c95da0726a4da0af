//! RON as every file of ours is written: options without `Some`, readable layout, typed errors.

use crate::error::ReadError;
use crate::files::read_text;
use ron::extensions::Extensions;
use ron::ser::PrettyConfig;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::path::Path;

/// Deepest nesting a reader follows.
pub(crate) const MAX_DEPTH: usize = 64;

/// A value from RON text; an `Option` stands without `Some`.
///
/// # Errors
/// [`ReadError::Text`] with the line at fault.
pub fn from_ron<T: DeserializeOwned>(text: &str) -> Result<T, ReadError> {
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
    fn errors_name_the_line() {
        let error = from_ron::<Sample>("(\n name: \"a\",\n row: [],\n)").unwrap_err();
        assert!(error.to_string().starts_with("line 3: column"), "{error}");
        let deep = "[".repeat(100_000);
        let error = from_ron::<Vec<ron::Value>>(&deep).unwrap_err();
        assert!(error.to_string().contains("nesting"), "{error}");
    }
}
