//! STEP files of other programs: what Open CASCADE finds in them, what we read, and what it finds
//! in what we then write.

use super::verdict::Verdict;
use crate::shell::{Outcome, root};
use geom_core::BoundingBox;
use std::path::{Path, PathBuf};

/// Largest relative difference of the areas of a face that counts as agreement, beyond what the
/// tolerances of its edges make of it.
const AREA_AGREEMENT: f64 = 1e-6;
/// The same of volumes.
const VOLUME_AGREEMENT: f64 = 1e-6;
/// Largest difference of bounding boxes, as a share of their diagonal.
const BOX_AGREEMENT: f64 = 1e-6;
/// Files with the number of faces whose area Open CASCADE misses by more, as closed forms show: a
/// sphere without two segments and an extrusion (tests of the crate `exchange`), a sphere with a
/// circular hole, and a rational bilinear face (4.386113862 m² by quadrature with 60 x 60 nodes).
const MISSED: &[(&str, usize)] =
    &[("sweeps-bare.step", 2), ("abc-0000.step", 1), ("rational-bilinear.step", 1)];
/// Files whose box Open CASCADE finds too small: a glass turned about an axis is as wide in y as in
/// x, where both agree.
const NARROW: &[&str] = &["abc-0000.step"];
/// Files without a product, in which Open CASCADE finds no shape.
const BARE: &[&str] = &[
    "analytic-torus.step",
    "extrusion.step",
    "inch-untyped-measure.step",
    "latin1-name.step",
    "offset-surface-face.step",
    "two-units.step",
    "vertex-loop-sphere.step",
];

/// Judges the STEP files of the fixtures and of `UMBILIC_MODELS`.
pub(super) fn judge(python: &Path) -> Outcome {
    let models = std::env::var_os("UMBILIC_MODELS").map(PathBuf::from).filter(|p| p.is_dir());
    if models.is_none() {
        println!("SKIPPED files of other programs: UMBILIC_MODELS names no folder");
    }
    let out = root().join("target/judges");
    std::fs::create_dir_all(&out).map_err(|e| format!("{}: {e}", out.display()))?;
    for folder in models.into_iter().chain([root().join("fixtures/step")]) {
        let listed =
            std::fs::read_dir(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        let mut files: Vec<PathBuf> = listed.flatten().map(|entry| entry.path()).collect();
        files.retain(|file| file.extension().is_some_and(|e| e == "step"));
        files.sort();
        for file in files {
            let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
            if BARE.contains(&name.as_str()) {
                println!("SKIPPED {name}: it has no product for Open CASCADE");
                continue;
            }
            let said = judge_file(python, &file, &name, &out.join("again.step"))
                .map_err(|e| format!("{name}: {e}"))?;
            println!("{name}: Open CASCADE agrees: {said}");
        }
    }
    Ok(())
}

fn judge_file(python: &Path, file: &Path, name: &str, again: &Path) -> Outcome<String> {
    let theirs = Verdict::of(python, file)?;
    let model = exchange::read_model(file).map_err(|e| e.to_string())?;
    let scale = model.unit.metres() * 1e3;
    if theirs.faces.len() != model.surfaces.len() {
        return Err(format!("{} faces, we read {}", theirs.faces.len(), model.surfaces.len()));
    }
    let measured: Vec<_> = model.surfaces.iter().map(|s| s.curvature_statistics()).collect();
    let mut ours: Vec<f64> = measured.iter().map(|s| s.area * scale * scale).collect();
    let mut areas: Vec<[f64; 2]> = theirs.faces.iter().map(|f| [f.area, f.slack]).collect();
    ours.sort_by(f64::total_cmp);
    areas.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let allowed = MISSED.iter().find(|(known, _)| *known == name).map_or(0, |(_, n)| *n);
    let missed = unmatched(&ours, &areas);
    if missed > allowed {
        return Err(format!("areas {areas:?}, we measure {ours:?}"));
    }
    let boxes = measured.iter().filter_map(|s| s.bounding_box);
    let bounds = BoundingBox::of(boxes.flat_map(|b| [b.min * scale, b.max * scale]));
    let bounds = bounds.ok_or("there is nothing to measure")?;
    let corners = [bounds.min.to_array(), bounds.max.to_array()].concat();
    let beyond = |k: usize| {
        if k < 3 { theirs.bounds[k] - corners[k] } else { corners[k] - theirs.bounds[k] }
    };
    let apart = |k: usize| if NARROW.contains(&name) { -beyond(k) } else { beyond(k).abs() };
    // Written so that NaN is a disagreement.
    if !(0..6).all(|k| apart(k) <= BOX_AGREEMENT * bounds.diagonal()) {
        return Err(format!("a box of {:?}, we measure {corners:?}", theirs.bounds));
    }
    // What is written again is the same to the judge.
    let bytes = exchange::encode_model(again, &model).map_err(|e| e.to_string())?;
    std::fs::write(again, bytes).map_err(|e| e.to_string())?;
    let written = Verdict::of(python, again)?;
    // Edges that only cut a border of a whole surface in two are not written again.
    let counts = |v: &Verdict| [v.solids, v.faces.len(), v.open_edges];
    if !written.valid || counts(&written) != counts(&theirs) {
        let (wanted, found) = (counts(&theirs), counts(&written));
        let valid = if written.valid { "valid" } else { "invalid" };
        return Err(format!(
            "solids, faces and open edges {wanted:?} become {found:?} ({valid}) when written"
        ));
    }
    if theirs.solids > 0 && allowed == 0 {
        let change = (written.volume / theirs.volume - 1.0).abs();
        if !(change <= VOLUME_AGREEMENT) {
            return Err(format!("a volume of {} becomes {}", theirs.volume, written.volume));
        }
    }
    Ok(format!("{} faces, {} edges, {} solids", areas.len(), theirs.edges, theirs.solids))
}

/// How many of a rising list have no partner in one of areas with their slack.
fn unmatched(ours: &[f64], theirs: &[[f64; 2]]) -> usize {
    let (mut k, mut missed) = (0, 0);
    for a in ours {
        let bound = |k: usize| AREA_AGREEMENT * a + theirs[k][1];
        while k < theirs.len() && theirs[k][0] < a - bound(k) {
            k += 1;
        }
        if k < theirs.len() && theirs[k][0] <= a + bound(k) {
            k += 1;
        } else {
            missed += 1;
        }
    }
    missed
}
