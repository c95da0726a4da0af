//! The joint seam step: poses and molds together, against kinks and gaps.
//!
//! The fit brings every panel near the design and never looks at its neighbours. Here all poses and
//! all molds move at once to lower the sum of squared gaps and kinks along the seams, while a
//! weaker term keeps them on the design.

use crate::fit::residuals::foot;
use crate::fit::retraction::moved_on;
use crate::fit::state::{EXACT, Fit};
use crate::layout::panels::{PanelSet, SEAM_SAMPLES, Seam};
use crate::pulse::{Pulse, Stop};
use crate::seam::system::{Solution, System};
use crate::seam::unknowns::{SeamOptions, Seams, parts};
use gp_solver::{
    Attempt, ConjugateGradients, DampedModel, DampedOptions, DampedRun, DampingPolicy, Descending,
    Observer, SolverError, Status, Step, Verdict,
};

/// Damping of the first step, a share of the diagonal.
const FIRST_DAMPING: f64 = 1e-2;

/// Seam steps between two of them.
#[derive(Clone, Debug)]
pub(crate) struct SeamRun {
    /// Dampings of every mold and its panels, steps tried, energies.
    pub(crate) steps: DampedRun,
    /// How it ended, once it has.
    pub(crate) status: Option<Status>,
    energy: Energy,
}

impl SeamRun {
    /// Begins at `fit`; `None` if asked to stop.
    pub(crate) fn new(seams: Seams<'_>, fit: &Fit, pulse: &Pulse<'_>) -> Option<Self> {
        assert_eq!(seams.weights.seams.len(), seams.set.seams.len(), "one weight per seam");
        let energy = Energy::new(seams, fit, pulse)?;
        let damping = vec![FIRST_DAMPING; fit.molds.len()];
        let steps = DampedRun::after(damping, 0, vec![energy.total]);
        Some(Self { steps, status: None, energy })
    }

    /// Goes on from a step before; `None` if asked to stop.
    pub(crate) fn resumed(
        seams: Seams<'_>,
        fit: &Fit,
        steps: DampedRun,
        pulse: &Pulse<'_>,
    ) -> Option<Self> {
        Some(Self { steps, ..Self::new(seams, fit, pulse)? })
    }

    /// Takes one step that lowers the energy of `fit`, or sets the status that says why there is
    /// none. The status may come with the last step. An interrupted step changes nothing.
    pub(crate) fn step(
        &mut self,
        seams: Seams<'_>,
        fit: &mut Fit,
        solver: &mut ConjugateGradients,
        pulse: &Pulse<'_>,
    ) {
        let options = DampedOptions {
            max_attempts: seams.options.steps,
            exact: EXACT * seams.set.edges.points.len() as f64,
            stall: seams.options.stall,
        };
        let energy = &self.energy;
        let mut model =
            SeamModel { seams, fit, system: None, energy, solver, pulse, tried: None, taken: None };
        let step = self.steps.step(&mut model, &mut PerMold::default(), &options, &mut Stop(pulse));
        if let Some(taken) = model.taken {
            *fit = taken.fit;
            self.energy = taken.energy;
        }
        self.status = match step {
            Ok(Step::Taken) => None,
            Ok(Step::Ended(status)) => Some(status),
            Err(_) => Some(Status::Stalled),
        };
    }
}

/// A fit linearised for a step of all its poses and molds; every mold with its panels is a group.
struct SeamModel<'m, 'o> {
    seams: Seams<'m>,
    fit: &'m Fit,
    system: Option<System<'m>>,
    energy: &'m Energy,
    solver: &'m mut ConjugateGradients,
    pulse: &'m Pulse<'o>,
    /// The last attempt; none if it was interrupted.
    tried: Option<Tried>,
    /// The attempt that was accepted.
    taken: Option<Tried>,
}

impl Descending for SeamModel<'_, '_> {
    fn energy(&self) -> f64 {
        self.taken.as_ref().map_or(self.energy.total, |taken| taken.energy.total)
    }

