//! The course of a run: its attempts one after the other, and the published grid beside them.
//!
//! As in Eigensatz et al. 2010 bounds are tolerances at the seams and the cost is that of the molds
//! and of the panels made on them. From several numbers of molds the search starts with the
//! cheapest type that fits each cluster, then mends; the cheapest result within the bounds wins, and
//! gives up molds as long as the bounds are kept.

use crate::error::Error;
use crate::fit::clustering::Feature;
use crate::fit::state::Fit;
use crate::mold::shape::MoldType;
use crate::options::Clustering;
use crate::pulse::Pulse;
use crate::search::attempt::{Attempt, Found, MENDING_ROUNDS, Phase, Setting};
use crate::search::cheapening::cheapened;
use crate::search::mending::Typed;
use crate::search::plan::{Outcome, Plan, SLACKS, Try};
use crate::search::rehoming::{Merged, merged};
use crate::search::saved;
use crate::search::site::Site;
use gp_solver::{Checkpoint, ConjugateGradients, Extra, Progress, Stage};

/// The name of the method in checkpoints.
const METHOD: &str = "paneling";
/// How many times beyond the bounds an attempt may be to be mended, where one with more molds would
/// come next, and after molds have been dissolved.
const NEAR: f64 = 1.5;
const NEAR_MERGED: f64 = 4.0;
/// Most rounds of weighing and mending where there is a result within the bounds already.
const MERGING_ROUNDS: usize = 10;
/// Rounds and steps of a search among [`PANELS`] panels with an effort of 1; among fewer, more.
const STEPS: f64 = 100.0;
const PANELS: f64 = 900.0;
/// With several types so many times as many.
const SEVERAL_TYPES: f64 = 3.0;
/// An attempt may cost so many times what the best does: it may yet give up molds.
const DEARER: f64 = 1.25;
/// Attempts of a search are shown as so many at least.
const USUAL_ATTEMPTS: usize = 16;

/// A run between two attempts, or within one.
pub(crate) struct Course<'s> {
    site: &'s Site<'s>,
    features: Vec<Feature>,
    plan: Plan,
    /// Attempts before this one.
    number: usize,
    attempt: Option<Attempt>,
    /// Fits by type for the last number of molds.
    typed: Option<(usize, Typed)>,
    /// Fits that were judged.
    pub(crate) fits: usize,
    /// Rounds and steps of all attempts.
    steps: usize,
    /// What gives up molds: the last attempt within the bounds.
    base: Option<Found>,
    /// The best attempt.
    pub(crate) best: Option<Found>,
    /// The published grid.
    pub(crate) grid: Option<Found>,
    fingerprint: u64,
}

impl<'s> Course<'s> {
    /// A run from its beginning, or from a checkpoint of it; `None` if asked to stop.
    pub(crate) fn new(site: &'s Site<'s>, pulse: &Pulse<'_>) -> Result<Option<Self>, Error> {
        let has_bounds = site.bounds().is_some();
        let needs_shapes = has_bounds || site.options.clustering != Clustering::Grid;
        let features = if needs_shapes { site.features(pulse) } else { Some(Vec::new()) };
        let Some(features) = features else { return Ok(None) };
        let has_grid = site.options.compare_grid && site.options.clustering == Clustering::Own;
        let mut course = Self {
            site,
            features,
            plan: Plan::new(site.rule, site.set.len(), site.types.len(), has_grid),
            number: 0,
            attempt: None,
            typed: None,
            fits: 0,
            steps: 0,
            base: None,
            best: None,
            grid: None,
            fingerprint: site.fingerprint(),
        };
        if let Some(checkpoint) = pulse.resume()
            && course.load(&checkpoint, pulse)?.is_none()
        {
            return Ok(None);
        }
        Ok(Some(course))
    }

    /// Goes through what is left of the run; `None` if asked to stop.
    pub(crate) fn run(
        &mut self,
        mut extra: Option<&mut Extra<'_, Error>>,
        pulse: &Pulse<'_>,
    ) -> Result<Option<()>, Error> {
        while self.plan.next != Try::Done {
            let what = self.plan.next;
            if self.attempt.is_none() {
                let Some(begun) = self.begin(what, pulse) else { return Ok(None) };
                self.attempt = begun;
            }
            if let Some(mut attempt) = self.attempt.take() {
                let done = self.make(&mut attempt, what, extra.as_deref_mut(), pulse);
                let is_done = matches!(done, Ok(Some(())));
                self.attempt = Some(attempt);
                if !is_done {
                    return done;
                }
            }
            self.conclude(what);
            if !pulse.is_stopped() {
                pulse.offer(&|| self.save(None));
            }
        }
        Ok(Some(()))
    }

