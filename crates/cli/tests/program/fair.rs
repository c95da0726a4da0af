//! `umbilic fair` from the outside: files, metrics, exit codes, messages.

use crate::common;
use crate::common::umbilic;
use std::fs;
use std::path::{Path, PathBuf};

const THETA: &str = "fixtures/quads/theta.obj";

/// A refusal: exit code 2, a message with these words, nothing written.
fn refused(args: &[&str], words: &[&str]) {
    common::refused(&[&["fair"], args].concat(), "out.obj", words);
}

fn written(folder: &Path, name: &str, content: &str) -> String {
    let path: PathBuf = folder.join(name);
    fs::write(&path, content).expect("a file");
    path.display().to_string()
}

#[test]
fn a_mesh_is_faired_into_every_format_with_metrics() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (obj, step, glb, json) = (path("a.obj"), path("a.step"), path("a.glb"), path("a.json"));
    let html = path("a.html");
    let result = umbilic(&[
        "fair",
        THETA,
        "-o",
        &obj,
        "-o",
        &step,
        "-o",
        &glb,
        "--levels",
        "1",
        "--iterations",
        "3",
        "--metrics",
        &json,
        "--report",
        &html,
    ]);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    for file in [&obj, &step, &glb, &html] {
        assert!(fs::metadata(file).expect("a file").len() > 1000, "{file}");
    }
    let text = fs::read_to_string(&json).expect("a metrics file");
    let m: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((&m["schema"], &m["command"]), (&1.into(), &"fair".into()));
    assert_eq!((&m["status"], &m["iterations"]), (&"iteration_limit".into(), &6.into()));
    let number = |key: &str| m["metrics"][key].as_f64().expect(key);
    assert!(number("energy_final") < number("energy_initial"));
    assert!(number("gauss_bonnet_residual") < 1e-3);
    let energies = m["metrics"]["energies"].as_object().expect("energies");
    assert!(energies["mehlum_tarrou"].is_f64() && energies["bending"].is_f64(), "{text}");
}

#[test]
fn bad_expressions_are_refused_with_their_position() {
    refused(&[THETA, "--energy", "bending +"], &["position"]);
    refused(&[THETA, "--energy", "bending + bendng"], &["position 10", "bendng"]);
    refused(&[THETA, "--energy", "0*bending"], &["energy"]);
    refused(&[THETA, "--energy", "bending*(2"], &["position 8", "expected a number"]);
    refused(&[THETA, "--energy", "area"], &["area", "size"]);
    refused(&[THETA, "--energy", "mean_curvature"], &["mean_curvature", "size"]);
    let torus = "fixtures/quads/torus-thin.obj";
    refused(&[THETA, "--family", torus], &["mesh 1 of the family", "other faces"]);
    refused(&[THETA, "--family", THETA, "--clamp-boundary"], &["--family", "--clamp-boundary"]);
}

#[test]
fn bad_meshes_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    let obj = |name: &str, text: &str| written(folder.path(), name, text);
    let triangles =
        obj("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
    refused(&[&triangles], &["triangles"]);
    let fan = "v 0 0 0\nv 0 0 1\nv 1 0 0\nv 1 0 1\nv 0 1 0\nv 0 1 1\nv -1 0 0\nv -1 0 1\n";
    let fan = obj("fan.obj", &format!("{fan}f 1 2 4 3\nf 2 1 5 6\nf 1 2 8 7\n"));
    refused(&[&fan], &["edge"]);
    // A Möbius strip, of which no face can be turned over.
    let strip = "v 1 0 0\nv 1 0 1\nv 0 1 0\nv 0 1 1\nv -1 0 0\nv -1 0 1\n";
    let strip = obj("strip.obj", &format!("{strip}f 1 2 4 3\nf 3 4 6 5\nf 5 6 1 2\n"));
    refused(&[&strip], &["faces", "flip one of them"]);
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    refused(
        &[&obj("loose.obj", &format!("{square}v 5 5 5\nf 1 2 3 4\n"))],
        &["vertex 4 belongs to no face", "remove it"],
    );
    let second = "v 5 0 0\nv 6 0 0\nv 6 1 0\nv 5 1 0\n";
    refused(
        &[&obj("two.obj", &format!("{square}{second}f 1 2 3 4\nf 5 6 7 8\n"))],
        &["2 separate parts"],
    );
    let all = written(folder.path(), "all.ron", "(vertices: [0, 1, 2, 3])");
    let one = obj("one.obj", &format!("{square}f 1 2 3 4\n"));
    refused(&[&one, "--fix", &all], &["all 4 vertices are fixed", "free some"]);
    let points = obj("p.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\n");
    refused(&[&points], &["no mesh"]);
    let flat = "v 0 0 0\nv 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3 4\n";
    refused(&[&obj("point.obj", flat)], &["all vertices coincide", "no extent"]);
    refused(&["no-such-file.obj"], &["no-such-file.obj"]);
}

