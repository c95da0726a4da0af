//! Files are handled with care: none is overwritten that was read, folders are made, a refusal
//! names the file it speaks of.

use crate::common::{UMBILIC, message, root, umbilic, write_into};
use std::fs;
use std::path::Path;
use std::process::Command;

/// Runs the program and expects exit code 2 and a message that begins with `want`.
fn refused(args: &[&str], want: &str) {
    let result = umbilic(args);
    let said = message(&result);
    assert_eq!(result.status.code(), Some(2), "{args:?}: {said}");
    assert!(said.starts_with(&format!("umbilic: {want}")), "{args:?}\nsaid   {said}wanted {want}");
}

/// A command line with more arguments.
fn with<'a>(start: &[&'a str], more: &[&'a str]) -> Vec<&'a str> {
    [start, more].concat()
}

fn name(path: &Path) -> String {
    path.display().to_string()
}

#[test]
fn what_is_read_is_not_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let input = name(&folder.path().join("in.ron"));
    fs::copy(root().join("fixtures/survey.ron"), &input).expect("copied");
    let config = write_into(&folder, "options.ron", "(degree: 3)");
    let out = name(&folder.path().join("out.ron"));
    let before = fs::read(&input).expect("there");
    let read = |file: &str| format!("{file}: this run reads the file; name another output\n");
    refused(&["fit", &input, "-o", &out, "--metrics", &input], &read(&input));
    refused(&["fit", &input, "-o", &input], &read(&input));
    refused(&["convert", &input, &input], &read(&input));
    refused(&["fit", &input, "-o", &out, "--report", &input], &read(&input));
    refused(&["fit", &input, "-o", &config, "--config", &config], &read(&config));
    let twice = format!("{out}: two results would be written to this file");
    refused(&["fit", &input, "-o", &out, "--metrics", &out], &twice);
    assert_eq!(fs::read(&input).expect("there"), before);
    assert_eq!(fs::read_to_string(&config).expect("there"), "(degree: 3)");
    assert!(!Path::new(&out).exists());
}

#[cfg(unix)]
#[test]
fn links_do_not_hide_what_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let input = folder.path().join("in.ron");
    fs::copy(root().join("fixtures/survey.ron"), &input).expect("copied");
    let (soft, hard) = (folder.path().join("soft.ron"), folder.path().join("hard.ron"));
    std::os::unix::fs::symlink(&input, &soft).expect("linked");
    fs::hard_link(&input, &hard).expect("linked");
    for link in [&soft, &hard] {
        let want = format!("{}: is the file {} that this run reads", name(link), name(&input));
        refused(&["fit", &name(&input), "-o", &name(link)], &want);
    }
    // Two outputs through a link.
    let (out, link) = (folder.path().join("out.ron"), folder.path().join("link.ron"));
    fs::write(&out, "old").expect("written");
    std::os::unix::fs::symlink(&out, &link).expect("linked");
    let want = format!("{} and {}: two results would be written", name(&out), name(&link));
    refused(&["fit", &name(&input), "-o", &name(&out), "-o", &name(&link)], &want);
    assert_eq!(fs::read_to_string(&out).expect("there"), "old");
}

#[cfg(target_os = "linux")]
#[test]
fn what_comes_through_standard_input_is_not_overwritten() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = name(&folder.path().join("in.ron"));
    fs::copy(root().join("fixtures/roof.ron"), &file).expect("copied");
    let before = fs::read(&file).expect("there");
    let script = "exec \"$0\" convert - \"$1\" < \"$1\"";
    let mut shell = Command::new("sh");
    let result = shell.args(["-c", script, UMBILIC, &file]).output().expect("a shell");
    let said = message(&result);
    assert_eq!(result.status.code(), Some(2), "{said}");
    let want = format!("umbilic: {file}: is the file /dev/stdin that this run reads");
    assert!(said.starts_with(&want), "{said}");
    assert_eq!(fs::read(&file).expect("there"), before);
}

