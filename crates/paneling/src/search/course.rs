//! The course of a run: its attempts one after the other, and the published grid beside them.
//!
//! As in Eigensatz et al. 2010 bounds are tolerances at the seams and the cost is that of the molds
//! and of the panels made on them. From several numbers of molds the search starts with the
//! cheapest type that fits each cluster, then mends; the cheapest result within the bounds wins.

use crate::error::Error;
use crate::fit::clustering::Feature;
use crate::fit::state::Fit;
use crate::options::{Clustering, MoldRule, mold_count};
use crate::pulse::Pulse;
use crate::search::attempt::{Attempt, Found, MENDING_ROUNDS, Phase, Setting};
use crate::search::mending::cheapest_types;
use crate::search::saved;
use crate::search::site::Site;
use gp_solver::{Checkpoint, ConjugateGradients, Extra, Progress, Stage};

/// The name of the method in checkpoints.
const METHOD: &str = "paneling";
/// First numbers of molds, in units of the square root of the number of panels.
const STARTS: [f64; 6] = [0.1, 0.3, 0.6, 1.2, 3.0, 8.0];
/// How far from the design a cheaper type may lead, in halves of the bounds. Seams often need less
/// than the sum of what their two panels deviate.
const SLACKS: [f64; 3] = [1.0, 2.0, f64::INFINITY];

/// What is attempted.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Try {
    /// So many molds, with a type each that is within so many halves of the bounds.
    Molds(usize, f64),
    /// The published grid with as many molds as the best attempt.
    Grid,
}

