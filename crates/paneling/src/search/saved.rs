//! Attempts and what they have come to, in checkpoints.
//!
//! Numbers that may be infinite or NaN, and vectors whose length is not known beforehand, are kept
//! bit by bit among the counts.

use crate::fit::alternation::Alternation;
use crate::fit::state::{Fit, members_of};
use crate::layout::panels::Pose;
use crate::mold::shape::{MAX_PARAMETERS, Mold, MoldType};
use crate::pulse::Pulse;
use crate::seam::step::SeamRun;
use crate::seam::unknowns::Weights;
use crate::search::attempt::{Attempt, Found, Phase, Weighing};
use crate::search::bounds::Excess;
use crate::search::site::Site;
use glam::{DMat3, DVec3};
use gp_solver::{Checkpoint, DampedRun, SolverError, Status};

/// How seam steps end.
const ENDS: [Status; 3] = [Status::Converged, Status::Stalled, Status::IterationLimit];
/// Numbers of a pose.
const POSE_NUMBERS: usize = 12;

fn damaged(name: &str) -> SolverError {
    SolverError::ForeignCheckpoint {
        what: format!("a run of another size, or its {name} is damaged"),
    }
}

/// Adds numbers bit by bit.
pub(crate) fn put_bits(to: Checkpoint, name: &str, values: &[f64]) -> Checkpoint {
    let bits: Vec<u64> = values.iter().map(|v| v.to_bits()).collect();
    to.with_counts(name, &bits)
}

/// The numbers [`put_bits`] has added.
pub(crate) fn bits(of: &Checkpoint, name: &str) -> Result<Vec<f64>, SolverError> {
    Ok(of.counts(name)?.iter().map(|b| f64::from_bits(*b)).collect())
}

/// As [`bits`], if there are so many.
fn some_bits(of: &Checkpoint, name: &str, count: usize) -> Result<Vec<f64>, SolverError> {
    let values = bits(of, name)?;
    if values.len() == count { Ok(values) } else { Err(damaged(name)) }
}

/// As many counts as an array has.
pub(crate) fn counts<const N: usize>(
    of: &Checkpoint,
    name: &str,
) -> Result<[usize; N], SolverError> {
    let counts: [u64; N] = of.counts(name)?.try_into().map_err(|_| damaged(name))?;
    Ok(counts.map(|c| c as usize))
}

fn put_fit(to: Checkpoint, name: &str, fit: &Fit) -> Checkpoint {
    let kinds: Vec<u64> = fit.molds.iter().map(|m| m.kind as u64).collect();
    let labels: Vec<u64> = fit.labels.iter().map(|&m| m as u64).collect();
    let parameters: Vec<f64> = fit.molds.iter().flat_map(|m| m.parameters).collect();
    let poses = fit.poses.iter().flat_map(|p| {
        let rotation = p.rotation.to_cols_array();
        p.origin.to_array().into_iter().chain(rotation)
    });
    let poses: Vec<f64> = poses.collect();
    let to = to
        .with_counts(&format!("{name} types"), &kinds)
        .with_counts(&format!("{name} labels"), &labels)
        .with_numbers(&format!("{name} parameters"), &parameters)
        .with_numbers(&format!("{name} poses"), &poses);
    put_bits(to, &format!("{name} energies"), &fit.energies)
}

fn fit(of: &Checkpoint, name: &str, site: &Site<'_>) -> Result<Fit, SolverError> {
    let panels = site.set.len();
    let (types, places) = (format!("{name} types"), format!("{name} labels"));
    let kind = |&k: &u64| MoldType::ALL.get(k as usize).copied().ok_or_else(|| damaged(&types));
    let kinds: Vec<MoldType> = of.counts(&types)?.iter().map(kind).collect::<Result<_, _>>()?;
    let labels: Vec<usize> = of.counts(&places)?.iter().map(|&m| m as usize).collect();
    if labels.len() != panels || labels.iter().any(|&m| m >= kinds.len()) {
        return Err(damaged(&places));
    }
    let parameters =
        of.numbers(&format!("{name} parameters"), MAX_PARAMETERS * kinds.len())?.as_chunks().0;
    let poses = of.numbers(&format!("{name} poses"), POSE_NUMBERS * panels)?;
    let pose = |n: &[f64; POSE_NUMBERS]| {
        let rotation = DMat3::from_cols_slice(&n[3..]);
        Pose { origin: DVec3::from_slice(&n[..3]), rotation }
    };
    Ok(Fit {
        molds: kinds
            .iter()
            .zip(parameters)
            .map(|(&kind, &p)| Mold { kind, parameters: p })
            .collect(),
        members: members_of(&labels, kinds.len()),
        labels,
        poses: poses.as_chunks().0.iter().map(pose).collect(),
        energies: some_bits(of, &format!("{name} energies"), panels)?,
        slope_weight: site.options.slope_weight,
    })
}

fn put_weights(to: Checkpoint, name: &str, weights: &Weights) -> Checkpoint {
    let to = put_bits(to, &format!("{name}seam weights"), &weights.seams);
    put_bits(to, &format!("{name}panel weights"), &weights.panels)
}

fn weights(of: &Checkpoint, name: &str, site: &Site<'_>) -> Result<Weights, SolverError> {
    Ok(Weights {
        seams: some_bits(of, &format!("{name}seam weights"), site.set.seams.len())?,
        panels: some_bits(of, &format!("{name}panel weights"), site.set.len())?,
    })
}