    /// The first attempt as it comes to its first seam step.
    pub(crate) fn first_fit(&mut self, pulse: &Pulse<'_>) -> Option<Fit> {
        let mut fit = self.begin(self.plan.next, pulse)??.fit;
        fit.alternate(&self.site.set, self.site.options.rounds, pulse)?;
        Some(fit)
    }

    /// The best attempt and that of the grid; if there is none, what there is so far.
    pub(crate) fn into_results(self) -> (Found, Option<Found>) {
        let Self { site, attempt, best, grid, .. } = self;
        let unfinished = || attempt.map_or_else(|| bare(site), |a| a.into_found(site));
        (best.unwrap_or_else(unfinished), grid)
    }

    /// The best attempt if it is within the bounds.
    fn within(&self) -> Option<&Found> {
        self.best.as_ref().filter(|b| b.excess.is_within())
    }

    /// What an attempt has to cost less than.
    fn limit(&self, what: Try) -> f64 {
        let cost = |found: &Found| self.site.cost(&found.fit);
        match what {
            Try::Merge { .. } | Try::Cheapen { .. } => {
                self.base.as_ref().map_or(f64::INFINITY, cost)
            }
            _ => self.within().map_or(f64::INFINITY, |b| DEARER * cost(b)),
        }
    }

    /// `Some(None)` if there is nothing to attempt, `None` if asked to stop.
    fn begin(&mut self, what: Try, pulse: &Pulse<'_>) -> Option<Option<Attempt>> {
        let site = self.site;
        let fit = match what {
            Try::Done => return Some(None),
            Try::Molds { molds, slack } => match site.bounds() {
                Some(_) => match self.cheapest(molds, slack, pulse)? {
                    Some(fit) if site.cost(&fit) < self.limit(what) => fit,
                    _ => return Some(None),
                },
                None => {
                    let own = site.options.clustering;
                    let clusters = site.cluster(&self.features, own, molds, pulse)?;
                    site.first_fit(&clusters, site.general(), pulse)?
                }
            },
            Try::Merge { .. } | Try::Cheapen { .. } => {
                let (Some(bounds), Some(base)) = (site.bounds(), &self.base) else {
                    return Some(None);
                };
                let features = &self.features;
                let next = match what {
                    Try::Cheapen { skip } => {
                        cheapened(site, &bounds, &base.fit, features, skip, pulse)?
                    }
                    Try::Merge { count, skip } => {
                        merged(site, &bounds, &base.fit, features, [count, skip], pulse)?
                    }
                    Try::Molds { .. } | Try::Grid | Try::Done => None,
                };
                let warm = |Merged { fit, has_got }: Merged| {
                    Attempt::warm(fit, &has_got, base.weights.clone())
                };
                return Some(next.filter(|m| site.cost(&m.fit) < self.limit(what)).map(warm));
            }
            Try::Grid => {
                let molds = match (site.bounds(), self.plan.first()) {
                    (None, Some(molds)) => molds,
                    _ => self.best.as_ref().map_or(1, |b| b.fit.molds.len()),
                };
                let clusters = site.cluster(&self.features, Clustering::Grid, molds, pulse)?;
                site.first_fit(&clusters, site.general(), pulse)?
            }
        };
        Some(Some(Attempt::new(site, fit)))
    }

