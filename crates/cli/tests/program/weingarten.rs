//! `umbilic weingarten` and `umbilic demo` from the outside: files, exit codes, messages.

use crate::common;
use crate::common::{message, root, umbilic};
use std::fs;
use std::path::Path;

/// A refusal: exit code 2, a message with these words, nothing written.
fn refused(args: &[&str], words: &[&str]) {
    common::refused(&[&["weingarten"], args].concat(), "out.step", words);
}

fn metrics(path: &Path) -> serde_json::Value {
    serde_json::from_str(&fs::read_to_string(path).expect("a metrics file")).expect("JSON")
}

#[test]
fn a_surface_is_optimised_into_every_format_with_metrics() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (ron, step, glb, json) = (path("a.ron"), path("a.step"), path("a.glb"), path("a.json"));
    let args = ["weingarten", "fixtures/saddle.ron", "-o", &ron, "-o", &step, "-o", &glb];
    let mut args = args.to_vec();
    args.extend(["--iterations", "3", "--metrics", &json]);
    let result = umbilic(&args);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    let m = metrics(Path::new(&json));
    assert_eq!((&m["schema"], &m["command"]), (&1.into(), &"weingarten".into()));
    assert_eq!((&m["status"], &m["iterations"]), (&"iteration_limit".into(), &3.into()));
    for key in [
        "alignment_rms",
        "diagram_area",
        "deviation_mean_percent",
        "deviation_max_percent",
        "boundary_deviation_max_percent",
        "mean_curvature_min",
        "mean_curvature_max",
        "gaussian_curvature_min",
        "gaussian_curvature_max",
        "relation_rms",
        "variables",
        "control_points",
        "samples",
        "ms_per_iteration",
        "factorizations",
    ] {
        assert!(m["metrics"][key].is_number(), "{key}");
    }
    // The same number of control points and the same unit, read back.
    let back = umbilic(&["analyze", &step]);
    let text = String::from_utf8_lossy(&back.stdout).into_owned();
    assert!(text.contains("14 x 14 control points"), "{text}");
    assert!(fs::read(&glb).expect("a GLB").starts_with(b"glTF"));
}

#[test]
fn an_optimised_surface_resumes_to_the_same_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let run = |iterations: &str, out: &str, more: &[&str]| {
        let mut args = vec!["weingarten", "fixtures/saddle.ron", "--iterations", iterations];
        args.extend(["-o", out]);
        args.extend(more);
        let result = umbilic(&args);
        assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    };
    let (whole, half, rest) = (path("whole.ron"), path("half.ron"), path("rest.ron"));
    let state = path("state.json");
    run("4", &whole, &["--threads", "1"]);
    run("2", &half, &["--checkpoint", &state]);
    run("4", &rest, &["--resume", &state, "--threads", "2"]);
    assert_eq!(fs::read(whole).expect("a file"), fs::read(rest).expect("a file"));
}

#[test]
fn options_come_from_a_file_and_flags_override_them() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let (config, out, json) = (path("o.ron"), path("a.ron"), path("a.json"));
    let text = "(iterations: 5, levels: \"9x8\", samples: \"14x12\", border: glide, shape: 0.1)";
    fs::write(&config, text).expect("written");
    let [config, out, json] = [config, out, json].map(|p| p.display().to_string());
    let args = ["weingarten", "fixtures/saddle.ron", "-o", &out, "--config", &config];
    let mut args = args.to_vec();
    args.extend(["--iterations", "1", "--metrics", &json]);
    let result = umbilic(&args);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    let m = metrics(Path::new(&json));
    assert_eq!(m["iterations"], 1);
    assert_eq!(
        (&m["metrics"]["control_points"], &m["metrics"]["samples"]),
        (&72.into(), &168.into())
    );
}

#[test]
fn not_converging_is_code_3_if_asked_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("a.ron").display().to_string();
    let args = ["weingarten", "fixtures/saddle.ron", "-o", &out, "--iterations", "1"];
    let mut args = args.to_vec();
    args.push("--require-converged");
    assert_eq!(umbilic(&args).status.code(), Some(3));
    assert!(Path::new(&out).exists());
}

#[test]
fn the_demo_writes_its_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let made = folder.path().join("made");
    let result = umbilic(&["demo", &made.display().to_string()]);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    for name in ["surface.step", "surface.glb", "metrics.json"] {
        assert!(made.join(name).exists(), "{name}");
    }
    let m = metrics(&made.join("metrics.json"));
    assert!(m["metrics"]["diagram_area"].as_f64().expect("a number") < 0.003);
    let text = String::from_utf8_lossy(&result.stdout).into_owned();
    assert!(text.contains("curvature diagram"), "{text}");
}

