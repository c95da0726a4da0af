//! Molds, or one half of their panels, given a cheaper type.

use crate::fit::alternation::Alternation;
use crate::fit::clustering::{self, Feature};
use crate::fit::state::Fit;
use crate::mold::shape::MoldType;
use crate::pulse::Pulse;
use crate::search::bounds::Bounds;
use crate::search::mending::SHORT_ALTERNATION;
use crate::search::rehoming::Merged;
use crate::search::site::Site;
use crate::search::strain::strain;

/// Changes that are fitted: those that save most.
const FITTED: usize = 24;

/// A mold that is to change: whole, or one half of it.
struct Change {
    mold: usize,
    half: Option<usize>,
    kind: MoldType,
    saving: f64,
}

/// The fit with one mold, or one half of it, of a cheaper type: of the changes that save most the
/// one that strains its panels least, the first `skip` left out. `Some(None)` if there is none,
/// `None` if asked to stop.
pub(crate) fn cheapened(
    site: &Site<'_>,
    bounds: &Bounds,
    fit: &Fit,
    features: &[Feature],
    skip: usize,
    pulse: &Pulse<'_>,
) -> Option<Option<Merged>> {
    let mut halves = Vec::with_capacity(fit.molds.len());
    let mut changes = Vec::new();
    for (m, members) in fit.members.iter().enumerate() {
        let own: Vec<Feature> = members.iter().map(|&p| features[p]).collect();
        let two = if own.len() > 1 {
            clustering::shapes(&own, 2, 10, pulse)?.labels
        } else {
            vec![0; own.len()]
        };
        let of = fit.molds[m].kind;
        let second = two.iter().filter(|h| **h == 1).count();
        let before = site.price(of, members.len());
        for &kind in site.types.iter().filter(|t| **t != of) {
            let whole = site.price(kind, members.len());
            changes.push(Change { mold: m, half: None, kind, saving: before - whole });
            for (half, size) in [(0, members.len() - second), (1, second)] {
                let rest = members.len() - size;
                if size > 0 && rest > 0 {
                    let cost = site.price(kind, size) + site.price(of, rest);
                    changes.push(Change { mold: m, half: Some(half), kind, saving: before - cost });
                }
            }
        }
        halves.push(two);
    }
    changes.retain(|c| c.saving > 0.0);
    changes.sort_by(|a, b| b.saving.total_cmp(&a.saving));
    let mut tried = Vec::new();
    for change in changes.iter().take(FITTED) {
        let (trial, m) = changed(site, fit, change, &halves[change.mold], pulse)?;
        let of = |&p: &usize| strain(site, bounds, &trial.molds[m], &trial.poses[p], p);
        let worst = trial.members[m].iter().map(of).fold(0.0, f64::max);
        if worst.is_finite() {
            tried.push((worst, trial, m));
        }
    }
    tried.sort_by(|a, b| a.0.total_cmp(&b.0));
    let chosen = tried.into_iter().nth(skip).map(|(_, fit, m)| {
        let has_got = (0..fit.molds.len()).map(|k| k == m).collect();
        Merged { fit, has_got }
    });
    Some(chosen)
}

/// The fit after a change, and the mold that is new.
fn changed(
    site: &Site<'_>,
    fit: &Fit,
    change: &Change,
    halves: &[usize],
    pulse: &Pulse<'_>,
) -> Option<(Fit, usize)> {
    let mut trial = fit.clone();
    let mut m = change.mold;
    if let Some(half) = change.half {
        // The half that is to change leaves.
        let leaves: Vec<usize> = halves.iter().map(|h| usize::from(*h == half)).collect();
        trial.split(m, &leaves);
        m = trial.molds.len() - 1;
    }
    trial.restart(&site.set, m, change.kind);
    trial.update_energies(&site.set, pulse)?;
    let is_new: Vec<bool> = (0..trial.molds.len()).map(|k| k == m).collect();
    let mut rounds = Alternation::of_some(&is_new);
    while rounds.rounds < SHORT_ALTERNATION && rounds.round(&site.set, &mut trial, pulse)? {}
    Some((trial, m))
}