    /// So many molds of the cheapest types within the bounds; `Some(None)` if a smaller slack has
    /// given the same ones, `None` if asked to stop.
    fn cheapest(&mut self, molds: usize, slack: f64, pulse: &Pulse<'_>) -> Option<Option<Fit>> {
        let site = self.site;
        let Some(bounds) = site.bounds() else { return Some(None) };
        if self.typed.as_ref().is_none_or(|(of, _)| *of != molds) {
            let own = site.options.clustering;
            let clusters = site.cluster(&self.features, own, molds, pulse)?;
            self.typed = Some((molds, Typed::new(site, clusters)));
        }
        let Some((_, typed)) = &mut self.typed else { return Some(None) };
        let kinds = |fit: &Fit| fit.molds.iter().map(|m| m.kind).collect::<Vec<MoldType>>();
        let fit = typed.cheapest(site, &bounds, slack, pulse)?;
        for smaller in SLACKS.into_iter().take_while(|s| *s < slack) {
            if kinds(&typed.cheapest(site, &bounds, smaller, pulse)?) == kinds(&fit) {
                return Some(None);
            }
        }
        Some(Some(fit))
    }

    /// All rounds and steps of an attempt; `None` if asked to stop.
    fn make(
        &self,
        attempt: &mut Attempt,
        what: Try,
        mut extra: Option<&mut Extra<'_, Error>>,
        pulse: &Pulse<'_>,
    ) -> Result<Option<()>, Error> {
        let mut shown = None;
        let mut solver = ConjugateGradients::new();
        while !matches!(attempt.phase, Phase::Done) {
            let stage = self.stage(what, matches!(attempt.phase, Phase::Rounds(..)));
            // The start of a stage, and every step.
            let is_new = shown != Some((stage.number, attempt.steps));
            if is_new && !matches!(attempt.phase, Phase::General(..)) {
                shown = Some((stage.number, attempt.steps));
                self.show(&stage, attempt, pulse);
            }
            if pulse.is_stopped() {
                return Ok(None);
            }
            let mut setting = self.setting(what, attempt, extra.as_deref_mut(), pulse);
            let save = |a: &Attempt| self.save(Some(a));
            if attempt.advance(&mut solver, &mut setting, &save)?.is_none() {
                return Ok(None);
            }
            pulse.offer(&|| self.save(Some(attempt)));
        }
        Ok(Some(()))
    }

    /// Rounds and steps that may still be spent on fewer molds.
    fn steps_left(&self) -> usize {
        let fewer = (PANELS / self.site.set.len() as f64).max(1.0).sqrt();
        let several = if self.site.types.len() > 1 { SEVERAL_TYPES } else { 1.0 };
        let all = self.site.options.effort * fewer * several * STEPS;
        (all.ceil() as usize).saturating_sub(self.steps)
    }

    fn towards_bounds(&self, what: Try) -> bool {
        self.site.bounds().is_some() && what != Try::Grid
    }

