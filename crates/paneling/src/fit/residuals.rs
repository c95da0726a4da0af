//! Residuals of a panel on its mold and of a seam between two molds, with their derivatives.
//!
//! All lengths are in units of the typical panel size, so that heights and slopes compare.
//! A pose moves by six numbers in its own frame: a displacement `δ` and a rotation `ω`, after
//! which local coordinates are `L' = exp(ω) L − δ`.

use crate::layout::panels::Pose;
use crate::mold::shape::{MAX_PARAMETERS, Mold, MoldType};
use glam::{DMat3, DVec3};

/// Degrees of freedom of a pose.
pub(crate) const POSE: usize = 6;
/// Pose and mold together.
pub(crate) const SIDE: usize = POSE + MAX_PARAMETERS;

/// Smallest third component of a sample's local normal: keeps slopes finite while a panel is far
/// out of place.
const MIN_NORMAL_Z: f64 = 0.1;

/// The pose after a move by `step = (δ, ω)`.
pub(crate) fn moved(pose: &Pose, step: &[f64]) -> Pose {
    let (delta, omega) = (DVec3::from_slice(&step[..3]), DVec3::from_slice(&step[3..6]));
    // L' = exp(ω) Rᵀ (X − C) − δ: the new rotation is R exp(−ω), and the origin goes to where L'
    // vanishes.
    let turn = match omega.length() {
        0.0 => DMat3::IDENTITY,
        angle => DMat3::from_axis_angle(omega / angle, -angle),
    };
    let rotation = pose.rotation * turn;
    Pose { origin: pose.origin + rotation * delta, rotation }
}

/// Residuals of one sample: height above the mold, and the two slope differences times `weight`.
pub(crate) fn sample_residual(mold: &Mold, weight: f64, local: DVec3, normal: DVec3) -> [f64; 3] {
    let z = mold.at(local.x, local.y);
    let nz = normal.z.max(MIN_NORMAL_Z);
    [local.z - z.f, weight * (z.fx + normal.x / nz), weight * (z.fy + normal.y / nz)]
}

/// How far the middle of a panel may slide from the origin of a polynomial mold, in panel sizes
/// (half a panel's width): the mold is then at most about three panels wide. Round molds have no
/// limit, for they are the same everywhere.
const REACH: f64 = 2.0;
const REACH_WEIGHT: f64 = 0.01;

/// What a panel pays for lying further out on its mold than the reach: residual and its
/// derivatives in the pose, `w (x² + y² − reach²)` at the panel's middle.
pub(crate) fn reach(mold: &Mold, middle: DVec3) -> Option<(f64, [f64; POSE])> {
    let beyond = middle.x * middle.x + middle.y * middle.y - REACH * REACH;
    let is_polynomial = matches!(mold.kind, MoldType::Paraboloid | MoldType::Cubic);
    if !is_polynomial || beyond <= 0.0 {
        return None;
    }
    let by_point = 2.0 * REACH_WEIGHT * DVec3::new(middle.x, middle.y, 0.0);
    let turn = middle.cross(by_point);
    let row = [-by_point.x, -by_point.y, -by_point.z, turn.x, turn.y, turn.z];
    Some((REACH_WEIGHT * beyond, row))
}

/// Sum of squares of a panel's residuals; the last sample is its middle.
pub(crate) fn panel_energy(
    mold: &Mold,
    weight: f64,
    pose: &Pose,
    points: &[DVec3],
    normals: &[DVec3],
) -> f64 {
    let to_local = pose.rotation.transpose();
    let mut sum = 0.0;
    for (p, n) in points.iter().zip(normals) {
        let r = sample_residual(mold, weight, to_local * (*p - pose.origin), to_local * *n);
        sum += r[0] * r[0] + r[1] * r[1] + r[2] * r[2];
    }
    let beyond = points.last().and_then(|p| reach(mold, to_local * (*p - pose.origin)));
    sum + beyond.map_or(0.0, |(r, _)| r * r)
}

/// Residuals of one sample and their derivatives in the pose.
pub(crate) fn sample_pose_rows(
    mold: &Mold,
    weight: f64,
    local: DVec3,
    normal: DVec3,
) -> ([f64; 3], [[f64; POSE]; 3]) {
    let z = mold.at(local.x, local.y);
    let nz = normal.z.max(MIN_NORMAL_Z);
    let residual =
        [local.z - z.f, weight * (z.fx + normal.x / nz), weight * (z.fy + normal.y / nz)];
    // Gradients with respect to the local point, and to the local normal.
    let by_point = [
        DVec3::new(-z.fx, -z.fy, 1.0),
        weight * DVec3::new(z.fxx, z.fxy, 0.0),
        weight * DVec3::new(z.fxy, z.fyy, 0.0),
    ];
    let is_steep = normal.z < MIN_NORMAL_Z;
    let slope = |a: f64| if is_steep { 0.0 } else { -a / (nz * nz) };
    let by_normal = [
        DVec3::ZERO,
        weight * DVec3::new(1.0 / nz, 0.0, slope(normal.x)),
        weight * DVec3::new(0.0, 1.0 / nz, slope(normal.y)),
    ];
    let mut rows = [[0.0; POSE]; 3];
    for k in 0..3 {
        // dL = ω × L − δ and dn = ω × n, and g · (ω × L) = ω · (L × g).
        let turn = local.cross(by_point[k]) + normal.cross(by_normal[k]);
        rows[k] = [-by_point[k].x, -by_point[k].y, -by_point[k].z, turn.x, turn.y, turn.z];
    }
    (residual, rows)
}