    fn linearize(&mut self, _: &mut dyn Observer) -> Result<Result<(), Status>, SolverError> {
        self.system = System::linearize(self.seams, self.fit, self.pulse);
        Ok(self.system.as_ref().map(|_| ()).ok_or(Status::Interrupted))
    }

    fn take(&mut self) {
        self.taken = self.tried.take();
    }
}

/// Where a step leads.
struct Tried {
    fit: Fit,
    energy: Energy,
    promised: Vec<f64>,
    length: f64,
}

impl SeamModel<'_, '_> {
    fn try_step(&mut self, damping: &[f64]) -> Option<Tried> {
        let Solution { step, promised, report } =
            self.system.as_mut()?.solve(damping, self.solver, self.pulse);
        let fit = applied(self.seams.set, self.fit, &step, self.pulse)?;
        let energy = Energy::new(self.seams, &fit, self.pulse)?;
        let (before, cg) = (self.energy.total, report.iterations);
        tracing::debug!(before, energy = energy.total, cg, "seam step");
        let length = step.iter().map(|s| s * s).sum::<f64>().sqrt();
        Some(Tried { fit, energy, promised, length })
    }

    /// What the step that was tried last brings.
    fn attempt_of(&self, tried: &Tried) -> Attempt {
        Attempt {
            predicted: tried.promised.iter().sum(),
            decrease: self.energy.total - tried.energy.total,
            length: tried.length,
        }
    }

    /// A few molds that went astray should not cost the others their step: puts them and their
    /// panels back where they were, if that is better.
    fn put_back(&mut self, astray: &[bool]) {
        let Some(tried) = &mut self.tried else { return };
        let part = without(&tried.fit, self.fit, astray);
        let Some(energy) = Energy::new(self.seams, &part, self.pulse) else { return };
        if !(tried.energy.total <= energy.total) {
            tried.fit = part;
            tried.energy = energy;
        }
    }
}

impl DampedModel for SeamModel<'_, '_> {
    fn attempt(&mut self, damping: &[f64]) -> Result<Attempt, SolverError> {
        self.tried = self.try_step(damping);
        // Interrupted: cannot be judged, and the loop asks the observer before the next attempt.
        let unknown = Attempt { decrease: f64::NAN, ..Attempt::default() };
        Ok(self.tried.as_ref().map_or(unknown, |tried| self.attempt_of(tried)))
    }
}

/// Damps molds that got worse and frees those that got better as promised. One damping for all
/// would let the worst of many molds hold back the rest.
struct PerMold {
    /// How the damping of a mold grows that got worse.
    worse: f64,
    /// Nielsen's rule frees a mold at most by this factor.
    freed: f64,
    least: f64,
    most: f64,
    /// Refused steps in a row after which nothing can be gained.
    tries: usize,
}

impl Default for PerMold {
    fn default() -> Self {
        Self { worse: 8.0, freed: 0.2, least: 1e-8, most: 1e4, tries: 4 }
    }
}

impl PerMold {
    /// Changes the damping of every mold; returns which got worse.
    fn adapt(&self, before: &Energy, tried: &Tried, damping: &mut [f64]) -> Vec<bool> {
        let molds = before.molds.iter().zip(&tried.energy.molds).zip(&tried.promised).zip(damping);
        molds
            .map(|(((before, after), promised), d)| {
                // NaN, a panel beyond the reach of a round mold, counts as worse.
                let is_worse = !(after <= before);
                // Nielsen's rule.
                let gain = ((before - after) / promised).clamp(0.0, 1.0);
                let factor = if is_worse { self.worse } else { 1.0 - (2.0 * gain - 1.0).powi(3) };
                *d = (*d * factor.max(self.freed)).clamp(self.least, self.most);
                is_worse
            })
            .collect()
    }
}

