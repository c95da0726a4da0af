//! Converged results that are started again: a status is a proof only if nothing was left to gain.

use crate::shell::{Outcome, read, root, target, umbilic};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What a converged result may gain, as a share of its energy or of that of the start.
const GAIN: [f64; 2] = [0.01, 1e-9];
/// Steps at most.
const STEPS: u64 = 400;

const ENERGIES: &[&str] = &["mehlum_tarrou", "bending", "f1", "mvs"];
const METHODS: &[&str] = &["lagged-gauss-newton", "gauss-newton", "sobolev", "lbfgs"];

/// Every closed or open mesh of the fixtures by every method, and every surface, each started again
/// from its result for as many steps as it took.
pub(crate) fn run() -> Outcome<String> {
    let folder = target().join("nightly");
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    let mut restarts = Restarts { folder, converged: 0, runs: 0, faults: Vec::new() };
    for mesh in fixtures("quads", "obj")? {
        for energy in ENERGIES {
            for method in METHODS {
                restarts.fair(&mesh, energy, method)?;
            }
        }
    }
    for surface in fixtures("", "ron")? {
        restarts.weingarten(&surface)?;
    }
    let Restarts { converged, runs, faults, .. } = restarts;
    if faults.is_empty() {
        Ok(format!("{converged} of {runs} runs converged"))
    } else {
        Err(faults.join("; "))
    }
}

/// The files of a folder of the fixtures that have an extension, in the order of their names.
fn fixtures(folder: &str, extension: &str) -> Outcome<Vec<PathBuf>> {
    let path = root().join("fixtures").join(folder);
    let list = std::fs::read_dir(&path).map_err(|e| format!("{}: {e}", path.display()))?;
    let mut files: Vec<PathBuf> = list.filter_map(|entry| entry.ok().map(|e| e.path())).collect();
    files.retain(|file| file.extension().is_some_and(|e| e == extension));
    files.sort();
    Ok(files)
}

struct Restarts {
    folder: PathBuf,
    converged: usize,
    runs: usize,
    faults: Vec<String>,
}

/// What a run said.
struct Ran {
    status: String,
    steps: u64,
    metrics: Value,
}

impl Ran {
    fn number(&self, key: &str) -> f64 {
        self.metrics[key].as_f64().unwrap_or(f64::NAN)
    }
}

impl Restarts {
    fn fair(&mut self, mesh: &Path, energy: &str, method: &str) -> Outcome {
        let options = ["--levels", "0", "--energy", energy, "--method", method];
        let first = self.ran("fair", mesh, &options, STEPS, "first.obj")?;
        if first.status != "converged" {
            return Ok(());
        }
        self.converged += 1;
        let (before, scale) = (first.number("energy_final"), first.number("energy_initial"));
        let result = self.folder.join("first.obj");
        for again in ["lagged-gauss-newton", "lbfgs"] {
            let options = ["--levels", "0", "--energy", energy, "--method", again];
            let second = self.ran("fair", &result, &options, first.steps.max(1), "again.obj")?;
            let gain = before - second.number("energy_final");
            if gain > (GAIN[0] * before.abs()).max(GAIN[1] * scale.abs()) {
                let share = 100.0 * gain / before;
                let name = mesh.display();
                self.faults.push(format!("{name} {energy} {method}: {again} gains {share:.1} %"));
            }
        }
        Ok(())
    }

    fn weingarten(&mut self, surface: &Path) -> Outcome {
        // Price lists and the like are no surfaces.
        let Ok(first) = self.ran("weingarten", surface, &[], STEPS, "first.ron") else {
            return Ok(());
        };
        if first.status != "converged" {
            return Ok(());
        }
        self.converged += 1;
        let result = self.folder.join("first.ron").display().to_string();
        let start = ["--start", result.as_str()];
        let second = self.ran("weingarten", surface, &start, first.steps.max(1), "again.ron")?;
        let (before, after) = (first.number("alignment_rms"), second.number("alignment_rms"));
        if before - after > (GAIN[0] * before).max(1e-9) {
            let name = surface.display();
            self.faults.push(format!("{name}: alignment {before:e} became {after:e}"));
        }
        Ok(())
    }

    fn ran(
        &mut self,
        command: &str,
        input: &Path,
        options: &[&str],
        steps: u64,
        out: &str,
    ) -> Outcome<Ran> {
        self.runs += 1;
        let (out, metrics) = (self.folder.join(out), self.folder.join("metrics.json"));
        let mut run: Command = umbilic();
        run.arg(command).arg(input).args(options).args(["--iterations", &steps.to_string(), "-q"]);
        run.arg("-o").arg(&out).arg("--metrics").arg(&metrics);
        let output = run.output().map_err(|e| format!("umbilic: {e}"))?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            return Err(format!("{command} {}: {}", input.display(), said.trim()));
        }
        let json: Value =
            serde_json::from_str(&read(&metrics)?).map_err(|e| format!("metrics: {e}"))?;
        Ok(Ran {
            status: json["status"].as_str().unwrap_or_default().to_owned(),
            steps: json["iterations"].as_u64().unwrap_or(0),
            metrics: json["metrics"].clone(),
        })
    }
}