/// Derivatives of the residuals of one sample in the parameters of the mold.
pub(crate) fn sample_mold_rows(
    mold: &Mold,
    weight: f64,
    local: DVec3,
) -> [[f64; MAX_PARAMETERS]; 3] {
    let [f, fx, fy] = mold.parameter_rows(local.x, local.y);
    [f.map(|v| -v), fx.map(|v| weight * v), fy.map(|v| weight * v)]
}

/// One side of a seam at one sample: offset of the mold along the design normal, and the tangential
/// components of the mold's normal.
pub(crate) struct SeamSide {
    pub(crate) offset: f64,
    pub(crate) tilt: [f64; 2],
    /// Derivatives of offset and tilt in pose and mold parameters.
    pub(crate) rows: [[f64; SIDE]; 3],
}

/// A step along the line this much smaller than the first is the last: the next would be smaller by
/// the square.
const FOOT_STEP: f64 = 1e-9;

/// Where the line through a design point along its normal meets the mold, and the mold's unit
/// normal there: offset along the line and normal in local coordinates.
pub(crate) fn foot(mold: &Mold, local: DVec3, normal: DVec3) -> (f64, DVec3) {
    let mut t = 0.0;
    let mut z = mold.at(local.x, local.y);
    // The mold is nearly parallel to the design there, so each step squares the error.
    let mut least = 0.0;
    for k in 0..4 {
        let q = local + t * normal;
        z = mold.at(q.x, q.y);
        let step = (q.z - z.f) / (normal.z - z.fx * normal.x - z.fy * normal.y);
        t -= step;
        if k == 0 {
            least = FOOT_STEP * step.abs();
        } else if step.abs() <= least {
            break;
        }
    }
    (t, DVec3::new(-z.fx, -z.fy, 1.0).normalize())
}

/// Offset and tilt of the side of a seam at a design point with the given normal and two tangents,
/// to the bit as [`seam_side`] has them.
pub(crate) fn seam_values(
    mold: &Mold,
    pose: &Pose,
    point: DVec3,
    normal: DVec3,
    tangents: [DVec3; 2],
) -> [f64; 3] {
    let to_local = pose.rotation.transpose();
    let (offset, m) = foot(mold, to_local * (point - pose.origin), to_local * normal);
    let [a, b] = tangents.map(|t| (to_local * t).dot(m));
    [offset, a, b]
}

