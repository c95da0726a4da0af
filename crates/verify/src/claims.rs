//! What a metrics file claims, what the files give, and whether the two agree.

use crate::table::{Row, Scale};
use glam::DVec3;
use serde_json::Value;
use std::collections::BTreeMap;

/// The `metrics` object of a run.
#[derive(Clone, Copy, Debug)]
pub struct Claims<'a> {
    metrics: &'a Value,
}

impl<'a> Claims<'a> {
    /// Of a metrics file's `metrics`.
    #[must_use]
    pub fn new(metrics: &'a Value) -> Self {
        Self { metrics }
    }

    fn at(&self, key: &str) -> Option<&'a Value> {
        key.split('.').try_fold(self.metrics, |at, part| match at {
            Value::Array(list) => list.get(part.parse::<usize>().ok()?),
            other => other.get(part),
        })
    }

    /// The number at a dotted key.
    #[must_use]
    pub fn number(&self, key: &str) -> Option<f64> {
        self.at(key)?.as_f64()
    }

    /// The whole number at a dotted key.
    #[must_use]
    pub fn count(&self, key: &str) -> Option<usize> {
        usize::try_from(self.at(key)?.as_u64()?).ok()
    }

    /// The text at a dotted key.
    #[must_use]
    pub fn text(&self, key: &str) -> Option<&'a str> {
        self.at(key)?.as_str()
    }

    /// Every number with its dotted key, in the order of the file.
    #[must_use]
    pub fn numbers(&self) -> Vec<(String, f64)> {
        let mut out = Vec::new();
        collect(self.metrics, "", &mut out);
        out
    }
}

fn collect(value: &Value, key: &str, out: &mut Vec<(String, f64)>) {
    let below = |part: &str| if key.is_empty() { part.to_owned() } else { format!("{key}.{part}") };
    match value {
        Value::Object(map) => map.iter().for_each(|(k, v)| collect(v, &below(k), out)),
        Value::Array(list) => {
            list.iter().enumerate().for_each(|(k, v)| collect(v, &below(&k.to_string()), out));
        }
        other => out.extend(other.as_f64().map(|x| (key.to_owned(), x))),
    }
}

/// Numbers recomputed from one file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    numbers: BTreeMap<String, f64>,
    prefix: String,
    center: DVec3,
}

impl Values {
    /// Of content that was moved to the origin from `center`.
    pub(crate) fn around(center: DVec3) -> Self {
        Self { center, ..Self::default() }
    }

    /// A place in space, one number to a coordinate.
    pub(crate) fn place(&mut self, key: &str, point: DVec3) {
        for (k, x) in (point + self.center).to_array().into_iter().enumerate() {
            self.number(&format!("{key}.{k}"), x);
        }
    }

    /// A number.
    pub(crate) fn number(&mut self, key: &str, value: f64) {
        self.numbers.insert(format!("{}{key}", self.prefix), value);
    }

    /// A whole number.
    pub(crate) fn count(&mut self, key: &str, value: usize) {
        self.number(key, value as f64);
    }

    /// What is recomputed from here on stands below this key.
    pub(crate) fn below(&mut self, key: &str) {
        self.prefix = format!("{key}.");
    }

    /// The number at a dotted key.
    #[must_use]
    pub fn get(&self, key: &str) -> Option<f64> {
        self.numbers.get(key).copied()
    }
}

/// Whether a claim holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Claimed and recomputed value agree within the accuracy.
    Same,
    /// They do not.
    Differs,
    /// The files do not hold what this number comes from.
    NotCheckable,
}

/// One claim and what became of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Dotted key in the metrics.
    pub key: String,
    /// What the run says.
    pub claimed: f64,
    /// What the files give, if they do.
    pub recomputed: Option<f64>,
    /// How far the two may be apart, in the unit of the claim.
    pub accuracy: f64,
    /// Whether they are not.
    pub verdict: Verdict,
}

impl Finding {
    /// Compares a claim with what a file of this scale gives.
    pub(crate) fn new(
        (key, claimed): (String, f64),
        row: Option<&Row>,
        values: &Values,
        (scale, is_single): (&Scale, bool),
    ) -> Self {
        let accuracy = row.and_then(|row| if is_single { row.single } else { Some(row.double) });
        let (Some(recomputed), Some(accuracy)) = (values.get(&key), accuracy) else {
            let verdict = Verdict::NotCheckable;
            return Self { key, claimed, recomputed: None, accuracy: 0.0, verdict };
        };
        let accuracy = accuracy.of(claimed, scale);
        // A NaN differs.
        let is_same = (claimed - recomputed).abs() <= accuracy;
        let verdict = if is_same { Verdict::Same } else { Verdict::Differs };
        Self { key, claimed, recomputed: Some(recomputed), accuracy, verdict }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn numbers_have_dotted_keys() {
        let metrics = json!({"a": 1, "b": {"c": 2.5, "d": [3, null]}, "e": "text", "f": true});
        let claims = Claims::new(&metrics);
        let want = [("a", 1.0), ("b.c", 2.5), ("b.d.0", 3.0)].map(|(k, x)| (k.to_owned(), x));
        assert_eq!(claims.numbers(), want);
        assert_eq!(claims.number("b.d.0"), Some(3.0));
        assert_eq!((claims.number("b.d.1"), claims.count("b.c")), (None, None));
        assert_eq!((claims.text("e"), claims.text("a")), (Some("text"), None));
    }
}
