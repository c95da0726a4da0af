//! The joint seam step: poses and molds together, against kinks and gaps.
//!
//! The fit brings every panel near the design and never looks at its neighbours. Here all poses and
//! all molds move at once to lower the sum of squared gaps and kinks along the seams, while a
//! weaker term keeps them on the design.

use crate::fit::residuals::foot;
use crate::fit::retraction::moved_on;
use crate::fit::state::{EXACT, Fit};
use crate::layout::panels::{PanelSet, SEAM_SAMPLES, Seam};
use crate::seam::system::{SeamOptions, System, Unknowns};
use rayon::prelude::*;

/// Damping of the first step, a share of the diagonal.
const FIRST_DAMPING: f64 = 1e-2;
const LEAST_DAMPING: f64 = 1e-8;
const MOST_DAMPING: f64 = 1e4;
/// Refused steps in a row after which nothing can be gained.
const TRIES: usize = 4;

/// Lowers kinks and gaps of a fit; returns the energy before and after every accepted step.
///
/// `weights` has one factor per seam for its part of the energy.
pub(crate) fn improve(
    set: &PanelSet,
    fit: &mut Fit,
    options: &SeamOptions,
    weights: &[f64],
) -> Vec<f64> {
    assert_eq!(weights.len(), set.seams.len(), "one weight per seam");
    let incident = set.incident_seams();
    let mut energy = Energy::new(set, fit, options, weights);
    let mut history = vec![energy.total];
    let mut damping = vec![FIRST_DAMPING; fit.molds.len()];
    let mut step = 0;
    let exact = EXACT * set.edges.points.len() as f64;
    while step < options.steps && energy.total > exact {
        let system = System::linearize(set, fit, options, weights, &incident);
        let mut accepted = false;
        // A refused step is tried again with more damping on the same linearisation.
        for _ in 0..TRIES {
            let solution = system.solve(fit, &damping);
            let mut trial = applied(set, fit, &solution.step);
            let mut next = Energy::new(set, &trial, options, weights);
            let worse = energy.adapt(&next, &solution.promised, &mut damping);
            if worse.contains(&true) {
                // A few molds that went astray should not cost the others their step.
                let part = without(&trial, fit, &worse);
                let part_energy = Energy::new(set, &part, options, weights);
                if !(next.total <= part_energy.total) {
                    (trial, next) = (part, part_energy);
                }
            }
            step += 1;
            let (before, cg) = (energy.total, solution.iterations);
            tracing::debug!(step, before, energy = next.total, cg, "seam step");
            accepted = next.total < before;
            if accepted {
                *fit = trial;
                energy = next;
                history.push(energy.total);
                if energy.total > (1.0 - options.stall) * before {
                    step = options.steps;
                }
                break;
            }
        }
        if !accepted {
            break;
        }
    }
    fit.energies = (0..set.len()).into_par_iter().map(|p| fit.panel_energy(set, p)).collect();
    history
}

/// The energy, and the part of it that each mold is to blame for.
struct Energy {
    total: f64,
    molds: Vec<f64>,
}

impl Energy {
    fn new(set: &PanelSet, fit: &Fit, options: &SeamOptions, weights: &[f64]) -> Self {
        let seams: Vec<f64> = set
            .seams
            .par_iter()
            .zip(weights)
            .with_min_len(64)
            .map(|(seam, weight)| weight * seam_energy(set, fit, seam, options.gap_weight))
            .collect();
        let design: Vec<f64> = (0..set.len())
            .into_par_iter()
            .with_min_len(64)
            .map(|p| fit.panel_energy(set, p))
            .collect();
        let weight = options.design_weight * options.design_weight;
        let total = seams.iter().sum::<f64>() + weight * design.iter().sum::<f64>();
        let mut molds = vec![0.0; fit.molds.len()];
        for (seam, energy) in set.seams.iter().zip(&seams) {
            seam.panels.iter().for_each(|&p| molds[fit.labels[p]] += 0.5 * energy);
        }
        for (energy, &label) in design.iter().zip(&fit.labels) {
            molds[label] += weight * energy;
        }
        Self { total, molds }
    }

    /// Damps molds that got worse and frees those that got better as promised; returns which got
    /// worse. One damping for all would let the worst of many molds hold back the rest.
    fn adapt(&self, next: &Self, promised: &[f64], damping: &mut [f64]) -> Vec<bool> {
        let molds = self.molds.iter().zip(&next.molds).zip(promised).zip(damping);
        molds
            .map(|(((before, after), promised), d)| {
                // NaN, a panel beyond the reach of a round mold, counts as worse.
                let is_worse = !(after <= before);
                // Nielsen's rule.
                let gain = ((before - after) / promised).clamp(0.0, 1.0);
                let factor = if is_worse { 8.0 } else { 1.0 - (2.0 * gain - 1.0).powi(3) };
                *d = (*d * factor.max(0.2)).clamp(LEAST_DAMPING, MOST_DAMPING);
                is_worse
            })
            .collect()
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

fn seam_energy(set: &PanelSet, fit: &Fit, seam: &Seam, gap_weight: f64) -> f64 {
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
        let gap = gap_weight * (a.0 - b.0);
        sum += gap * gap + tilt.length_squared() - along * along;
    }
    sum
}

fn applied(set: &PanelSet, fit: &Fit, change: &Unknowns) -> Fit {
    let mut trial = fit.clone();
    for (mold, step) in trial.molds.iter_mut().zip(&change.molds) {
        mold.parameters.iter_mut().zip(step).for_each(|(p, s)| *p += s);
    }
    trial.poses = (0..set.len())
        .into_par_iter()
        .with_min_len(64)
        .map(|p| {
            let m = fit.labels[p];
            moved_on(set, p, &fit.poses[p], &change.poses[p], &fit.molds[m], &trial.molds[m])
        })
        .collect();
    trial
}
