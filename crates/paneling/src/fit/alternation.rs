//! Molds and poses improved by turns, then together.

use crate::fit::mold_step::{self, FIRST_DAMPING};
use crate::fit::residuals::{
    POSE, moved, panel_energy, reach, sample_mold_rows, sample_pose_rows, sample_residual,
};
use crate::fit::state::{EXACT, Fit};
use crate::fit::torus_start;
use crate::layout::panels::{PanelSet, Pose};
use crate::mold::shape::{MAX_PARAMETERS, Mold, MoldType};
use crate::pulse::Pulse;
use numerics::{PIVOT_RATIO, add_normal_row, factor_semidefinite, solve_semidefinite};

/// A round that lowers the energy by less than this share ends the alternation.
pub(crate) const STALL: f64 = 1e-2;
/// Rounds that alternate, before molds and poses move together.
const ALTERNATING: usize = 1;
/// Gauss-Newton steps of a registration per round.
const REGISTRATION_STEPS: usize = 2;
/// Damping of a registration, a share of the mean diagonal.
const REGISTRATION_DAMPING: f64 = 1e-4;

/// An alternation between two rounds.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Alternation {
    /// Damping of every mold's next step; `None` where the last one changed too little.
    pub(crate) damping: Vec<Option<f64>>,
    /// Rounds done.
    pub(crate) rounds: usize,
    /// Energy after the last round.
    pub(crate) energy: Option<f64>,
}

impl Alternation {
    pub(crate) fn new(molds: usize) -> Self {
        Self { damping: vec![Some(FIRST_DAMPING); molds], rounds: 0, energy: None }
    }

    /// Rounds in which only some molds move, together with their panels.
    pub(crate) fn of_some(moves: &[bool]) -> Self {
        let damping = moves.iter().map(|moves| moves.then_some(FIRST_DAMPING)).collect();
        Self { damping, rounds: ALTERNATING, energy: None }
    }

    /// One round. The first alternates between molds and poses and tries both half turns of every
    /// panel, the others move every mold together with its panels; the energy never rises. Returns
    /// whether another round is worth while, `None` if asked to stop.
    pub(crate) fn round(
        &mut self,
        set: &PanelSet,
        fit: &mut Fit,
        pulse: &Pulse<'_>,
    ) -> Option<bool> {
        fit.center_tori(set, pulse)?;
        if self.rounds < ALTERNATING {
            fit.refit_molds(set, pulse)?;
            fit.register(set, pulse)?;
        } else {
            fit.step_jointly(set, &mut self.damping, pulse)?;
        }
        let energy = fit.energy();
        let stalled = self.energy.is_some_and(|before| energy > (1.0 - STALL) * before);
        let is_exact = energy <= EXACT * set.samples.points.len() as f64;
        let is_last = is_exact || (stalled && self.rounds > ALTERNATING);
        tracing::debug!(round = self.rounds, energy, "molds and poses");
        self.energy = Some(energy);
        self.rounds += 1;
        Some(!is_last)
    }
}

impl Fit {
    /// Fits molds and poses in at most `rounds` rounds; `None` if asked to stop.
    pub(crate) fn alternate(
        &mut self,
        set: &PanelSet,
        rounds: usize,
        pulse: &Pulse<'_>,
    ) -> Option<()> {
        let mut alternation = Alternation::new(self.molds.len());
        while alternation.rounds < rounds && alternation.round(set, self, pulse)? {}
        Some(())
    }

    /// A step of every mold that still moves, together with its panels. `damping` is `None` where
    /// the last step changed too little.
    fn step_jointly(
        &mut self,
        set: &PanelSet,
        damping: &mut [Option<f64>],
        pulse: &Pulse<'_>,
    ) -> Option<()> {
        let items = damping.iter_mut().collect();
        let moved = pulse.map_molds(&self.members, items, |m, damping: &mut Option<f64>| {
            mold_step::step(set, self, m, damping)
        })?;
        for (m, moved) in moved.into_iter().enumerate() {
            let Some(moved) = moved else { continue };
            self.molds[m] = moved.mold;
            for (&p, (pose, energy)) in self.members[m].iter().zip(moved.panels) {
                self.poses[p] = pose;
                self.energies[p] = energy;
            }
        }
        Some(())
    }

