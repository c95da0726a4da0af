//! Molds that keep bounds: the cheapest types to begin with, and what to change where seams are
//! beyond the bounds.

use crate::fit::clustering::{self, Clusters, Feature};
use crate::fit::state::Fit;
use crate::mold::shape::MoldType;
use crate::pulse::Pulse;
use crate::seam::measure::{Measures, own_deviation};
use crate::search::bounds::Bounds;
use crate::search::site::Site;

/// Rounds of the alternation for a try of one type, and after a mending.
pub(crate) const SHORT_ALTERNATION: usize = 4;

/// Each cluster with the cheapest type that keeps its panels within `slack` halves of the bounds of
/// the design (two panels meet at a seam), or the most general type. `None` if asked to stop.
pub(crate) fn cheapest_types(
    site: &Site<'_>,
    bounds: &Bounds,
    clusters: &Clusters,
    slack: f64,
    pulse: &Pulse<'_>,
) -> Option<Fit> {
    let general = site.general();
    let fitted = |kind: MoldType| {
        let mut fit = site.first_fit(clusters, kind, pulse)?;
        fit.alternate(&site.set, SHORT_ALTERNATION, pulse)?;
        Some(fit)
    };
    let mut result = fitted(general)?;
    let mut costs: Vec<f64> =
        result.members.iter().map(|p| site.prices.cost(general, p.len())).collect();
    for &kind in &site.types[..site.types.len() - 1] {
        let other = fitted(kind)?;
        for m in 0..clusters.count {
            let members = &other.members[m];
            let cost = site.prices.cost(kind, members.len());
            // At equal cost the simpler type, which comes earlier, is kept too.
            let is_wanted =
                cost < costs[m] || (cost == costs[m] && result.molds[m].kind == general);
            let is_near = |&p: &usize| half_excess(site, bounds, &other, p) <= slack;
            if is_wanted && members.iter().all(is_near) {
                costs[m] = cost;
                result.molds[m] = other.molds[m];
                for &p in members {
                    result.poses[p] = other.poses[p];
                    result.energies[p] = other.energies[p];
                }
            }
        }
    }
    Some(result)
}

/// How many times a panel exceeds half of the bounds against the design.
fn half_excess(site: &Site<'_>, bounds: &Bounds, fit: &Fit, p: usize) -> f64 {
    let [kink, gap] = own_deviation(&site.set, &fit.molds[fit.labels[p]], &fit.poses[p], p);
    2.0 * bounds.excess(kink, gap)
}

/// Raises the weights of seams that are near or beyond the bounds.
pub(crate) fn weigh(bounds: &Bounds, measures: &Measures, weights: &mut [f64]) {
    for (weight, seam) in weights.iter_mut().zip(&measures.seams) {
        let excess = bounds.excess(seam.max_kink(), seam.max_gap());
        if excess > 0.9 {
            *weight = (*weight * (excess / 0.9).powi(2)).min(100.0);
        }
    }
}

/// Gives molds at seams beyond the bounds a more general type or splits them; false if nothing
/// could be changed, `None` if asked to stop.
pub(crate) fn mend(
    site: &Site<'_>,
    bounds: &Bounds,
    fit: &mut Fit,
    measures: &Measures,
    features: &[Feature],
    pulse: &Pulse<'_>,
) -> Option<bool> {
    let mut faulty = vec![false; fit.molds.len()];
    for seam in &measures.seams {
        let excess = bounds.excess(seam.max_kink(), seam.max_gap());
        if excess > 1.0 {
            let [a, b] = seam.panels;
            let deviation = |p: usize| half_excess(site, bounds, fit, p);
            let worse = if deviation(a) >= deviation(b) { a } else { b };
            faulty[fit.labels[worse]] = true;
        }
    }
    let mut changed = false;
    for m in 0..faulty.len() {
        if !faulty[m] {
            continue;
        }
        if pulse.is_stopped() {
            return None;
        }
        let kind = fit.molds[m].kind;
        if let Some(&next) = site.types.iter().find(|&&t| t > kind) {
            fit.restart(&site.set, m, next);
            changed = true;
        } else if fit.members[m].len() > 1 {
            let own: Vec<Feature> = fit.members[m].iter().map(|&p| features[p]).collect();
            let halves = clustering::shapes(&own, 2, 10, pulse)?;
            fit.split(m, &halves.labels);
            changed = true;
        }
    }
    Some(changed)
}
