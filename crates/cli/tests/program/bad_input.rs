//! Bad input of the main job, kind by kind: one sentence with file, place and mend, exit code 2,
//! and no output file touched.

use crate::common::{root, umbilic};
use std::fs;

/// Runs the main job with these arguments; `want` is the sentence without the program's name.
fn refused(args: &[&str], want: &str) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name).display().to_string();
    let (new, old, metrics) = (path("new.step"), path("old.glb"), path("metrics.json"));
    fs::write(&old, "before").expect("written");
    let mut all = vec!["weingarten"];
    all.extend(args);
    all.extend(["-o", &new, "-o", &old, "--metrics", &metrics]);
    let result = umbilic(&all);
    let message = String::from_utf8_lossy(&result.stderr).into_owned();
    assert_eq!(result.status.code(), Some(2), "{args:?}: {message}");
    let (said, want) = (message.trim_end(), format!("umbilic: {want}"));
    let fits = match want.strip_suffix('…') {
        Some(begin) => said.starts_with(begin),
        None => said == want,
    };
    assert!(fits, "said   {said}\nwanted {want}");
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(result.stdout.is_empty());
    assert_eq!(fs::read_to_string(&old).expect("still there"), "before");
    assert_eq!(fs::read_dir(folder.path()).expect("a folder").count(), 1, "{args:?} left a file");
}

const ROWS: [&str; 3] = [
    "(0, 0, 0), (0, 1, 0), (0, 2, 0)",
    "(1, 0, 0), (1, 1, 1), (1, 2, 0)",
    "(2, 0, 0), (2, 1, 0), (2, 2, 0)",
];

/// A scene with one surface, quadratic in v.
fn scene(u: &str, rows: [&str; 3], more: &str) -> String {
    let points = rows.map(|row| format!("[{row}]")).join(", ");
    format!("(surfaces: [(u: (degree: {u}), v: (degree: 2), control_points: [{points}]{more})])\n")
}

#[test]
fn faulty_surfaces() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("surface.ron");
    let name = file.display().to_string();
    let [first, second, third] = ROWS;
    let one = "(1, 1, 1), (1, 1, 1), (1, 1, 1)";
    let origin = "(0, 0, 0), (0, 0, 0), (0, 0, 0)";
    let cases = [
        // Wrong counts.
        (
            scene("2", [first, "(1, 0, 0)", third], ""),
            "surface 1: row 2 of the control points has 1 entries and row 1 has 3; make all rows \
             equally long",
        ),
        (
            scene("2, knots: [0, 0, 0, 1, 1]", ROWS, ""),
            "surface 1: degree 2 needs 6 knots, found 5; add knots or lower the degree",
        ),
        (
            scene("2, knots: [0, 0, 0, 0.5, 1, 1, 1]", ROWS, ""),
            "surface 1 has 3 control points in u; its knots need 4; change the knots or the \
             control points",
        ),
        // NaN, infinity, a weight that is not positive.
        (
            scene("2", [first, "(1, 0, 0), (1, 1, NaN), (1, 2, 0)", third], ""),
            "line 1: column 117: `NaN` is not a finite number; write finite numbers",
        ),
        (
            scene("2", [first, "(1, 0, 0), (1, 1, 1e999), (1, 2, 0)", third], ""),
            "line 1: column 117: `1e999` is not a finite number; write finite numbers",
        ),
        (
            scene("2, knots: [0, 0, 0, NaN, 1, 1]", ROWS, ""),
            "line 1: column 46: `NaN` is not a finite number; write finite numbers",
        ),
        (
            scene("2", ROWS, ", weights: [[1, 1, 1], [1, -1, 1], [1, 1, 1]]"),
            "surface 1: weight 4 is -1; weights must be positive and finite",
        ),
        // Decreasing and over-repeated knots.
        (
            scene("2, knots: [0, 0, 1, 0, 1, 1]", ROWS, ""),
            "surface 1: knot 2 is 1 and the next 0; knots must be finite and sorted",
        ),
        (
            scene("1, knots: [0, 0, 0, 1, 1]", ROWS, ""),
            "surface 1: knot 0 is repeated 3 times, at most 2 are possible there for degree 1; \
             drop the surplus knots or split the spline",
        ),
        // A degree above the number of control points, that is fewer than (d + 1)² of them.
        (
            scene("3", ROWS, ""),
            "surface 1: degree 3 needs at least 4 control points, found 3; add control points or \
             lower the degree",
        ),
        // No area, and a pole.
        (
            scene("2", [one, one, one], ""),
            "all control points coincide, so the surface has no extent; check the coordinates",
        ),
        (
            scene(
                "2",
                [origin, "(1, 0, 0), (1, 0, 0), (1, 0, 0)", "(2, 0, 0), (2, 0, 0), (2, 0, 0)"],
                "",
            ),
            "the surface is pinched at u = 0, v = 0: its tangents vanish or are parallel there; \
             cut the pole off or spread the control points that coincide",
        ),
        (
            scene("2", [origin, second, third], ""),
            "the surface is pinched at u = 0, v = 0: its tangents vanish or are parallel there; \
             cut the pole off or spread the control points that coincide",
        ),
        // An unknown field, and text that is no scene at all.
        (scene("2", ROWS, ", colour: 3"), "line 1: column 169: Unexpected field named `colour`…"),
        (String::new(), "line 1: column 1: Expected opening `(`…"),
    ];
    for (text, want) in cases {
        fs::write(&file, &text).expect("written");
        refused(&[&name], &format!("{name}: {want}"));
    }
}

