//! What the judges in Python say.

use crate::shell::{Outcome, root};
use serde::Deserialize;
use std::path::Path;
use std::process::Command;

/// Samples per direction of every face, both ends included.
const SAMPLES: usize = 9;

/// What the judge of Open CASCADE prints.
#[derive(Deserialize)]
pub(super) struct Verdict {
    pub(super) roots: usize,
    pub(super) valid: bool,
    pub(super) solids: usize,
    pub(super) shells: usize,
    /// Edges with length.
    pub(super) edges: usize,
    /// Those of them with one face only.
    pub(super) open_edges: usize,
    /// Largest angle between the normals of two faces along an edge, degrees.
    pub(super) kink: f64,
    /// Cubic millimetres; nothing for what is open.
    pub(super) volume: f64,
    /// Lowest and highest corner, millimetres.
    #[serde(rename = "box")]
    pub(super) bounds: [f64; 6],
    pub(super) faces: Vec<Face>,
}

#[derive(Deserialize)]
pub(super) struct Face {
    /// Square millimetres.
    pub(super) area: f64,
    /// What the tolerances of its edges make of the area.
    pub(super) slack: f64,
    pub(super) domain: [f64; 4],
    /// u, v, x, y, z, K, H; millimetres.
    pub(super) samples: Vec<[f64; 7]>,
}

impl Verdict {
    /// Of a STEP file.
    pub(super) fn of(python: &Path, file: &Path) -> Outcome<Self> {
        let text = ask(python, "open_cascade.py", file)?;
        // The reader itself may print a report before the JSON.
        let json = text.find("{\"roots\"").map_or("", |at| &text[at..]);
        serde_json::from_str(json).map_err(|e| format!("the judge said: {e}"))
    }
}

/// What a judge in Python prints about a file.
pub(super) fn ask(python: &Path, judge: &str, file: &Path) -> Outcome<String> {
    let mut command = Command::new(python);
    command.arg(root().join("xtask/judges").join(judge)).arg(file).arg(SAMPLES.to_string());
    let output = command.output().map_err(|e| format!("the judge could not start: {e}"))?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(String::from_utf8_lossy(&output.stderr).into_owned())
    }
}