    /// Moves the origins of tori into the middle of their panels where that lowers the energy: the
    /// surface stays, heights and slopes are measured in a better direction.
    fn center_tori(&mut self, set: &PanelSet, pulse: &Pulse<'_>) -> Option<()> {
        let items = vec![(); self.molds.len()];
        let centered = pulse.map_molds(&self.members, items, |m, ()| {
            if self.molds[m].kind != MoldType::Torus {
                return None;
            }
            let members = &self.members[m];
            let (mold, poses) = torus_start::centered(set, members, &self.poses, &self.molds[m])?;
            let energy = |(&p, pose): (&usize, &Pose)| {
                let (points, normals) = set.panel_samples(p);
                panel_energy(&mold, self.slope_weight, pose, points, normals)
            };
            let energies: Vec<f64> = members.iter().zip(&poses).map(energy).collect();
            let before: f64 = members.iter().map(|&p| self.energies[p]).sum();
            // A panel beyond the reach of the torus has no energy; any number is better.
            let is_better = energies.iter().sum::<f64>() <= before || before.is_nan();
            is_better.then_some((mold, poses, energies))
        })?;
        for (m, centered) in centered.into_iter().enumerate() {
            let Some((mold, poses, energies)) = centered else { continue };
            self.molds[m] = mold;
            for ((&p, pose), energy) in self.members[m].iter().zip(poses).zip(energies) {
                self.poses[p] = pose;
                self.energies[p] = energy;
            }
        }
        Some(())
    }

    /// One Gauss-Newton step of every mold's parameters (exact where these are linear).
    fn refit_molds(&mut self, set: &PanelSet, pulse: &Pulse<'_>) -> Option<()> {
        let items = vec![(); self.molds.len()];
        self.molds = pulse.map_molds(&self.members, items, |m, ()| self.refitted(set, m))?;
        self.update_energies(set, pulse)
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
                    add_normal_row(&mut a, &mut b, row, -r);
                }
            }
        }
        for (i, row) in a.iter_mut().enumerate() {
            row[i] *= 1.0 + 1e-9;
        }
        factor_semidefinite(&mut a, PIVOT_RATIO);
        solve_semidefinite(&a, &mut b);
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
    fn register(&mut self, set: &PanelSet, pulse: &Pulse<'_>) -> Option<()> {
        let registered = pulse.map(set.len(), 16, |p| {
            let mold = &self.molds[self.labels[p]];
            let here = (self.poses[p], self.energies[p]);
            let best = self.registered(set, p, mold, here);
            let turned = self.poses[p].turned();
            let (points, normals) = set.panel_samples(p);
            let energy = panel_energy(mold, self.slope_weight, &turned, points, normals);
            let other = self.registered(set, p, mold, (turned, energy));
            if other.1 < best.1 { other } else { best }
        })?;
        for (p, (pose, energy)) in registered.into_iter().enumerate() {
            self.poses[p] = pose;
            self.energies[p] = energy;
        }
        Some(())
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
                    add_normal_row(&mut a, &mut b, row, -r);
                }
            }
            if let Some((r, row)) = reach(mold, to_local * (points[points.len() - 1] - pose.origin))
            {
                add_normal_row(&mut a, &mut b, &row, -r);
            }
            let damping = REGISTRATION_DAMPING * (0..POSE).map(|i| a[i][i]).sum::<f64>() / 6.0;
            for (i, row) in a.iter_mut().enumerate() {
                row[i] += damping;
            }
            factor_semidefinite(&mut a, PIVOT_RATIO);
            solve_semidefinite(&a, &mut b);
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
