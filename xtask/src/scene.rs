//! A regress scene: one run of the command line and what its metrics must be.

use crate::shell::{Outcome, read, root};
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What one metric must be.
#[derive(Clone, Debug, Deserialize, PartialEq)]
pub(crate) enum Expectation {
    /// No larger than this bound.
    AtMost(f64),
    /// No smaller than this bound.
    AtLeast(f64),
    /// Within the tolerance (second) of the value (first), which `--bless` may rewrite.
    CloseTo(f64, f64),
    /// Exactly this text.
    Equals(String),
}

/// A file under `fixtures/regress`.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Scene {
    /// Arguments of `umbilic`; `{out}` is a scratch folder, `{models}` and `{reference}` the
    /// folders of input models and reference data.
    pub(crate) args: Vec<String>,
    /// Dotted paths into `metrics` (or `status`, `iterations`) and what stands there.
    pub(crate) expect: BTreeMap<String, Expectation>,
    /// `Some("models")` or `Some("reference")` if the scene needs that folder.
    #[serde(default)]
    pub(crate) needs: Option<String>,
}

/// A scene with its name and file.
pub(crate) struct NamedScene {
    pub(crate) name: String,
    pub(crate) path: PathBuf,
    pub(crate) scene: Scene,
}

/// Reads all scenes in order of their names.
pub(crate) fn all() -> Outcome<Vec<NamedScene>> {
    let folder = root().join("fixtures/regress");
    let entries = std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|e| e == "ron"));
    paths.sort();
    paths.into_iter().map(|path| load(&path)).collect()
}

fn load(path: &Path) -> Outcome<NamedScene> {
    let options =
        ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    let scene = options.from_str(&read(path)?).map_err(|e| format!("{}: {e}", path.display()))?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    Ok(NamedScene { name, path: path.to_path_buf(), scene })
}

/// What stands at a dotted path in a metrics file.
pub(crate) fn look_up<'a>(file: &'a Value, key: &str) -> Option<&'a Value> {
    if matches!(key, "status" | "iterations" | "command") {
        return file.get(key);
    }
    key.split('.').try_fold(file.get("metrics")?, |at, part| match part.parse::<usize>() {
        Ok(item) if at.is_array() => at.get(item),
        _ => at.get(part),
    })
}

impl Expectation {
    /// Whether `got` is as expected; a missing or non-numeric value never is.
    pub(crate) fn holds(&self, got: Option<&Value>) -> bool {
        let number = got.and_then(Value::as_f64);
        match self {
            Self::AtMost(bound) => number.is_some_and(|x| x <= *bound),
            Self::AtLeast(bound) => number.is_some_and(|x| x >= *bound),
            Self::CloseTo(value, tolerance) => {
                number.is_some_and(|x| (x - value).abs() <= *tolerance)
            }
            Self::Equals(text) => got.and_then(Value::as_str) == Some(text),
        }
    }
}

impl std::fmt::Display for Expectation {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::AtMost(bound) => write!(f, "<= {bound}"),
            Self::AtLeast(bound) => write!(f, ">= {bound}"),
            Self::CloseTo(value, tolerance) => write!(f, "{value} ± {tolerance}"),
            Self::Equals(text) => write!(f, "{text}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn bounds_refuse_missing_values_and_nan() {
        let file =
            json!({"status": "converged", "metrics": {"a": 1.0, "b": {"c": 2.0}, "n": null}});
        assert!(Expectation::AtMost(1.0).holds(look_up(&file, "a")));
        assert!(!Expectation::AtMost(0.9).holds(look_up(&file, "a")));
        assert!(Expectation::AtLeast(2.0).holds(look_up(&file, "b.c")));
        assert!(Expectation::CloseTo(2.1, 0.2).holds(look_up(&file, "b.c")));
        assert!(!Expectation::AtMost(9.0).holds(look_up(&file, "n")));
        assert!(!Expectation::AtMost(9.0).holds(look_up(&file, "missing")));
        assert!(Expectation::Equals("converged".into()).holds(look_up(&file, "status")));
    }
}
