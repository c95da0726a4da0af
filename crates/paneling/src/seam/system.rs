//! The Gauss-Newton system of the joint seam step.
//!
//! The shared molds would fill a factorisation with a dense border, so the system is solved by
//! preconditioned conjugate gradients. Its matrix is kept in blocks: one per panel for pose and
//! mold, one per seam for the coupling of its two panels.

use crate::fit::normal::{Matrix, Row, add_products, design_block};
use crate::fit::residuals::{POSE, SIDE, seam_side};
use crate::fit::state::Fit;
use crate::layout::panels::{PanelSet, SEAM_SAMPLES};
use crate::mold::shape::MAX_PARAMETERS;
use crate::pulse::{Pulse, Stop};
use crate::seam::unknowns::{SeamOptions, Seams, dot, parts, parts_mut};
use gp_solver::{CgOptions, CgReport, ConjugateGradients, LinearOperator, Preconditioner};
use numerics::{PIVOT_RATIO, factor_semidefinite, solve_semidefinite};
use rayon::prelude::*;

/// Rows of a seam: a gap and two components of the kink per sample.
const ROWS: usize = 3 * SEAM_SAMPLES;
/// And most rows beyond limits: a gap and a kink per sample.
const MOST_ROWS: usize = ROWS + 2 * SEAM_SAMPLES;
/// Conjugate gradients per linearisation: Gauss-Newton needs no more than a good direction.
const CG: CgOptions = CgOptions { rel_tol: 0.03, max_iterations: 40 };

/// The Gauss-Newton system at one iterate.
pub(crate) struct System<'a> {
    set: &'a PanelSet,
    labels: &'a [usize],
    molds: usize,
    incident: &'a [Vec<(usize, usize)>],
    /// `couplings[s]` is `J₀ᵀ J₁` of the two sides of seam `s`.
    couplings: Vec<Matrix>,
    /// Sum of `Jᵀ J` of a panel's own rows: design and all its seams.
    blocks: Vec<Matrix>,
    /// Minus the gradient of every panel's own rows.
    sides: Vec<Row>,
}

/// An approximate solution of the damped system.
pub(crate) struct Solution {
    pub(crate) step: Vec<f64>,
    /// By how much the energy would fall if it were quadratic, by mold.
    pub(crate) promised: Vec<f64>,
    pub(crate) report: CgReport,
}

/// A seam's share of the system.
struct SeamPart {
    own: [Matrix; 2],
    sides: [Row; 2],
    coupling: Matrix,
}

impl<'a> System<'a> {
    /// The system at `fit`; `None` if asked to stop.
    pub(crate) fn linearize(seams: Seams<'a>, fit: &'a Fit, pulse: &Pulse<'_>) -> Option<Self> {
        let Seams { set, options, weights, incident } = seams;
        let parts = pulse
            .map(set.seams.len(), 16, |s| seam_part(set, fit, s, options, weights.seams[s]))?;
        let weight = options.design_weight * options.design_weight;
        let panels = pulse.map_with(set.len(), 16, Vec::new, |rows, p| {
            let mold = &fit.molds[fit.labels[p]];
            let (mut block, mut side) =
                design_block(set, p, mold, &fit.poses[p], fit.slope_weight, rows);
            let weight = weight * weights.panels[p];
            block.iter_mut().flatten().chain(&mut side).for_each(|v| *v *= weight);
            for &(s, k) in &incident[p] {
                for (row, own) in block.iter_mut().zip(&parts[s].own[k]) {
                    row.iter_mut().zip(own).for_each(|(a, b)| *a += b);
                }
                side.iter_mut().zip(&parts[s].sides[k]).for_each(|(a, b)| *a += b);
            }
            (block, side)
        })?;
        let (blocks, sides) = panels.into_iter().unzip();
        let couplings = parts.into_iter().map(|s| s.coupling).collect();
        let (labels, molds) = (&fit.labels[..], fit.molds.len());
        Some(Self { set, labels, molds, incident, couplings, blocks, sides })
    }

    /// Number of unknowns.
    fn unknowns(&self) -> usize {
        POSE * self.blocks.len() + MAX_PARAMETERS * self.molds
    }

