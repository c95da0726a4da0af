//! The cheapest molds that keep kinks and gaps within bounds.
//!
//! As in Eigensatz et al. 2010 the bounds are tolerances at the seams and the cost is that of the
//! molds and of the panels made on them. From several numbers of molds the search starts with the
//! cheapest type that fits each cluster, then mends: the joint seam step weighs the seams that were
//! beyond the bounds more, and once that does not help, molds at such seams get a more general type
//! or, where there is none, are split in two. The cheapest result within the bounds wins.

use crate::error::PanelingError;
use crate::fit::clustering::{self, Feature};
use crate::fit::state::Fit;
use crate::layout::panels::PanelSet;
use crate::mold::prices::PriceList;
use crate::mold::shape::MoldType;
use crate::paneling::{Options, Paneling, cluster, finish};
use crate::seam::measure::{Measures, measure, own_deviation};
use crate::seam::step as seam_step;

/// What is allowed at a seam.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bounds {
    /// Largest kink, in radians.
    pub max_kink: Option<f64>,
    /// Largest gap.
    pub max_gap: Option<f64>,
}

impl Bounds {
    fn check(&self) -> Result<(), PanelingError> {
        for (name, value) in
            [("the largest kink", self.max_kink), ("the largest gap", self.max_gap)]
        {
            if let Some(value) = value.filter(|v| !(*v > 0.0 && v.is_finite())) {
                return Err(PanelingError::BadOption { name, value });
            }
        }
        Ok(())
    }

    /// How many times a kink or gap exceeds its bound; at most 1 if neither does.
    fn excess(&self, kink: f64, gap: f64) -> f64 {
        let of = |value: f64, bound: Option<f64>| bound.map_or(0.0, |b| value / b);
        of(kink, self.max_kink).max(of(gap, self.max_gap))
    }

    /// How many times the worst seam exceeds the bounds; at most 1 if all are within.
    #[must_use]
    pub fn worst_excess(&self, measures: &Measures) -> f64 {
        measures.seams.iter().map(|s| self.excess(s.max_kink(), s.max_gap())).fold(0.0, f64::max)
    }
}

/// A paneling made for bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct Bounded {
    /// The panels and molds.
    pub paneling: Paneling,
    /// Whether every seam is within the bounds.
    pub is_within: bool,
    /// How many times the worst seam exceeds the bounds; at most 1 if all are within.
    pub worst_excess: f64,
    /// Total cost by the price list.
    pub cost: f64,
    /// How many fits were tried.
    pub attempts: usize,
}

/// Most rounds of mending from one start.
const MENDING_ROUNDS: usize = 24;
/// Rounds of the alternation after a mending.
const SHORT_ALTERNATION: usize = 4;
/// A round of weighing seams that lowers the worst excess by less than this share is followed by
/// changes of the molds.
const WEIGHING_STALL: f64 = 0.1;
/// First numbers of molds, in units of the square root of the number of panels.
const STARTS: [f64; 6] = [0.1, 0.3, 0.6, 1.2, 3.0, 8.0];

/// The cheapest paneling found with every seam within `bounds`, using only `types`; `options`
/// gives everything but the number and type of the molds. If no try is within the bounds, the one
/// that is nearest to them.
///
/// # Errors
/// [`PanelingError`] for bounds that are not positive, no types, or prices that are missing.
pub fn panel_within(
    set: &PanelSet,
    bounds: &Bounds,
    types: &[MoldType],
    prices: &PriceList,
    options: &Options,
) -> Result<Bounded, PanelingError> {
    bounds.check()?;
    prices.check(types)?;
    let mut types = types.to_vec();
    types.sort_unstable();
    types.dedup();
    if types.is_empty() {
        return Err(PanelingError::NoMoldTypes);
    }
    let search = Search {
        set,
        scaled: set.scaled(1.0 / set.size),
        bounds: Bounds { max_gap: bounds.max_gap.map(|g| g / set.size), ..*bounds },
        types: &types,
        prices,
        options,
    };
    let features = clustering::features(&search.scaled, options.slope_weight);
    let mut best: Option<Bounded> = None;
    let mut attempts = 0;
    // How far from the design a cheaper type may lead, in halves of the bounds. Seams often need
    // less than the sum of what their two panels deviate.
    let slacks: &[f64] = if types.len() > 1 { &[1.0, 2.0, f64::INFINITY] } else { &[1.0] };
    let counts = STARTS.map(|start| crate::paneling::mold_count(start, set.len()));
    for (k, (&molds, &slack)) in
        counts.iter().flat_map(|m| slacks.iter().map(move |s| (m, s))).enumerate()
    {
        if k >= slacks.len() && counts[k / slacks.len() - 1] == molds {
            continue;
        }
        let limit = best.as_ref().filter(|b| b.is_within).map_or(f64::INFINITY, |b| b.cost);
        let found = search.from(molds, slack, &features, limit, &mut attempts);
        let is_better = match &best {
            None => true,
            Some(b) if found.is_within => !b.is_within || found.cost < b.cost,
            Some(b) => !b.is_within && found.worst_excess < b.worst_excess,
        };
        let is_hopeless = !is_better && best.as_ref().is_some_and(|b| b.is_within);
        if is_better {
            best = Some(found);
        }
        // Starts rise, so once a start alone costs more than the best there is nothing to gain.
        if is_hopeless && types.len() == 1 {
            break;
        }
    }
    let mut best = best.ok_or(PanelingError::NoMoldTypes)?;
    best.attempts = attempts;
    Ok(best)
}

