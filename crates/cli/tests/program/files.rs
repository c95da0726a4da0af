//! Files of several surfaces or meshes, units, and what is trimmed.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use crate::common::{message, refused, root, umbilic, write_into};
use serde_json::Value;
use std::fs;

/// Runs a command that must do well, with metrics; what it printed, and the metrics.
fn run(args: &[&str]) -> (String, Value) {
    let folder = tempfile::tempdir().unwrap();
    let metrics = folder.path().join("m.json");
    let output = umbilic(&[args, &["--metrics", metrics.to_str().unwrap()]].concat());
    assert_eq!(output.status.code(), Some(0), "{args:?}: {}", message(&output));
    let json: Value = serde_json::from_slice(&fs::read(metrics).unwrap()).unwrap();
    (String::from_utf8(output.stdout).unwrap(), json["metrics"].clone())
}

#[test]
fn the_surfaces_of_a_file_are_listed_and_chosen() {
    let file = "fixtures/step/bracket.step";
    let (text, listing) = run(&["analyze", file, "--list"]);
    assert_eq!(text.lines().count(), 10, "{text}");
    assert!(text.lines().nth(1).unwrap().trim_start().starts_with('1'), "{text}");
    let areas: Vec<f64> = listing["surfaces"]
        .as_array()
        .unwrap()
        .iter()
        .map(|s| s["area"].as_f64().unwrap())
        .collect();
    let area = |args: &[&str]| {
        let (_, metrics) = run(&[&["analyze", file], args].concat());
        metrics["area"].as_f64().unwrap()
    };
    let near = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-12;
    assert!(near(area(&["--surface", "2", "--surface", "5"]), areas[1] + areas[4]));
    assert!(near(area(&["--surface", "all"]), areas.iter().sum()));
    assert!(near(area(&[]), areas.iter().sum()));
    let choose = ["there are 9 surfaces in this file, 1, 2,", "choose one of them with --surface"];
    refused(&["weingarten", file], "a.step", &choose);
    let beyond = ["no surface 10 in this file; give a number from 1 to 9"];
    refused(&["panel", file, "--surface", "10"], "a.glb", &beyond);
}

#[test]
fn parts_of_meshes_are_listed_and_chosen() {
    let folder = tempfile::tempdir().unwrap();
    let square = |x: f64| format!("v {x} 0 0\nv {} 0 0\nv {} 1 0\nv {x} 1 0\n", x + 1.0, x + 1.0);
    let text = format!("{}{}f 1 2 3 4\nf 5 6 7 8\n", square(0.0), square(5.0));
    let file = write_into(&folder, "two.obj", &text);
    let (listed, listing) = run(&["analyze", &file, "--list"]);
    assert!(listed.contains("1 to 2"), "{listed}");
    assert_eq!(listing["meshes"][0]["parts"], serde_json::json!([1, 2]));
    let (_, second) = run(&["analyze", &file, "--part", "2"]);
    for (corner, wanted) in [[5.0, 0.0, 0.0], [6.0, 1.0, 0.0]].iter().enumerate() {
        for (axis, wanted) in wanted.iter().enumerate() {
            let got: f64 = second["bounding_box"][corner][axis].as_f64().unwrap();
            assert!((got - wanted).abs() < 1e-14, "{second}");
        }
    }
    let out = folder.path().join("second.obj").display().to_string();
    let (said, _) = run(&["convert", &file, &out, "--part", "2"]);
    assert!(said.contains("second.obj: 1 mesh, 4 vertices, 1 face"), "{said}");
    refused(&["fit", &file, "--part", "3"], "a.step", &["no part 3", "from 1 to 2"]);
}

#[test]
fn units_are_converted_or_their_loss_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let out = |name: &str| folder.path().join(name).display().to_string();
    let (file, step) = ("fixtures/step/inch-untyped-measure.step", out("a.step"));
    let (said, _) = run(&["convert", file, &step, "--unit", "mm"]);
    assert!(said.contains("lengths in mm"), "{said}");
    let size = |file: &str| {
        let (_, metrics) = run(&["analyze", file]);
        let at = |k: usize| metrics["bounding_box"][k][0].as_f64().unwrap();
        at(1) - at(0)
    };
    assert!((size(&step) / size(file) / 25.4 - 1.0).abs() < 1e-12);
    let output = umbilic(&["convert", file, &out("a.obj")]);
    let told = "warning: OBJ holds no unit of length; its numbers are in in";
    assert!(message(&output).contains(told), "{}", message(&output));
    refused(&["fit", "fixtures/grid.obj", "--unit", "mm"], "a.step", &["--unit"]);
    let output = umbilic(&["convert", file, &out("b.obj"), "--unit", "furlong"]);
    assert!(message(&output).contains("use mm, cm"), "{}", message(&output));
}

#[test]
fn a_trim_is_sampled_and_kept() {
    let folder = tempfile::tempdir().unwrap();
    let (file, out) = ("fixtures/step/bicubic-hole.step", folder.path().join("a.step"));
    let args = ["weingarten", file, "--iterations", "2", "-o", out.to_str().unwrap()];
    let (_, metrics) = run(&args);
    assert!(metrics["alignment_rms"].as_f64().unwrap().is_finite());
    let (before, after) = (root().join(file), out);
    let [before, after] = [before, after].map(|path| exchange::read_model(&path).unwrap());
    let loops = |model: &exchange::Model| model.surfaces[0].trim.as_ref().unwrap().loops().len();
    assert_eq!((loops(&before), loops(&after)), (2, 2));
    assert_ne!(before.surfaces[0].surface, after.surfaces[0].surface);
    // What counts is as large as before, to within the little that the surface has moved.
    let area = |model: &exchange::Model| model.surfaces[0].curvature_statistics().area;
    assert!((area(&after) / area(&before) - 1.0).abs() < 0.05);
}
