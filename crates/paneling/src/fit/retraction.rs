//! Moving a panel over a curved mold.
//!
//! A step slides panels along their molds. Taken literally it leaves the mold by half the curvature
//! times the square of the slide, which would limit steps to a small part of a panel. So after the
//! step the panel's middle is lifted and tilted to the offset and the tilt that the linearisation
//! had promised there.

use crate::fit::residuals::{POSE, SIDE, moved, seam_side};
use crate::layout::panels::{PanelSet, Pose};
use crate::mold::shape::{MAX_PARAMETERS, Mold};
use glam::{DMat3, DVec3};

/// The pose of panel `p` after a `step` of it, where the mold changes from `old` to `new`.
pub(crate) fn moved_on(
    set: &PanelSet,
    p: usize,
    pose: &Pose,
    step: &[f64; POSE],
    old: &Mold,
    new: &Mold,
) -> Pose {
    let (points, normals) = set.panel_samples(p);
    let (point, normal) = (points[points.len() - 1], normals[normals.len() - 1]);
    let tangents = normal.any_orthonormal_pair().into();
    let before = seam_side(old, pose, point, normal, tangents);
    let mut change = [0.0; SIDE];
    change[..POSE].copy_from_slice(step);
    for i in 0..MAX_PARAMETERS {
        change[POSE + i] = new.parameters[i] - old.parameters[i];
    }
    let promised = |row: usize| -> f64 {
        let value = if row == 0 { before.offset } else { before.tilt[row - 1] };
        value + before.rows[row].iter().zip(&change).map(|(r, c)| r * c).sum::<f64>()
    };
    let goal = DVec3::new(promised(0), promised(1), promised(2));
    let after = moved(pose, step);
    let here = seam_side(new, &after, point, normal, tangents);
    let local = after.to_local(point);
    // A lift, and two turns about the axes through the panel's middle, which stays where it is.
    let turn = |axis: DVec3| {
        let shift = axis.cross(local);
        [shift.x, shift.y, shift.z, axis.x, axis.y, axis.z]
    };
    let moves = [[0.0, 0.0, 1.0, 0.0, 0.0, 0.0], turn(DVec3::X), turn(DVec3::Y)];
    let effect = |m: &[f64; POSE]| {
        let along = |row: usize| here.rows[row].iter().zip(m).map(|(r, v)| r * v).sum::<f64>();
        DVec3::new(along(0), along(1), along(2))
    };
    let matrix = DMat3::from_cols(effect(&moves[0]), effect(&moves[1]), effect(&moves[2]));
    let missing = goal - DVec3::new(here.offset, here.tilt[0], here.tilt[1]);
    let factors = matrix.inverse() * missing;
    // A steep or unreached place: the step as it is, for the energy to refuse.
    if !factors.is_finite() {
        return after;
    }
    let mut correction = [0.0; POSE];
    for (m, factor) in moves.iter().zip(factors.to_array()) {
        correction.iter_mut().zip(m).for_each(|(c, v)| *c += factor * v);
    }
    moved(&after, &correction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Layout, MoldType, Pattern};
    use geom_core::assert_close;

    #[test]
    fn a_slide_stays_on_a_sphere() {
        let sphere = fixtures::surfaces::sphere_cap(4, 2);
        let layout = Layout::generate(Pattern::Quad, 5, 5, [false; 2]).unwrap();
        let set = PanelSet::new(&sphere, &layout).unwrap();
        let mut mold = Mold::flat(MoldType::Sphere);
        mold.parameters[0] = set.curvatures()[12][0];
        let radius = 1.0 / mold.parameters[0].abs();
        let energy = |pose: &Pose| {
            let (points, normals) = set.panel_samples(12);
            crate::fit::residuals::panel_energy(&mold, 1.0, pose, points, normals)
        };
        let pose = set.frames[12];
        let slide = [0.1 * radius, -0.05 * radius, 0.0, 0.0, 0.0, 0.0];
        // To first order a slide needs a turn as well; the linearisation promises what is missing.
        let k = mold.parameters[0];
        let step = [slide[0], slide[1], 0.0, -k * slide[1], k * slide[0], 0.0];
        let literal = moved(&pose, &step);
        let kept = moved_on(&set, 12, &pose, &step, &mold, &mold);
        assert!(energy(&kept) < 1e-3 * energy(&literal), "{} {}", energy(&kept), energy(&literal));
        assert_close(kept.rotation.determinant(), 1.0, 1e-12);
    }
}
