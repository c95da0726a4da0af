//! Where to start the fit of a torus.
//!
//! Curvatures at one point do not tell a torus: the geodesic curvature `g` of its parallels is
//! needed as well. To third order a torus is
//! `z = k₁ x²/2 + k₂ y²/2 + (k₁ − k₂) g x² y / 2`, so `g` is read off a cubic fitted to the panel.
//! With it the place of every panel on the tube is known, and panels slide there before the fit.

use crate::fit::clustering::best_cubic;
use crate::fit::residuals::panel_energy;
use crate::layout::panels::{PanelSet, Pose};
use crate::mold::shape::{Mold, MoldType};
use glam::{DMat3, DVec3};

/// Most of a geodesic curvature, in units of the panel size: where both principal curvatures
/// agree, nothing can be read off.
const MOST_GEODESIC: f64 = 0.5;
/// A panel does not slide further along the tube, in radians: the mold is a height function.
const LONGEST_SLIDE: f64 = 1.2;
/// Panels whose middle is nearer than this to the origin, in radians along the tube, stay there.
const LEAST_TURN: f64 = 0.05;
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
    fn slid(&self, latitude: f64) -> Option<Pose> {
        let turn = latitude - self.latitude();
        let turn = turn - std::f64::consts::TAU * (turn / std::f64::consts::TAU).round();
        let slides = self.k2 != 0.0 && self.k1.hypot(self.g) > FAR_AXIS * self.k2.abs();
        if !slides {
            return Some(self.frame);
        }
        if turn.abs() > LONGEST_SLIDE {
            return None;
        }
        let center = self.frame.to_world(DVec3::new(0.0, 0.0, 1.0 / self.k2));
        // About the local x axis; y moves on to where the latitude is larger.
        let rotation = self.frame.rotation * DMat3::from_rotation_x(turn);
        Some(Pose { origin: center - rotation.z_axis / self.k2, rotation })
    }
}

/// The frame with its axes exchanged: the old y axis comes first.
pub(crate) fn quarter_turn(rotation: DMat3) -> DMat3 {
    DMat3::from_cols(rotation.y_axis, -rotation.x_axis, rotation.z_axis)
}

/// A torus as seen from further along its generating circle, and the frame there in the frame of
/// the old one. `turn` is the angle at the middle of the tube, in radians.
fn seen_from(mold: &Mold, turn: f64) -> (Mold, Pose) {
    let [k1, k2, g, ..] = mold.parameters;
    let (sin, cos) = turn.sin_cos();
    let origin = DVec3::new(0.0, sin / k2, (1.0 - cos) / k2);
    // `(g, k₁)` points from the origin to the axis in the plane x = 0 and is the inverse of the
    // distance long.
    let nearer = 1.0 - g * origin.y - k1 * origin.z;
    let mut seen = *mold;
    seen.parameters[0] = (k1 * cos - g * sin) / nearer;
    seen.parameters[2] = (g * cos + k1 * sin) / nearer;
    (seen, Pose { origin, rotation: DMat3::from_rotation_x(turn) })
}

/// The same torus with its origin in the middle of its panels, and their poses in that frame;
/// `None` if they lie about there already.
///
/// A panel that has slid far along the tube is near the edge of the height function, where slopes
/// are steep and steps are refused because they would leave it.
pub(crate) fn centered(
    set: &PanelSet,
    panels: &[usize],
    poses: &[Pose],
    mold: &Mold,
) -> Option<(Mold, Vec<Pose>)> {
    let k2 = mold.parameters[1];
    let angle = |&p: &usize| {
        let (points, _) = set.panel_samples(p);
        let middle = poses[p].to_local(points[points.len() - 1]);
        (k2 * middle.y).atan2(1.0 - k2 * middle.z)
    };
    let angles = panels.iter().map(angle);
    let low = angles.clone().fold(f64::INFINITY, f64::min);
    let turn = 0.5 * (low + angles.fold(f64::NEG_INFINITY, f64::max));
    // NaN and infinite angles are refused as well.
    if !(turn.abs() > LEAST_TURN && turn.abs() < LONGEST_SLIDE) {
        return None;
    }
    let (seen, frame) = seen_from(mold, turn);
    let moved = panels.iter().map(|&p| {
        let origin = poses[p].to_world(frame.origin);
        Pose { origin, rotation: poses[p].rotation * frame.rotation }
    });
    Some((seen, moved.collect()))
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
    // Sliding a panel to the latitude of the model is right if its geodesic curvature is; where
    // that is read off noise, the panel had better stay.
    let poses = panels.iter().zip(&patches).map(|(&p, patch)| {
        let (points, normals) = set.panel_samples(p);
        let energy = |pose: &Pose| panel_energy(&mold, slope_weight, pose, points, normals);
        let turned = patch.turned();
        let slid = [patch, &turned].into_iter().filter_map(|patch| patch.slid(latitude));
        let rated =
            [patch.frame, turned.frame].into_iter().chain(slid).map(|pose| (energy(&pose), pose));
        // A pose beyond the reach of the torus has no energy.
        let best = rated.reduce(|a, b| if b.0 < a.0 || a.0.is_nan() { b } else { a });
        best.map_or(patch.frame, |(_, pose)| pose)
    });
    (mold, poses.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    #[test]
    fn a_torus_seen_from_elsewhere_is_the_same_surface() {
        let mut mold = Mold::flat(MoldType::Torus);
        for [k1, k2, g] in [[0.3, -0.8, 0.1], [-0.4, 0.7, -0.2], [0.0, 0.5, 0.25], [0.2, 0.9, 0.0]]
        {
            mold.parameters[..3].copy_from_slice(&[k1, k2, g]);
            for turn in [0.4, -0.3] {
                let (seen, frame) = seen_from(&mold, turn);
                for (x, y) in [(0.0, 0.0), (0.2, 0.1), (-0.3, 0.2), (0.1, -0.25)] {
                    let there = frame.to_world(DVec3::new(x, y, seen.height(x, y)));
                    assert_close(mold.height(there.x, there.y), there.z, 1e-12);
                }
            }
        }
    }
}
