//! Shared molds and the panels' poses on them, by alternation.

use crate::fit::clustering::Clusters;
use crate::fit::mold_step::{self, FIRST_DAMPING};
use crate::fit::residuals::{
    POSE, moved, panel_energy, reach, sample_mold_rows, sample_pose_rows, sample_residual,
};
use crate::fit::torus_start::{self, quarter_turn};
use crate::layout::panels::{PanelSet, Pose};
use crate::mold::shape::{MAX_PARAMETERS, Mold, MoldType};
use crate::small::{accumulate, solve_spd};
use rayon::prelude::*;

/// Molds with the panels that are made on them; lengths in units of the panel size.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) molds: Vec<Mold>,
    /// The mold of each panel.
    pub(crate) labels: Vec<usize>,
    /// Pose of the mold's frame for each panel.
    pub(crate) poses: Vec<Pose>,
    /// Panels of each mold, in rising order.
    pub(crate) members: Vec<Vec<usize>>,
    /// Sum of squared residuals of each panel.
    pub(crate) energies: Vec<f64>,
    pub(crate) slope_weight: f64,
}

/// A round that lowers the energy by less than this share ends the alternation.
pub(crate) const STALL: f64 = 1e-2;
/// A mold whose step lowers the energy of its panels by less than this share stays as it is.
const MOLD_STALL: f64 = 1e-3;
/// Rounds that alternate, before molds and poses move together.
const ALTERNATING: usize = 1;
/// Mean squared residual of a sample, in panel sizes and radians, at which a fit is exact for
/// every workshop and nothing is left to improve.
pub(crate) const EXACT: f64 = 1e-22;
/// Gauss-Newton steps of a registration per round.
const REGISTRATION_STEPS: usize = 2;
/// Damping of a registration, a share of the mean diagonal.
const REGISTRATION_DAMPING: f64 = 1e-4;

impl Fit {
    /// Flat molds of the given types, the panels in their principal frames.
    pub(crate) fn new(
        set: &PanelSet,
        clusters: &Clusters,
        kinds: &[MoldType],
        slope_weight: f64,
    ) -> Self {
        let mut members = vec![Vec::new(); clusters.count];
        for (p, &c) in clusters.labels.iter().enumerate() {
            members[c].push(p);
        }
        let mut poses: Vec<Pose> = set
            .frames
            .iter()
            .zip(&clusters.turned)
            .map(|(f, &turned)| if turned { f.turned() } else { *f })
            .collect();
        let molds = members
            .iter()
            .zip(kinds)
            .map(|(panels, &kind)| first_mold(set, panels, kind, slope_weight, &mut poses))
            .collect();
        let mut fit = Self {
            molds,
            labels: clusters.labels.clone(),
            poses,
            members,
            energies: vec![0.0; set.len()],
            slope_weight,
        };
        fit.update_energies(set);
        fit
    }

    pub(crate) fn energy(&self) -> f64 {
        self.energies.iter().sum()
    }

    fn update_energies(&mut self, set: &PanelSet) {
        let energies = (0..set.len()).into_par_iter().map(|p| self.panel_energy(set, p)).collect();
        self.energies = energies;
    }

    pub(crate) fn panel_energy(&self, set: &PanelSet, p: usize) -> f64 {
        let (points, normals) = set.panel_samples(p);
        panel_energy(
            &self.molds[self.labels[p]],
            self.slope_weight,
            &self.poses[p],
            points,
            normals,
        )
    }

    /// Fits molds and poses in at most `rounds` rounds; the energy never rises. The first
    /// alternates between molds and poses and try both half turns of every panel, the others move
    /// every mold together with its panels. Returns the energy after each round.
    pub(crate) fn alternate(&mut self, set: &PanelSet, rounds: usize) -> Vec<f64> {
        let mut history = Vec::new();
        let mut joint = vec![Some(FIRST_DAMPING); self.molds.len()];
        for round in 0..rounds {
            self.center_tori(set);
            if round < ALTERNATING {
                self.refit_molds(set);
                self.register(set);
            } else {
                self.step_jointly(set, &mut joint);
            }
            let energy = self.energy();
            let stalled =
                history.last().is_some_and(|&before: &f64| energy > (1.0 - STALL) * before);
            history.push(energy);
            tracing::debug!(round, energy, "molds and poses");
            let is_exact = energy <= EXACT * set.samples.points.len() as f64;
            if is_exact || (stalled && round > ALTERNATING) {
                break;
            }
        }
        history
    }

