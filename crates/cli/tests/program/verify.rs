//! `verify` finds what its runs claim in their files, and a control point that has moved by a
//! millionth of the size.

use crate::common::{message, root, umbilic, write_into};
use geom_core::DVec3;
use std::fs;
use std::path::Path;

/// What follows `start` is three numbers in brackets or behind blanks; adds `by` to the last.
fn moved(text: &str, start: &str, nth: usize, by: f64) -> String {
    let (at, _) = text.match_indices(start).nth(nth).expect("as many points");
    let from = at + start.len();
    let is_number = |c: char| c.is_ascii_digit() || "+-.eE".contains(c);
    let mut place = from;
    for k in 0..3 {
        let begin = place + text[place..].find(is_number).expect("a number");
        let end = begin + text[begin..].find(|c| !is_number(c)).expect("its end");
        if k == 2 {
            let value: f64 = text[begin..end].parse().expect("a number");
            return format!("{}{:?}{}", &text[..begin], value + by, &text[end..]);
        }
        place = end;
    }
    unreachable!("three numbers were seen")
}

/// The same of a control point of the first surface of a STEP file.
fn moved_in_step(text: &str, nth: usize, by: f64) -> String {
    let surface = text.find("B_SPLINE_SURFACE").expect("a surface");
    let from = surface + text[surface..].find("((#").expect("a list");
    let list = &text[from..from + text[from..].find("))").expect("its end")];
    let id = list.split('#').nth(nth + 1).expect("as many points");
    let id: String = id.chars().take_while(char::is_ascii_digit).collect();
    moved(text, &format!("\n#{id}=CARTESIAN_POINT('',("), 0, by)
}

struct Run {
    folder: tempfile::TempDir,
}

impl Run {
    /// Runs a command that writes `file` and its metrics.
    fn of(args: &[&str], file: &str) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let out = folder.path().join(file).display().to_string();
        let metrics = folder.path().join("metrics.json").display().to_string();
        let output: &[&str] = match args[0] {
            "convert" => &[&out],
            "analyze" => &[],
            _ => &["-o", &out],
        };
        let result = umbilic(&[args, output, &["-q", "--metrics", &metrics]].concat());
        assert!(result.status.success(), "{args:?}: {}", message(&result));
        Self { folder }
    }

    fn path(&self, name: &str) -> String {
        self.folder.path().join(name).display().to_string()
    }

    /// The exit code and what was printed.
    fn verified(&self, more: &[&str]) -> (i32, String) {
        let metrics = self.path("metrics.json");
        let result = umbilic(&[&["verify", &metrics], more].concat());
        let text = String::from_utf8_lossy(&result.stdout).into_owned() + &message(&result);
        (result.status.code().expect("it ends"), text)
    }

    /// Unchanged it passes with at least so many claims checked, changed it does not.
    fn check(&self, file: &str, least: usize, change: impl Fn(&str) -> String) {
        let (code, text) = self.verified(&[]);
        assert_eq!(code, 0, "{text}");
        let last = text.lines().rfind(|l| l.contains("claims checked")).expect("a last line");
        let count: usize = last.split(' ').next().and_then(|n| n.parse().ok()).expect("a count");
        assert!(count >= least, "{text}");
        let path = self.path(file);
        let written = fs::read_to_string(&path).expect("text");
        fs::write(&path, change(&written)).expect("written");
        let (code, text) = self.verified(&[]);
        assert_eq!(code, 1, "{text}");
        assert!(text.contains("DIFFERS"), "{text}");
    }
}

/// A millionth of the size of a model of about this size.
const ROOF: f64 = 40e-6;

#[test]
fn weingarten() {
    let args = ["weingarten", "fixtures/roof.ron", "--iterations", "2", "--levels", "10x8"];
    for relation in ["free", "minimal", "linear", "ratio=-1", "cmc"] {
        let run = Run::of(&[&args[..], &["--relation", relation]].concat(), "a.step");
        run.check("a.step", 11, |text| moved_in_step(text, 30, ROOF));
    }
}

#[test]
fn far_from_the_origin_and_in_rhino() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut model = exchange::read_model(&root().join("fixtures/roof.ron")).expect("a fixture");
    let far = DVec3::new(5e5, -2.5e5, 1e4);
    model.surfaces.iter_mut().for_each(|s| s.surface = s.surface.translated(far));
    let moved_roof = write_into(&folder, "far.ron", &exchange::write_scene(&model).expect("text"));
    for (input, file) in [(moved_roof.as_str(), "a.step"), ("fixtures/roof.ron", "a.3dm")] {
        let args = ["weingarten", input, "--iterations", "2", "--levels", "10x8"];
        let (code, text) = Run::of(&args, file).verified(&[]);
        assert_eq!(code, 0, "{text}");
        assert!(text.contains("15 claims checked, 0 differ"), "{text}");
    }
    let args = ["weingarten", &moved_roof, "--iterations", "2", "--levels", "10x8"];
    Run::of(&args, "a.step").check("a.step", 15, |text| moved_in_step(text, 30, ROOF));
}

#[test]
fn remesh() {
    let args = ["remesh", "fixtures/triangles/bumped-ring.obj", "--faces", "200"];
    Run::of(&args, "a.obj").check("a.obj", 8, |text| moved(text, "\nv ", 20, 4e-6));
}

#[test]
fn what_was_chosen_of_a_file_is_what_claims_are_about() {
    let bracket = "fixtures/step/bracket.step";
    let (code, text) = Run::of(&["analyze", bracket, "--surface", "2"], "").verified(&[]);
    assert_eq!(code, 0, "{text}");
    // Of a trimmed surface a part is measured, which is not checked.
    let trimmed = "fixtures/step/bicubic-hole.step";
    let run = Run::of(&["weingarten", trimmed, "--iterations", "1", "--levels", "6x6"], "a.step");
    let (code, text) = run.verified(&[]);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("0 claims checked"), "{text}");
}

