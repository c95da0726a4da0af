//! One attempt: molds and poses fitted, seams closed, and under bounds mended until they keep them.
//!
//! The joint seam step weighs the seams that were beyond the bounds more; once that does not help,
//! molds at such seams get a more general type or, where there is none, are split in two.

use crate::error::Error;
use crate::fit::alternation::Alternation;
use crate::fit::clustering::Feature;
use crate::fit::state::Fit;
use crate::pulse::Pulse;
use crate::seam::general::{SeamProblem, take};
use crate::seam::measure::measure;
use crate::seam::step::SeamRun;
use crate::seam::unknowns::Weights;
use crate::search::bounds::{Bounds, Excess};
use crate::search::mending::{SHORT_ALTERNATION, mend, weigh};
use crate::search::site::Site;
use gp_solver::{Checkpoint, ConjugateGradients, Extra, Observer, Progress, Stage, Status};
use std::ops::ControlFlow;

/// Most rounds of mending.
pub(crate) const MENDING_ROUNDS: usize = 24;
/// Rounds of weighing seams in a row that do not lower the worst excess by this share, after which
/// molds change; so they do once rounds like those so far would not be enough.
const IDLE: usize = 4;
const WEIGHING_STALL: f64 = 0.003;
/// The same, of one round, where molds may be split.
const SPLIT_STALL: f64 = 0.1;

/// What an attempt has come to.
#[derive(Clone, Debug)]
pub(crate) struct Found {
    pub(crate) fit: Fit,
    /// Energy of the fit before its first round.
    pub(crate) start: f64,
    /// Energy after each round of the alternation.
    pub(crate) fit_history: Vec<f64>,
    /// Energy of the joint seam step at its start and after each step.
    pub(crate) seam_history: Vec<f64>,
    /// How the seam steps ended.
    pub(crate) seams: Status,
    /// How many times the bounds are exceeded.
    pub(crate) excess: Excess,
    /// What seams and panels weighed in the last seam step.
    pub(crate) weights: Weights,
}

impl Found {
    /// A fit before any round or step.
    pub(crate) fn bare(site: &Site<'_>, fit: Fit) -> Self {
        Self {
            fit,
            weights: Weights::even(&site.set),
            start: 0.0,
            fit_history: Vec::new(),
            seam_history: Vec::new(),
            seams: Status::Interrupted,
            excess: Excess::UNKNOWN,
        }
    }
}

/// What an attempt does next.
#[derive(Clone, Debug)]
pub(crate) enum Phase {
    /// A round of the alternation, of at most so many.
    Rounds(Alternation, usize),
    /// A seam step.
    Seams(SeamRun),
    /// All seam steps of a problem with blocks of the caller's; the energies so far, and where to
    /// go on from.
    General(Vec<f64>, Option<Checkpoint>),
    /// Nothing.
    Done,
}

/// An attempt between two steps.
#[derive(Clone, Debug)]
pub(crate) struct Attempt {
    pub(crate) fit: Fit,
    pub(crate) start: f64,
    pub(crate) weights: Weights,
    pub(crate) fit_history: Vec<f64>,
    pub(crate) phase: Phase,
    /// Rounds of mending.
    pub(crate) round: usize,
    pub(crate) weighing: Weighing,
    pub(crate) best: Option<Found>,
    /// Rounds and steps done.
    pub(crate) steps: usize,
}

/// What the steps of an attempt need besides.
pub(crate) struct Setting<'s, 'o, 'e> {
    pub(crate) site: &'s Site<'s>,
    /// Of this attempt; none where it is to take the molds as they are.
    pub(crate) bounds: Option<Bounds>,
    pub(crate) features: &'s [Feature],
    /// An attempt that costs as much is given up.
    pub(crate) limit: f64,
    /// How far beyond the bounds an attempt may be to be mended.
    pub(crate) mendable: f64,
    /// Most rounds of weighing and mending.
    pub(crate) rounds: usize,
    /// Most rounds and steps before the last mending.
    pub(crate) steps: usize,
    /// Whether mending may make more molds.
    pub(crate) may_split: bool,
    pub(crate) pulse: &'s Pulse<'o>,
    pub(crate) extra: Option<&'s mut Extra<'e, Error>>,
    /// The stage seam steps belong to.
    pub(crate) stage: Stage,
}

