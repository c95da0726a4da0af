//! Rows of the seams between panels: gaps and kinks.

use crate::blocks::assembly::Assembly;
use crate::fit::residuals::{POSE, SIDE, seam_side, seam_values};
use crate::layout::panels::SEAM_SAMPLES;
use gp_solver::{Elements, ResidualBlock};
use std::sync::Arc;

/// The seams of an assembly with what both blocks share.
#[derive(Clone, Debug)]
struct SeamRows {
    assembly: Arc<Assembly>,
    /// Square roots of the seams' weights.
    roots: Vec<f64>,
    elements: Elements,
    /// Rows per sample.
    rows: usize,
}

impl SeamRows {
    fn new(assembly: Arc<Assembly>, weights: &[f64], rows: usize) -> Self {
        let seams = assembly.panels.seams();
        assert_eq!(weights.len(), seams.len(), "one weight per seam");
        let mut elements = Elements::new();
        let mut columns = Vec::new();
        for seam in seams {
            assembly.columns(&seam.panels, &mut columns);
            elements.push(&columns, rows * SEAM_SAMPLES);
        }
        let roots = weights.iter().map(|w| w.sqrt()).collect();
        Self { assembly, roots, elements, rows }
    }

    /// Residuals: the differences of the values `first..first + rows` of both sides.
    fn residuals(&self, x: &[f64], first: usize, residuals: &mut [f64]) {
        let assembly = &self.assembly;
        for (s, seam) in assembly.panels.seams().iter().enumerate() {
            let (points, normals) = assembly.panels.edge_samples(seam.edge);
            let out = &mut residuals[self.elements.rows(s)];
            let sides =
                seam.panels.map(|p| (assembly.mold(x, assembly.labels[p]), assembly.pose(x, p)));
            for k in 0..SEAM_SAMPLES {
                let tangents = normals[k].any_orthonormal_pair().into();
                let [a, b] = [0, 1].map(|side| {
                    let (mold, pose) = &sides[side];
                    seam_values(mold, pose, points[k], normals[k], tangents)
                });
                for row in 0..self.rows {
                    out[self.rows * k + row] = self.roots[s] * (a[first + row] - b[first + row]);
                }
            }
        }
    }

    fn linearize(&self, x: &[f64], first: usize, residuals: &mut [f64], jacobian: &mut [f64]) {
        let assembly = &self.assembly;
        for (s, seam) in assembly.panels.seams().iter().enumerate() {
            let (points, normals) = assembly.panels.edge_samples(seam.edge);
            let out = &mut residuals[self.elements.rows(s)];
            let width = self.elements.columns(s).len();
            let values = &mut jacobian[self.elements.jacobian_range(s)];
            let [a, b] = seam.panels;
            let is_shared = assembly.labels[a] == assembly.labels[b];
            for k in 0..SEAM_SAMPLES {
                let tangents = normals[k].any_orthonormal_pair().into();
                let rows = &mut values[self.rows * k * width..self.rows * (k + 1) * width];
                let out = &mut out[self.rows * k..self.rows * (k + 1)];
                rows.fill(0.0);
                let sides = seam.panels.map(|p| {
                    let (mold, pose) = (assembly.mold(x, assembly.labels[p]), assembly.pose(x, p));
                    seam_side(&mold, &pose, points[k], normals[k], tangents)
                });
                let value = |side: usize, row: usize| match first + row {
                    0 => sides[side].offset,
                    tilt => sides[side].tilt[tilt - 1],
                };
                for (row, entries) in rows.chunks_exact_mut(width).enumerate() {
                    out[row] = self.roots[s] * (value(0, row) - value(1, row));
                    for (side, &p) in seam.panels.iter().enumerate() {
                        let sign = if side == 0 { self.roots[s] } else { -self.roots[s] };
                        let own: &[f64; SIDE] = &sides[side].rows[first + row];
                        let pose = assembly.row_from_here(x, p, &own[..POSE]);
                        let place = POSE * side;
                        for (e, v) in entries[place..place + POSE].iter_mut().zip(pose) {
                            *e = sign * v;
                        }
                        let after_first = if is_shared { 0 } else { side * assembly.parameters(a) };
                        let place = 2 * POSE + after_first;
                        let count = assembly.parameters(p);
                        for (e, v) in entries[place..place + count].iter_mut().zip(&own[POSE..]) {
                            *e += sign * v;
                        }
                    }
                }
            }
        }
    }
}

/// Gaps along the seams, one row per sample `k` of seam `s`:
///
/// `residual[5 s + k] = √w_s (t₀ − t₁)`, the offsets of the molds of the two panels from the design
/// point along its normal, in the assembly's unit of length. Derivatives in both poses and the
/// parameters of both molds, with the sign of the residual. The gap of Pellis et al. 2021,
/// Sec. 4.2.
#[derive(Clone, Debug)]
pub struct GapRows(SeamRows);

impl GapRows {
    /// The rows of all seams, each with its weight.
    ///
    /// # Panics
    /// If there is not one weight per seam.
    #[must_use]
    pub fn new(assembly: Arc<Assembly>, weights: &[f64]) -> Self {
        Self(SeamRows::new(assembly, weights, 1))
    }
}

impl ResidualBlock for GapRows {
    fn name(&self) -> &str {
        "gaps"
    }

    fn elements(&self) -> &Elements {
        &self.0.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        self.0.residuals(x, 0, residuals);
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.0.linearize(x, 0, residuals, jacobian);
    }
}

/// Kinks along the seams, two rows per sample `k` of seam `s`:
///
/// `residual[10 s + 2 k + i] = √w_s (m₀ − m₁) · eᵢ`, the difference of the unit normals of the two
/// molds along two tangents of the design: the kink in radians where it is small. Derivatives in
/// both poses and the parameters of both molds, with the sign of the residual. The kink of Pellis
/// et al. 2021, Sec. 4.2.
#[derive(Clone, Debug)]
pub struct KinkRows(SeamRows);

impl KinkRows {
    /// The rows of all seams, each with its weight.
    ///
    /// # Panics
    /// If there is not one weight per seam.
    #[must_use]
    pub fn new(assembly: Arc<Assembly>, weights: &[f64]) -> Self {
        Self(SeamRows::new(assembly, weights, 2))
    }
}

impl ResidualBlock for KinkRows {
    fn name(&self) -> &str {
        "kinks"
    }

    fn elements(&self) -> &Elements {
        &self.0.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        self.0.residuals(x, 1, residuals);
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.0.linearize(x, 1, residuals, jacobian);
    }
}
