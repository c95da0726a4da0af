//! Where to start the fit of a torus.
//!
//! Curvatures at one point do not tell a torus: the geodesic curvature `g` of its parallels is
//! needed as well. To third order a torus is
//! `z = k₁ x²/2 + k₂ y²/2 + (k₁ − k₂) g x² y / 2`, so `g` is read off a cubic fitted to the panel.
//! With it the place of every panel on the tube is known, and panels slide there before the fit.

use crate::clustering::best_cubic;
use crate::mold::{Mold, MoldType};
use crate::panels::{PanelSet, Pose};
use glam::{DMat3, DVec3};

/// Most of a geodesic curvature, in units of the panel size: where both principal curvatures
/// agree, nothing can be read off.
const MOST_GEODESIC: f64 = 0.5;
/// A panel does not slide further along the tube, in radians: the mold is a height function.
const LONGEST_SLIDE: f64 = 1.2;
/// An axis this much further away than the tube is wide says nothing about the place on the tube.
const FAR_AXIS: f64 = 1e-3;

/// A panel as a patch of a torus, in its own frame.
#[derive(Clone, Copy)]
struct Patch {
    frame: Pose,
    k1: f64,
    k2: f64,
    g: f64,
}

impl Patch {
    /// The patch of a panel whose tube runs across (`is_across`) or along the first principal
    /// direction, in the frame whose y axis is tangent to the generating circle.
    fn new(set: &PanelSet, p: usize, slope_weight: f64, is_across: bool) -> Self {
        let [h, k] = set.curvatures[p];
        let half = (h * h - k).max(0.0).sqrt();
        let mut frame = set.frames[p];
        let [_, _, _, _, xxy, xyy, _] = best_cubic(set, p, slope_weight).0;
        let (k1, k2, third) =
            if is_across { (h + half, h - half, xxy) } else { (h - half, h + half, -xyy) };
        if !is_across {
            frame.rotation = quarter_turn(frame.rotation);
        }
        let g = 2.0 * third / (k1 - k2);
        let g = if g.is_finite() { g.clamp(-MOST_GEODESIC, MOST_GEODESIC) } else { 0.0 };
        Self { frame, k1, k2, g }
    }

    fn turned(self) -> Self {
        Self { frame: self.frame.turned(), g: -self.g, ..self }
    }

    /// Angle on the generating circle, 0 where the tube is furthest from the axis or nearest to it.
    fn latitude(&self) -> f64 {
        if self.k1.hypot(self.g) > FAR_AXIS * self.k2.abs() { self.g.atan2(self.k1) } else { 0.0 }
    }

    /// The frame moved along the generating circle to another latitude.
    fn slid(&self, latitude: f64) -> Option<(Pose, f64)> {
        let turn = latitude - self.latitude();
        let turn = turn - std::f64::consts::TAU * (turn / std::f64::consts::TAU).round();
        let slides = self.k2 != 0.0 && self.k1.hypot(self.g) > FAR_AXIS * self.k2.abs();
        if !slides {
            return Some((self.frame, 0.0));
        }
        if turn.abs() > LONGEST_SLIDE {
            return None;
        }
        let center = self.frame.to_world(DVec3::new(0.0, 0.0, 1.0 / self.k2));
        // About the local x axis; y moves on to where the latitude is larger.
        let rotation = self.frame.rotation * DMat3::from_rotation_x(turn);
        Some((Pose { origin: center - rotation.z_axis / self.k2, rotation }, turn.abs()))
    }
}

/// The frame with its axes exchanged: the old y axis comes first.
pub(crate) fn quarter_turn(rotation: DMat3) -> DMat3 {
    DMat3::from_cols(rotation.y_axis, -rotation.x_axis, rotation.z_axis)
}

/// A torus for these panels, and where they stand on it; `is_across` says which principal
/// direction is taken for that of the parallels.
pub(crate) fn start(
    set: &PanelSet,
    panels: &[usize],
    slope_weight: f64,
    is_across: bool,
) -> (Mold, Vec<Pose>) {
    let patches: Vec<Patch> =
        panels.iter().map(|&p| Patch::new(set, p, slope_weight, is_across)).collect();
    let n = patches.len() as f64;
    let mean = |f: fn(&Patch) -> f64| patches.iter().map(f).sum::<f64>() / n;
    let (k1, k2) = (mean(|p| p.k1), mean(|p| p.k2));
    let far = |p: &Patch| (p.k1 - k1).hypot(p.k2 - k2);
    // The panel nearest to the mean gives the mold.
    let model = patches.iter().copied().reduce(|a, b| if far(&b) < far(&a) { b } else { a });
    let mut mold = Mold::flat(MoldType::Torus);
    let Some(model) = model else { return (mold, Vec::new()) };
    mold.parameters[..3].copy_from_slice(&[model.k1, model.k2, model.g]);
    let latitude = model.latitude();
    let poses = patches.iter().map(|patch| {
        let [here, turned] = [patch.slid(latitude), patch.turned().slid(latitude)];
        match (here, turned) {
            (Some(a), Some(b)) => {
                if b.1 < a.1 {
                    b.0
                } else {
                    a.0
                }
            }
            (Some((pose, _)), None) | (None, Some((pose, _))) => pose,
            (None, None) => patch.frame,
        }
    });
    (mold, poses.collect())
}