impl DampingPolicy<SeamModel<'_, '_>> for PerMold {
    fn judge(
        &mut self,
        model: &mut SeamModel<'_, '_>,
        _: &Attempt,
        damping: &mut [f64],
    ) -> Verdict {
        let Some(tried) = &model.tried else { return Verdict::Retry };
        let astray = self.adapt(model.energy, tried, damping);
        if astray.contains(&true) {
            model.put_back(&astray);
        }
        let Some(tried) = &model.tried else { return Verdict::Retry };
        let attempt = model.attempt_of(tried);
        self.tries -= 1;
        // NaN is refused too.
        if attempt.decrease > 0.0 {
            Verdict::AcceptChanged(attempt)
        } else if self.tries > 0 {
            Verdict::Retry
        } else {
            Verdict::End(Status::Stalled)
        }
    }

    fn mend(&mut self, _: &mut SeamModel<'_, '_>, _: &mut [f64]) -> Verdict {
        // Conjugate gradients end early where the matrix is not positive definite.
        Verdict::End(Status::Stalled)
    }
}

/// The energy, and the part of it that each mold is to blame for.
#[derive(Clone, Debug)]
pub(crate) struct Energy {
    pub(crate) total: f64,
    molds: Vec<f64>,
}

impl Energy {
    /// `None` if asked to stop.
    pub(crate) fn new(seams: Seams<'_>, fit: &Fit, pulse: &Pulse<'_>) -> Option<Self> {
        let Seams { set, options, weights, .. } = seams;
        let of_seams = pulse.map(set.seams.len(), 64, |s| {
            weights.seams[s] * seam_energy(set, fit, &set.seams[s], options)
        })?;
        let of_panels =
            pulse.map(set.len(), 64, |p| weights.panels[p] * fit.panel_energy(set, p))?;
        let weight = options.design_weight * options.design_weight;
        let total = of_seams.iter().sum::<f64>() + weight * of_panels.iter().sum::<f64>();
        let mut molds = vec![0.0; fit.molds.len()];
        for (seam, energy) in set.seams.iter().zip(&of_seams) {
            seam.panels.iter().for_each(|&p| molds[fit.labels[p]] += 0.5 * energy);
        }
        for (energy, &label) in of_panels.iter().zip(&fit.labels) {
            molds[label] += weight * energy;
        }
        Some(Self { total, molds })
    }
}

/// The trial with some molds and their panels back where they were.
fn without(trial: &Fit, fit: &Fit, molds: &[bool]) -> Fit {
    let mut part = trial.clone();
    for (m, _) in molds.iter().enumerate().filter(|(_, is_out)| **is_out) {
        part.molds[m] = fit.molds[m];
        for &p in &fit.members[m] {
            part.poses[p] = fit.poses[p];
        }
    }
    part
}

fn seam_energy(set: &PanelSet, fit: &Fit, seam: &Seam, options: &SeamOptions) -> f64 {
    let (points, normals) = set.edge_samples(seam.edge);
    let mut sum = 0.0;
    for k in 0..SEAM_SAMPLES {
        let [a, b] = seam.panels.map(|p| {
            let pose = &fit.poses[p];
            let to_local = pose.rotation.transpose();
            let local = to_local * (points[k] - pose.origin);
            let (t, m) = foot(&fit.molds[fit.labels[p]], local, to_local * normals[k]);
            (t, pose.rotation * m)
        });
        let tilt = a.1 - b.1;
        // Only the tangential part counts, as in the rows.
        let along = tilt.dot(normals[k]);
        let (gap, squared) = (a.0 - b.0, tilt.length_squared() - along * along);
        sum += (options.gap_weight * gap).powi(2) + squared;
        if let Some(hinge) = &options.hinge {
            sum += hinge.energy(squared.max(0.0).sqrt(), gap.abs());
        }
    }
    sum
}

fn applied(set: &PanelSet, fit: &Fit, step: &[f64], pulse: &Pulse<'_>) -> Option<Fit> {
    let (poses, molds) = parts(step, set.len());
    let mut trial = fit.clone();
    for (mold, step) in trial.molds.iter_mut().zip(molds) {
        mold.parameters.iter_mut().zip(step).for_each(|(p, s)| *p += s);
    }
    trial.poses = pulse.map(set.len(), 64, |p| {
        let m = fit.labels[p];
        moved_on(set, p, &fit.poses[p], &poses[p], &fit.molds[m], &trial.molds[m])
    })?;
    Some(trial)
}