    fn setting<'a, 'o, 'e>(
        &'a self,
        what: Try,
        attempt: &Attempt,
        extra: Option<&'a mut Extra<'e, Error>>,
        pulse: &'a Pulse<'o>,
    ) -> Setting<'a, 'o, 'e> {
        let is_merge = matches!(what, Try::Merge { .. } | Try::Cheapen { .. });
        let is_last = attempt.fit.molds.len() == self.site.set.len();
        Setting {
            site: self.site,
            bounds: self.site.bounds().filter(|_| self.towards_bounds(what)),
            features: &self.features,
            limit: self.limit(what),
            mendable: match what {
                Try::Molds { .. } if self.plan.is_rising() && !is_last => NEAR,
                Try::Merge { .. } | Try::Cheapen { .. } => NEAR_MERGED,
                Try::Molds { .. } | Try::Grid | Try::Done => f64::INFINITY,
            },
            steps: if is_merge { self.steps_left() } else { usize::MAX },
            rounds: if is_merge || self.within().is_some() {
                MERGING_ROUNDS
            } else {
                MENDING_ROUNDS
            },
            // Where the number of molds rises, it rises instead.
            may_split: !is_merge && !self.plan.is_rising(),
            pulse,
            extra,
            stage: self.stage(what, false),
        }
    }

    /// Takes the attempt over if it is better than those before, and chooses the next one.
    fn conclude(&mut self, what: Try) {
        let site = self.site;
        self.number += 1;
        let mut outcome =
            Outcome { excess: f64::INFINITY, is_within: false, is_spent: false, molds: 0 };
        if let Some(attempt) = self.attempt.take() {
            if what == Try::Grid {
                self.grid = Some(attempt.into_found(site));
            } else {
                self.fits += attempt.round + 1;
                self.steps += attempt.steps;
                let found = attempt.into_found(site);
                outcome.excess = found.excess.worst();
                let is_cheaper = |than: &Found| site.cost(&found.fit) < site.cost(&than.fit);
                let is_within = found.excess.is_within();
                outcome.is_within = is_within
                    && match what {
                        Try::Merge { .. } | Try::Cheapen { .. } => {
                            self.base.as_ref().is_none_or(is_cheaper)
                        }
                        _ => true,
                    };
                if outcome.is_within {
                    self.base = Some(found.clone());
                }
                let is_better = match &self.best {
                    None => true,
                    Some(b) if is_within => !b.excess.is_within() || is_cheaper(b),
                    Some(b) => !b.excess.is_within() && found.excess.is_less(&b.excess),
                };
                if is_better {
                    self.best = Some(found);
                }
            }
        }
        outcome.is_spent = self.within().is_some() && self.steps_left() == 0;
        outcome.molds = self.base.as_ref().map_or(0, |b| b.fit.molds.len());
        tracing::debug!(?what, ?outcome, "attempt");
        self.plan.conclude(&outcome);
    }

    /// Under bounds every attempt is a stage; otherwise its fit and its seam steps are one each.
    fn stage(&self, what: Try, is_fit: bool) -> Stage {
        let is_search = self.site.bounds().is_some();
        let before = usize::from(!is_search);
        let grid = usize::from(self.plan.has_grid());
        let count = if is_search { USUAL_ATTEMPTS.max(self.number + 1 + grid) } else { 2 + grid };
        let (name, number) = match what {
            Try::Grid => ("grid".to_owned(), self.number + before),
            Try::Molds { molds, .. } if is_search => (format!("{molds} molds"), self.number),
            Try::Cheapen { .. } => ("cheaper types".to_owned(), self.number),
            Try::Merge { count, .. } => {
                let before = self.base.as_ref().map_or(1, |b| b.fit.molds.len());
                (format!("{} molds", before.saturating_sub(count)), self.number)
            }
            _ if is_fit => ("fit".to_owned(), 0),
            _ => ("seams".to_owned(), 1),
        };
        Stage::new(name, number, count).at([0.0; 3], self.site.unit)
    }

    fn show(&self, stage: &Stage, attempt: &Attempt, pulse: &Pulse<'_>) {
        let (rounds, steps) = (self.site.options.rounds, self.site.seam.steps);
        let (iteration, max_iterations) = match (stage.name.as_str(), &attempt.phase) {
            ("fit", _) => (attempt.fit_history.len(), rounds),
            ("seams", Phase::Seams(run)) => (run.steps.history().len() - 1, steps),
            ("seams", _) => (0, steps),
            ("grid", _) => (attempt.steps, rounds + steps),
            _ => (attempt.steps, rounds + (MENDING_ROUNDS + 1) * steps),
        };
        pulse.show(&Progress {
            stage,
            iteration,
            max_iterations,
            energy: attempt.energy(),
            gradient_norm: f64::NAN,
            x: &[],
            system: None,
        });
    }

    fn save(&self, attempt: Option<&Attempt>) -> Checkpoint {
        let steps = attempt.map_or(0, |a| a.steps);
        let to = Checkpoint::new(METHOD, self.fingerprint, self.number, steps);
        let to = to.with_counts("course", &[self.number, self.fits, self.steps].map(|n| n as u64));
        let to = to.with_counts("plan", &self.plan.counts());
        let found = [("base", &self.base), ("best", &self.best), ("grid", &self.grid)];
        let to = found.into_iter().fold(to, |to, (name, found)| match found {
            Some(found) => saved::put_found(to, name, found),
            None => to,
        });
        attempt.map_or(to.clone(), |attempt| saved::put_attempt(to, attempt))
    }

    fn load(&mut self, of: &Checkpoint, pulse: &Pulse<'_>) -> Result<Option<()>, Error> {
        of.check(METHOD, self.fingerprint)?;
        [self.number, self.fits, self.steps] = saved::counts(of, "course")?;
        self.plan.restore(saved::counts(of, "plan")?)?;
        self.base = saved::found(of, "base", self.site)?;
        self.best = saved::found(of, "best", self.site)?;
        self.grid = saved::found(of, "grid", self.site)?;
        let towards = self.towards_bounds(self.plan.next);
        match saved::attempt(of, self.site, towards, pulse)? {
            Some(None) => Ok(None),
            attempt => {
                self.attempt = attempt.flatten();
                Ok(Some(()))
            }
        }
    }
}