#[test]
fn what_was_standard_input_is_left_out_or_named() {
    let run = Run::of(&["fit", "fixtures/grid.obj"], "a.step");
    let text = fs::read_to_string(run.path("metrics.json")).expect("written");
    let piped = text.replace("\"fixtures/grid.obj\"", "\"-\"");
    assert_ne!(text, piped);
    fs::write(run.path("metrics.json"), piped).expect("written");
    let (code, text) = run.verified(&[]);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("standard input; give a file of it as --input"), "{text}");
    let (_, with_input) = run.verified(&["--input", "fixtures/grid.obj"]);
    assert!(with_input.contains("10 claims checked, 0 differ"), "{with_input}");
}

#[test]
fn panel() {
    let args = ["panel", "fixtures/roof.ron", "--panels", "6x5", "--seam-steps", "1"];
    let types = ["--mold-types", "cubic"];
    let run = Run::of(&[&args[..], &types].concat(), "a.obj");
    run.check("a.obj", 8, |text| moved(text, "\nv ", 200, ROOF));
    for kind in ["cubic", "torus", "cylinder", "sphere", "paraboloid", "plane"] {
        let run = Run::of(&[&args[..], &["--mold-types", kind]].concat(), "a.ron");
        run.check("a.ron", 15, |text| moved(text, "origin: (", 7, ROOF));
    }
}

#[test]
fn hnet() {
    let args = ["hnet", "fixtures/nets/enneper.obj"];
    let size = 2e-6;
    let run = Run::of(&args, "a.ron");
    run.check("a.ron", 11, |text| moved(text, "vertices: [", 0, size));
    let run = Run::of(&args, "a.step");
    run.check("a.step", 11, |text| moved_in_step(text, 0, size));
}

#[test]
fn darboux() {
    let run = Run::of(&["darboux", "fixtures/nets/enneper.obj", "--c", "-0.6"], "a.obj");
    run.check("a.obj", 4, |text| moved(text, "\nv ", 100, 1e-6));
}

#[test]
fn asymptotic() {
    let run = Run::of(&["asymptotic", "fixtures/asymptotic/catenoid.ron"], "a.step");
    run.check("a.step", 10, |text| moved_in_step(text, 12, 2e-6));
    let net = ["asymptotic", "fixtures/asymptotic/hyperbolic-enneper.obj", "--from-net"];
    let run = Run::of(&net, "a.ron");
    run.check("a.ron", 10, |text| moved(text, "control_points: [", 5, 2e-6));
}

#[test]
fn fair() {
    let args = ["fair", "fixtures/quads/torus-thin.obj", "--levels", "0", "--iterations", "3"];
    let run = Run::of(&args, "a.obj");
    run.check("a.obj", 20, |text| moved(text, "v ", 11, 5e-6));
    let args = ["fair", "fixtures/quads/cube.obj", "--levels", "0", "--iterations", "2"];
    let run = Run::of(&args, "a.obj");
    run.check("a.obj", 6, |text| moved(text, "v ", 11, 2e-6));
    let run = Run::of(&args, "a.step");
    run.check("a.step", 14, |text| moved_in_step(text, 5, 2e-6));
}

#[test]
fn fit() {
    let run = Run::of(&["fit", "fixtures/grid.obj"], "a.step");
    run.check("a.step", 8, |text| moved_in_step(text, 20, 1e-6));
}

#[test]
fn convert() {
    let run = Run::of(&["convert", "fixtures/roof.ron"], "a.step");
    run.check("a.step", 5, |text| moved_in_step(text, 20, ROOF));
    let run = Run::of(&["convert", "fixtures/quads/cube.obj"], "a.obj");
    run.check("a.obj", 5, |text| moved(text, "v ", 20, 2e-6));
}

#[test]
fn analyze() {
    let run = Run::of(&["analyze", "fixtures/saddle.step"], "");
    let (code, text) = run.verified(&[]);
    assert_eq!(code, 0, "{text}");
    assert!(text.contains("16 claims checked, 0 differ"), "{text}");
    let saddle = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/saddle.step");
    let changed = moved_in_step(&fs::read_to_string(saddle).unwrap(), 20, 1e-6);
    let other = run.path("saddle.step");
    fs::write(&other, changed).unwrap();
    assert_eq!(run.verified(&[&other]).0, 1);
}

#[test]
fn a_file_that_is_not_there_and_metrics_that_are_none() {
    let run = Run::of(&["fit", "fixtures/grid.obj"], "a.step");
    fs::remove_file(run.path("a.step")).expect("removed");
    let (code, text) = run.verified(&[]);
    assert_eq!(code, 2, "{text}");
    assert!(text.contains("a.step: cannot be read"), "{text}");
    fs::write(run.path("metrics.json"), "{\"command\": 3}").expect("written");
    let (code, text) = run.verified(&[]);
    assert_eq!(code, 2, "{text}");
    assert!(
        text.contains("metrics.json: ") && text.contains("give a file that --metrics"),
        "{text}"
    );
}

#[test]
fn files_are_found_beside_their_metrics() {
    let run = Run::of(&["fit", "fixtures/grid.obj"], "a.step");
    let elsewhere = tempfile::tempdir().expect("a folder");
    for name in ["a.step", "metrics.json"] {
        fs::rename(run.path(name), elsewhere.path().join(name)).expect("moved");
    }
    let (code, text) = Run { folder: elsewhere }.verified(&[]);
    assert_eq!(code, 0, "{text}");
}