    /// A step of every mold that still moves, together with its panels. `damping` is `None` where
    /// the last step changed too little.
    fn step_jointly(&mut self, set: &PanelSet, damping: &mut [Option<f64>]) {
        let moved: Vec<_> = damping
            .par_iter_mut()
            .enumerate()
            .map(|(m, damping)| {
                let step = damping.as_mut().and_then(|d| mold_step::step(set, self, m, d));
                if step.is_none() {
                    *damping = None;
                }
                step
            })
            .collect();
        for (m, moved) in moved.into_iter().enumerate() {
            let Some(moved) = moved else { continue };
            self.molds[m] = moved.mold;
            let (mut before, mut after) = (0.0, 0.0);
            for (&p, (pose, energy)) in self.members[m].iter().zip(moved.panels) {
                before += self.energies[p];
                after += energy;
                self.poses[p] = pose;
                self.energies[p] = energy;
            }
            if after > (1.0 - MOLD_STALL) * before {
                damping[m] = None;
            }
        }
    }

    /// Moves the origins of tori into the middle of their panels where that lowers the energy: the
    /// surface stays, heights and slopes are measured in a better direction.
    fn center_tori(&mut self, set: &PanelSet) {
        let tori = (0..self.molds.len())
            .into_par_iter()
            .filter(|&m| self.molds[m].kind == MoldType::Torus);
        let centered: Vec<_> = tori
            .filter_map(|m| {
                let members = &self.members[m];
                let (mold, poses) =
                    torus_start::centered(set, members, &self.poses, &self.molds[m])?;
                let energy = |(&p, pose): (&usize, &Pose)| {
                    let (points, normals) = set.panel_samples(p);
                    panel_energy(&mold, self.slope_weight, pose, points, normals)
                };
                let energies: Vec<f64> = members.iter().zip(&poses).map(energy).collect();
                let before: f64 = members.iter().map(|&p| self.energies[p]).sum();
                // A panel beyond the reach of the torus has no energy; any number is better.
                let is_better = energies.iter().sum::<f64>() <= before || before.is_nan();
                is_better.then_some((m, mold, poses, energies))
            })
            .collect();
        for (m, mold, poses, energies) in centered {
            self.molds[m] = mold;
            for ((&p, pose), energy) in self.members[m].iter().zip(poses).zip(energies) {
                self.poses[p] = pose;
                self.energies[p] = energy;
            }
        }
    }

    /// Gives a mold another type and starts its panels afresh from their principal frames.
    pub(crate) fn restart(&mut self, set: &PanelSet, m: usize, kind: MoldType) {
        for &p in &self.members[m] {
            self.poses[p] = set.frames[p];
        }
        let panels = &self.members[m];
        self.molds[m] = first_mold(set, panels, kind, self.slope_weight, &mut self.poses);
    }

    /// Splits a mold in two equal ones; `halves` says for each of its panels whether it stays (0)
    /// or moves to the new mold (1).
    pub(crate) fn split(&mut self, m: usize, halves: &[usize]) {
        let fresh = self.molds.len();
        let (stay, leave): (Vec<_>, Vec<_>) =
            self.members[m].iter().zip(halves).partition(|(_, half)| **half == 0);
        let panels = |list: Vec<(&usize, &usize)>| list.into_iter().map(|(p, _)| *p).collect();
        let (stay, leave): (Vec<usize>, Vec<usize>) = (panels(stay), panels(leave));
        for &p in &leave {
            self.labels[p] = fresh;
        }
        self.molds.push(self.molds[m]);
        self.members[m] = stay;
        self.members.push(leave);
    }

    /// One Gauss-Newton step of every mold's parameters (exact where these are linear).
    fn refit_molds(&mut self, set: &PanelSet) {
        let refitted: Vec<Mold> =
            (0..self.molds.len()).into_par_iter().map(|m| self.refitted(set, m)).collect();
        self.molds = refitted;
        self.update_energies(set);
    }

    fn refitted(&self, set: &PanelSet, m: usize) -> Mold {
        let mold = &self.molds[m];
        if mold.kind.parameter_count() == 0 {
            return *mold;
        }
        let (mut a, mut b) = ([[0.0; MAX_PARAMETERS]; MAX_PARAMETERS], [0.0; MAX_PARAMETERS]);
        for &p in &self.members[m] {
            let (points, normals) = set.panel_samples(p);
            let to_local = self.poses[p].rotation.transpose();
            for (x, n) in points.iter().zip(normals) {
                let local = to_local * (*x - self.poses[p].origin);
                let r = sample_residual(mold, self.slope_weight, local, to_local * *n);
                let rows = sample_mold_rows(mold, self.slope_weight, local);
                for (row, r) in rows.iter().zip(r) {
                    accumulate(&mut a, &mut b, row, -r);
                }
            }
        }
        for (i, row) in a.iter_mut().enumerate() {
            row[i] *= 1.0 + 1e-9;
        }
        solve_spd(&mut a, &mut b);
        let mut next = *mold;
        for (p, step) in next.parameters.iter_mut().zip(b) {
            *p += step;
        }
        let energy = |mold: &Mold| {
            let of = |&p: &usize| {
                let (points, normals) = set.panel_samples(p);
                panel_energy(mold, self.slope_weight, &self.poses[p], points, normals)
            };
            self.members[m].iter().map(of).sum::<f64>()
        };
        // Only the round molds are nonlinear, but rounding can spoil a perfect fit as well.
        if energy(&next) <= energy(mold) { next } else { *mold }
    }