    /// Minus the gradient of half the energy.
    pub(crate) fn side(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.unknowns()];
        let (poses, molds) = parts_mut(&mut out, self.blocks.len());
        for ((side, pose), &label) in self.sides.iter().zip(poses).zip(self.labels) {
            pose.copy_from_slice(&side[..POSE]);
            molds[label].iter_mut().zip(&side[POSE..]).for_each(|(o, v)| *o += v);
        }
        out
    }

    /// The entries of one panel in a product with the normal matrix.
    #[inline(always)]
    fn product_of(&self, p: usize, values: impl Fn(usize) -> Row) -> Row {
        let mut sum = [0.0; SIDE];
        add_transposed(&mut sum, &self.blocks[p], &values(p));
        for &(s, side) in &self.incident[p] {
            let other = values(self.set.seams[s].panels[1 - side]);
            if side == 0 {
                add_product(&mut sum, &self.couplings[s], &other);
            } else {
                add_transposed(&mut sum, &self.couplings[s], &other);
            }
        }
        sum
    }

    /// The step `(A + damping · diag A) x = −g` by preconditioned conjugate gradients; `damping` has
    /// a share for each mold and its panels.
    pub(crate) fn solve(
        &self,
        damping: &[f64],
        solver: &mut ConjugateGradients,
        pulse: &Pulse<'_>,
    ) -> Solution {
        let (mut preconditioner, diagonal) = Arrows::new(self, damping);
        let side = self.side();
        let mut step = vec![0.0; self.unknowns()];
        let mut operator = Damped {
            system: self,
            diagonal: &diagonal,
            shares: vec![[0.0; MAX_PARAMETERS]; self.blocks.len()],
        };
        let stop = &mut Stop(pulse);
        let report = solver.solve(&mut operator, &mut preconditioner, &side, &mut step, &CG, stop);
        let promised = self.promised(&step, &side, &diagonal);
        Solution { step, promised, report }
    }

    /// `|r|² − |r + J x|² = xᵀb + xᵀD x` for the `x` that conjugate gradients give, by mold.
    fn promised(&self, x: &[f64], side: &[f64], diagonal: &[f64]) -> Vec<f64> {
        let gain = |x: &[f64], b: &[f64], d: &[f64]| -> f64 {
            x.iter().zip(b).zip(d).map(|((x, b), d)| x * b + d * x * x).sum()
        };
        let panels = self.blocks.len();
        let (poses, molds) = parts(x, panels);
        let (pose_sides, mold_sides) = parts(side, panels);
        let (pose_diagonals, mold_diagonals) = parts(diagonal, panels);
        let mut promised: Vec<f64> =
            (0..self.molds).map(|m| gain(&molds[m], &mold_sides[m], &mold_diagonals[m])).collect();
        for (p, &label) in self.labels.iter().enumerate() {
            promised[label] += gain(&poses[p], &pose_sides[p], &pose_diagonals[p]);
        }
        promised
    }
}

/// The normal matrix with damping.
struct Damped<'s> {
    system: &'s System<'s>,
    diagonal: &'s [f64],
    /// Scratch space: what every panel adds to its mold.
    shares: Vec<[f64; MAX_PARAMETERS]>,
}

impl LinearOperator for Damped<'_> {
    fn apply(&mut self, x: &[f64], out: &mut [f64]) {
        let (system, panels) = (self.system, self.system.blocks.len());
        let (poses, molds) = parts(x, panels);
        let values = |p: usize| {
            let mut values = [0.0; SIDE];
            values[..POSE].copy_from_slice(&poses[p]);
            values[POSE..].copy_from_slice(&molds[system.labels[p]]);
            values
        };
        let (out_poses, out_molds) = parts_mut(out, panels);
        out_poses.par_iter_mut().zip(&mut self.shares).with_min_len(64).enumerate().for_each(
            |(p, (pose, mold))| {
                let sum = pulp::Arch::new().dispatch(|| system.product_of(p, values));
                pose.copy_from_slice(&sum[..POSE]);
                mold.copy_from_slice(&sum[POSE..]);
            },
        );
        // In the order of the panels: the same for every number of threads.
        out_molds.iter_mut().for_each(|m| *m = [0.0; MAX_PARAMETERS]);
        for (share, &label) in self.shares.iter().zip(system.labels) {
            out_molds[label].iter_mut().zip(share).for_each(|(o, v)| *o += v);
        }
        out.iter_mut().zip(self.diagonal).zip(x).for_each(|((o, d), x)| *o += d * x);
    }

    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        dot(a, b, self.system.blocks.len())
    }
}

