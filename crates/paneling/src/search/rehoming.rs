//! Panels that move to other molds.
//!
//! Panels of like shape lie on a mold at like places. So a panel that is to move takes the place of
//! the panel most like it there, is registered, and goes to the mold that suits it best.

use crate::fit::clustering::{Feature, distance};
use crate::fit::residuals::panel_energy;
use crate::fit::state::{Fit, members_of};
use crate::layout::panels::Pose;
use crate::pulse::Pulse;
use crate::search::bounds::Bounds;
use crate::search::site::Site;
use crate::search::strain::strain;

/// Molds that are tried for a panel: those of the panels most like it.
const CANDIDATES: usize = 4;
/// Registrations of a panel on each of them.
const REGISTRATIONS: usize = 2;
/// Panels that are looked at for their molds; of more, only every so many.
const LOOKED_AT: usize = 20_000;

/// A place on another mold.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Home {
    pub(crate) mold: usize,
    pub(crate) pose: Pose,
    /// How many times the panel exceeds its share of the bounds there.
    pub(crate) strain: f64,
}

/// Where panel `p` of a fit would lie on a mold of another fit with the same panels, in the place of
/// panel `q`; `is_turned` if half round.
fn in_place_of(site: &Site<'_>, fit: &Fit, p: usize, q: usize, is_turned: bool) -> Pose {
    let frames = &site.set.frames;
    let frame = if is_turned { frames[p].turned() } else { frames[p] };
    let origin = frames[q].to_local(fit.poses[q].origin);
    let rotation = frames[q].rotation.transpose() * fit.poses[q].rotation;
    Pose { origin: frame.to_world(origin), rotation: frame.rotation * rotation }
}

/// The mold that suits a panel best among those that are open; none if none is.
pub(crate) fn best_home(
    site: &Site<'_>,
    bounds: &Bounds,
    fit: &Fit,
    features: &[Feature],
    p: usize,
    is_open: impl Fn(usize) -> bool,
) -> Option<Home> {
    // The nearest panel of each of the nearest molds, nearest first.
    let mut near: Vec<(f64, usize, bool)> = Vec::with_capacity(CANDIDATES + 1);
    let step = features.len().div_ceil(LOOKED_AT);
    for q in (0..features.len()).step_by(step) {
        let mold = fit.labels[q];
        if q == p || !is_open(mold) {
            continue;
        }
        let (far, is_turned) = distance(&features[p], &features[q]);
        if near.len() == CANDIDATES && far >= near[CANDIDATES - 1].0 {
            continue;
        }
        match near.iter().position(|n| fit.labels[n.1] == mold) {
            Some(k) if near[k].0 <= far => continue,
            Some(k) => {
                near.remove(k);
            }
            None => {}
        }
        let at = near.partition_point(|n| n.0 <= far);
        near.insert(at, (far, q, is_turned));
        near.truncate(CANDIDATES);
    }
    let home = |&(_, q, is_turned): &(f64, usize, bool)| {
        let mold = fit.labels[q];
        let mut here = (in_place_of(site, fit, p, q, is_turned), f64::INFINITY);
        let (points, normals) = site.set.panel_samples(p);
        here.1 = panel_energy(&fit.molds[mold], fit.slope_weight, &here.0, points, normals);
        for _ in 0..REGISTRATIONS {
            here = fit.registered(&site.set, p, &fit.molds[mold], here);
        }
        let strain = strain(site, bounds, &fit.molds[mold], &here.0, p);
        Home { mold, pose: here.0, strain }
    };
    let best = near.iter().map(home).reduce(|a, b| if b.strain < a.strain { b } else { a });
    // Beyond the reach of a round mold there is no home.
    best.filter(|h| h.strain.is_finite())
}

impl Fit {
    /// Moves panels to other molds and drops molds that have none left; returns for every mold
    /// whether it has got panels. Energies are those of before.
    pub(crate) fn rehome(&mut self, moves: &[(usize, Home)]) -> Vec<bool> {
        let mut has_got = vec![false; self.molds.len()];
        for (p, home) in moves {
            self.labels[*p] = home.mold;
            self.poses[*p] = home.pose;
            has_got[home.mold] = true;
        }
        let mut used = vec![false; self.molds.len()];
        self.labels.iter().for_each(|&m| used[m] = true);
        let mut fresh = 0;
        let numbers: Vec<usize> = used
            .iter()
            .map(|is_used| {
                fresh += usize::from(*is_used);
                fresh.saturating_sub(1)
            })
            .collect();
        let kept = |m: &usize| used[*m];
        self.molds = (0..used.len()).filter(kept).map(|m| self.molds[m]).collect();
        let has_got = (0..used.len()).filter(kept).map(|m| has_got[m]).collect();
        self.labels.iter_mut().for_each(|m| *m = numbers[*m]);
        self.members = members_of(&self.labels, fresh);
        has_got
    }
}

/// A fit with some molds dissolved, and which of its molds have got their panels.
pub(crate) struct Merged {
    pub(crate) fit: Fit,
    pub(crate) has_got: Vec<bool>,
}

/// Dissolves so many molds, those whose panels are strained least by moving to other molds, the
/// first `skip` of these left out. `Some(None)` if none can be dissolved, `None` if asked to stop.
pub(crate) fn merged(
    site: &Site<'_>,
    bounds: &Bounds,
    fit: &Fit,
    features: &[Feature],
    [count, skip]: [usize; 2],
    pulse: &Pulse<'_>,
) -> Option<Option<Merged>> {
    let molds = fit.molds.len();
    if molds < 2 {
        return Some(None);
    }
    let homes = pulse.map(site.set.len(), 8, |p| {
        best_home(site, bounds, fit, features, p, |m| m != fit.labels[p])
    })?;
    let mut strains = vec![0.0_f64; molds];
    for (home, &m) in homes.iter().zip(&fit.labels) {
        strains[m] = strains[m].max(home.map_or(f64::INFINITY, |h| h.strain));
    }
    let mut order: Vec<usize> = (0..molds).collect();
    // The index breaks ties, so that the order is always the same.
    order.sort_by(|&a, &b| strains[a].total_cmp(&strains[b]).then(a.cmp(&b)));
    let mut is_dissolved = vec![false; molds];
    let mut is_goal = vec![false; molds];
    let mut moves = Vec::new();
    let mut left = count.min(molds - 1);
    for &m in order.iter().skip(skip) {
        let own: Vec<(usize, Home)> =
            fit.members[m].iter().filter_map(|&p| homes[p].map(|h| (p, h))).collect();
        let stays = own.iter().any(|(_, h)| is_dissolved[h.mold]);
        if left == 0 {
            break;
        }
        if is_goal[m] || stays || own.len() < fit.members[m].len() {
            continue;
        }
        is_dissolved[m] = true;
        own.iter().for_each(|(_, h)| is_goal[h.mold] = true);
        moves.extend(own);
        left -= 1;
    }
    if moves.is_empty() {
        return Some(None);
    }
    let mut fit = fit.clone();
    let has_got = fit.rehome(&moves);
    fit.update_energies(&site.set, pulse)?;
    Some(Some(Merged { fit, has_got }))
}