struct Search<'a> {
    set: &'a PanelSet,
    scaled: PanelSet,
    /// In units of the panel size.
    bounds: Bounds,
    types: &'a [MoldType],
    prices: &'a PriceList,
    options: &'a Options,
}

impl Search<'_> {
    /// The result from one first number of molds; gives up once the cost exceeds `limit`.
    fn from(
        &self,
        molds: usize,
        slack: f64,
        features: &[Feature],
        limit: f64,
        attempts: &mut usize,
    ) -> Bounded {
        let options = Options { molds, ..self.options.clone() };
        let clusters = cluster(self.set, features, &options);
        let mut fit = self.cheapest_types(&clusters, slack, &options);
        let mut weights = vec![1.0; self.scaled.seams.len()];
        let mut fit_history = fit.alternate(&self.scaled, options.rounds);
        let mut best: Option<(f64, Fit, Vec<f64>)> = None;
        let mut last_excess = f64::INFINITY;
        for round in 0..=MENDING_ROUNDS {
            *attempts += 1;
            let seam = options.seam_settings();
            let seam_history = if options.seam_steps > 0 {
                seam_step::improve(&self.scaled, &mut fit, &seam, &weights)
            } else {
                Vec::new()
            };
            let measures = measure(&self.scaled, &fit.molds, &fit.labels, &fit.poses);
            let excess = self.bounds.worst_excess(&measures);
            if best.as_ref().is_none_or(|b| excess < b.0) {
                best = Some((excess, fit.clone(), seam_history));
            }
            if excess <= 1.0 || round == MENDING_ROUNDS || self.cost(&fit) >= limit {
                break;
            }
            self.weigh(&measures, &mut weights);
            if excess > (1.0 - WEIGHING_STALL) * last_excess || options.seam_steps == 0 {
                if !self.mend(&mut fit, &measures, features) {
                    break;
                }
                fit_history.extend(fit.alternate(&self.scaled, SHORT_ALTERNATION));
                last_excess = f64::INFINITY;
            } else {
                last_excess = excess;
            }
        }
        let (worst_excess, fit, seam_history) = best.unwrap_or((f64::INFINITY, fit, Vec::new()));
        let cost = self.cost(&fit);
        let paneling = finish(self.set, fit, fit_history, seam_history);
        Bounded { paneling, is_within: worst_excess <= 1.0, worst_excess, cost, attempts: 0 }
    }

    fn cost(&self, fit: &Fit) -> f64 {
        fit.molds.iter().zip(&fit.members).map(|(m, p)| self.prices.cost(m.kind, p.len())).sum()
    }

    /// Each cluster with the cheapest type that keeps its panels within half of the bounds of the
    /// design (two panels meet at a seam), or the most general type.
    fn cheapest_types(
        &self,
        clusters: &clustering::Clusters,
        slack: f64,
        options: &Options,
    ) -> Fit {
        let general = self.types[self.types.len() - 1];
        let fitted = |kind: MoldType| {
            let kinds = vec![kind; clusters.count];
            let mut fit = Fit::new(&self.scaled, clusters, &kinds, options.slope_weight);
            fit.alternate(&self.scaled, SHORT_ALTERNATION);
            fit
        };
        let mut result = fitted(general);
        let mut costs: Vec<f64> =
            result.members.iter().map(|p| self.prices.cost(general, p.len())).collect();
        for &kind in &self.types[..self.types.len() - 1] {
            let other = fitted(kind);
            for m in 0..clusters.count {
                let members = &other.members[m];
                let cost = self.prices.cost(kind, members.len());
                // At equal cost the simpler type, which comes earlier, is kept too.
                let is_wanted =
                    cost < costs[m] || (cost == costs[m] && result.molds[m].kind == general);
                if is_wanted && members.iter().all(|&p| self.half_excess(&other, p) <= slack) {
                    costs[m] = cost;
                    result.molds[m] = other.molds[m];
                    for &p in members {
                        result.poses[p] = other.poses[p];
                        result.energies[p] = other.energies[p];
                    }
                }
            }
        }
        result
    }

    /// How many times a panel exceeds half of the bounds against the design.
    fn half_excess(&self, fit: &Fit, p: usize) -> f64 {
        let [kink, gap] = own_deviation(&self.scaled, &fit.molds[fit.labels[p]], &fit.poses[p], p);
        2.0 * self.bounds.excess(kink, gap)
    }

    /// Raises the weights of seams that are near or beyond the bounds.
    fn weigh(&self, measures: &Measures, weights: &mut [f64]) {
        for (weight, seam) in weights.iter_mut().zip(&measures.seams) {
            let excess = self.bounds.excess(seam.max_kink(), seam.max_gap());
            if excess > 0.9 {
                *weight = (*weight * (excess / 0.9).powi(2)).min(100.0);
            }
        }
    }

    /// Gives molds at seams beyond the bounds a more general type or splits them; false if
    /// nothing could be changed.
    fn mend(&self, fit: &mut Fit, measures: &Measures, features: &[Feature]) -> bool {
        let mut faulty = vec![false; fit.molds.len()];
        for seam in &measures.seams {
            let excess = self.bounds.excess(seam.max_kink(), seam.max_gap());
            if excess > 1.0 {
                let [a, b] = seam.panels;
                let worse =
                    if self.half_excess(fit, a) >= self.half_excess(fit, b) { a } else { b };
                faulty[fit.labels[worse]] = true;
            }
        }
        let mut changed = false;
        for m in 0..faulty.len() {
            if !faulty[m] {
                continue;
            }
            let kind = fit.molds[m].kind;
            if let Some(&next) = self.types.iter().find(|&&t| t > kind) {
                fit.restart(&self.scaled, m, next);
                changed = true;
            } else if fit.members[m].len() > 1 {
                let own: Vec<Feature> = fit.members[m].iter().map(|&p| features[p]).collect();
                let halves = clustering::shapes(&own, 2, 10);
                fit.split(m, &halves.labels);
                changed = true;
            }
        }
        changed
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::clustering::Clusters;
    use crate::mold::prices::Price;
    use crate::{Layout, Pattern};
    use fixtures::surfaces::Shape;

    /// All ways to put `n` panels into groups, as the group of each panel.
    fn partitions(n: usize) -> Vec<Vec<usize>> {
        let mut all = vec![vec![]];
        for _ in 0..n {
            all = all
                .into_iter()
                .flat_map(|labels: Vec<usize>| {
                    let groups = labels.iter().max().map_or(0, |m| m + 1);
                    (0..=groups).map(move |g| labels.iter().copied().chain([g]).collect())
                })
                .collect();
        }
        all
    }

    /// The least cost over every grouping and every choice of types whose seams are within bounds.
    fn least_cost(
        set: &PanelSet,
        bounds: &Bounds,
        types: &[MoldType],
        prices: &PriceList,
        options: &Options,
    ) -> f64 {
        let scaled = set.scaled(1.0 / set.size);
        let bounds = Bounds { max_gap: bounds.max_gap.map(|g| g / set.size), ..*bounds };
        let weights = vec![1.0; set.seams().len()];
        let mut least = f64::INFINITY;
        for labels in partitions(set.len()) {
            let count = labels.iter().max().map_or(0, |m| m + 1);
            let clusters = Clusters { labels, turned: vec![false; set.len()], count };
            for choice in 0..types.len().pow(count as u32) {
                let kinds: Vec<MoldType> = (0..count as u32)
                    .map(|m| types[choice / types.len().pow(m) % types.len()])
                    .collect();
                let mut fit = Fit::new(&scaled, &clusters, &kinds, options.slope_weight);
                fit.alternate(&scaled, options.rounds);
                seam_step::improve(&scaled, &mut fit, &options.seam_settings(), &weights);
                let measures = measure(&scaled, &fit.molds, &fit.labels, &fit.poses);
                if bounds.worst_excess(&measures) <= 1.0 {
                    let molds = fit.molds.iter().zip(&fit.members);
                    least = least.min(molds.map(|(m, p)| prices.cost(m.kind, p.len())).sum());
                }
            }
        }
        least
    }

    #[test]
    fn tiny_designs_cost_no_more_than_by_trying_everything() {
        let price = |mold, panel| Price { mold, panel };
        let plane_first = [
            (MoldType::Plane, price(1.0, 1.0)),
            (MoldType::Paraboloid, price(5.0, 2.0)),
            (MoldType::Cubic, price(9.0, 3.0)),
        ];
        let even = plane_first.map(|(kind, _)| (kind, price(1.0, 0.0)));
        let types = plane_first.map(|(kind, _)| kind);
        let surface = Shape::Roof.surface(10, 10, 4, 4);
        let layout = Layout::generate(Pattern::Quad, 2, 2, [false; 2]).unwrap();
        let set = PanelSet::new(&surface, &layout).unwrap();
        let options = Options::with_molds(1);
        for prices in [plane_first, even] {
            let prices = PriceList::new(prices);
            for degrees in [40.0_f64, 12.0, 6.0, 3.0] {
                let bounds = Bounds { max_kink: Some(degrees.to_radians()), max_gap: None };
                let found = panel_within(&set, &bounds, &types, &prices, &options).unwrap();
                let least = least_cost(&set, &bounds, &types, &prices, &options);
                assert_eq!(found.is_within, least.is_finite(), "{degrees}");
                let case = format!("{degrees}°: found {}, least {least}", found.cost);
                assert!(!found.is_within || found.cost <= least + 1e-9, "{case}");
            }
        }
    }
}
