//! Molds that keep bounds: the cheapest types to begin with, and what to change where seams or
//! panels are beyond the bounds.

use crate::fit::clustering::{self, Clusters, Feature};
use crate::fit::state::Fit;
use crate::pulse::Pulse;
use crate::seam::measure::Measures;
use crate::seam::unknowns::Weights;
use crate::search::bounds::Bounds;
use crate::search::rehoming::{Home, best_home};
use crate::search::site::Site;
use crate::search::strain::{strain, strains};

/// Rounds of the alternation for a try of one type, and after a mending.
pub(crate) const SHORT_ALTERNATION: usize = 4;
/// A panel moves to another mold if that strains it less than this share of what its own does.
const RELIEF: f64 = 0.8;
/// Seams and panels nearer to their bounds than this share weigh more in the next seam step, others
/// less.
const NEAR: f64 = 0.9;
/// How a weight changes from one seam step to the next at least and at most.
const LIGHTER: f64 = 0.7;
const HEAVIER: f64 = 4.0;
/// Least and most that a seam weighs, and that a panel's distance to the design does.
const SEAM_WEIGHTS: [f64; 2] = [0.1, 100.0];
const PANEL_WEIGHTS: [f64; 2] = [1.0, 1e7];

/// Fits of the same clusters, one per type, made when they are first asked for.
pub(crate) struct Typed {
    clusters: Clusters,
    fits: Vec<Option<Fit>>,
}

impl Typed {
    pub(crate) fn new(site: &Site<'_>, clusters: Clusters) -> Self {
        Self { clusters, fits: vec![None; site.types.len()] }
    }

    /// The fit with the type number `of`; `None` if asked to stop.
    fn fit(&mut self, site: &Site<'_>, of: usize, pulse: &Pulse<'_>) -> Option<&Fit> {
        if self.fits[of].is_none() {
            let mut fit = site.first_fit(&self.clusters, site.types[of], pulse)?;
            fit.alternate(&site.set, SHORT_ALTERNATION, pulse)?;
            self.fits[of] = Some(fit);
        }
        self.fits[of].as_ref()
    }

    /// Each cluster with the cheapest type that keeps its panels within `slack` halves of the
    /// bounds of the design (two panels meet at a seam) and within the bound on the design, or else
    /// the most general type. `None` if asked to stop.
    ///
    /// Types are tried from the cheapest on, and only as long as a cluster is left that none suits.
    pub(crate) fn cheapest(
        &mut self,
        site: &Site<'_>,
        bounds: &Bounds,
        slack: f64,
        pulse: &Pulse<'_>,
    ) -> Option<Fit> {
        let general = site.types.len() - 1;
        let count = self.clusters.count;
        let mut sizes = vec![0; count];
        self.clusters.labels.iter().for_each(|&m| sizes[m] += 1);
        // For every cluster its types by cost; at equal cost the simpler one first.
        let orders: Vec<Vec<usize>> = sizes
            .iter()
            .map(|&panels| {
                let cost = |of: usize| site.price(site.types[of], panels);
                let mut order: Vec<usize> =
                    (0..general).filter(|&of| cost(of) <= cost(general)).collect();
                order.sort_by(|&a, &b| cost(a).total_cmp(&cost(b)).then(a.cmp(&b)));
                order
            })
            .collect();
        let mut chosen: Vec<Option<usize>> = vec![None; count];
        for place in 0..general {
            for of in 0..general {
                let asks = |m: &usize| chosen[*m].is_none() && orders[*m].get(place) == Some(&of);
                let asking: Vec<usize> = (0..count).filter(asks).collect();
                if asking.is_empty() {
                    continue;
                }
                let fit = self.fit(site, of, pulse)?;
                for m in asking {
                    let is_near = |&p: &usize| {
                        let (mold, pose) = (&fit.molds[m], &fit.poses[p]);
                        let [seams, design] = strains(site, bounds, mold, pose, p);
                        seams <= slack && design <= 1.0
                    };
                    if fit.members[m].iter().all(is_near) {
                        chosen[m] = Some(of);
                    }
                }
            }
        }
        let first = chosen.first().copied().flatten().unwrap_or(general);
        let mut result = self.fit(site, first, pulse)?.clone();
        for (m, of) in chosen.into_iter().enumerate() {
            let of = of.unwrap_or(general);
            let other = self.fit(site, of, pulse)?;
            result.molds[m] = other.molds[m];
            for &p in &other.members[m] {
                result.poses[p] = other.poses[p];
                result.energies[p] = other.energies[p];
            }
        }
        Some(result)
    }
}