#[test]
fn bad_options_are_refused() {
    let folder = tempfile::tempdir().expect("a folder");
    refused(&[THETA, "--levels", "14"], &["levels"]);
    let beyond = written(folder.path(), "a.ron", "(vertices: [99999])");
    refused(&[THETA, "--fix", &beyond], &["99999"]);
    let unknown = written(folder.path(), "b.ron", "(vertexes: [1])");
    refused(&[THETA, "--fix", &unknown], &["vertexes"]);
    refused(&[THETA, "--symmetry", "no-such-file.ron"], &["no-such-file.ron"]);
    refused(&[THETA, "--method", "magic"], &["magic"]);
}

#[test]
fn a_flat_sheet_is_fair_already() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut text = String::new();
    for k in 0..25 {
        text += &format!("v {} {} 0\n", k % 5, k / 5);
    }
    for k in (0..19).filter(|k| k % 5 != 4) {
        text += &format!("f {} {} {} {}\n", k + 1, k + 2, k + 7, k + 6);
    }
    let sheet = written(folder.path(), "sheet.obj", &text);
    let (out, json) =
        (folder.path().join("out.obj"), folder.path().join("m.json").display().to_string());
    let out = out.display().to_string();
    let result = umbilic(&["fair", &sheet, "-o", &out, "--levels", "0", "--metrics", &json]);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    let text = fs::read_to_string(&json).expect("a metrics file");
    let m: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!((&m["status"], &m["iterations"]), (&"converged".into(), &0.into()));
    assert_eq!(m["metrics"]["quadrature_gap"].as_f64(), Some(0.0));
}

#[test]
fn quad_files_of_any_format_are_analysed_as_subdivision_surfaces() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let ply = path("clifford.ply");
    let result = umbilic(&["convert", "fixtures/quads/clifford.obj", &ply]);
    assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
    let obj = fs::read_to_string(
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/quads/clifford.obj"),
    )
    .expect("a fixture");
    let mut off = String::from("OFF\n192 192 0\n");
    for line in obj.lines() {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => off += &format!("{}\n", words.collect::<Vec<_>>().join(" ")),
            Some("f") => {
                let corners = words.map(|w| w.parse::<usize>().expect("an index") - 1);
                let corners: Vec<String> = corners.map(|c| c.to_string()).collect();
                off += &format!("4 {}\n", corners.join(" "));
            }
            _ => {}
        }
    }
    let off = written(folder.path(), "clifford.off", &off);
    for file in ["fixtures/quads/clifford.obj", &ply, &off] {
        let json = path("m.json");
        let result = umbilic(&["analyze", file, "--discrete-bending", "--metrics", &json]);
        assert!(result.status.success(), "{}", String::from_utf8_lossy(&result.stderr));
        let text = fs::read_to_string(&json).expect("a metrics file");
        let m: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let metrics = &m["metrics"];
        assert_eq!(metrics["kind"], "subdivision_surface", "{file}");
        let bending = metrics["energies"]["bending"].as_f64().expect("an energy");
        assert!((bending - 78.957).abs() < 0.1, "{file}: {bending}");
        let discrete = metrics["discrete_bending"].as_f64().expect("an energy");
        assert!((discrete - 79.18).abs() < 0.1, "{file}: {discrete}");
        assert!(metrics["gauss_bonnet_residual"].as_f64().expect("a residual") < 2e-4);
        assert!(metrics["principal_curvature_mean_abs"].is_f64(), "{text}");
    }
    let result = umbilic(&["analyze", "fixtures/roof.ron", "--discrete-bending"]);
    assert_eq!(result.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&result.stderr).contains("needs a mesh"));
}

