//! Normal equations of one panel: its pose first, then the parameters of its mold.

use crate::fit::residuals::{POSE, SIDE, reach, sample_mold_rows, sample_pose_rows};
use crate::layout::panels::{PanelSet, Pose};
use crate::mold::shape::{MAX_PARAMETERS, Mold};

/// A matrix in pose and mold parameters.
pub(crate) type Matrix = [[f64; SIDE]; SIDE];
/// A row of a Jacobian, or a vector, in pose and mold parameters.
pub(crate) type Row = [f64; SIDE];

/// `Jᵀ J` and `−Jᵀ r` of a panel's distance to the design; `rows` is scratch space.
pub(crate) fn design_block(
    set: &PanelSet,
    p: usize,
    mold: &Mold,
    pose: &Pose,
    slope_weight: f64,
    rows: &mut Vec<Row>,
) -> (Matrix, Row) {
    let (points, normals) = set.panel_samples(p);
    let to_local = pose.rotation.transpose();
    let mut side = [0.0; SIDE];
    rows.clear();
    let mut add = |pose_row: &[f64; POSE], mold_row: &[f64; MAX_PARAMETERS], r: f64| {
        let mut row = [0.0; SIDE];
        row[..POSE].copy_from_slice(pose_row);
        row[POSE..].copy_from_slice(mold_row);
        side.iter_mut().zip(&row).for_each(|(s, v)| *s -= r * v);
        rows.push(row);
    };
    for (x, n) in points.iter().zip(normals) {
        let local = to_local * (*x - pose.origin);
        let (r, pose_rows) = sample_pose_rows(mold, slope_weight, local, to_local * *n);
        let mold_rows = sample_mold_rows(mold, slope_weight, local);
        for k in 0..3 {
            add(&pose_rows[k], &mold_rows[k], r[k]);
        }
    }
    if let Some((r, row)) = reach(mold, to_local * (points[points.len() - 1] - pose.origin)) {
        add(&row, &[0.0; MAX_PARAMETERS], r);
    }
    let mut matrix = [[0.0; SIDE]; SIDE];
    pulp::Arch::new().dispatch(|| add_products(&mut matrix, rows, rows));
    (matrix, side)
}

/// `matrix += aᵀ b`.
#[inline(always)]
pub(crate) fn add_products(matrix: &mut Matrix, a: &[Row], b: &[Row]) {
    // A row of the result stays in registers while all products are added.
    for (i, out) in matrix.iter_mut().enumerate() {
        let mut sum = *out;
        for (a, b) in a.iter().zip(b) {
            let factor = a[i];
            for (s, v) in sum.iter_mut().zip(b) {
                *s += factor * v;
            }
        }
        *out = sum;
    }
}
