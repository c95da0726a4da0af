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
use numerics::{PIVOT_RATIO, factor_semidefinite, solve_semidefinite};
use rayon::prelude::*;

/// Rows of a seam: a gap and two components of the kink per sample.
const ROWS: usize = 3 * SEAM_SAMPLES;
/// Relative residual at which the conjugate gradients stop.
const CG_TOLERANCE: f64 = 0.03;
/// Most conjugate gradient steps per linearisation.
const CG_STEPS: usize = 40;

/// Settings of the joint seam step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SeamOptions {
    /// Most Gauss-Newton steps.
    pub(crate) steps: usize,
    /// Weight of a gap in units of the panel size, against a kink in radians.
    pub(crate) gap_weight: f64,
    /// Weight of the distance to the design against the seams.
    pub(crate) design_weight: f64,
    /// Ends when a step lowers the energy by less than this share.
    pub(crate) stall: f64,
}

/// A point of the space of all poses and molds.
#[derive(Clone)]
pub(crate) struct Unknowns {
    pub(crate) poses: Vec<[f64; POSE]>,
    pub(crate) molds: Vec<[f64; MAX_PARAMETERS]>,
}

impl Unknowns {
    fn zero(poses: usize, molds: usize) -> Self {
        Self { poses: vec![[0.0; POSE]; poses], molds: vec![[0.0; MAX_PARAMETERS]; molds] }
    }

    fn dot(&self, other: &Self) -> f64 {
        // Serial and in order: the same for every number of threads.
        let poses: f64 = self
            .poses
            .iter()
            .zip(&other.poses)
            .map(|(a, b)| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>())
            .sum();
        let molds: f64 = self
            .molds
            .iter()
            .zip(&other.molds)
            .map(|(a, b)| a.iter().zip(b).map(|(x, y)| x * y).sum::<f64>())
            .sum();
        poses + molds
    }

    /// `self += diagonal · other`, entry by entry.
    fn add_scaled_by(&mut self, diagonal: &Self, other: &Self) {
        for ((q, d), v) in self.poses.iter_mut().zip(&diagonal.poses).zip(&other.poses) {
            q.iter_mut().zip(d).zip(v).for_each(|((q, d), v)| *q += d * v);
        }
        for ((q, d), v) in self.molds.iter_mut().zip(&diagonal.molds).zip(&other.molds) {
            q.iter_mut().zip(d).zip(v).for_each(|((q, d), v)| *q += d * v);
        }
    }

    /// `self = factor · self + other`.
    fn scale_and_add(&mut self, factor: f64, other: &Self) {
        for (a, b) in self.poses.iter_mut().zip(&other.poses) {
            a.iter_mut().zip(b).for_each(|(x, y)| *x = factor * *x + y);
        }
        for (a, b) in self.molds.iter_mut().zip(&other.molds) {
            a.iter_mut().zip(b).for_each(|(x, y)| *x = factor * *x + y);
        }
    }

    /// `self += factor · other`.
    fn add(&mut self, factor: f64, other: &Self) {
        for (a, b) in self.poses.iter_mut().zip(&other.poses) {
            a.iter_mut().zip(b).for_each(|(x, y)| *x += factor * y);
        }
        for (a, b) in self.molds.iter_mut().zip(&other.molds) {
            a.iter_mut().zip(b).for_each(|(x, y)| *x += factor * y);
        }
    }
}

/// The Gauss-Newton system at one iterate.
pub(crate) struct System<'a> {
    set: &'a PanelSet,
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
    pub(crate) step: Unknowns,
    /// By how much the energy would fall if it were quadratic, by mold.
    pub(crate) promised: Vec<f64>,
    pub(crate) iterations: usize,
}

/// A seam's share of the system.
struct SeamPart {
    own: [Matrix; 2],
    sides: [Row; 2],
    coupling: Matrix,
}