/// Adds what an attempt has come to.
pub(crate) fn put_found(to: Checkpoint, name: &str, found: &Found) -> Checkpoint {
    let to = put_fit(to, name, &found.fit);
    let to = put_bits(to, &format!("{name} rounds"), &found.fit_history);
    let to = put_bits(to, &format!("{name} steps"), &found.seam_history);
    let Excess { seams, design } = found.excess;
    let to = put_bits(to, &format!("{name} sizes"), &[found.start, seams, design]);
    let to = put_weights(to, &format!("{name} "), &found.weights);
    let status = ENDS.iter().position(|s| *s == found.seams).unwrap_or(0);
    to.with_counts(&format!("{name} end"), &[status as u64])
}

/// What [`put_found`] has added, if there is anything of this name.
pub(crate) fn found(
    of: &Checkpoint,
    name: &str,
    site: &Site<'_>,
) -> Result<Option<Found>, SolverError> {
    let end = format!("{name} end");
    if !of.counts.contains_key(&end) {
        return Ok(None);
    }
    let sizes = some_bits(of, &format!("{name} sizes"), 3)?;
    Ok(Some(Found {
        fit: fit(of, name, site)?,
        fit_history: bits(of, &format!("{name} rounds"))?,
        seam_history: bits(of, &format!("{name} steps"))?,
        seams: *ENDS.get(counts::<1>(of, &end)?[0]).ok_or_else(|| damaged(&end))?,
        start: sizes[0],
        excess: Excess { seams: sizes[1], design: sizes[2] },
        weights: weights(of, &format!("{name} "), site)?,
    }))
}

/// Adds an attempt.
pub(crate) fn put_attempt(to: Checkpoint, attempt: &Attempt) -> Checkpoint {
    let to = put_fit(to, "fit", &attempt.fit);
    let to = put_weights(to, "", &attempt.weights);
    let to = put_bits(to, "rounds", &attempt.fit_history);
    let Weighing { rounds, idle, first, least } = attempt.weighing;
    let to = put_bits(to, "sizes", &[attempt.start, first, least]);
    let to = to.with_counts("weighing", &[rounds as u64, idle as u64]);
    let to = match &attempt.best {
        Some(found) => put_found(to, "best of the attempt", found),
        None => to,
    };
    let (kind, done, most) = match &attempt.phase {
        Phase::Rounds(alternation, most) => (0, alternation.rounds, *most),
        Phase::Seams(run) => (1, run.steps.attempts(), 0),
        Phase::General(..) => (2, 0, 0),
        Phase::Done => (3, 0, 0),
    };
    let place = [kind, done, most, attempt.round, attempt.steps].map(|n| n as u64);
    let to = to.with_counts("place", &place);
    match &attempt.phase {
        Phase::Rounds(Alternation { damping, energy, .. }, _) => {
            // No damping, as no energy, is NaN.
            let damping: Vec<f64> = damping.iter().map(|d| d.unwrap_or(f64::NAN)).collect();
            let to = put_bits(to, "dampings", &damping);
            put_bits(to, "energy", energy.as_slice())
        }
        Phase::Seams(run) => {
            put_bits(put_bits(to, "dampings", run.steps.damping()), "energy", run.steps.history())
        }
        Phase::General(history, _) => put_bits(to, "general", history),
        Phase::Done => to,
    }
}

/// The attempt [`put_attempt`] has added, if there is one; `None` inside if asked to stop. `towards`
/// bounds or not, as of [`Site::seams`].
pub(crate) fn attempt(
    of: &Checkpoint,
    site: &Site<'_>,
    towards: bool,
    pulse: &Pulse<'_>,
) -> Result<Option<Option<Attempt>>, SolverError> {
    if !of.counts.contains_key("place") {
        return Ok(None);
    }
    let [kind, done, most, round, steps] = counts(of, "place")?;
    let fit = fit(of, "fit", site)?;
    let weights = weights(of, "", site)?;
    let phase = match kind {
        0 => {
            let damping = some_bits(of, "dampings", fit.molds.len())?;
            let damping = damping.into_iter().map(|d| (!d.is_nan()).then_some(d)).collect();
            let energy = bits(of, "energy")?.first().copied();
            Phase::Rounds(Alternation { damping, rounds: done, energy }, most)
        }
        1 => {
            let damping = some_bits(of, "dampings", fit.molds.len())?;
            let state = DampedRun::after(damping, done, bits(of, "energy")?);
            let run = SeamRun::resumed(site.seams(&weights, towards), &fit, state, pulse);
            let Some(run) = run else { return Ok(Some(None)) };
            Phase::Seams(run)
        }
        2 => Phase::General(bits(of, "general")?, of.numbers.contains_key("x").then(|| of.clone())),
        3 => Phase::Done,
        _ => return Err(damaged("place")),
    };
    let sizes = some_bits(of, "sizes", 3)?;
    let [rounds, idle] = counts(of, "weighing")?;
    Ok(Some(Some(Attempt {
        phase,
        fit,
        weights,
        start: sizes[0],
        weighing: Weighing { rounds, idle, first: sizes[1], least: sizes[2] },
        fit_history: bits(of, "rounds")?,
        round,
        steps,
        best: found(of, "best of the attempt", site)?,
    })))
}