#[cfg(unix)]
#[test]
fn a_rhino_file_is_replaced_with_care() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().expect("a folder");
    let file = name(&folder.path().join("a.3dm"));
    let convert = ["convert", "fixtures/roof.ron", &file, "-q"];
    let mode = |bits: u32| fs::set_permissions(&file, fs::Permissions::from_mode(bits));
    assert!(umbilic(&convert).status.success());
    mode(0o640).expect("ours");
    assert!(umbilic(&convert).status.success());
    let now = fs::metadata(&file).expect("there").permissions().mode();
    assert_eq!(now & 0o777, 0o640);
    mode(0o440).expect("ours");
    refused(&convert, &format!("{file}: is write-protected"));
    mode(0o640).expect("ours");
    refused(&["convert", &file, &file], &format!("{file}: this run reads the file"));
}

#[test]
fn folders_of_options_are_made() {
    let folder = tempfile::tempdir().expect("a folder");
    let figures = folder.path().join("new/deep");
    let result = umbilic(&["analyze", "fixtures/saddle.step", "-q", "--figures", &name(&figures)]);
    assert!(result.status.success(), "{}", message(&result));
    assert!(fs::read_dir(&figures).expect("made").count() > 0);
    let file = write_into(&folder, "file", "x");
    let want = format!("{file}/figures: {file} is no folder; name another");
    refused(&["analyze", "fixtures/saddle.step", "--figures", &format!("{file}/figures")], &want);
}