impl Attempt {
    pub(crate) fn new(site: &Site<'_>, fit: Fit) -> Self {
        let alternation = Alternation::new(fit.molds.len());
        Self {
            start: fit.energy(),
            fit,
            weights: Weights::even(&site.set),
            fit_history: Vec::new(),
            phase: Phase::Rounds(alternation, site.options.rounds),
            round: 0,
            weighing: Weighing::default(),
            best: None,
            steps: 0,
        }
    }

    /// Goes on from a fit of which only some molds have changed, with the weights of before.
    pub(crate) fn warm(fit: Fit, has_changed: &[bool], weights: Weights) -> Self {
        let alternation = Alternation::of_some(has_changed);
        Self {
            start: fit.energy(),
            fit,
            weights,
            fit_history: Vec::new(),
            phase: Phase::Rounds(alternation, SHORT_ALTERNATION),
            round: 0,
            weighing: Weighing::default(),
            best: None,
            steps: 0,
        }
    }

    /// The energy that is being lowered.
    pub(crate) fn energy(&self) -> f64 {
        match &self.phase {
            Phase::Seams(run) => *run.steps.history().last().unwrap_or(&f64::NAN),
            Phase::General(history, _) => *history.last().unwrap_or(&f64::NAN),
            Phase::Rounds(..) | Phase::Done => *self.fit_history.last().unwrap_or(&self.start),
        }
    }

    /// The best so far, or what there is.
    pub(crate) fn into_found(self, site: &Site<'_>) -> Found {
        let Self { fit, start, fit_history, .. } = self;
        match self.best {
            Some(best) => Found { start, fit_history, ..best },
            None => Found { start, fit_history, ..Found::bare(site, fit) },
        }
    }

    /// Does one round or one step and what follows from it; `None` if asked to stop. `save` adds
    /// the state of the run around the attempt to a checkpoint.
    pub(crate) fn advance(
        &mut self,
        solver: &mut ConjugateGradients,
        setting: &mut Setting<'_, '_, '_>,
        save: &dyn Fn(&Self) -> Checkpoint,
    ) -> Result<Option<()>, Error> {
        let (site, pulse) = (setting.site, setting.pulse);
        match &mut self.phase {
            Phase::Rounds(alternation, most) => {
                if alternation.rounds < *most {
                    let Some(go_on) = alternation.round(&site.set, &mut self.fit, pulse) else {
                        return Ok(None);
                    };
                    self.fit_history.extend(alternation.energy);
                    self.steps += 1;
                    if go_on && alternation.rounds < *most {
                        return Ok(Some(()));
                    }
                }
                self.begin_seams(setting)
            }
            Phase::Seams(run) => {
                let taken = run.steps.history().len();
                run.step(
                    site.seams(&self.weights, setting.bounds.is_some()),
                    &mut self.fit,
                    solver,
                    pulse,
                );
                self.steps += run.steps.history().len() - taken;
                match run.status {
                    // Within the bounds nothing more is asked for.
                    None => match setting.bounds {
                        Some(bounds) if self.judged(&bounds, site).is_within() => {
                            let history = run_history(&self.phase);
                            Ok(self.end_seams(history, Status::Converged, setting))
                        }
                        _ => Ok(Some(())),
                    },
                    Some(Status::Interrupted) => Ok(None),
                    Some(status) => {
                        let history = run.steps.history().to_vec();
                        Ok(self.end_seams(history, status, setting))
                    }
                }
            }
            Phase::General(..) => self.solve_with_extra(setting, save),
            Phase::Done => Ok(Some(())),
        }
    }