/// Runs `fair` and gives its metrics.
fn metrics(args: &[&str]) -> serde_json::Value {
    let folder = tempfile::tempdir().expect("a folder");
    let (obj, json) = (folder.path().join("a.obj"), folder.path().join("a.json"));
    let (obj, json) = (obj.display().to_string(), json.display().to_string());
    let mut all = vec!["fair"];
    all.extend(args);
    all.extend(["-o", &obj, "--metrics", &json]);
    let result = umbilic(&all);
    assert!(result.status.success(), "{args:?}: {}", String::from_utf8_lossy(&result.stderr));
    serde_json::from_str(&fs::read_to_string(&json).expect("metrics")).expect("JSON")
}

fn energies(m: &serde_json::Value) -> [f64; 2] {
    ["energy_initial", "energy_final"].map(|key| m["metrics"][key].as_f64().expect(key))
}

#[test]
fn every_method_blend_and_symmetry_lowers_the_energy() {
    let folder = tempfile::tempdir().expect("a folder");
    let half_turn = written(
        folder.path(),
        "s.ron",
        "(matrices: [((-1, 0, 0), (0, -1, 0), (0, 0, 1)), ((1, 0, 0), (0, 1, 0), (0, 0, -1))])",
    );
    for choice in [
        ["--method", "lagged-gauss-newton"],
        ["--method", "gauss-newton"],
        ["--method", "sobolev"],
        ["--method", "lbfgs"],
        ["--blend", "smooth"],
        ["--blend", "flat"],
        ["--symmetry", "auto"],
        ["--symmetry", "none"],
        ["--symmetry", &half_turn],
    ] {
        let mut args = vec![THETA, "--levels", "0", "--iterations", "20"];
        args.extend(choice);
        let [before, after] = energies(&metrics(&args));
        assert!(after < 0.9 * before, "{choice:?}: {before} {after}");
    }
}

#[test]
fn constraints_and_creases_are_read_from_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let sphere = "fixtures/quads/ellipsoid.obj";
    let fix = written(
        folder.path(),
        "f.ron",
        "(vertices: [0], limit_points: [(3, None), (4, Some((0.0, 0.0, 1.0)))],
          tangent_planes: [(3, None)], weights: [(5, 10.0)])",
    );
    let common = ["--energy", "bending", "--levels", "0", "--iterations", "8"];
    let mut args = vec![sphere, "--fix", &fix];
    args.extend(common);
    assert!(energies(&metrics(&args)).iter().all(|e| e.is_finite()));
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(sphere));
    let text = text.expect("a fixture");
    let face: Vec<u32> = text
        .lines()
        .find_map(|line| line.strip_prefix("f "))
        .expect("a face")
        .split_whitespace()
        .map(|word| word.split('/').next().and_then(|n| n.parse().ok()).expect("a number"))
        .collect();
    let (a, b) = (face[0] - 1, face[1] - 1);
    let creases = format!("(edges: [(({a}, {b}), 1.5)], corners: [{a}])");
    let creases = written(folder.path(), "c.ron", &creases);
    let mut args = vec![sphere, "--creases", &creases];
    args.extend(common);
    let [before, after] = energies(&metrics(&args));
    assert!(after < before, "{before} {after}");
    let wrong = format!("(edges: [(({a}, {}), 1.5)])", face[2] - 1);
    let wrong = written(folder.path(), "w.ron", &wrong);
    refused(&[sphere, "--creases", &wrong], &["no edge"]);
    let clamped = ["--clamp-boundary", "--energy", "area + 0.1*bending", "--iterations", "8"];
    let mut args = vec!["fixtures/quads/lamp-shade.obj", "--levels", "0"];
    args.extend(clamped);
    let [before, after] = energies(&metrics(&args));
    assert!(after < before, "{before} {after}");
}

