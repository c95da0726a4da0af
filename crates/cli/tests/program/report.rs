//! `--report` and `--figures` from the outside: what is written, how large it is, and that it
//! repeats.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use crate::common::{message, umbilic};
use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// Runs the program, which must succeed.
fn succeed(args: &[&str]) {
    let output = umbilic(args);
    assert!(output.status.success(), "{}", message(&output));
}

/// The page without the one block that may change from run to run.
fn lasting(page: &Path) -> String {
    let text = fs::read_to_string(page).unwrap();
    let (lasting, changing): (Vec<&str>, Vec<&str>) =
        text.lines().partition(|line| !line.contains("id=\"run\">"));
    assert_eq!(changing.len(), 1);
    lasting.join("\n")
}

fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let content = |e: fs::DirEntry| (e.file_name().into_string().unwrap(), fs::read(e.path()));
    entries.map(content).map(|(name, bytes)| (name, bytes.unwrap())).collect()
}

#[test]
fn pages_and_figures_repeat_for_any_number_of_threads() {
    let runs = ["1", "3"].map(|threads| {
        let folder = tempfile::tempdir().unwrap();
        let page = folder.path().join("page.html");
        let figures = folder.path().join("figures");
        fs::create_dir(&figures).unwrap();
        succeed(&[
            "analyze",
            "fixtures/torus-patch.ron",
            "--report",
            page.to_str().unwrap(),
            "--figures",
            figures.to_str().unwrap(),
            "--threads",
            threads,
        ]);
        (lasting(&page), files(&figures))
    });
    assert!(runs[0] == runs[1]);
    let names: Vec<&str> = runs[0].1.keys().map(String::as_str).collect();
    assert_eq!(
        names,
        [
            "surface-diagram.svg",
            "surface-h.png",
            "surface-k.png",
            "surface-kappa1.png",
            "surface-kappa2.png"
        ]
    );
    assert!(runs[0].0.contains("Curvature analysis") && runs[0].0.contains("stage-0"));
}

#[test]
fn the_page_of_the_demo_is_small_and_repeats() {
    let pages = ["1", "2"].map(|threads| {
        let folder = tempfile::tempdir().unwrap();
        succeed(&["demo", folder.path().to_str().unwrap(), "--threads", threads]);
        let page = folder.path().join("report.html");
        assert!(fs::metadata(&page).unwrap().len() <= 3_000_000);
        lasting(&page)
    });
    assert!(pages[0] == pages[1]);
    let parts = [
        "Energies per iteration",
        "Kinks along seams",
        "Worst seams of panels after",
        "stage-3",
        "diagram_area",
        "panels_before",
        "<th scope=\"row\">kink_median_deg</th>",
    ];
    for part in parts {
        assert!(pages[0].contains(part), "{part}");
    }
}

#[test]
fn relations_are_drawn_over_the_diagrams_of_both_surfaces() {
    for (relation, curve) in [
        ("minimal", "H = 0"),
        ("linear=1,2,-0.3", "K = −0.5 H + 0.15"),
        ("ratio=-1.5", "κ₁ = −1.5 κ₂"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let [out, page] = ["out.ron", "page.html"].map(|name| folder.path().join(name));
        succeed(&[
            "weingarten",
            "fixtures/saddle.ron",
            "-o",
            out.to_str().unwrap(),
            "--iterations",
            "1",
            "--relation",
            relation,
            "--report",
            page.to_str().unwrap(),
            "--figures",
            folder.path().to_str().unwrap(),
        ]);
        let page = fs::read_to_string(&page).unwrap();
        assert!(page.contains(&format!("\"relations\":[{{\"name\":\"{curve}\"")), "{relation}");
        let figure = fs::read_to_string(folder.path().join("after-diagram.svg")).unwrap();
        for text in [curve, ">before<", ">after<"] {
            assert!(figure.contains(text), "{relation}: {text}");
        }
    }
}

#[test]
fn the_page_of_panels_shows_molds_kinks_and_seams() {
    let folder = tempfile::tempdir().unwrap();
    let [table, page] = ["panels.csv", "page.html"].map(|name| folder.path().join(name));
    succeed(&[
        "panel",
        "fixtures/saddle.ron",
        "--panels",
        "8x8",
        "-o",
        table.to_str().unwrap(),
        "--report",
        page.to_str().unwrap(),
        "--figures",
        folder.path().to_str().unwrap(),
    ]);
    let text = fs::read_to_string(&page).unwrap();
    for part in ["Panels and molds", "Kinks along seams", "Worst seams of panels", "clustering"] {
        assert!(text.contains(part), "{part}");
    }
    let names = files(folder.path());
    for name in ["histogram-kinks.svg", "histogram-gaps.svg", "panels-molds.png"] {
        assert!(names.contains_key(name), "{name}");
    }
}

#[test]
fn nets_and_their_images_are_drawn() {
    let draw = |command: &str, out: &str, more: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join(out).display().to_string();
        let figures = folder.path().display().to_string();
        let args = [command, "fixtures/nets/helicoid.obj", "-o", &out, "--figures", &figures];
        succeed(&[&args, more].concat());
        files(folder.path())
    };
    for (names, wanted) in [
        (draw("hnet", "net.ron", &[]), ["hyperbolic-net-h.png", "histogram-kinks.svg"]),
        (draw("darboux", "a.glb", &["--c", "0.7"]), ["regular-image-k.png", "other-image-k.png"]),
    ] {
        for name in wanted {
            assert!(names.contains_key(name), "{name} is not among {:?}", names.keys());
        }
    }
}

#[test]
fn two_results_in_one_file_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("roof.json");
    let same = folder.path().join(".").join("roof.json");
    let [file_name, same] = [&file, &same].map(|path| path.display().to_string());
    let output = umbilic(&["convert", "fixtures/roof.ron", &file_name, "--metrics", &same]);
    let message = message(&output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    // After a warning that JSON holds no unit.
    let said: Vec<&str> = message.trim().lines().filter(|l| !l.contains("warning:")).collect();
    assert!(said.len() == 1 && said[0].contains("two results"), "{message}");
    assert!(!file.exists());
}