    /// Rigid registration of every panel on its mold, of the two half turns the better.
    fn register(&mut self, set: &PanelSet) {
        let registered: Vec<(Pose, f64)> = (0..set.len())
            .into_par_iter()
            .with_min_len(16)
            .map(|p| {
                let mold = &self.molds[self.labels[p]];
                let here = (self.poses[p], self.energies[p]);
                let best = self.registered(set, p, mold, here);
                let turned = self.poses[p].turned();
                let (points, normals) = set.panel_samples(p);
                let energy = panel_energy(mold, self.slope_weight, &turned, points, normals);
                let other = self.registered(set, p, mold, (turned, energy));
                if other.1 < best.1 { other } else { best }
            })
            .collect();
        for (p, (pose, energy)) in registered.into_iter().enumerate() {
            self.poses[p] = pose;
            self.energies[p] = energy;
        }
    }

    /// A few damped Gauss-Newton steps of a panel's pose, taken only if they lower its energy.
    pub(crate) fn registered(
        &self,
        set: &PanelSet,
        p: usize,
        mold: &Mold,
        (mut pose, mut energy): (Pose, f64),
    ) -> (Pose, f64) {
        let (points, normals) = set.panel_samples(p);
        for _ in 0..REGISTRATION_STEPS {
            let (mut a, mut b) = ([[0.0; POSE]; POSE], [0.0; POSE]);
            let to_local = pose.rotation.transpose();
            for (x, n) in points.iter().zip(normals) {
                let local = to_local * (*x - pose.origin);
                let (r, rows) = sample_pose_rows(mold, self.slope_weight, local, to_local * *n);
                for (row, r) in rows.iter().zip(r) {
                    accumulate(&mut a, &mut b, row, -r);
                }
            }
            if let Some((r, row)) = reach(mold, to_local * (points[points.len() - 1] - pose.origin))
            {
                accumulate(&mut a, &mut b, &row, -r);
            }
            let damping = REGISTRATION_DAMPING * (0..POSE).map(|i| a[i][i]).sum::<f64>() / 6.0;
            for (i, row) in a.iter_mut().enumerate() {
                row[i] += damping;
            }
            solve_spd(&mut a, &mut b);
            let next = moved(&pose, &b);
            let next_energy = panel_energy(mold, self.slope_weight, &next, points, normals);
            // Written so that NaN, a panel beyond the reach of a round mold, is refused.
            if !(next_energy < energy) {
                break;
            }
            (pose, energy) = (next, next_energy);
        }
        (pose, energy)
    }
}

/// The mold a cluster starts from; moves the frames of its panels to where the type needs them.
fn first_mold(
    set: &PanelSet,
    panels: &[usize],
    kind: MoldType,
    slope_weight: f64,
    poses: &mut [Pose],
) -> Mold {
    if kind == MoldType::Torus {
        return first_torus(set, panels, slope_weight, poses);
    }
    let mut mold = Mold::flat(kind);
    let n = panels.len() as f64;
    let mean = |f: &dyn Fn(f64, f64) -> f64| {
        panels.iter().map(|&p| f(set.curvatures[p][0], set.curvatures[p][1])).sum::<f64>() / n
    };
    let half = |h: f64, k: f64| (h * h - k).max(0.0).sqrt();
    let k1 = mean(&|h, k| h + half(h, k));
    let k2 = mean(&|h, k| h - half(h, k));
    match kind {
        MoldType::Cylinder => {
            // Frames have the larger curvature along x; the one of larger size is wanted there.
            let turn = k1.abs() < k2.abs();
            mold.parameters[0] = if turn { k2 } else { k1 };
            if turn {
                for &p in panels {
                    poses[p].rotation = quarter_turn(poses[p].rotation);
                }
            }
        }
        MoldType::Sphere => mold.parameters[0] = 0.5 * (k1 + k2),
        MoldType::Plane | MoldType::Paraboloid | MoldType::Torus | MoldType::Cubic => {}
    }
    mold
}

/// The better of two tori, whose parallels run along the one or the other principal direction.
fn first_torus(set: &PanelSet, panels: &[usize], slope_weight: f64, poses: &mut [Pose]) -> Mold {
    let starts = [true, false].map(|is_across| {
        let (mold, own) = torus_start::start(set, panels, slope_weight, is_across);
        let energy = |(&p, pose): (&usize, &Pose)| {
            let (points, normals) = set.panel_samples(p);
            panel_energy(&mold, slope_weight, pose, points, normals)
        };
        let sum: f64 = panels.iter().zip(&own).map(energy).sum();
        (mold, own, sum)
    });
    let [a, b] = starts;
    // NaN, a panel beyond the reach of the torus, loses.
    let (mold, own, _) = if b.2 < a.2 || a.2.is_nan() { b } else { a };
    for (&p, pose) in panels.iter().zip(own) {
        poses[p] = pose;
    }
    mold
}