#[test]
fn step_files_have_a_face_for_every_patch() {
    let folder = tempfile::tempdir().expect("a folder");
    let step = folder.path().join("a.step");
    let m =
        metrics(&[THETA, "--levels", "0", "--iterations", "1", "-o", &step.display().to_string()]);
    let text = fs::read_to_string(&step).expect("a STEP file");
    let faces = text.matches("ADVANCED_FACE").count() as u64;
    assert_eq!(m["metrics"]["patches"].as_u64(), Some(faces));
    let fitted = m["metrics"]["fitted_patches"].as_u64().expect("a count");
    assert!(fitted > 0 && fitted <= faces, "{fitted} of {faces}");
    assert!(m["metrics"]["fitted_deviation_max"].as_f64().expect("a distance") < 1e-3);
}

#[test]
fn converged_results_have_nothing_left_to_gain() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (first, again, json) = (path("first.obj"), path("again.obj"), path("m.json"));
    let run = |input: &str, out: &str, method: &str| {
        let result = umbilic(&[
            "fair",
            input,
            "-o",
            out,
            "--levels",
            "0",
            "--method",
            method,
            "--metrics",
            &json,
        ]);
        assert!(result.status.success(), "{}", common::message(&result));
        let text = fs::read_to_string(&json).expect("a metrics file");
        let m: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let energy = m["metrics"]["energy_final"].as_f64().expect("an energy");
        (m["status"] == "converged", energy)
    };
    let methods = ["lagged-gauss-newton", "gauss-newton", "sobolev", "lbfgs"];
    let mut converged = 0;
    for mesh in ["cube", "torus-thin", "ellipsoid", "vase"] {
        for method in methods {
            let (is_converged, before) = run(&format!("fixtures/quads/{mesh}.obj"), &first, method);
            if is_converged {
                converged += 1;
                for restart in methods {
                    let (_, after) = run(&first, &again, restart);
                    let gain = (before - after) / before;
                    assert!(gain <= 0.01, "{mesh}, {method}, then {restart}: {gain}");
                }
            }
        }
    }
    assert!(converged >= 8, "{converged} runs converged");
}

#[test]
fn tags_of_an_obj_file_are_creases() {
    let folder = tempfile::tempdir().expect("a folder");
    let cube = fs::read_to_string(common::root().join("fixtures/quads/cube.obj")).expect("a cube");
    let face: Vec<u32> = cube
        .lines()
        .find_map(|line| line.strip_prefix("f "))
        .expect("a face")
        .split_whitespace()
        .map(|word| word.split('/').next().and_then(|v| v.parse::<u32>().ok()).expect("a number"))
        .map(|v| v - 1)
        .collect();
    let (a, b) = (face[0], face[1]);
    let tagged =
        written(folder.path(), "tagged.obj", &format!("{cube}t crease 2/1/0 {a} {b} 10\n"));
    let list = written(folder.path(), "list.ron", &format!("(edges: [(({a}, {b}), inf)])"));
    let run = |input: &str, more: &[&str], name: &str| {
        let out = folder.path().join(name).display().to_string();
        let start = ["fair", input, "-o", &out, "--levels", "1", "--iterations", "2"];
        let result = umbilic(&[&start, more].concat());
        assert!(result.status.success(), "{}", common::message(&result));
        fs::read(out).expect("written")
    };
    let smooth = run("fixtures/quads/cube.obj", &[], "a.obj");
    let by_list = run("fixtures/quads/cube.obj", &["--creases", &list], "b.obj");
    let by_tag = run(&tagged, &[], "c.obj");
    assert!(by_tag == by_list && by_tag != smooth);
}
