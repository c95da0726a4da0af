//! Filled patches as numbers of a checkpoint and back.

use geom_core::DVec3;

use crate::error::{Error, Place};
use crate::patch::solve::FilledPatch;
use crate::patch::surface::Patch;
use crate::warning::Warning;
use crate::watch::{Entry, foreign};

/// Counts of a patch: degree, freedoms, kind of the transversality, whether bounds were active, the
/// degree it was raised from (or 0), the number of joins it folds with plus one (or 0).
const COUNTS: usize = 6;

/// Patches, and which curves got a common cross derivative.
pub(crate) fn entry_of(patches: &[FilledPatch], continuous: &[bool]) -> Entry {
    let mut entry = Entry::default();
    entry.counts.push(patches.len() as u64);
    for p in patches {
        let kind = match p.transversality {
            t if t.is_finite() => 0,
            t if t.is_nan() => 1,
            _ => 2,
        };
        let (mut bounded, mut raised, mut folded) = (0, 0, 0);
        for warning in &p.warnings {
            match warning {
                Warning::BoundsActive { .. } => bounded = 1,
                Warning::DegreeRaised { from, .. } => raised = *from,
                Warning::JointFold { shared, .. } => folded = shared + 1,
                _ => {}
            }
        }
        let counts = [p.patch.degree(), p.freedoms, kind, bounded, raised, folded];
        entry.counts.extend(counts.map(|c| c as u64));
        let transversality = if kind == 0 { p.transversality } else { 0.0 };
        entry.numbers.extend([p.thin_plate_energy, transversality]);
        entry.numbers.extend(p.patch.points().iter().flat_map(|q| q.to_array()));
    }
    entry.counts.extend(continuous.iter().map(|c| u64::from(*c)));
    entry
}

/// What [`entry_of`] made an entry of.
pub(crate) fn patches_of(entry: &Entry) -> Result<(Vec<FilledPatch>, Vec<bool>), Error> {
    let (count, mut counts) = entry.counts.split_first().ok_or_else(foreign)?;
    let mut numbers = entry.numbers.as_slice();
    let mut patches = Vec::new();
    for f in 0..*count as usize {
        let (own, rest) = counts.split_at_checked(COUNTS).ok_or_else(foreign)?;
        counts = rest;
        let [degree, freedoms, kind, bounded, raised, folded] =
            std::array::from_fn(|k| own[k] as usize);
        let place = Place::Patch(f);
        let mut warnings = Vec::new();
        if bounded == 1 {
            warnings.push(Warning::BoundsActive { place });
        }
        if raised > 0 {
            warnings.push(Warning::DegreeRaised { place, from: raised, to: degree });
        }
        if folded > 0 {
            warnings.push(Warning::JointFold { place, shared: folded - 1 });
        }
        let points = 3 * (degree + 1) * (degree + 1);
        let (own, rest) = numbers.split_at_checked(2 + points).ok_or_else(foreign)?;
        numbers = rest;
        patches.push(FilledPatch {
            patch: Patch::new(degree, own[2..].chunks_exact(3).map(DVec3::from_slice).collect()),
            thin_plate_energy: own[0],
            freedoms,
            transversality: [own[1], f64::NAN, f64::INFINITY][kind.min(2)],
            warnings,
        });
    }
    Ok((patches, counts.iter().map(|c| *c == 1).collect()))
}