impl<'a> System<'a> {
    /// The system at `fit`; `incident` as of [`PanelSet::incident_seams`].
    pub(crate) fn linearize(
        set: &'a PanelSet,
        fit: &Fit,
        options: &SeamOptions,
        weights: &[f64],
        incident: &'a [Vec<(usize, usize)>],
    ) -> Self {
        let seams: Vec<SeamPart> = (0..set.seams.len())
            .into_par_iter()
            .with_min_len(16)
            .map(|s| seam_part(set, fit, s, options.gap_weight, weights[s]))
            .collect();
        let weight = options.design_weight * options.design_weight;
        let (blocks, sides) = (0..set.len())
            .into_par_iter()
            .with_min_len(16)
            .map_init(Vec::new, |rows, p| {
                let mold = &fit.molds[fit.labels[p]];
                let (mut block, mut side) =
                    design_block(set, p, mold, &fit.poses[p], fit.slope_weight, rows);
                block.iter_mut().flatten().chain(&mut side).for_each(|v| *v *= weight);
                for &(s, k) in &incident[p] {
                    for (row, own) in block.iter_mut().zip(&seams[s].own[k]) {
                        row.iter_mut().zip(own).for_each(|(a, b)| *a += b);
                    }
                    side.iter_mut().zip(&seams[s].sides[k]).for_each(|(a, b)| *a += b);
                }
                (block, side)
            })
            .unzip();
        let couplings = seams.into_iter().map(|s| s.coupling).collect();
        Self { set, incident, couplings, blocks, sides }
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

    /// Applies the normal matrix without damping.
    fn apply(&self, fit: &Fit, x: &Unknowns, out: &mut Unknowns) {
        let values = |p: usize| {
            let mut values = [0.0; SIDE];
            values[..POSE].copy_from_slice(&x.poses[p]);
            values[POSE..].copy_from_slice(&x.molds[fit.labels[p]]);
            values
        };
        let parts: Vec<[f64; MAX_PARAMETERS]> = out
            .poses
            .par_iter_mut()
            .with_min_len(64)
            .enumerate()
            .map(|(p, pose)| {
                let sum = pulp::Arch::new().dispatch(|| self.product_of(p, values));
                pose.copy_from_slice(&sum[..POSE]);
                let mut mold = [0.0; MAX_PARAMETERS];
                mold.copy_from_slice(&sum[POSE..]);
                mold
            })
            .collect();
        // In the order of the panels: the same for every number of threads.
        out.molds.iter_mut().for_each(|m| *m = [0.0; MAX_PARAMETERS]);
        for (part, &label) in parts.iter().zip(&fit.labels) {
            out.molds[label].iter_mut().zip(part).for_each(|(o, v)| *o += v);
        }
    }

    /// The step `(A + damping · diag A) x = −g` by preconditioned conjugate gradients; `damping` has
    /// a share for each mold and its panels.
    pub(crate) fn solve(&self, fit: &Fit, damping: &[f64]) -> Solution {
        let preconditioner = Arrows::new(&self.blocks, fit, damping);
        let mut r = Unknowns::zero(self.blocks.len(), fit.molds.len());
        for (p, side) in self.sides.iter().enumerate() {
            r.poses[p].copy_from_slice(&side[..POSE]);
            let mold = &mut r.molds[fit.labels[p]];
            mold.iter_mut().zip(&side[POSE..]).for_each(|(o, v)| *o += v);
        }
        let side = r.clone();
        let mut x = Unknowns::zero(self.blocks.len(), fit.molds.len());
        let mut z = x.clone();
        let mut product = x.clone();
        preconditioner.apply(fit, &r, &mut z);
        let mut direction = z.clone();
        let mut rz = r.dot(&z);
        let goal = CG_TOLERANCE * CG_TOLERANCE * rz;
        let mut iterations = 0;
        while iterations < CG_STEPS && rz > goal {
            iterations += 1;
            self.apply(fit, &direction, &mut product);
            product.add_scaled_by(&preconditioner.diagonal, &direction);
            let curvature = direction.dot(&product);
            if !(curvature > 0.0) {
                break;
            }
            let alpha = rz / curvature;
            x.add(alpha, &direction);
            r.add(-alpha, &product);
            preconditioner.apply(fit, &r, &mut z);
            let next = r.dot(&z);
            direction.scale_and_add(next / rz, &z);
            rz = next;
        }
        let promised = preconditioner.promised(fit, &x, &side);
        Solution { step: x, promised, iterations }
    }
}

/// The preconditioner: each mold with the poses of its panels, without what couples panels with
/// one another. Without the pose blocks a slide of all panels on a mold and the change of the mold
/// that undoes it would be far from solved.
struct Arrows {
    /// Damping of every unknown.
    diagonal: Unknowns,
    /// Factored pose blocks.
    poses: Vec<[[f64; POSE]; POSE]>,
    /// `pose block⁻¹ · cross`, a column per mold parameter.
    through: Vec<[[f64; POSE]; MAX_PARAMETERS]>,
    /// Factored systems in the parameters of each mold, after the poses are eliminated.
    molds: Vec<[[f64; MAX_PARAMETERS]; MAX_PARAMETERS]>,
}

impl Arrows {
    fn new(blocks: &[Matrix], fit: &Fit, damping: &[f64]) -> Self {
        let mut diagonal = Unknowns::zero(blocks.len(), fit.molds.len());
        let mut molds = vec![[[0.0; MAX_PARAMETERS]; MAX_PARAMETERS]; fit.molds.len()];
        for (p, block) in blocks.iter().enumerate() {
            let mold = &mut molds[fit.labels[p]];
            for i in 0..MAX_PARAMETERS {
                for j in 0..=i {
                    mold[i][j] += block[POSE + i][POSE + j];
                }
            }
        }
        for ((d, block), &damping) in diagonal.molds.iter_mut().zip(&mut molds).zip(damping) {
            damp(block, d, damping);
        }
        let mut poses = vec![[[0.0; POSE]; POSE]; blocks.len()];
        let mut through = vec![[[0.0; POSE]; MAX_PARAMETERS]; blocks.len()];
        poses
            .par_iter_mut()
            .zip(&mut through)
            .zip(&mut diagonal.poses)
            .zip(blocks)
            .zip(&fit.labels)
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
        for (p, block) in blocks.iter().enumerate() {
            let mold = &mut molds[fit.labels[p]];
            for i in 0..MAX_PARAMETERS {
                for j in 0..=i {
                    let cross = &block[POSE + i][..POSE];
                    mold[i][j] -= cross.iter().zip(through[p][j]).map(|(a, b)| a * b).sum::<f64>();
                }
            }
        }
        molds.iter_mut().for_each(|mold| factor_semidefinite(mold, PIVOT_RATIO));
        Self { diagonal, poses, through, molds }
    }