/// The side of a seam at a design point with the given normal and two tangents.
pub(crate) fn seam_side(
    mold: &Mold,
    pose: &Pose,
    point: DVec3,
    normal: DVec3,
    tangents: [DVec3; 2],
) -> SeamSide {
    let to_local = pose.rotation.transpose();
    let (local, n) = (to_local * (point - pose.origin), to_local * normal);
    let (offset, m) = foot(mold, local, n);
    let q = local + offset * n;
    let z = mold.at(q.x, q.y);
    let parameter_rows = mold.parameter_rows(q.x, q.y);
    let slope = 1.0 / m.z;
    let denominator = n.z - z.fx * n.x - z.fy * n.y;
    let up = DVec3::new(-z.fx, -z.fy, 1.0);
    let mut rows = [[0.0; SIDE]; 3];
    // The foot q = L + t n stays on the mold: up · (dL + n dt + t dn) = f_a da.
    let turn = (local + offset * n).cross(up);
    let to_offset = -1.0 / denominator;
    let pose_row = [-up.x, -up.y, -up.z, turn.x, turn.y, turn.z];
    for (entry, v) in rows[0].iter_mut().zip(pose_row) {
        *entry = to_offset * v;
    }
    for (entry, f) in rows[0][POSE..].iter_mut().zip(parameter_rows[0]) {
        *entry = -to_offset * f;
    }
    let mut tilt = [0.0; 2];
    for k in 0..2 {
        let tangent = to_local * tangents[k];
        tilt[k] = tangent.dot(m);
        // dm = (I − m mᵀ)(−df_x, −df_y, 0)/s with s = |up|, so tangent · dm = w · d(f_x, f_y).
        let w = (m * tilt[k] - tangent) / slope;
        let by_x = w.x * z.fxx + w.y * z.fxy;
        let by_y = w.x * z.fxy + w.y * z.fyy;
        // dq = ω × q − δ + n dt, and the tangent turns with the frame: ω × tangent.
        let g = DVec3::new(by_x, by_y, 0.0);
        let turn = q.cross(g) + tangent.cross(m);
        let own = [-g.x, -g.y, -g.z, turn.x, turn.y, turn.z];
        let along = g.dot(n);
        let (head, tail) = rows.split_at_mut(1);
        for i in 0..POSE {
            tail[k][i] = own[i] + along * head[0][i];
        }
        for i in 0..MAX_PARAMETERS {
            let direct = w.x * parameter_rows[1][i] + w.y * parameter_rows[2][i];
            tail[k][POSE + i] = direct + along * head[0][POSE + i];
        }
    }
    SeamSide { offset, tilt, rows }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    fn setting(kind: MoldType) -> (Mold, Pose, DVec3, DVec3) {
        let mut mold = Mold::flat(kind);
        for i in 0..kind.parameter_count() {
            mold.parameters[i] = 0.2 * (1.0 + 2.3 * i as f64).sin();
        }
        let rotation = DMat3::from_axis_angle(DVec3::new(0.3, -0.5, 0.8).normalize(), 0.9);
        let pose = Pose { origin: DVec3::new(0.4, -1.0, 2.0), rotation };
        let point = pose.to_world(DVec3::new(0.7, -0.5, 0.05));
        let normal = rotation * DVec3::new(0.2, -0.1, 1.0).normalize();
        (mold, pose, point, normal)
    }

    fn changed(mold: &Mold, pose: &Pose, i: usize, h: f64) -> (Mold, Pose) {
        let mut step = [0.0; POSE];
        let mut mold = *mold;
        if i < POSE {
            step[i] = h;
        } else if i - POSE < mold.kind.parameter_count() {
            mold.parameters[i - POSE] += h;
        }
        (mold, moved(pose, &step))
    }

    #[test]
    fn sample_rows_match_central_differences() {
        for kind in MoldType::ALL {
            let (mold, pose, point, normal) = setting(kind);
            let at = |mold: &Mold, pose: &Pose| {
                let r = pose.rotation.transpose();
                sample_residual(mold, 0.7, r * (point - pose.origin), r * normal)
            };
            let r = pose.rotation.transpose();
            let (local, n) = (r * (point - pose.origin), r * normal);
            let (residual, pose_rows) = sample_pose_rows(&mold, 0.7, local, n);
            assert_eq!(residual, at(&mold, &pose));
            let mold_rows = sample_mold_rows(&mold, 0.7, local);
            let h = 1e-6;
            for i in 0..SIDE {
                let (a, b) = (changed(&mold, &pose, i, h), changed(&mold, &pose, i, -h));
                let (a, b) = (at(&a.0, &a.1), at(&b.0, &b.1));
                for row in 0..3 {
                    let got = if i < POSE { pose_rows[row][i] } else { mold_rows[row][i - POSE] };
                    assert_close(got, (a[row] - b[row]) / (2.0 * h), 1e-8);
                }
            }
        }
    }

    #[test]
    fn seam_rows_match_central_differences() {
        for kind in MoldType::ALL {
            let (mold, pose, point, normal) = setting(kind);
            let tangents = normal.any_orthonormal_pair();
            let at = |mold: &Mold, pose: &Pose| {
                let side = seam_side(mold, pose, point, normal, tangents.into());
                ([side.offset, side.tilt[0], side.tilt[1]], side.rows)
            };
            let (_, rows) = at(&mold, &pose);
            let h = 1e-6;
            for i in 0..SIDE {
                let (a, b) = (changed(&mold, &pose, i, h), changed(&mold, &pose, i, -h));
                let (a, b) = (at(&a.0, &a.1).0, at(&b.0, &b.1).0);
                for row in 0..3 {
                    assert_close(rows[row][i], (a[row] - b[row]) / (2.0 * h), 1e-8);
                }
            }
        }
    }

    #[test]
    fn the_reach_grows_from_zero_and_its_row_matches_central_differences() {
        let mold = Mold::flat(MoldType::Cubic);
        assert_eq!(reach(&mold, DVec3::new(1.2, 1.5, 0.3)), None);
        assert_eq!(reach(&Mold::flat(MoldType::Sphere), DVec3::new(9.0, 0.0, 0.3)), None);
        let pose = Pose { origin: DVec3::ZERO, rotation: DMat3::IDENTITY };
        let point = DVec3::new(1.9, -1.1, 0.3);
        let (_, row) = reach(&mold, point).unwrap();
        for (i, entry) in row.into_iter().enumerate() {
            let at = |h: f64| {
                let mut step = [0.0; POSE];
                step[i] = h;
                reach(&mold, moved(&pose, &step).to_local(point)).unwrap().0
            };
            assert_close(entry, (at(1e-6) - at(-1e-6)) / 2e-6, 1e-9);
        }
    }

    #[test]
    fn foot_lies_on_the_mold() {
        let (mold, pose, point, normal) = setting(MoldType::Cubic);
        let r = pose.rotation.transpose();
        let (local, n) = (pose.to_local(point), r * normal);
        let (t, m) = foot(&mold, local, n);
        let q = local + t * n;
        assert_close(q.z, mold.height(q.x, q.y), 1e-14);
        assert_close(m.length(), 1.0, 1e-14);
    }
}
