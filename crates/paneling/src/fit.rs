//! Shared molds and the panels' poses on them, by alternation.

use crate::clustering::Clusters;
use crate::mold::{MAX_PARAMETERS, Mold, MoldType};
use crate::panels::{PanelSet, Pose};
use crate::residuals::{
    POSE, moved, panel_energy, sample_mold_rows, sample_pose_rows, sample_residual,
};
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
pub(crate) const STALL: f64 = 2e-3;
/// Mean squared residual of a sample, in panel sizes and radians, at which a fit is exact to
/// rounding and nothing is left to improve.
pub(crate) const EXACT: f64 = 1e-28;
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
            .map(|(panels, &kind)| first_mold(set, panels, kind, &mut poses))
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

    /// Alternates between molds and poses for at most `rounds` rounds; the energy never rises.
    /// Returns the energy after each round.
    pub(crate) fn alternate(&mut self, set: &PanelSet, rounds: usize) -> Vec<f64> {
        let mut history = Vec::new();
        for round in 0..rounds {
            self.refit_molds(set);
            self.register(set, round < 2);
            let energy = self.energy();
            let stalled =
                history.last().is_some_and(|&before: &f64| energy > (1.0 - STALL) * before);
            history.push(energy);
            let is_exact = energy <= EXACT * set.samples.points.len() as f64;
            if is_exact || (stalled && round > 2) {
                break;
            }
        }
        history
    }

    /// Gives a mold another type and starts its panels afresh from their principal frames.
    pub(crate) fn restart(&mut self, set: &PanelSet, m: usize, kind: MoldType) {
        for &p in &self.members[m] {
            self.poses[p] = set.frames[p];
        }
        self.molds[m] = first_mold(set, &self.members[m], kind, &mut self.poses);
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

    /// Rigid registration of every panel on its mold.
    fn register(&mut self, set: &PanelSet, try_turned: bool) {
        let registered: Vec<(Pose, f64)> = (0..set.len())
            .into_par_iter()
            .with_min_len(16)
            .map(|p| {
                let mold = &self.molds[self.labels[p]];
                let here = (self.poses[p], self.energies[p]);
                let best = self.registered(set, p, mold, here);
                if !try_turned {
                    return best;
                }
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

/// The mold a cluster starts from; turns the frames of its panels where the type needs its axes
/// in a certain order.
fn first_mold(set: &PanelSet, panels: &[usize], kind: MoldType, poses: &mut [Pose]) -> Mold {
    let mut mold = Mold::flat(kind);
    let n = panels.len() as f64;
    let mean = |f: &dyn Fn(f64, f64) -> f64| {
        panels.iter().map(|&p| f(set.curvatures[p][0], set.curvatures[p][1])).sum::<f64>() / n
    };
    let half = |h: f64, k: f64| (h * h - k).max(0.0).sqrt();
    let k1 = mean(&|h, k| h + half(h, k));
    let k2 = mean(&|h, k| h - half(h, k));
    // Frames have the larger curvature along x. A cylinder wants the one of larger size there,
    // a torus along y, where its generating circle is.
    let x_has_larger_size = k1.abs() >= k2.abs();
    let turn = match kind {
        MoldType::Cylinder => !x_has_larger_size,
        MoldType::Torus => x_has_larger_size,
        _ => false,
    };
    let (along_x, along_y) = if turn { (k2, k1) } else { (k1, k2) };
    match kind {
        MoldType::Cylinder => mold.parameters[0] = along_x,
        MoldType::Sphere => mold.parameters[0] = 0.5 * (k1 + k2),
        MoldType::Torus => {
            mold.parameters[0] = along_x;
            mold.parameters[1] = along_y;
        }
        MoldType::Plane | MoldType::Paraboloid | MoldType::Cubic => {}
    }
    if turn {
        for &p in panels {
            let r = poses[p].rotation;
            poses[p].rotation = glam::DMat3::from_cols(r.y_axis, -r.x_axis, r.z_axis);
        }
    }
    mold
}