/// Raises the weights of seams and panels that are near or beyond the bounds, and lowers the others.
pub(crate) fn weigh(bounds: &Bounds, measures: &Measures, weights: &mut Weights) {
    let change = |weight: &mut f64, excess: f64, [least, most]: [f64; 2]| {
        let factor = (excess / NEAR).powi(2).clamp(LIGHTER, HEAVIER);
        *weight = (*weight * factor).clamp(least, most);
    };
    for (weight, seam) in weights.seams.iter_mut().zip(&measures.seams) {
        change(weight, bounds.excess(seam.max_kink(), seam.max_gap()), SEAM_WEIGHTS);
    }
    for (weight, deviation) in weights.panels.iter_mut().zip(&measures.deviations) {
        change(weight, bounds.design_excess(*deviation), PANEL_WEIGHTS);
    }
}

/// Panels to blame for what is beyond the bounds: at a seam the one that is strained more.
fn faulty_panels(
    site: &Site<'_>,
    bounds: &Bounds,
    fit: &Fit,
    measures: &Measures,
) -> Vec<(usize, f64)> {
    let of = |p: usize| strain(site, bounds, &fit.molds[fit.labels[p]], &fit.poses[p], p);
    let mut is_faulty: Vec<bool> =
        measures.deviations.iter().map(|d| bounds.design_excess(*d) > 1.0).collect();
    for seam in &measures.seams {
        if bounds.excess(seam.max_kink(), seam.max_gap()) > 1.0 {
            let [a, b] = seam.panels;
            is_faulty[if of(a) >= of(b) { a } else { b }] = true;
        }
    }
    (0..is_faulty.len()).filter(|&p| is_faulty[p]).map(|p| (p, of(p))).collect()
}

/// Moves panels beyond the bounds to molds that suit them better; if there are none, gives their
/// molds a more general type or splits them, if that is allowed. Returns which molds have changed;
/// `None` if asked to stop.
pub(crate) fn mend(
    site: &Site<'_>,
    bounds: &Bounds,
    fit: &mut Fit,
    measures: &Measures,
    features: &[Feature],
    may_split: bool,
    pulse: &Pulse<'_>,
) -> Option<Vec<bool>> {
    let faulty = faulty_panels(site, bounds, fit, measures);
    let homes = pulse.map(faulty.len(), 1, |k| {
        let (p, strain) = faulty[k];
        let home = best_home(site, bounds, fit, features, p, |m| m != fit.labels[p]);
        home.filter(|h| h.strain < RELIEF * strain)
    })?;
    let moves: Vec<(usize, Home)> =
        faulty.iter().zip(&homes).filter_map(|((p, _), home)| home.map(|h| (*p, h))).collect();
    let stay = faulty.iter().zip(&homes).filter(|(_, home)| home.is_none());
    let stay: Vec<usize> = stay.map(|((p, _), _)| *p).collect();
    let mut changed = fit.rehome(&moves);
    if !may_split {
        fit.update_energies(&site.set, pulse)?;
        return Some(changed);
    }
    let mut is_to_change = vec![false; fit.molds.len()];
    stay.iter().for_each(|&p| is_to_change[fit.labels[p]] = true);
    for m in (0..is_to_change.len()).filter(|&m| is_to_change[m]) {
        if pulse.is_stopped() {
            return None;
        }
        let kind = fit.molds[m].kind;
        if let Some(&next) = site.types.iter().find(|&&t| t > kind) {
            fit.restart(&site.set, m, next);
            changed[m] = true;
        } else if fit.members[m].len() > 1 {
            let own: Vec<Feature> = fit.members[m].iter().map(|&p| features[p]).collect();
            let halves = clustering::shapes(&own, 2, 10, pulse)?;
            fit.split(m, &halves.labels);
            changed[m] = true;
            changed.push(true);
        }
    }
    fit.update_energies(&site.set, pulse)?;
    Some(changed)
}