#[test]
fn faulty_step_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let whole = fs::read(root().join("fixtures/saddle.step")).expect("a fixture");
    let none = "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n";
    let no_step = "line 1: the file does not begin with ISO-10303-21; export the file again as \
                   STEP (ISO 10303-21)";
    let cases: [(&str, &[u8], &str); 4] = [
        (
            "cut.step",
            &whole[..2000],
            "line 35: the statement that begins here has no `;`; the file is truncated; copy or \
             export it again",
        ),
        (
            "none.step",
            none.as_bytes(),
            "the file has no surface; export the faces as B-spline (NURBS) surfaces",
        ),
        ("empty.step", b"", no_step),
        ("noise.step", &[0x80, 0, 0xff, 7, 13], no_step),
    ];
    for (name, bytes, want) in cases {
        let file = folder.path().join(name);
        fs::write(&file, bytes).expect("written");
        let name = file.display().to_string();
        refused(&[&name], &format!("{name}: {want}"));
    }
    let missing = folder.path().join("missing.step").display().to_string();
    let want = "cannot be read (No such file or directory (os error 2)); check the path and its \
                permissions";
    refused(&[&missing], &format!("{missing}: {want}"));
    let is_folder = folder.path().join("folder.step");
    fs::create_dir(&is_folder).expect("made");
    let name = is_folder.display().to_string();
    refused(&[&name], &format!("{name}: is not a regular file; name a file"));
}

#[test]
fn faulty_options() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("options.ron");
    let name = file.display().to_string();
    let cases = [
        ("(iteration: 5)", "line 1: column 2: Unexpected field named `iteration`…"),
        ("(iterations: -5)", "line 1: column 15: Integer is out of bounds…"),
        ("(border: loose)", "line 1: column 10: Unexpected variant named `loose`…"),
        ("(iterations: 5", "line 1: column 14: Expected comma…"),
    ];
    for (text, want) in cases {
        fs::write(&file, text).expect("written");
        refused(&["fixtures/roof.ron", "--config", &name], &format!("{name}: {want}"));
    }
}

#[test]
fn outputs_that_cannot_be_written() {
    let cases = [
        ("no/such/a.step", "the folder no/such does not exist; create it first"),
        ("/dev/null/a.step", "the folder /dev/null does not exist; create it first"),
        ("/proc/a.step", "cannot be written (…"),
        ("a.xyz", "no writer for the extension `xyz`; use one of …"),
    ];
    for (path, want) in cases {
        if path.starts_with("/proc") && !cfg!(target_os = "linux") {
            continue;
        }
        refused(&["fixtures/roof.ron", "-o", path], &format!("{path}: {want}"));
    }
    let folder = tempfile::tempdir().expect("a folder");
    let is_folder = folder.path().join("a.step");
    fs::create_dir(&is_folder).expect("made");
    let name = is_folder.display().to_string();
    let want = format!("{name}: is not a regular file; name a file");
    refused(&["fixtures/roof.ron", "-o", &name], &want);
}