    fn judged(&self, bounds: &Bounds, site: &Site<'_>) -> Excess {
        let Fit { molds, labels, poses, .. } = &self.fit;
        bounds.judge(&measure(&site.set, molds, labels, poses))
    }

    fn begin_seams(&mut self, setting: &mut Setting<'_, '_, '_>) -> Result<Option<()>, Error> {
        let site = setting.site;
        if site.seam.steps == 0 {
            return Ok(self.end_seams(Vec::new(), Status::Converged, setting));
        }
        let seams = site.seams(&self.weights, setting.bounds.is_some());
        if let Some(extra) = setting.extra.as_deref_mut()
            && SeamProblem::new(seams, &self.fit)?.extend(&setting.stage, extra)?
        {
            self.phase = Phase::General(Vec::new(), None);
            return Ok(Some(()));
        }
        let Some(run) = SeamRun::new(seams, &self.fit, setting.pulse) else { return Ok(None) };
        if let Some(bounds) = setting.bounds {
            // Seam steps may leave the design where the bounds cannot be met.
            let excess = self.judged(&bounds, site);
            if self.best.as_ref().is_none_or(|b| excess.is_less(&b.excess)) {
                let weights = self.weights.clone();
                self.best = Some(Found { excess, weights, ..Found::bare(site, self.fit.clone()) });
            }
        }
        self.phase = Phase::Seams(run);
        Ok(Some(()))
    }

    /// The general path: a run of the solver on the problem with the caller's blocks.
    fn solve_with_extra(
        &mut self,
        setting: &mut Setting<'_, '_, '_>,
        save: &dyn Fn(&Self) -> Checkpoint,
    ) -> Result<Option<()>, Error> {
        let Phase::General(history, resumed) = &mut self.phase else { return Ok(Some(())) };
        let (mut history, resumed) = (std::mem::take(history), resumed.take());
        let seams = setting.site.seams(&self.weights, false);
        let mut problem = SeamProblem::new(seams, &self.fit)?;
        if let Some(extra) = setting.extra.as_deref_mut() {
            problem.extend(&setting.stage, extra)?;
        }
        let (mut run, assembly) = problem.run(seams)?;
        if let Some(checkpoint) = resumed {
            run.resume(&checkpoint)?;
        }
        let mut watch = Watch { pulse: setting.pulse, attempt: self, save, history: &mut history };
        let status = run.go_on(&setting.stage, &mut watch)?;
        take(&assembly, run.x(), &mut self.fit);
        if status == Status::Interrupted {
            return Ok(None);
        }
        self.steps += history.len().saturating_sub(1);
        Ok(self.end_seams(history, status, setting))
    }

    /// Measures the result of a seam step against the bounds, and decides what follows.
    fn end_seams(
        &mut self,
        seam_history: Vec<f64>,
        status: Status,
        setting: &Setting<'_, '_, '_>,
    ) -> Option<()> {
        let Setting { site, pulse, .. } = *setting;
        self.fit.update_energies(&site.set, pulse)?;
        let (start, fit_history) = (self.start, Vec::new());
        let weights = self.weights.clone();
        let found = |fit: &Fit, excess| {
            let fit = fit.clone();
            Found { fit, start, fit_history, seam_history, seams: status, excess, weights }
        };
        let Some(bounds) = setting.bounds else {
            self.best = Some(found(&self.fit, Excess::NONE));
            self.phase = Phase::Done;
            return Some(());
        };
        let measures = measure(&site.set, &self.fit.molds, &self.fit.labels, &self.fit.poses);
        let excess = bounds.judge(&measures);
        if self.best.as_ref().is_none_or(|b| excess.is_less(&b.excess)) {
            self.best = Some(found(&self.fit, excess));
        }
        let is_spent = self.round >= setting.rounds
            || self.steps >= setting.steps
            || site.cost(&self.fit) >= setting.limit;
        let worst = excess.worst();
        if excess.is_within() || is_spent || worst > setting.mendable {
            self.phase = Phase::Done;
            return Some(());
        }
        weigh(&bounds, &measures, &mut self.weights);
        let rounds = setting.rounds.saturating_sub(self.round);
        let is_hopeful = self.weighing.goes_on(worst, rounds, setting.may_split);
        // Without a mending no round is left to do, and the seam step follows at once.
        self.phase = Phase::Rounds(Alternation::new(self.fit.molds.len()), 0);
        if !is_hopeful || site.seam.steps == 0 {
            let (features, may_split) = (setting.features, setting.may_split);
            let changed =
                mend(site, &bounds, &mut self.fit, &measures, features, may_split, pulse)?;
            if !changed.contains(&true) {
                if self.weighing.idle >= IDLE || site.seam.steps == 0 {
                    self.phase = Phase::Done;
                }
                self.round += 1;
                return Some(());
            }
            let rounds = if setting.may_split {
                Alternation::new(changed.len())
            } else {
                Alternation::of_some(&changed)
            };
            self.phase = Phase::Rounds(rounds, SHORT_ALTERNATION);
            self.weighing = Weighing::default();
        }
        self.round += 1;
        Some(())
    }
}

