//! What is attacked: every kind of file a command reads, and how.

use crate::shell::{Outcome, root};
use std::fs;
use std::path::{Path, PathBuf};

/// A file that one option or the input of a command names.
pub(super) struct Target {
    /// The whole file, before it is made worse.
    pub(super) seed: PathBuf,
    /// The command line; [`HOSTILE`] stands for the mutated file.
    pub(super) line: &'static str,
    /// Extension of the model it writes; none if it writes none.
    pub(super) writes: Option<&'static str>,
}

/// Where the mutated file goes in a command line.
pub(super) const HOSTILE: &str = "{file}";

const MODELS: &[&str] = &[
    "fixtures/roof.ron",
    "fixtures/saddle.step",
    "fixtures/step",
    "fixtures/rhino",
    "fixtures/read",
    "fixtures/quads/cube.obj",
    "fixtures/quads/theta-4.obj",
    "fixtures/nets/scherk.obj",
    "fixtures/triangles/enneper-3.obj",
    "fixtures/grid.obj",
    "fixtures/hard",
    "fixtures/tube.ron",
];
const EXTENSIONS: &[&str] =
    &["ron", "step", "stp", "3dm", "obj", "ply", "off", "stl", "glb", "json"];

const SURFACES: &[&str] = &[
    "weingarten {file} --iterations 2",
    "weingarten {file} --levels 8x8,10x10 --iterations 1",
    "panel {file} --panels 4x3",
    "panel {file} --panels 3x3 --max-kink-deg 1",
];
const MESHES: &[&str] = &[
    "hnet {file}",
    "hnet {file} --method published --rounds 1",
    "darboux {file} --c -0.6",
    "asymptotic {file} --from-net",
    "fair {file} --levels 0 --iterations 2",
    "fair {file} --levels 1 --iterations 1 --method lbfgs",
    "fit {file}",
    "remesh {file} --faces 60",
];

/// Option files that are written here, with the command that reads them.
const OPTION_FILES: &[(&str, &str, &str)] = &[
    (
        "config.ron",
        "(iterations: 2, levels: \"9x8\", samples: \"14x12\", border: glide, shape: 0.1)",
        "weingarten fixtures/saddle.ron --config {file}",
    ),
    (
        "fix.ron",
        "(vertices: [0, 1], limit_points: [(3, Some((0.0, 1.0, 2.0))), (4, None)], tangent_planes: [(3, Some((0.0, 0.0, 1.0)))])",
        "fair fixtures/quads/cube.obj --levels 0 --iterations 2 --fix {file}",
    ),
    (
        "creases.ron",
        "(edges: [((0, 1), 2.0), ((1, 2), 1e6)], corners: [0])",
        "fair fixtures/quads/cube.obj --levels 0 --iterations 2 --creases {file}",
    ),
    (
        "cage.ron",
        "(images: [(-2.0,-2.0,-2.0),(2.0,-2.0,-2.0),(-2.0,2.0,-2.0),(2.0,2.0,-2.0),(-2.0,-2.0,2.0),(2.0,-2.0,2.0),(-2.0,2.0,2.0),(2.1,2.1,2.2)], freedom: Some(19))",
        "darboux fixtures/nets/scherk.obj --cage {file}",
    ),
    (
        "curve.ron",
        "[(-0.5, -0.2), (-0.3, 0.0), (-0.2, 0.1), (0.1, 0.3)]",
        "weingarten fixtures/saddle.ron --iterations 2 --relation curve={file}",
    ),
];

/// All targets; those written for the purpose go to `folder`.
pub(super) fn all(folder: &Path) -> Outcome<Vec<Target>> {
    let mut targets = Vec::new();
    for seed in models()? {
        let surfaces = ["ron", "step", "stp", "3dm"].contains(&extension(&seed).as_str());
        let lines = if surfaces { SURFACES } else { MESHES };
        for line in lines {
            targets.push(Target { seed: seed.clone(), line, writes: Some("obj") });
        }
        targets.push(Target { seed: seed.clone(), line: "convert {file}", writes: Some("glb") });
        targets.push(Target { seed, line: "analyze {file}", writes: None });
    }
    let prices = root().join("fixtures/prices.ron");
    let line = "panel fixtures/roof.ron --panels 4x3 --max-kink-deg 1 --prices {file}";
    targets.push(Target { seed: prices, line, writes: Some("csv") });
    let creases = root().join("fixtures/quads/ellipsoid-crease.ron");
    let line = "fair fixtures/quads/ellipsoid.obj --levels 0 --iterations 1 --creases {file}";
    targets.push(Target { seed: creases, line, writes: Some("obj") });
    for (name, text, line) in OPTION_FILES {
        let seed = folder.join(name);
        fs::write(&seed, text).map_err(|e| format!("{}: {e}", seed.display()))?;
        targets.push(Target { seed, line, writes: Some("obj") });
    }
    let line = "weingarten fixtures/saddle.ron --iterations 2 --resume {file}";
    targets.push(Target { seed: folder.join("state.json"), line, writes: Some("ron") });
    let line = "verify {file}";
    targets.push(Target { seed: folder.join("metrics.json"), line, writes: None });
    Ok(targets)
}

/// The files of the fixtures that are models and not too long to be read thousands of times.
fn models() -> Outcome<Vec<PathBuf>> {
    const LONGEST: u64 = 200_000;
    let mut files = Vec::new();
    for name in MODELS {
        let path = root().join(name);
        if path.is_dir() {
            let list = fs::read_dir(&path).map_err(|e| format!("{}: {e}", path.display()))?;
            files.extend(list.flatten().map(|entry| entry.path()));
        } else {
            files.push(path);
        }
    }
    files.retain(|file| {
        EXTENSIONS.contains(&extension(file).as_str())
            && fs::metadata(file).is_ok_and(|m| m.len() <= LONGEST)
    });
    files.sort();
    Ok(files)
}

pub(super) fn extension(file: &Path) -> String {
    file.extension().map_or_else(String::new, |e| e.to_string_lossy().to_lowercase())
}
