//! Shared molds and the panels' poses on them.

use crate::fit::clustering::Clusters;
use crate::fit::residuals::panel_energy;
use crate::fit::torus_start::{self, quarter_turn};
use crate::layout::panels::{PanelSet, Pose};
use crate::mold::shape::{Mold, MoldType};
use crate::pulse::Pulse;

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

/// Mean squared residual of a sample, in panel sizes and radians, at which a fit is exact for
/// every workshop and nothing is left to improve.
pub(crate) const EXACT: f64 = 1e-22;

impl Fit {
    /// First molds of the given types, the panels in their principal frames; `None` if asked to
    /// stop.
    pub(crate) fn new(
        set: &PanelSet,
        clusters: &Clusters,
        kinds: &[MoldType],
        slope_weight: f64,
        pulse: &Pulse<'_>,
    ) -> Option<Self> {
        let members = members_of(&clusters.labels, clusters.count);
        let mut poses: Vec<Pose> = set
            .frames
            .iter()
            .zip(&clusters.turned)
            .map(|(f, &turned)| if turned { f.turned() } else { *f })
            .collect();
        let first = pulse.map_molds(&members, kinds.to_vec(), |m, kind| {
            let own = members[m].iter().map(|&p| poses[p]).collect();
            first_mold(set, &members[m], kind, slope_weight, own)
        })?;
        let mut molds = Vec::with_capacity(clusters.count);
        for ((mold, own), panels) in first.into_iter().zip(&members) {
            molds.push(mold);
            panels.iter().zip(own).for_each(|(&p, pose)| poses[p] = pose);
        }
        let mut fit = Self {
            molds,
            labels: clusters.labels.clone(),
            poses,
            members,
            energies: vec![0.0; set.len()],
            slope_weight,
        };
        fit.update_energies(set, pulse)?;
        Some(fit)
    }

    /// Every panel in its principal frame on one flat mold: what there is before any fit.
    pub(crate) fn flat(set: &PanelSet, kind: MoldType, slope_weight: f64) -> Self {
        Self {
            molds: vec![Mold::flat(kind)],
            labels: vec![0; set.len()],
            poses: set.frames.clone(),
            members: vec![(0..set.len()).collect()],
            energies: vec![0.0; set.len()],
            slope_weight,
        }
    }

    pub(crate) fn energy(&self) -> f64 {
        self.energies.iter().sum()
    }

    /// `None` if asked to stop.
    pub(crate) fn update_energies(&mut self, set: &PanelSet, pulse: &Pulse<'_>) -> Option<()> {
        self.energies = pulse.map(set.len(), 1, |p| self.panel_energy(set, p))?;
        Some(())
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

    /// Gives a mold another type and starts its panels afresh from their principal frames.
    pub(crate) fn restart(&mut self, set: &PanelSet, m: usize, kind: MoldType) {
        let panels = &self.members[m];
        let frames = panels.iter().map(|&p| set.frames[p]).collect();
        let (mold, own) = first_mold(set, panels, kind, self.slope_weight, frames);
        self.molds[m] = mold;
        panels.iter().zip(own).for_each(|(&p, pose)| self.poses[p] = pose);
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
}

/// The panels of each of `count` molds, in rising order.
pub(crate) fn members_of(labels: &[usize], count: usize) -> Vec<Vec<usize>> {
    let mut members = vec![Vec::new(); count];
    for (p, &m) in labels.iter().enumerate() {
        members[m].push(p);
    }
    members
}

/// The mold a cluster starts from, and its panels' frames moved to where the type needs them.
fn first_mold(
    set: &PanelSet,
    panels: &[usize],
    kind: MoldType,
    slope_weight: f64,
    mut poses: Vec<Pose>,
) -> (Mold, Vec<Pose>) {
    if kind == MoldType::Torus {
        return first_torus(set, panels, slope_weight);
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
                poses.iter_mut().for_each(|pose| pose.rotation = quarter_turn(pose.rotation));
            }
        }
        MoldType::Sphere => mold.parameters[0] = 0.5 * (k1 + k2),
        MoldType::Plane | MoldType::Paraboloid | MoldType::Torus | MoldType::Cubic => {}
    }
    (mold, poses)
}

/// The better of two tori, whose parallels run along the one or the other principal direction.
fn first_torus(set: &PanelSet, panels: &[usize], slope_weight: f64) -> (Mold, Vec<Pose>) {
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
    (mold, own)
}
