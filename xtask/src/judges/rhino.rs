//! 3DM files both ways: openNURBS (by rhino3dm) reads ours, and we read its own.

use super::verdict::ask;
use crate::shell::{Outcome, root};
use geom_core::DVec3;
use serde::Deserialize;
use std::path::Path;

/// Largest difference of points, as a share of the size of the surface, that counts as agreement.
const AGREEMENT: f64 = 1e-12;
/// Files whose content is written as 3DM.
const CASES: [&str; 7] = [
    "roof.ron",
    "tube.ron",
    "torus-patch.ron",
    "sphere-cap.ron",
    "grid.obj",
    "step/assembly.step",
    "step/bracket.step",
];

/// What the judge prints.
#[derive(Deserialize)]
struct Said {
    invalid: Vec<String>,
    /// u, v, x, y, z of every NURBS surface that stands alone.
    surfaces: Vec<Vec<[f64; 5]>>,
    /// Faces of Breps.
    faces: usize,
}

/// Judges our files and those that the judge writes.
pub(super) fn judge(python: &Path) -> Outcome {
    let out = root().join("target/judges");
    std::fs::create_dir_all(&out).map_err(|e| format!("{}: {e}", out.display()))?;
    for name in CASES {
        let source = root().join("fixtures").join(name);
        if !source.is_file() {
            println!("SKIPPED {name} as 3DM: it is not among the fixtures");
            continue;
        }
        let file = out.join("a.3dm");
        let model = exchange::read_model(&source).map_err(|e| format!("{name}: {e}"))?;
        let bytes = exchange::encode_model(&file, &model).map_err(|e| format!("{name}: {e}"))?;
        std::fs::write(&file, bytes).map_err(|e| format!("{}: {e}", file.display()))?;
        let said = compare(python, &file).map_err(|e| format!("{name} as 3DM: {e}"))?;
        println!("{name} as 3DM: rhino3dm agrees: {said}");
    }
    let theirs = out.join("theirs.3dm");
    if theirs.exists() {
        std::fs::remove_file(&theirs).map_err(|e| format!("{}: {e}", theirs.display()))?;
    }
    let said = compare(python, &theirs).map_err(|e| format!("a file of rhino3dm: {e}"))?;
    println!("a file of rhino3dm: we agree: {said}");
    Ok(())
}

/// Whether both find the same surfaces in a file, in words.
fn compare(python: &Path, file: &Path) -> Outcome<String> {
    let said: Said = serde_json::from_str(&ask(python, "rhino.py", file)?)
        .map_err(|e| format!("the judge said: {e}"))?;
    if let Some(first) = said.invalid.first() {
        return Err(format!("{} objects are invalid: {first}", said.invalid.len()));
    }
    let model = exchange::read_model(file).map_err(|e| e.to_string())?;
    if said.surfaces.len() + said.faces != model.surfaces.len() {
        let ours = model.surfaces.len();
        return Err(format!("{} and {} faces, we find {ours}", said.surfaces.len(), said.faces));
    }
    let mut worst = 0.0_f64;
    for samples in &said.surfaces {
        let size = samples.iter().flat_map(|s| &s[2..]).fold(0.0_f64, |m, x| m.max(x.abs()));
        // Faces of Breps stand between them, so the surface is looked for by its points.
        let nearest = model.surfaces.iter().filter(|s| s.trim.is_none()).map(|named| {
            let difference = |&[u, v, x, y, z]: &[f64; 5]| {
                named.surface.point(u, v).distance(DVec3::new(x, y, z))
            };
            samples.iter().map(difference).fold(0.0_f64, f64::max) / size
        });
        worst = worst.max(nearest.fold(f64::INFINITY, f64::min));
    }
    // Written so that NaN is a disagreement.
    if !(worst <= AGREEMENT) {
        return Err(format!("points differ by {worst:.1e}"));
    }
    Ok(format!("{} surfaces to {worst:.1e}, {} faces", said.surfaces.len(), said.faces))
}