    /// `|r|² − |r + J x|² = xᵀb + xᵀD x` for the `x` that conjugate gradients give, by mold.
    fn promised(&self, fit: &Fit, x: &Unknowns, side: &Unknowns) -> Vec<f64> {
        let gain = |x: &[f64], b: &[f64], d: &[f64]| -> f64 {
            x.iter().zip(b).zip(d).map(|((x, b), d)| x * b + d * x * x).sum()
        };
        let mut promised: Vec<f64> = (0..x.molds.len())
            .map(|m| gain(&x.molds[m], &side.molds[m], &self.diagonal.molds[m]))
            .collect();
        for (p, &label) in fit.labels.iter().enumerate() {
            promised[label] += gain(&x.poses[p], &side.poses[p], &self.diagonal.poses[p]);
        }
        promised
    }

    fn apply(&self, fit: &Fit, r: &Unknowns, z: &mut Unknowns) {
        z.molds.clone_from(&r.molds);
        for ((through, r), &label) in self.through.iter().zip(&r.poses).zip(&fit.labels) {
            for (z, column) in z.molds[label].iter_mut().zip(through) {
                *z -= column.iter().zip(r).map(|(a, b)| a * b).sum::<f64>();
            }
        }
        z.molds.iter_mut().zip(&self.molds).for_each(|(z, l)| solve_semidefinite(l, z));
        let molds = &z.molds;
        z.poses
            .par_iter_mut()
            .zip(&r.poses)
            .zip(&self.poses)
            .zip(&self.through)
            .zip(&fit.labels)
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

fn seam_part(set: &PanelSet, fit: &Fit, s: usize, gap_weight: f64, seam_weight: f64) -> SeamPart {
    let seam = &set.seams[s];
    let root = seam_weight.sqrt();
    let (points, normals) = set.edge_samples(seam.edge);
    let mut residual = [0.0; ROWS];
    let mut sides = [[[0.0; SIDE]; ROWS]; 2];
    for k in 0..SEAM_SAMPLES {
        let (t1, t2) = normals[k].any_orthonormal_pair();
        for (side, &p) in seam.panels.iter().enumerate() {
            let sign = if side == 0 { root } else { -root };
            let mold = &fit.molds[fit.labels[p]];
            let here = seam_side(mold, &fit.poses[p], points[k], normals[k], [t1, t2]);
            let values = [here.offset, here.tilt[0], here.tilt[1]];
            for row in 0..3 {
                let weight = sign * if row == 0 { gap_weight } else { 1.0 };
                residual[3 * k + row] += weight * values[row];
                sides[side][3 * k + row] = here.rows[row].map(|v| weight * v);
            }
        }
    }
    let mut part = SeamPart {
        own: [[[0.0; SIDE]; SIDE]; 2],
        sides: [[0.0; SIDE]; 2],
        coupling: [[0.0; SIDE]; SIDE],
    };
    for k in 0..2 {
        for (row, r) in sides[k].iter().zip(&residual) {
            part.sides[k].iter_mut().zip(row).for_each(|(o, a)| *o -= a * r);
        }
    }
    let SeamPart { own, coupling, .. } = &mut part;
    pulp::Arch::new().dispatch(|| {
        for (own, rows) in own.iter_mut().zip(&sides) {
            add_products(own, rows, rows);
        }
        add_products(coupling, &sides[0], &sides[1]);
    });
    part
}
