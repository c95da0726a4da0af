//! Input that once gave wrong numbers, took for ever, or overflowed: `fixtures/hard`.

use crate::common::umbilic;
use serde_json::Value;
use std::fs;

/// Runs `analyze` and gives its metrics and what it said on stderr.
fn measured(file: &str) -> (Value, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let metrics = folder.path().join("m.json").display().to_string();
    let result = umbilic(&["analyze", file, "--metrics", &metrics]);
    let said = String::from_utf8_lossy(&result.stderr).into_owned();
    assert_eq!(result.status.code(), Some(0), "{file}: {said}");
    let summary = String::from_utf8_lossy(&result.stdout).into_owned();
    assert!(!summary.contains("NaN") && !summary.contains("inf"), "{summary}");
    let text = fs::read_to_string(&metrics).expect("metrics");
    (serde_json::from_str::<Value>(&text).expect("JSON")["metrics"].clone(), said)
}

fn number(metrics: &Value, key: &str) -> f64 {
    metrics[key].as_f64().unwrap_or_else(|| panic!("{key} in {metrics}"))
}

#[track_caller]
fn refused(args: &[&str], want: &str) {
    let result = umbilic(args);
    let said = String::from_utf8_lossy(&result.stderr).into_owned();
    assert_eq!(result.status.code(), Some(2), "{args:?}: {said}");
    assert!(said.contains(want) && said.trim_end().lines().count() < 9, "{said}");
}

#[test]
fn a_sphere_has_its_curvature_up_to_the_poles() {
    let (metrics, _) = measured("fixtures/hard/sphere-pole-exact.ron");
    for (key, want) in [
        ("mean_curvature_min", -0.02),
        ("mean_curvature_max", -0.02),
        ("gaussian_curvature_min", 0.0004),
        ("gaussian_curvature_max", 0.0004),
    ] {
        let got = number(&metrics, key);
        assert!((got / want - 1.0).abs() < 1e-9, "{key}: {got}");
    }
    assert_eq!(number(&metrics, "singular_points"), 0.0);
}

#[test]
fn alternating_diagonals_do_not_spoil_the_border() {
    let (metrics, _) = measured("fixtures/hard/alternating-diagonals.obj");
    let (low, high) = (-0.255, 0.169);
    let bound = 0.06 * (high - low);
    let got = ["gaussian_curvature_min", "gaussian_curvature_max"].map(|k| number(&metrics, k));
    assert!((got[0] - low).abs() < bound && (got[1] - high).abs() < bound, "{got:?}");
    assert!(number(&metrics, "gaussian_curvature_p01") >= got[0]);
    assert!(metrics["gaussian_curvature_max_at"].is_array());
}

#[test]
fn corners_of_their_own_are_welded_unless_told_otherwise() {
    let file = "fixtures/hard/unwelded-quads.obj";
    let (metrics, said) = measured(file);
    assert!(said.contains("corners that coincide with others were welded"), "{said}");
    // z = x y / 10.
    assert!(number(&metrics, "gaussian_curvature_max") < 0.0);
    let apart = umbilic(&["analyze", file, "--no-weld"]);
    assert!(!String::from_utf8_lossy(&apart.stderr).contains("welded"));
}

#[test]
fn a_crease_inside_a_surface_is_named_and_refused_by_what_needs_smoothness() {
    let file = "fixtures/hard/crease-inside-surface.step";
    let (_, said) = measured(file);
    assert!(said.contains("a crease of 33.4 degrees along"), "{said}");
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("o.step").display().to_string();
    refused(&["weingarten", file, "-o", &out], "a crease of 33.4 degrees along");
    refused(&["panel", file, "-o", &out], "a crease of 33.4 degrees along");
}

#[test]
fn a_vertex_of_many_edges_is_measured_in_time() {
    let (metrics, _) = measured("fixtures/hard/fan64.obj");
    assert_eq!(metrics["kind"], "subdivision_surface");
    assert!(number(&metrics, "quadrature_gap") < 0.01);
}

#[test]
fn numbers_without_meaning_are_refused() {
    for (file, want) in [
        ("all-same.ron", "all control points coincide, so the surface has no extent"),
        ("weight-1e300.ron", "is 1e300, and its products leave the range of numbers"),
        ("knots-denormal.ron", "derivatives over such a step leave the range of numbers"),
    ] {
        refused(&["analyze", &format!("fixtures/hard/{file}")], want);
    }
}

#[test]
fn what_would_exceed_the_machine_is_refused_by_its_option() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("o.glb").display().to_string();
    refused(
        &["panel", "fixtures/roof.ron", "--panels", "2000x2000", "-o", &out],
        "--panels asks for about",
    );
    refused(&["analyze", "fixtures/roof.ron", "--threads", "4294967295"], "from 1 to 1024");
}