/// The preconditioner: each mold with the poses of its panels, without what couples panels with
/// one another. Without the pose blocks a slide of all panels on a mold and the change of the mold
/// that undoes it would be far from solved.
struct Arrows<'s> {
    labels: &'s [usize],
    /// Factored pose blocks.
    poses: Vec<[[f64; POSE]; POSE]>,
    /// `pose block⁻¹ · cross`, a column per mold parameter.
    through: Vec<[[f64; POSE]; MAX_PARAMETERS]>,
    /// Factored systems in the parameters of each mold, after the poses are eliminated.
    molds: Vec<[[f64; MAX_PARAMETERS]; MAX_PARAMETERS]>,
}

impl<'s> Arrows<'s> {
    /// The preconditioner, and the damping of every unknown.
    fn new(system: &'s System<'_>, damping: &[f64]) -> (Self, Vec<f64>) {
        let (blocks, labels) = (&system.blocks, system.labels);
        let mut diagonal = vec![0.0; system.unknowns()];
        let (pose_diagonals, mold_diagonals) = parts_mut(&mut diagonal, blocks.len());
        let mut molds = vec![[[0.0; MAX_PARAMETERS]; MAX_PARAMETERS]; system.molds];
        for (block, &label) in blocks.iter().zip(labels) {
            let mold = &mut molds[label];
            for i in 0..MAX_PARAMETERS {
                for j in 0..=i {
                    mold[i][j] += block[POSE + i][POSE + j];
                }
            }
        }
        for ((d, block), &damping) in mold_diagonals.iter_mut().zip(&mut molds).zip(damping) {
            damp(block, d, damping);
        }
        let mut poses = vec![[[0.0; POSE]; POSE]; blocks.len()];
        let mut through = vec![[[0.0; POSE]; MAX_PARAMETERS]; blocks.len()];
        poses
            .par_iter_mut()
            .zip(&mut through)
            .zip(pose_diagonals)
            .zip(blocks)
            .zip(labels)
            .with_min_len(64)
            .for_each(|((((pose, through), d), block), &label)| {
                for i in 0..POSE {
                    pose[i].copy_from_slice(&block[i][..POSE]);
                }
                damp(pose, d, damping[label]);
                factor_semidefinite(pose, PIVOT_RATIO);
                for (i, column) in through.iter_mut().enumerate() {
                    column.copy_from_slice(&block[POSE + i][..POSE]);
                    solve_semidefinite(pose, column);
                }
            });
        for (p, (block, &label)) in blocks.iter().zip(labels).enumerate() {
            let mold = &mut molds[label];
            for i in 0..MAX_PARAMETERS {
                for j in 0..=i {
                    let cross = &block[POSE + i][..POSE];
                    mold[i][j] -= cross.iter().zip(through[p][j]).map(|(a, b)| a * b).sum::<f64>();
                }
            }
        }
        molds.iter_mut().for_each(|mold| factor_semidefinite(mold, PIVOT_RATIO));
        (Self { labels, poses, through, molds }, diagonal)
    }
}

impl Preconditioner for Arrows<'_> {
    fn precondition(&mut self, residual: &[f64], out: &mut [f64]) {
        let panels = self.poses.len();
        let (poses, molds) = parts(residual, panels);
        let (out_poses, out_molds) = parts_mut(out, panels);
        out_molds.copy_from_slice(molds);
        for ((through, r), &label) in self.through.iter().zip(poses).zip(self.labels) {
            for (z, column) in out_molds[label].iter_mut().zip(through) {
                *z -= column.iter().zip(r).map(|(a, b)| a * b).sum::<f64>();
            }
        }
        out_molds.iter_mut().zip(&self.molds).for_each(|(z, l)| solve_semidefinite(l, z));
        let molds = &*out_molds;
        out_poses
            .par_iter_mut()
            .zip(poses)
            .zip(&self.poses)
            .zip(&self.through)
            .zip(self.labels)
            .with_min_len(64)
            .for_each(|((((z, r), pose), through), &label)| {
                *z = *r;
                solve_semidefinite(pose, z);
                for (column, change) in through.iter().zip(&molds[label]) {
                    z.iter_mut().zip(column).for_each(|(z, c)| *z -= c * change);
                }
            });
    }
}