#[test]
fn metrics_go_to_standard_output() {
    let result = umbilic(&["analyze", "fixtures/saddle.step", "--metrics", "-"]);
    assert!(result.status.success(), "{}", message(&result));
    let metrics: serde_json::Value = serde_json::from_slice(&result.stdout).expect("JSON alone");
    assert_eq!(metrics["command"], "analyze");
    // What people read stands beside it.
    assert!(message(&result).contains("mean curvature"));
    refused(
        &["fit", "fixtures/grid.obj", "-o", "-"],
        "--output -: only --metrics and --report can be written to standard output",
    );
    assert!(!root().join("-").exists());
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_behind_standard_output_is_an_error() {
    for args in [&["analyze", "fixtures/saddle.step"][..], &["--help"], &["fit", "--help"]] {
        let full = fs::OpenOptions::new().write(true).open("/dev/full").expect("a device");
        let mut command = Command::new(UMBILIC);
        let result = command.current_dir(root()).args(args).stdout(full).output().expect("runs");
        let said = message(&result);
        assert_eq!(result.status.code(), Some(1), "{args:?}: {said}");
        assert!(said.starts_with("umbilic: standard output cannot be written ("), "{said}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_limit_on_the_size_of_files_leaves_no_temporary() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = name(&folder.path().join("roof.stl"));
    let script = "ulimit -f 8; exec \"$0\" convert fixtures/roof.ron \"$1\"";
    let mut shell = Command::new("sh");
    shell.current_dir(root()).args(["-c", script, UMBILIC, &out]);
    let result = shell.output().expect("a shell");
    let said = message(&result);
    assert_eq!(result.status.code(), Some(2), "{said}");
    assert!(said.contains("cannot be written (File too large"), "{said}");
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 0);
}

#[test]
fn refusals_name_the_file_they_speak_of() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| write_into(&folder, name, text);
    let out = name(&folder.path().join("out.obj"));
    let step = name(&folder.path().join("out.step"));
    let glb = name(&folder.path().join("out.glb"));
    let number = "line 1: column";
    // Options: what the reader refuses, and what only the method can.
    let not_finite = write("nan.ron", "(fairness: NaN)");
    let negative = write("negative.ron", "(fairness: -1)");
    let weingarten = ["weingarten", "fixtures/eggbox-coarse.ron", "-o", &step];
    refused(&with(&weingarten, &["--config", &not_finite]), &format!("{not_finite}: {number}"));
    refused(
        &with(&weingarten, &["--config", &negative]),
        &format!("{negative}: `fairness` is -1; it must be"),
    );
    refused(&with(&weingarten, &["--fairness=-1"]), "--fairness is -1; it must be");
    refused(
        &with(&weingarten, &["--config", &negative, "--fairness=-2"]),
        "--fairness is -2; it must be",
    );
    let tolerance = write("tolerance.ron", "(tolerance: -1)");
    let fit = ["fit", "fixtures/grid.obj", "-o", &step, "--config", &tolerance];
    refused(&fit, &format!("{tolerance}: `tolerance` is -1"));
    // A curve of the diagram.
    let curve = write("curve.ron", "[(0, 1), (0.5, inf)]");
    let result = umbilic(&with(&weingarten, &[&format!("--relation=curve={curve}")]));
    assert_eq!(result.status.code(), Some(2));
    assert!(message(&result).contains(&format!("{curve}: {number}")), "{}", message(&result));
    // Fixed vertices, creases, symmetries.
    let fix = write("fix.ron", "(vertices: [4, 99999])");
    let weight = write("weight.ron", "(weights: [(3, -2)])");
    let creases = write("creases.ron", "(edges: [((0, 1), 1e400)])");
    let symmetry = write("symmetry.ron", "(matrices: [((1, 0, 0), (0, NaN, 0), (0, 0, 1))])");
    let fair = ["fair", "fixtures/quads/cube.obj", "-o", &out, "--levels", "0"];
    refused(&with(&fair, &["--fix", &fix]), &format!("{fix}: constraints name vertex 99999"));
    refused(
        &with(&fair, &["--fix", &weight]),
        &format!("{weight}: vertex 3 is pulled with weight -2"),
    );
    refused(&with(&fair, &["--creases", &creases]), &format!("{creases}: {number} 19: `1e400`"));
    refused(&with(&fair, &["--symmetry", &symmetry]), &format!("{symmetry}: {number}"));
    // Prices, of types that are not used too.
    let csv = name(&folder.path().join("out.csv"));
    let prices = write("prices.ron", "{plane: (mold: 1, panel: NaN)}");
    let below = write("below.ron", "{plane: (mold: 1, panel: 1), torus: (mold: -1, panel: 1)}");
    let panel =
        ["panel", "fixtures/roof.ron", "-o", &csv, "--panels", "3x3", "--mold-types", "plane"];
    refused(&with(&panel, &["--prices", &prices]), &format!("{prices}: {number}"));
    refused(&with(&panel, &["--prices", &below]), &format!("{below}: the price of torus is -1"));
    // A cage, and a net it cannot transform.
    let corner = "(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)";
    let flat = write("flat.ron", &format!("(images: [{corner}, {corner}])"));
    let wild = write("wild.ron", &format!("(images: [{corner}, (0, inf, 0), {corner}])"));
    let darboux = ["darboux", "fixtures/nets/enneper.obj", "-o", &glb, "--cage"];
    refused(&with(&darboux, &[&flat]), &format!("{flat}: the cage has no transformation"));
    refused(&with(&darboux, &[&wild]), &format!("{wild}: {number}"));
}

#[test]
fn text_after_the_end_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let off = write_into(&folder, "a.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\nmore\n");
    let result = umbilic(&["analyze", &off, "-q"]);
    assert!(result.status.success());
    assert!(message(&result).contains("line 7: what follows the last face is left out"));
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
               property float z\nend_header\n0 0 0\n\n7 7\n";
    let ply = write_into(&folder, "a.ply", ply);
    let result = umbilic(&["analyze", &ply, "-q"]);
    assert!(message(&result).contains("line 10: what follows the last element is left out"));
    let twice = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nelement vertex 1\n";
    let twice = write_into(&folder, "b.ply", twice);
    refused(&["analyze", &twice], &format!("{twice}: line 5: declared before: `element vertex 1`"));
}