/// A run between two attempts, or within one.
pub(crate) struct Course<'s> {
    site: &'s Site<'s>,
    features: Vec<Feature>,
    tries: Vec<Try>,
    /// The attempt that is being made, or comes next.
    number: usize,
    attempt: Option<Attempt>,
    /// Fits that were judged.
    pub(crate) fits: usize,
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
        let mut tries = match site.rule {
            MoldRule::PerRoot(k) => vec![Try::Molds(mold_count(k, site.set.len()), 1.0)],
            MoldRule::Count(molds) => vec![Try::Molds(molds, 1.0)],
            MoldRule::Bounds(_) => {
                let slacks = if site.types.len() > 1 { &SLACKS[..] } else { &SLACKS[..1] };
                let mut counts = STARTS.map(|k| mold_count(k, site.set.len())).to_vec();
                counts.dedup();
                let of_count = |&m: &usize| slacks.iter().map(move |&s| Try::Molds(m, s));
                counts.iter().flat_map(of_count).collect()
            }
        };
        if site.options.compare_grid && site.options.clustering == Clustering::Own {
            tries.push(Try::Grid);
        }
        let mut course = Self {
            site,
            features,
            tries,
            number: 0,
            attempt: None,
            fits: 0,
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
        while self.number < self.tries.len() {
            let what = self.tries[self.number];
            if self.attempt.is_none() {
                self.attempt = self.begin(what, pulse);
            }
            let Some(mut attempt) = self.attempt.take() else { return Ok(None) };
            let done = self.make(&mut attempt, what, extra.as_deref_mut(), pulse);
            let is_done = matches!(done, Ok(Some(())));
            self.attempt = Some(attempt);
            if !is_done {
                return done;
            }
            self.conclude(what);
            if !pulse.is_stopped() {
                pulse.offer(&|| self.save(None));
            }
        }
        Ok(Some(()))
    }

    /// The first attempt as it comes to its first seam step.
    pub(crate) fn first_fit(&self, pulse: &Pulse<'_>) -> Option<Fit> {
        let mut fit = self.begin(self.tries[0], pulse)?.fit;
        fit.alternate(&self.site.set, self.site.options.rounds, pulse)?;
        Some(fit)
    }

    /// The best attempt and that of the grid; if there is none, what there is so far.
    pub(crate) fn into_results(self) -> (Found, Option<Found>) {
        let Self { site, attempt, best, grid, .. } = self;
        let unfinished = || attempt.map_or_else(|| bare(site), Attempt::into_found);
        (best.unwrap_or_else(unfinished), grid)
    }

    fn begin(&self, what: Try, pulse: &Pulse<'_>) -> Option<Attempt> {
        let site = self.site;
        let fit = match what {
            Try::Molds(molds, slack) => {
                let own = site.options.clustering;
                let clusters = site.cluster(&self.features, own, molds, pulse)?;
                match site.bounds() {
                    Some(bounds) => cheapest_types(site, &bounds, &clusters, slack, pulse)?,
                    None => site.first_fit(&clusters, site.general(), pulse)?,
                }
            }
            Try::Grid => {
                let molds = match self.tries[0] {
                    Try::Molds(molds, _) if site.bounds().is_none() => molds,
                    _ => self.best.as_ref().map_or(1, |b| b.fit.molds.len()),
                };
                let clusters = site.cluster(&self.features, Clustering::Grid, molds, pulse)?;
                site.first_fit(&clusters, site.general(), pulse)?
            }
        };
        Some(Attempt::new(site, fit))
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
            let mut setting = self.setting(what, extra.as_deref_mut(), pulse);
            let save = |a: &Attempt| self.save(Some(a));
            if attempt.advance(&mut solver, &mut setting, &save)?.is_none() {
                return Ok(None);
            }
            pulse.offer(&|| self.save(Some(attempt)));
        }
        Ok(Some(()))
    }

    fn setting<'a, 'o, 'e>(
        &'a self,
        what: Try,
        extra: Option<&'a mut Extra<'e, Error>>,
        pulse: &'a Pulse<'o>,
    ) -> Setting<'a, 'o, 'e> {
        let limit = self.best.as_ref().filter(|b| b.excess <= 1.0);
        Setting {
            site: self.site,
            bounds: self.site.bounds().filter(|_| what != Try::Grid),
            features: &self.features,
            limit: limit.map_or(f64::INFINITY, |b| self.site.cost(&b.fit)),
            pulse,
            extra,
            stage: self.stage(what, false),
        }
    }

    /// Takes the attempt over if it is better than those before, and chooses the next one.
    fn conclude(&mut self, what: Try) {
        let site = self.site;
        self.number += 1;
        let Some(attempt) = self.attempt.take() else { return };
        if what == Try::Grid {
            self.grid = Some(attempt.into_found());
            return;
        }
        self.fits += attempt.round + 1;
        let found = attempt.into_found();
        let is_within = |f: &Found| f.excess <= 1.0;
        let is_better = match &self.best {
            None => true,
            Some(b) if is_within(&found) => {
                !is_within(b) || site.cost(&found.fit) < site.cost(&b.fit)
            }
            Some(b) => !is_within(b) && found.excess < b.excess,
        };
        let is_hopeless = !is_better && self.best.as_ref().is_some_and(is_within);
        if is_better {
            self.best = Some(found);
        }
        // Starts rise, so once a start alone costs more than the best there is nothing to gain.
        if is_hopeless && site.types.len() == 1 {
            let is_other = |t: &&Try| **t == Try::Grid;
            self.number = self.tries.len() - self.tries.iter().filter(is_other).count();
        }
    }

    /// Under bounds every attempt is a stage; otherwise its fit and its seam steps are one each.
    fn stage(&self, what: Try, is_fit: bool) -> Stage {
        let is_search = self.site.bounds().is_some();
        let before = usize::from(!is_search);
        let (name, number) = match what {
            Try::Grid => ("grid".to_owned(), self.number + before),
            Try::Molds(molds, _) if is_search => (format!("{molds} molds"), self.number),
            Try::Molds(..) if is_fit => ("fit".to_owned(), 0),
            Try::Molds(..) => ("seams".to_owned(), 1),
        };
        Stage::new(name, number, self.tries.len() + before).at([0.0; 3], self.site.unit)
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
        let to = to.with_counts("course", &[self.number as u64, self.fits as u64]);
        let found = [("best", &self.best), ("grid", &self.grid)];
        let to = found.into_iter().fold(to, |to, (name, found)| match found {
            Some(found) => saved::put_found(to, name, found),
            None => to,
        });
        attempt.map_or(to.clone(), |attempt| saved::put_attempt(to, attempt))
    }

    fn load(&mut self, of: &Checkpoint, pulse: &Pulse<'_>) -> Result<Option<()>, Error> {
        of.check(METHOD, self.fingerprint)?;
        [self.number, self.fits] = saved::counts(of, "course")?;
        self.best = saved::found(of, "best", self.site)?;
        self.grid = saved::found(of, "grid", self.site)?;
        match saved::attempt(of, self.site, pulse)? {
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
    Found::bare(Fit::flat(&site.set, site.general(), site.options.slope_weight))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::clustering::Clusters;
    use crate::mold::prices::{Price, PriceList};
    use crate::seam::measure::measure;
    use crate::seam::step::SeamRun;
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
        let weights = vec![1.0; site.set.seams().len()];
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
                let mut run = SeamRun::new(site.seams(&weights), &fit, pulse).unwrap();
                while run.status.is_none() {
                    let solver = &mut ConjugateGradients::new();
                    run.step(site.seams(&weights), &mut fit, solver, pulse);
                }
                let measures = measure(&site.set, &fit.molds, &fit.labels, &fit.poses);
                if bounds.worst_excess(&measures) <= 1.0 {
                    least = least.min(site.cost(&fit));
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
        let surface = Shape::Roof.surface(10, 10, 4, 4);
        let layout = Layout::generate(Pattern::Quad, 2, 2, [false; 2]).unwrap();
        let set = PanelSet::new(&surface, &layout).unwrap();
        for prices in [plane_first, even] {
            let prices = PriceList::new(prices);
            for degrees in [40.0, 12.0, 6.0, 3.0] {
                let options = Options {
                    max_kink_deg: Some(degrees),
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
                assert_eq!(found.excess <= 1.0, least.is_finite(), "{degrees}");
                let cost = site.cost(&found.fit);
                let case = format!("{degrees}°: found {cost}, least {least}");
                assert!(found.excess > 1.0 || cost <= least + 1e-9, "{case}");
            }
        }
    }
}