/// `diagonal = damping · diag(block)`, added to the block.
fn damp<const N: usize>(block: &mut [[f64; N]; N], diagonal: &mut [f64; N], damping: f64) {
    for i in 0..N {
        diagonal[i] = damping * block[i][i];
        block[i][i] += diagonal[i];
    }
}

/// `out += matrixᵀ x`; the matrix may be symmetric.
#[inline(always)]
fn add_transposed(out: &mut Row, matrix: &Matrix, x: &Row) {
    for (row, factor) in matrix.iter().zip(x) {
        out.iter_mut().zip(row).for_each(|(o, a)| *o += a * factor);
    }
}

/// `out += matrix x`.
#[inline(always)]
fn add_product(out: &mut Row, matrix: &Matrix, x: &Row) {
    for (o, row) in out.iter_mut().zip(matrix) {
        *o += row.iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
    }
}

fn seam_part(
    set: &PanelSet,
    fit: &Fit,
    s: usize,
    options: &SeamOptions,
    seam_weight: f64,
) -> SeamPart {
    let seam = &set.seams[s];
    let root = seam_weight.sqrt();
    let (points, normals) = set.edge_samples(seam.edge);
    let mut residual = [0.0; MOST_ROWS];
    let mut sides = [[[0.0; SIDE]; MOST_ROWS]; 2];
    let mut count = ROWS;
    for k in 0..SEAM_SAMPLES {
        let tangents = normals[k].any_orthonormal_pair().into();
        let here = seam.panels.map(|p| {
            let mold = &fit.molds[fit.labels[p]];
            seam_side(mold, &fit.poses[p], points[k], normals[k], tangents)
        });
        let [a, b] = &here;
        let apart = [a.offset - b.offset, a.tilt[0] - b.tilt[0], a.tilt[1] - b.tilt[1]];
        let mut add = |row: usize, value: f64, factors: [f64; 3]| {
            residual[row] = value;
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                for (of, factor) in here[side].rows.iter().zip(factors) {
                    let out = sides[side][row].iter_mut();
                    out.zip(of).for_each(|(o, v)| *o += sign * factor * v);
                }
            }
        };
        let gap_weight = root * options.gap_weight;
        add(3 * k, gap_weight * apart[0], [gap_weight, 0.0, 0.0]);
        add(3 * k + 1, root * apart[1], [0.0, root, 0.0]);
        add(3 * k + 2, root * apart[2], [0.0, 0.0, root]);
        let Some(hinge) = &options.hinge else { continue };
        let weight = root * hinge.weight.sqrt();
        let (gap, kink) = (apart[0].abs(), apart[1].hypot(apart[2]));
        if gap > hinge.gap {
            add(count, weight * (gap - hinge.gap), [weight * apart[0].signum(), 0.0, 0.0]);
            count += 1;
        }
        if kink > hinge.kink {
            let [t1, t2] = [apart[1], apart[2]].map(|t| weight * t / kink);
            add(count, weight * (kink - hinge.kink), [0.0, t1, t2]);
            count += 1;
        }
    }
    let mut part = SeamPart {
        own: [[[0.0; SIDE]; SIDE]; 2],
        sides: [[0.0; SIDE]; 2],
        coupling: [[0.0; SIDE]; SIDE],
    };
    for k in 0..2 {
        for (row, r) in sides[k][..count].iter().zip(&residual) {
            part.sides[k].iter_mut().zip(row).for_each(|(o, a)| *o -= a * r);
        }
    }
    let SeamPart { own, coupling, .. } = &mut part;
    pulp::Arch::new().dispatch(|| {
        for (own, rows) in own.iter_mut().zip(&sides) {
            add_products(own, &rows[..count], &rows[..count]);
        }
        add_products(coupling, &sides[0][..count], &sides[1][..count]);
    });
    part
}
