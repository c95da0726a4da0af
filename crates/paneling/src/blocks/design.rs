//! Rows that keep panels on the design and near the middle of their molds.

use crate::blocks::assembly::Assembly;
use crate::fit::residuals::{POSE, reach, sample_mold_rows, sample_pose_rows, sample_residual};
use gp_solver::{Elements, ResidualBlock};
use std::sync::Arc;

/// Rows per sample: a height and two slopes.
const ROWS: usize = 3;

/// Heights and slopes of the design above the molds, three rows per sample `(L, N)` of a panel in
/// local coordinates:
///
/// ```text
/// residual[3 s]     = L_z − f(L_x, L_y)
/// residual[3 s + 1] = w (f_x(L_x, L_y) + N_x / N_z)
/// residual[3 s + 2] = w (f_y(L_x, L_y) + N_y / N_z)
/// ```
///
/// with the slope weight `w`. Heights are in the assembly's unit of length, slopes are numbers;
/// derivatives in poses and mold parameters with the sign of the residual. The fit of panels to
/// molds of Pellis et al. 2021, Sec. 4.2.
#[derive(Clone, Debug)]
pub struct DesignRows {
    assembly: Arc<Assembly>,
    slope_weight: f64,
    /// Square roots of the panels' weights.
    roots: Vec<f64>,
    elements: Elements,
}

impl DesignRows {
    /// The rows of all samples of all panels.
    #[must_use]
    pub fn new(assembly: Arc<Assembly>, slope_weight: f64) -> Self {
        let mut elements = Elements::new();
        let mut columns = Vec::new();
        for p in 0..assembly.panels.len() {
            assembly.columns(&[p], &mut columns);
            elements.push(&columns, ROWS * assembly.panels.panel_samples(p).0.len());
        }
        let roots = vec![1.0; assembly.panels.len()];
        Self { assembly, slope_weight, roots, elements }
    }

    /// With a factor for the squares of every panel's residuals.
    ///
    /// # Panics
    /// If there is not one weight per panel.
    #[must_use]
    pub fn with_weights(mut self, weights: &[f64]) -> Self {
        self.roots = roots_of(&self.assembly, weights);
        self
    }
}

/// Square roots of one weight per panel.
fn roots_of(assembly: &Assembly, weights: &[f64]) -> Vec<f64> {
    assert_eq!(weights.len(), assembly.panels.len(), "one weight per panel");
    weights.iter().map(|w| w.sqrt()).collect()
}

impl ResidualBlock for DesignRows {
    fn name(&self) -> &str {
        "design"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        let assembly = &self.assembly;
        for p in 0..assembly.panels.len() {
            let (mold, pose) = (assembly.mold(x, assembly.labels[p]), assembly.pose(x, p));
            let to_local = pose.rotation.transpose();
            let (points, normals) = assembly.panels.panel_samples(p);
            let rows = residuals[self.elements.rows(p)].as_chunks_mut::<ROWS>().0;
            for ((out, point), normal) in rows.iter_mut().zip(points).zip(normals) {
                let local = to_local * (*point - pose.origin);
                let r = sample_residual(&mold, self.slope_weight, local, to_local * *normal);
                *out = r.map(|r| self.roots[p] * r);
            }
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        let (assembly, w) = (&self.assembly, self.slope_weight);
        for p in 0..assembly.panels.len() {
            let (mold, pose) = (assembly.mold(x, assembly.labels[p]), assembly.pose(x, p));
            let to_local = pose.rotation.transpose();
            let (points, normals) = assembly.panels.panel_samples(p);
            let out = residuals[self.elements.rows(p)].as_chunks_mut::<ROWS>().0;
            let width = self.elements.columns(p).len();
            let rows = jacobian[self.elements.jacobian_range(p)].chunks_exact_mut(ROWS * width);
            for (((out, rows), point), normal) in out.iter_mut().zip(rows).zip(points).zip(normals)
            {
                let local = to_local * (*point - pose.origin);
                let (r, pose_rows) = sample_pose_rows(&mold, w, local, to_local * *normal);
                let mold_rows = sample_mold_rows(&mold, w, local);
                *out = r.map(|r| self.roots[p] * r);
                for (k, row) in rows.chunks_exact_mut(width).enumerate() {
                    row[..POSE].copy_from_slice(&assembly.row_from_here(x, p, &pose_rows[k]));
                    row[POSE..].copy_from_slice(&mold_rows[k][..width - POSE]);
                    row.iter_mut().for_each(|v| *v *= self.roots[p]);
                }
            }
        }
    }
}

/// What a panel pays for lying further out on a polynomial mold than the reach, one row per panel:
///
/// `residual[p] = w max(0, x² + y² − reach²)` at the local coordinates `(x, y)` of its middle, with
/// `w = 0.01` and a reach of 2 in the assembly's unit of length, the panel size; 0 on round molds.
/// Derivatives in the pose with the sign of the residual.
#[derive(Clone, Debug)]
pub struct ReachRows {
    assembly: Arc<Assembly>,
    /// Square roots of the panels' weights.
    roots: Vec<f64>,
    elements: Elements,
}

impl ReachRows {
    /// The rows of all panels.
    #[must_use]
    pub fn new(assembly: Arc<Assembly>) -> Self {
        let mut elements = Elements::new();
        let mut columns = Vec::new();
        for p in 0..assembly.panels.len() {
            assembly.columns(&[p], &mut columns);
            elements.push(&columns[..POSE], 1);
        }
        let roots = vec![1.0; assembly.panels.len()];
        Self { assembly, roots, elements }
    }

    /// With a factor for the square of every panel's residual.
    ///
    /// # Panics
    /// If there is not one weight per panel.
    #[must_use]
    pub fn with_weights(mut self, weights: &[f64]) -> Self {
        self.roots = roots_of(&self.assembly, weights);
        self
    }

    fn row(&self, x: &[f64], p: usize) -> (f64, [f64; POSE]) {
        let (assembly, root) = (&self.assembly, self.roots[p]);
        let points = assembly.panels.panel_samples(p).0;
        let middle = assembly.pose(x, p).to_local(points[points.len() - 1]);
        let paid = reach(&assembly.mold(x, assembly.labels[p]), middle);
        paid.map_or((0.0, [0.0; POSE]), |(r, row)| (root * r, row.map(|v| root * v)))
    }
}

impl ResidualBlock for ReachRows {
    fn name(&self) -> &str {
        "reach"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        residuals.iter_mut().enumerate().for_each(|(p, r)| *r = self.row(x, p).0);
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        let rows = jacobian.as_chunks_mut::<POSE>().0;
        for (p, (out, row)) in residuals.iter_mut().zip(rows).enumerate() {
            let (r, here) = self.row(x, p);
            *out = r;
            *row = self.assembly.row_from_here(x, p, &here);
        }
    }
}
