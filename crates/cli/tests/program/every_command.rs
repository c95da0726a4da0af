//! The command line: exit codes, messages, and that nothing is written when something is wrong.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

#[cfg(unix)]
use crate::common::{copy, examples};
use crate::common::{message, root, umbilic, write_into};
#[cfg(unix)]
use crate::snapshots::redacted;
use std::fs;
use std::path::Path;
use std::process::{Command, Output};

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

/// Runs a command that must fail as bad input with one line that begins so, and write nothing.
fn refused(args: &[&str], want: &str) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out.obj");
    let metrics = folder.path().join("metrics.json");
    let (out, metrics) = (out.to_str().unwrap(), metrics.to_str().unwrap());
    let mut all: Vec<&str> = args.iter().map(|a| if *a == "OUT" { out } else { a }).collect();
    all.extend(["--metrics", metrics]);
    let output = umbilic(&all);
    let message = message(&output);
    assert_eq!(code(&output), 2, "{args:?}: {message}");
    assert!(message.starts_with(want), "{message}, not {want}");
    assert_eq!(message.lines().count(), 1, "{message}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "{args:?} left a file");
}

#[test]
fn analyze_measures_a_sphere() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("m.json");
    let output = umbilic(&[
        "analyze",
        "fixtures/sphere-cap.ron",
        "--metrics",
        file.to_str().unwrap(),
        "--threads",
        "1",
    ]);
    assert_eq!(code(&output), 0, "{}", message(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("mean curvature      from -1.000000 to -1.000000"), "{text}");
    let json: serde_json::Value = serde_json::from_slice(&fs::read(file).unwrap()).unwrap();
    assert_eq!(json["schema"], 1);
    assert_eq!(
        (json["command"].as_str(), json["status"].as_str()),
        (Some("analyze"), Some("converged"))
    );
    assert_eq!((json["threads"].as_u64(), json["outputs"].as_array().unwrap().len()), (Some(1), 0));
    assert_eq!(json["input"], "fixtures/sphere-cap.ron");
    assert_eq!(json["metrics"]["kind"], "rational_bspline_surface");
    let k = json["metrics"]["gaussian_curvature_mean_abs"].as_f64().unwrap();
    assert!((k - 1.0).abs() < 1e-9, "{k}");
}

#[cfg(unix)]
#[test]
fn every_help_has_an_example_that_works_as_printed() {
    let folder = tempfile::tempdir().unwrap();
    copy(&root().join("fixtures"), &folder.path().join("fixtures"));
    let programs = Path::new(env!("CARGO_BIN_EXE_umbilic")).parent().unwrap();
    let path = format!("{}:{}", programs.display(), std::env::var("PATH").unwrap());
    let mut said = String::new();
    for command in cli::command().get_subcommands() {
        let name = command.get_name();
        let help = String::from_utf8(umbilic(&[name, "--help"]).stdout).unwrap();
        let lines = examples(&help);
        assert!(!lines.is_empty(), "{name} has no example: {help}");
        // The demo has a test of its own.
        for line in lines.iter().filter(|_| name != "demo") {
            let mut shell = Command::new("sh");
            shell.args(["-c", line]).current_dir(folder.path()).env("PATH", &path);
            let output = shell.output().unwrap();
            assert_eq!(code(&output), 0, "{line}: {}", message(&output));
            assert_eq!(message(&output), "", "{line}");
            let summary = redacted(std::str::from_utf8(&output.stdout).unwrap());
            said += &format!("$ {line}\n{summary}\n");
        }
    }
    insta::assert_snapshot!("summaries", said);
}

#[test]
fn usage_errors_exit_with_2() {
    for args in [
        &["no-such-command"][..],
        &["analyze"],
        &["analyze", "fixtures/roof.ron", "--no-such-flag"],
        &["analyze", "fixtures/roof.ron", "--threads", "0"],
        &["fit", "fixtures/grid.obj"],
        &["fit", "fixtures/grid.obj", "-o", "a.step", "--ctrl", "5"],
        &[],
    ] {
        let output = umbilic(args);
        assert_eq!(code(&output), 2, "{args:?}");
        assert!(!message(&output).is_empty());
    }
    for args in [&["--help"][..], &["--version"], &["help", "fit"]] {
        assert_eq!(code(&umbilic(args)), 0, "{args:?}");
    }
}

