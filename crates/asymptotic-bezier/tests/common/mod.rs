//! The recorded reference data sets.

#![allow(dead_code, reason = "each test file uses its share")]

use asymptotic_bezier::{CornerData, Curvatures};
use geom_core::DVec3;
use serde_json::Value;

/// One recorded set.
pub(crate) struct ReferenceSet {
    pub(crate) name: String,
    pub(crate) data: CornerData,
    pub(crate) json: Value,
}

impl ReferenceSet {
    pub(crate) fn number(&self, path: &[&str]) -> f64 {
        path.iter().fold(&self.json, |v, key| &v[*key]).as_f64().unwrap()
    }
}

pub(crate) fn vector(value: &Value) -> DVec3 {
    let at = |i: usize| value[i].as_f64().unwrap();
    DVec3::new(at(0), at(1), at(2))
}

/// All sets of `fixtures/asymptotic/reference.json`.
pub(crate) fn reference_sets() -> Vec<ReferenceSet> {
    let text = include_str!("../../../../fixtures/asymptotic/reference.json");
    let json: Value = serde_json::from_str(text).unwrap();
    json["sets"].as_array().unwrap().iter().map(read_set).collect()
}

/// The set whose name starts with `prefix`.
pub(crate) fn reference_set(prefix: &str) -> ReferenceSet {
    reference_sets().into_iter().find(|s| s.name.starts_with(prefix)).unwrap()
}

fn read_set(json: &Value) -> ReferenceSet {
    let signed =
        std::array::from_fn(|i| std::array::from_fn(|e| json["signed_k"][i][e].as_f64().unwrap()));
    ReferenceSet {
        name: json["name"].as_str().unwrap().to_owned(),
        data: CornerData {
            corners: ["00", "10", "01", "11"].map(|c| vector(&json["X"][c])),
            start_points: std::array::from_fn(|i| vector(&json["P_i1"][i])),
            end_points: std::array::from_fn(|i| vector(&json["P_i4"][i])),
            curvatures: Curvatures::Signed(signed),
            lines: [false; 4],
            inflections: [0; 4],
        },
        json: json.clone(),
    }
}
