//! The command `panel` from the outside: bad input, bounds that cannot be met, flat outlines.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use crate::common::{umbilic, write_into};
use std::fs;
use std::process::Output;

fn panel(surface: &str, args: &[&str]) -> Output {
    umbilic(&[&["panel", surface], args].concat())
}

/// Runs the command, which must refuse its input with one sentence and write nothing.
fn refused(args: &[&str], want: &str) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("panels.csv").display().to_string();
    let output = panel("fixtures/roof.ron", &[args, &["-o", &out]].concat());
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{args:?}: {message}");
    assert!(message.contains(want), "said {message}wanted {want}");
    // The parser of the command line adds a hint on further lines.
    let sentences = if message.starts_with("umbilic: ") { 1 } else { 3 };
    assert_eq!(message.lines().count(), sentences, "{message}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0, "{args:?} left a file");
}

#[test]
fn bad_input_is_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| write_into(&folder, name, text);
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let outside = write("outside.obj", "v 0 0 0\nv 3 0 0\nv 3 1 0\nv 0 1 0\nf 1 2 3 4\n");
    let crossed = write("crossed.obj", &format!("{square}f 1 3 2 4\n"));
    let overlap = write("overlap.obj", &format!("{square}f 1 2 3\nf 1 2 4\n"));
    let raised = write("raised.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0.5\nv 0 1 0\nf 1 2 3 4\n");
    let unknown = write("unknown.ron", "{ conic: (mold: 1, panel: 1) }");
    let missing = write("missing.ron", "{ plane: (mold: 1, panel: 1) }");
    let negative = write("negative.ron", "{ cubic: (mold: -1, panel: 1) }");
    let layout = |path: &str, want: &str| {
        refused(&["--layout", path], &format!("{path}: {want}"));
    };
    layout(
        &outside,
        "layout vertex 1 at (3, 0) is outside the unit square, which stands for the whole surface; scale the layout",
    );
    layout(&crossed, "layout face 0 is not a simple polygon of positive area");
    layout(&overlap, "layout faces 0 and 1 overlap; every place belongs to one panel only");
    layout(&raised, "layout vertex 2 has z = 0.5; the layout is a mesh in the plane z = 0");
    layout("no/such.obj", "cannot be read");
    refused(
        &["--panels", "3x3", "--molds", "10"],
        "10 molds for 9 panels; ask for at most one per panel, and at least one",
    );
    refused(&["--prices", &unknown], &format!("{unknown}: line 1"));
    refused(&["--prices", &missing], &format!("{missing}: the price list has no entry for cubic"));
    refused(&["--prices", &negative], &format!("{negative}: the price of cubic is -1"));
    refused(&["--mold-types", "plane,cubic"], "several mold types need bounds to choose by");
    refused(&["--mold-types", "conic"], "`conic` is none of plane, cylinder");
    refused(&["--max-kink-deg=-1"], "--max-kink-deg is -1; it must be positive");
    refused(&["--k", "2", "--molds", "5"], "exclude one another; keep one");
    refused(&["--clustering", "best"], "`best` is none of own, grid, cover");
    refused(&["--layout", "circles"], "`circles` is none of quad, staggered");
    refused(&["--sheet", "3"], "is not of the form WxH");
}

#[test]
fn a_file_without_a_surface_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("panels.csv").display().to_string();
    let output = panel("fixtures/grid.obj", &["-o", &out]);
    let message = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(message.contains("fixtures/grid.obj: there is no surface in this file"), "{message}");
}

#[test]
fn bounds_that_cannot_be_met_are_a_status() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (out, metrics) = (path("panels.csv"), path("metrics.json"));
    let args = ["--panels", "4x4", "--max-gap", "1e-12", "-o", &out, "--metrics", &metrics];
    let output = panel("fixtures/roof.ron", &args);
    assert_eq!(output.status.code(), Some(0));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("the bounds are not met: the worst seam or panel is"), "{said}");
    assert_eq!(fs::read_to_string(&out).unwrap().lines().count(), 17);
    let json: serde_json::Value = serde_json::from_slice(&fs::read(&metrics).unwrap()).unwrap();
    assert_eq!(json["status"], "infeasible");
    assert!(json["metrics"]["worst_excess"].as_f64().unwrap() > 1.0);
    let strict = panel("fixtures/roof.ron", &[&args[..], &["--require-converged"]].concat());
    assert_eq!(strict.status.code(), Some(3));
}

#[test]
fn flat_outlines_are_drawn_at_full_size() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (svg, dxf) = (path("flat.svg"), path("flat.dxf"));
    let args = ["--panels", "6x5", "--mold-types", "cylinder", "--molds", "4", "-q"];
    let outputs = ["-o", &svg, "-o", &dxf, "--sheet", "3x2"];
    let output = panel("fixtures/roof.ron", &[&args[..], &outputs].concat());
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    let drawing = fs::read_to_string(&svg).unwrap();
    let layer = |name: &str| {
        let start = drawing.find(&format!("<g id=\"{name}\"")).unwrap();
        let end = start + drawing[start..].find("</g>").unwrap();
        drawing[start..end].to_owned()
    };
    assert_eq!(layer("cut").matches("<polygon").count(), 30);
    assert_eq!(layer("bend").matches("<polyline").count(), 30);
    assert!(layer("label").contains(">P29 M") && layer("label").contains(">R "));
    assert!(layer("sheet").contains("<polygon"));
    // A roof of some metres in metres.
    assert!(drawing.contains("mm\" height="));
    let text = fs::read_to_string(&dxf).unwrap();
    assert_eq!(text.matches("\nPOLYLINE").count(), drawing.matches("<poly").count());

    let cubic = panel("fixtures/roof.ron", &["--panels", "4x4", "--molds", "4", "-o", &svg]);
    let message = String::from_utf8(cubic.stderr).unwrap();
    assert_eq!(cubic.status.code(), Some(2));
    assert!(message.contains("no panel can be unrolled; flat outlines need"), "{message}");
    assert_eq!(fs::read_to_string(&svg).unwrap(), drawing, "the old file stays");
}