/// What there is before any attempt: all panels on one flat mold.
pub(crate) fn bare(site: &Site<'_>) -> Found {
    Found::bare(site, Fit::flat(&site.set, site.general(), site.options.slope_weight))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::clustering::Clusters;
    use crate::mold::prices::{Price, PriceList};
    use crate::seam::measure::measure;
    use crate::seam::step::SeamRun;
    use crate::seam::unknowns::Weights;
    use crate::search::bounds::Bounds;
    use crate::{Layout, MoldType, Options, PanelSet, Pattern};
    use fixtures::surfaces::Shape;
    use gp_solver::List;

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
    fn least_cost(site: &Site<'_>, bounds: &Bounds) -> f64 {
        let mut nobody = ();
        let pulse = &Pulse::new(&mut nobody);
        let weights = Weights::even(&site.set);
        let (types, panels) = (&site.types, site.set.len());
        let mut least = f64::INFINITY;
        for labels in partitions(panels) {
            let count = labels.iter().max().map_or(0, |m| m + 1);
            let clusters = Clusters { labels, turned: vec![false; panels], count };
            for choice in 0..types.len().pow(count as u32) {
                let kinds: Vec<MoldType> = (0..count as u32)
                    .map(|m| types[choice / types.len().pow(m) % types.len()])
                    .collect();
                let slope_weight = site.options.slope_weight;
                let mut fit = Fit::new(&site.set, &clusters, &kinds, slope_weight, pulse).unwrap();
                fit.alternate(&site.set, site.options.rounds, pulse).unwrap();
                let mut run = SeamRun::new(site.seams(&weights, false), &fit, pulse).unwrap();
                while run.status.is_none() {
                    let solver = &mut ConjugateGradients::new();
                    run.step(site.seams(&weights, false), &mut fit, solver, pulse);
                }
                let measures = measure(&site.set, &fit.molds, &fit.labels, &fit.poses);
                if bounds.judge(&measures).is_within() {
                    least = least.min(site.cost(&fit));
                }
            }
        }
        least
    }

    #[test]
    fn tiny_designs_cost_no_more_than_by_trying_everything() {
        let price = |mold, panel| Price { mold, panel, area: 0.0 };
        let plane_first = [
            (MoldType::Plane, price(1.0, 1.0)),
            (MoldType::Paraboloid, price(5.0, 2.0)),
            (MoldType::Cubic, price(9.0, 3.0)),
        ];
        let even = plane_first.map(|(kind, _)| (kind, price(1.0, 0.0)));
        let surface = Shape::Roof.surface(10, 10, 4, 4);
        let layout = Layout::generate(Pattern::Quad, 2, 2, [false; 2]).unwrap();
        let set = PanelSet::new(&surface, &layout).unwrap();
        let free = Some(0.1 * set.extent());
        for (prices, max_deviation) in [(plane_first, free), (even, free), (even, None)] {
            let prices = PriceList::new(prices);
            for degrees in [40.0, 12.0, 6.0, 3.0] {
                let options = Options {
                    max_kink_deg: Some(degrees),
                    max_deviation,
                    mold_types: List(plane_first.map(|(kind, _)| kind).to_vec()),
                    compare_grid: false,
                    ..Options::default()
                };
                let mut nobody = ();
                let pulse = &Pulse::new(&mut nobody);
                let site = Site::new(&set, &prices, &options).unwrap();
                let mut course = Course::new(&site, pulse).unwrap().unwrap();
                course.run(None, pulse).unwrap().unwrap();
                let (found, _) = course.into_results();
                let least = least_cost(&site, &site.bounds().unwrap());
                // The search also finds what no single fit comes upon.
                assert!(found.excess.is_within() || least.is_infinite(), "{degrees}");
                let cost = site.cost(&found.fit);
                let case = format!("{degrees}°: found {cost}, least {least}");
                assert!(!found.excess.is_within() || cost <= least + 1e-9, "{case}");
            }
        }
    }
}