/// How weighing the seams has gone since molds have last changed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Weighing {
    pub(crate) rounds: usize,
    /// Rounds since the least excess.
    pub(crate) idle: usize,
    /// The first excess, and the least.
    pub(crate) first: f64,
    pub(crate) least: f64,
}

impl Default for Weighing {
    fn default() -> Self {
        Self { rounds: 0, idle: 0, first: f64::INFINITY, least: f64::INFINITY }
    }
}

impl Weighing {
    /// Takes an excess down, and says whether another of at most so many rounds is worth while.
    fn goes_on(&mut self, excess: f64, rounds_left: usize, may_split: bool) -> bool {
        let (stall, most) = if may_split { (SPLIT_STALL, 1) } else { (WEIGHING_STALL, IDLE) };
        if self.rounds == 0 {
            self.first = excess;
        }
        if excess < (1.0 - stall) * self.least {
            self.least = excess;
            self.idle = 0;
        } else {
            self.idle += 1;
        }
        self.rounds += 1;
        let (rounds, left) = (self.rounds as f64 - 1.0, rounds_left as f64);
        let gain = self.least / self.first;
        let goal = self.least * gain.powf(left / rounds.max(1.0));
        self.idle < most && (rounds < 2.0 || goal <= 1.0)
    }
}

/// Energies of the seam steps of a phase.
fn run_history(phase: &Phase) -> Vec<f64> {
    match phase {
        Phase::Seams(run) => run.steps.history().to_vec(),
        Phase::Rounds(..) | Phase::General(..) | Phase::Done => Vec::new(),
    }
}

/// Shows the general path to the observer of the run.
struct Watch<'w, 'o> {
    pulse: &'w Pulse<'o>,
    attempt: &'w Attempt,
    save: &'w dyn Fn(&Attempt) -> Checkpoint,
    /// Energies in the scale of the matrix-free system, which is twice that of the solver.
    history: &'w mut Vec<f64>,
}

impl Observer for Watch<'_, '_> {
    fn step(&mut self, progress: &Progress<'_>) -> ControlFlow<()> {
        // A resumed run shows the step once more that it begins with.
        if progress.iteration >= self.history.len() {
            self.history.push(2.0 * progress.energy);
        }
        self.pulse.show(progress);
        if self.pulse.is_stopped() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn stop_requested(&mut self) -> bool {
        self.pulse.is_stopped()
    }

    fn checkpoint(&mut self, state: &dyn Fn() -> Checkpoint) {
        self.pulse.offer(&|| {
            let mut all = (self.save)(self.attempt);
            let run = state();
            all.numbers.extend(run.numbers);
            let history: Vec<u64> = self.history.iter().map(|e| e.to_bits()).collect();
            Checkpoint { iteration: run.iteration, ..all.with_counts("general", &history) }
        });
    }
}