#[test]
fn bad_input_is_one_sentence_with_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| write_into(&folder, name, text);
    let step = fs::read_to_string(root().join("fixtures/saddle.step")).unwrap();
    let truncated = write("cut.step", &step[..1500]);
    let no_surface = write("none.step", "ISO-10303-21;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n");
    let option = write("options.ron", "(ctrl: \"9x9\", degre: 3)");
    let knots = write(
        "knots.ron",
        "(surfaces: [(u: (degree: 1, knots: [0, 1, 0, 1]), v: (degree: 1),\n\
         control_points: [[(0,0,0),(0,1,0)],[(1,0,0),(1,1,1)]])])",
    );
    let hole = write("hole.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    let at = |path: &str, rest: &str| format!("umbilic: {path}: {rest}");
    refused(&["convert", "no/such.obj", "OUT"], &at("no/such.obj", "cannot be read (No such file"));
    refused(&["convert", "fixtures", "OUT"], &at("fixtures", "is not a regular file; name a file"));
    refused(&["convert", &truncated, "OUT"], &at(&truncated, "line "));
    refused(&["analyze", &no_surface], &at(&no_surface, "the file has no surface; export"));
    refused(&["analyze", &knots], &at(&knots, "surface 1: knot 1 is 1 and the next 0"));
    refused(
        &["convert", "fixtures/roof.ron", "no/such/folder/a.step"],
        &at("no/such/folder/a.step", "the folder no/such/folder does not exist; create it first"),
    );
    refused(
        &["convert", "fixtures/roof.ron", "/dev/null/a.step"],
        &at("/dev/null/a.step", "the folder /dev/null does not exist"),
    );
    refused(
        &["convert", "fixtures/roof.ron", "a.xyz"],
        &at("a.xyz", "no writer for the extension `xyz`"),
    );
    refused(&["convert", &hole, "a.step"], &at("a.step", "STEP cannot hold meshes"));
    refused(
        &["fit", &hole, "-o", "OUT"],
        &at(&hole, "face 0 has 3 corners; a grid has quads only"),
    );
    refused(
        &["fit", "fixtures/grid.obj", "-o", "OUT", "--config", &option],
        &at(&option, "line 1: column 15: Unexpected field named `degre`"),
    );
    refused(
        &["fit", "fixtures/grid.obj", "-o", "OUT", "--degree", "16"],
        "umbilic: --degree: degree 16 is not between 1 and 15",
    );
    refused(
        &["fit", "fixtures/grid.obj", "-o", "OUT", "--ctrl", "900x9"],
        &at("fixtures/grid.obj", "21 parameters in u do not determine 900 control points"),
    );
    refused(&["fit", "fixtures/grid.obj", "-o", "OUT", "-o", "OUT"], "umbilic: ");
}

#[test]
fn an_existing_file_survives_a_failure_and_flags_override_the_config() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let (out, metrics, config) = (path("out.step"), path("m.json"), path("c.ron"));
    fs::write(&out, "before").unwrap();
    let fit = ["fit", "fixtures/grid.obj", "-o", &out];
    let failing = [&fit[..], &["-o", "no/such/b.step"]].concat();
    assert_eq!(code(&umbilic(&failing)), 2);
    assert_eq!(fs::read_to_string(&out).unwrap(), "before");
    fs::write(&config, "(ctrl: \"9x8\", degree: 3)").unwrap();
    let all =
        [&fit[..], &["--config", &config, "--ctrl", "10x9", "--metrics", &metrics, "-q"]].concat();
    let output = umbilic(&all);
    assert_eq!(code(&output), 0, "{}", message(&output));
    assert!(output.stdout.is_empty(), "-q prints nothing");
    let json: serde_json::Value = serde_json::from_slice(&fs::read(&metrics).unwrap()).unwrap();
    let metrics = &json["metrics"];
    let counts = (metrics["control_points_u"].as_u64(), metrics["control_points_v"].as_u64());
    assert_eq!((counts, metrics["degree"].as_u64()), ((Some(10), Some(9)), Some(3)));
    assert_eq!(json["outputs"][0], out);
    assert!(fs::read_to_string(&out).unwrap().starts_with("ISO-10303-21;"));
}

#[test]
fn conversions_chain_without_loss() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let steps = [
        "fixtures/tube.ron",
        &path("a.step"),
        &path("b.json"),
        &path("c.compas.json"),
        &path("d.ron"),
    ];
    for pair in steps.windows(2) {
        let output = umbilic(&["convert", pair[0], pair[1]]);
        // JSON holds no unit, which is said.
        let without_unit = |line: &&str| !line.ends_with("its numbers are in m");
        let said = message(&output);
        let other: Vec<&str> = said.lines().filter(without_unit).collect();
        assert_eq!((code(&output), other), (0, vec![]), "{pair:?}");
    }
    let surfaces = |file: &str| {
        let text = fs::read_to_string(root().join(file)).unwrap();
        text.split_once("surfaces").unwrap().1.to_owned()
    };
    assert_eq!(surfaces(&path("d.ron")), surfaces("fixtures/tube.ron"));
}