#[test]
fn bad_flags_are_refused() {
    let roof = "fixtures/roof.ron";
    refused(&[roof, "--levels", "10x"], &["10x", "UxV"]);
    refused(&[roof, "--levels", "3x9"], &["roof.ron", "level 3x9", "at least 5"]);
    refused(&[roof, "--samples", "1x9"], &["samples in u", "at least 2"]);
    refused(&[roof, "--relation", "square"], &["square", "minimal"]);
    refused(&[roof, "--relation", "gauss"], &["gauss"]);
    refused(&[roof, "--closeness=-1"], &["closeness is -1", "zero or more"]);
    refused(&[roof, "--move", "99,0,0,0,1"], &["(99, 0)", "14 x 14"]);
    refused(&[roof, "--move", "1,2,3"], &["i,j,dx,dy,dz"]);
    refused(&[roof, "--formulation", "lifted", "--relation", "minimal"], &["reduced"]);
    refused(&[roof, "--pieces", "2x2"], &["--pieces"]);
    refused(&[roof, "--relation", "curve=no-such-file.ron"], &["no-such-file.ron"]);
    refused(&[roof, "--config", "no-such-file.ron"], &["no-such-file.ron"]);
    refused(&[roof, "--resume", "no-such-file.json"], &["no-such-file.json"]);
    refused(&["no-such-file.ron"], &["no-such-file.ron"]);
}

#[test]
fn bad_surfaces_are_refused_with_the_file_and_the_mend() {
    let folder = tempfile::tempdir().expect("a folder");
    let scene = |name: &str, u: &str, points: &str| {
        let path = folder.path().join(name);
        let text =
            format!("(surfaces: [(u: (degree: {u}), v: (degree: 1), control_points: [{points}])])");
        fs::write(&path, text).expect("written");
        path.display().to_string()
    };
    let two = "[(0, 0, 0), (0, 1, 0)], [(1, 0, 0), (1, 1, 1)]";
    let cases = [
        (scene("degree.ron", "3", two), vec!["degree.ron", "at least 4"]),
        (
            scene("nan.ron", "1", "[(0, 0, NaN), (0, 1, 0)], [(1, 0, 0), (1, 1, 1)]"),
            vec!["nan.ron"],
        ),
        (
            scene("point.ron", "1", "[(1, 1, 1), (1, 1, 1)], [(1, 1, 1), (1, 1, 1)]"),
            vec!["no extent"],
        ),
        (scene("pole.ron", "1", "[(0, 0, 0), (0, 0, 0)], [(1, 0, 0), (1, 1, 1)]"), vec!["pinched"]),
        (scene("line.ron", "1", "[(0, 0, 0), (1, 0, 0)], [(2, 0, 0), (3, 0, 0)]"), vec!["pinched"]),
    ];
    for (path, words) in &cases {
        refused(&[path], words);
    }
    let empty = folder.path().join("empty.step");
    let text = "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n";
    fs::write(&empty, text).expect("written");
    refused(&[&empty.display().to_string()], &["empty.step"]);
    let whole = fs::read_to_string(root().join("fixtures/saddle.step")).expect("a fixture");
    let cut = folder.path().join("cut.step");
    fs::write(&cut, &whole[..whole.len() / 2]).expect("written");
    refused(&[&cut.display().to_string()], &["cut.step"]);
}

#[test]
fn an_output_folder_that_is_missing_is_refused_before_any_work() {
    let result = umbilic(&["weingarten", "fixtures/roof.ron", "-o", "no/such/folder/a.step"]);
    let message = String::from_utf8_lossy(&result.stderr).into_owned();
    assert_eq!(result.status.code(), Some(2));
    assert!(message.contains("no/such/folder") && message.contains("does not exist"), "{message}");
    let result = umbilic(&["weingarten", "fixtures/roof.ron", "-o", "a.xyz"]);
    assert_eq!(result.status.code(), Some(2));
}

#[test]
fn systems_are_dumped_as_matrix_market_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let dir = folder.path().to_str().expect("a name");
    let out = format!("{dir}/a.ron");
    let args = ["weingarten", "fixtures/saddle.ron", "-o", &out, "--iterations", "1"];
    let levels = ["--levels", "7x7,8x8", "--dump-system", dir];
    let output = umbilic(&[&args[..], &levels[..]].concat());
    assert!(output.status.success(), "{}", message(&output));
    for (stage, columns) in [(0, 3 * 49), (1, 3 * 64)] {
        let jacobian = std::fs::read_to_string(format!("{dir}/stage-{stage}-jacobian.mtx"));
        let jacobian = jacobian.expect("a file");
        let mut lines = jacobian.lines().skip_while(|line| line.starts_with('%'));
        let size: Vec<usize> =
            lines.next().unwrap_or_default().split(' ').map(|n| n.parse().unwrap()).collect();
        assert_eq!((size[1], size[2]), (columns, lines.count()));
        let gradient = std::fs::read_to_string(format!("{dir}/stage-{stage}-gradient.mtx"));
        assert_eq!(gradient.expect("a file").lines().count(), columns + 2);
    }
}
