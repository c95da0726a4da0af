//! `--report` and `--figures` from the outside: what is written, how large it is, and that it
//! repeats.

#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

fn umbilic(args: &[&str]) {
    let root: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let mut command = Command::new(env!("CARGO_BIN_EXE_umbilic"));
    let output = command.current_dir(root).args(args).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
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
        umbilic(&[
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
        umbilic(&["demo", folder.path().to_str().unwrap(), "--threads", threads]);
        let page = folder.path().join("report.html");
        assert!(fs::metadata(&page).unwrap().len() <= 3_000_000);
        lasting(&page)
    });
    assert!(pages[0] == pages[1]);
    for part in ["Energies per iteration", "stage-1", "diagram_area"] {
        assert!(pages[0].contains(part), "{part}");
    }
}
