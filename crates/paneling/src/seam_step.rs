//! The joint seam step: poses and molds together, against kinks and gaps.
//!
//! The alternation fits every panel to the design and never looks at its neighbours. Here all
//! poses and all molds move at once to lower the sum of squared gaps and kinks along the seams,
//! while a weaker term keeps them on the design. The Gauss-Newton systems are solved by
//! preconditioned conjugate gradients on the Jacobian blocks of the seams: the shared molds would
//! fill a factorisation with a dense border.

use crate::fit::{EXACT, Fit};
use crate::mold::MAX_PARAMETERS;
use crate::panels::PanelSet;
use crate::panels::SEAM_SAMPLES;
use crate::residuals::{POSE, SIDE, foot, moved, sample_mold_rows, sample_pose_rows, seam_side};
use crate::small::{factor, solve_factored};
use glam::DVec3;
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

/// Jacobian of a seam: both sides, the second with its sign turned.
struct SeamRows {
    residual: [f64; ROWS],
    sides: [[[f64; SIDE]; ROWS]; 2],
}

/// Normal equations of a panel's distance to the design.
struct DesignBlock {
    matrix: [[f64; SIDE]; SIDE],
    gradient: [f64; SIDE],
}

/// A point of the space of all poses and molds.
#[derive(Clone)]
struct Unknowns {
    poses: Vec<[f64; POSE]>,
    molds: Vec<[f64; MAX_PARAMETERS]>,
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

/// Lowers kinks and gaps of a fit; returns the energy before and after every accepted step.
///
/// `weights` has one factor per seam for its part of the energy.
pub(crate) fn improve(
    set: &PanelSet,
    fit: &mut Fit,
    options: &SeamOptions,
    weights: &[f64],
) -> Vec<f64> {
    assert_eq!(weights.len(), set.seams.len(), "one weight per seam");
    let incident = incident_seams(set);
    let mut energy = total_energy(set, fit, options, weights);
    let mut history = vec![energy];
    let mut damping = 1e-4;
    let mut step = 0;
    let exact = EXACT * set.edges.points.len() as f64;
    while step < options.steps && energy > exact {
        let system = System::linearize(set, fit, options, weights, &incident);
        let mut accepted = false;
        // A refused step is tried again with more damping on the same linearisation.
        for _ in 0..4 {
            let change = system.solve(fit, damping);
            let trial = applied(fit, &change);
            let next = total_energy(set, &trial, options, weights);
            step += 1;
            if next < energy {
                accepted = true;
                let share = (energy - next) / energy;
                *fit = trial;
                energy = next;
                history.push(energy);
                damping = (damping * 0.1).max(1e-9);
                if share < options.stall {
                    step = options.steps;
                }
                break;
            }
            damping *= 10.0;
        }
        if !accepted {
            break;
        }
    }
    fit.energies = (0..set.len()).into_par_iter().map(|p| fit.panel_energy(set, p)).collect();
    history
}

/// For every panel the seams around it and which of their sides it is.
fn incident_seams(set: &PanelSet) -> Vec<Vec<(usize, usize)>> {
    let mut incident = vec![Vec::new(); set.len()];
    for (s, seam) in set.seams.iter().enumerate() {
        for (side, &p) in seam.panels.iter().enumerate() {
            incident[p].push((s, side));
        }
    }
    incident
}

fn total_energy(set: &PanelSet, fit: &Fit, options: &SeamOptions, weights: &[f64]) -> f64 {
    let seams: Vec<f64> = set
        .seams
        .par_iter()
        .zip(weights)
        .with_min_len(64)
        .map(|(seam, weight)| {
            let (points, normals) = set.edge_samples(seam.edge);
            let mut sum = 0.0;
            for k in 0..SEAM_SAMPLES {
                let [a, b] = seam.panels.map(|p| {
                    let pose = &fit.poses[p];
                    let to_local = pose.rotation.transpose();
                    let local = to_local * (points[k] - pose.origin);
                    let (t, m) = foot(&fit.molds[fit.labels[p]], local, to_local * normals[k]);
                    (t, pose.rotation * m)
                });
                let tilt = a.1 - b.1;
                // Only the tangential part counts, as in the rows.
                let along = tilt.dot(normals[k]);
                let gap = options.gap_weight * (a.0 - b.0);
                sum += gap * gap + tilt.length_squared() - along * along;
            }
            weight * sum
        })
        .collect();
    let design: Vec<f64> =
        (0..set.len()).into_par_iter().with_min_len(64).map(|p| fit.panel_energy(set, p)).collect();
    let weight = options.design_weight * options.design_weight;
    seams.iter().sum::<f64>() + weight * design.iter().sum::<f64>()
}

fn applied(fit: &Fit, change: &Unknowns) -> Fit {
    let mut trial = fit.clone();
    for (pose, step) in trial.poses.iter_mut().zip(&change.poses) {
        *pose = moved(pose, step);
    }
    for (mold, step) in trial.molds.iter_mut().zip(&change.molds) {
        for (p, s) in mold.parameters.iter_mut().zip(step) {
            *p += s;
        }
    }
    trial
}

/// The Gauss-Newton system at one iterate.
struct System<'a> {
    set: &'a PanelSet,
    incident: &'a [Vec<(usize, usize)>],
    seams: Vec<SeamRows>,
    design: Vec<DesignBlock>,
}

impl<'a> System<'a> {
    fn linearize(
        set: &'a PanelSet,
        fit: &Fit,
        options: &SeamOptions,
        weights: &[f64],
        incident: &'a [Vec<(usize, usize)>],
    ) -> Self {
        let seams = set
            .seams
            .par_iter()
            .zip(weights)
            .with_min_len(16)
            .map(|(seam, seam_weight)| {
                let seam_weight = seam_weight.sqrt();
                let (points, normals) = set.edge_samples(seam.edge);
                let mut rows = SeamRows { residual: [0.0; ROWS], sides: [[[0.0; SIDE]; ROWS]; 2] };
                for k in 0..SEAM_SAMPLES {
                    let (t1, t2) = normals[k].any_orthonormal_pair();
                    for (side, &p) in seam.panels.iter().enumerate() {
                        let sign = if side == 0 { seam_weight } else { -seam_weight };
                        let mold = &fit.molds[fit.labels[p]];
                        let here = seam_side(mold, &fit.poses[p], points[k], normals[k], [t1, t2]);
                        let values = [here.offset, here.tilt[0], here.tilt[1]];
                        for row in 0..3 {
                            let weight = sign * if row == 0 { options.gap_weight } else { 1.0 };
                            rows.residual[3 * k + row] += weight * values[row];
                            rows.sides[side][3 * k + row] = here.rows[row].map(|v| weight * v);
                        }
                    }
                }
                rows
            })
            .collect();
        let weight = options.design_weight * options.design_weight;
        let design = (0..set.len())
            .into_par_iter()
            .with_min_len(16)
            .map(|p| design_block(set, fit, p, weight))
            .collect();
        Self { set, incident, seams, design }
    }

    /// Applies the normal matrix without damping.
    fn apply(&self, fit: &Fit, x: &Unknowns) -> Unknowns {
        let side_values = |p: usize| {
            let mut values = [0.0; SIDE];
            values[..POSE].copy_from_slice(&x.poses[p]);
            values[POSE..].copy_from_slice(&x.molds[fit.labels[p]]);
            values
        };
        let products: Vec<[f64; ROWS]> = self
            .seams
            .par_iter()
            .zip(&self.set.seams)
            .with_min_len(64)
            .map(|(rows, seam)| {
                let mut y = [0.0; ROWS];
                for side in 0..2 {
                    let values = side_values(seam.panels[side]);
                    for (y, row) in y.iter_mut().zip(&rows.sides[side]) {
                        *y += row.iter().zip(&values).map(|(a, b)| a * b).sum::<f64>();
                    }
                }
                y
            })
            .collect();
        self.gather(fit, |p| {
            let values = side_values(p);
            let mut out = [0.0; SIDE];
            for (o, row) in out.iter_mut().zip(&self.design[p].matrix) {
                *o = row.iter().zip(&values).map(|(a, b)| a * b).sum();
            }
            for &(s, side) in &self.incident[p] {
                for (row, y) in self.seams[s].sides[side].iter().zip(&products[s]) {
                    out.iter_mut().zip(row).for_each(|(o, a)| *o += a * y);
                }
            }
            out
        })
    }

    /// Sums per-panel contributions into poses and molds, in the order of the panels.
    fn gather(&self, fit: &Fit, part: impl Fn(usize) -> [f64; SIDE] + Sync + Send) -> Unknowns {
        let parts: Vec<[f64; SIDE]> =
            (0..self.set.len()).into_par_iter().with_min_len(64).map(part).collect();
        let mut out = Unknowns::zero(parts.len(), fit.molds.len());
        for (p, values) in parts.iter().enumerate() {
            out.poses[p].copy_from_slice(&values[..POSE]);
            let mold = &mut out.molds[fit.labels[p]];
            mold.iter_mut().zip(&values[POSE..]).for_each(|(o, v)| *o += v);
        }
        out
    }

    /// Minus the gradient.
    fn right_hand_side(&self, fit: &Fit) -> Unknowns {
        self.gather(fit, |p| {
            let mut out = self.design[p].gradient.map(|g| -g);
            for &(s, side) in &self.incident[p] {
                let rows = &self.seams[s];
                for (row, r) in rows.sides[side].iter().zip(&rows.residual) {
                    out.iter_mut().zip(row).for_each(|(o, a)| *o -= a * r);
                }
            }
            out
        })
    }

    /// The step `(A + damping · diag A) x = −g` by conjugate gradients with block Jacobi.
    fn solve(&self, fit: &Fit, damping: f64) -> Unknowns {
        let blocks: Vec<[[f64; SIDE]; SIDE]> = (0..self.set.len())
            .into_par_iter()
            .with_min_len(64)
            .map(|p| {
                let mut block = self.design[p].matrix;
                for &(s, side) in &self.incident[p] {
                    for row in &self.seams[s].sides[side] {
                        for i in 0..SIDE {
                            for j in 0..=i {
                                block[i][j] += row[i] * row[j];
                            }
                        }
                    }
                }
                block
            })
            .collect();
        let mut pose_blocks = vec![[[0.0; POSE]; POSE]; blocks.len()];
        let mut mold_blocks = vec![[[0.0; MAX_PARAMETERS]; MAX_PARAMETERS]; fit.molds.len()];
        for (p, block) in blocks.iter().enumerate() {
            for i in 0..POSE {
                pose_blocks[p][i].copy_from_slice(&block[i][..POSE]);
            }
            let mold = &mut mold_blocks[fit.labels[p]];
            for i in 0..MAX_PARAMETERS {
                for j in 0..=i {
                    mold[i][j] += block[POSE + i][POSE + j];
                }
            }
        }
        let mut diagonal = Unknowns::zero(blocks.len(), fit.molds.len());
        for (d, block) in diagonal.poses.iter_mut().zip(&mut pose_blocks) {
            for i in 0..POSE {
                d[i] = damping * block[i][i];
                block[i][i] += d[i];
            }
        }
        for (d, block) in diagonal.molds.iter_mut().zip(&mut mold_blocks) {
            for i in 0..MAX_PARAMETERS {
                d[i] = damping * block[i][i];
                block[i][i] += d[i];
            }
        }
        pose_blocks.par_iter_mut().for_each(factor);
        mold_blocks.par_iter_mut().for_each(factor);
        let precondition = |r: &Unknowns| {
            let mut z = r.clone();
            z.poses.iter_mut().zip(&pose_blocks).for_each(|(z, l)| solve_factored(l, z));
            z.molds.iter_mut().zip(&mold_blocks).for_each(|(z, l)| solve_factored(l, z));
            z
        };
        let mut x = Unknowns::zero(blocks.len(), fit.molds.len());
        let mut r = self.right_hand_side(fit);
        let mut z = precondition(&r);
        let mut direction = z.clone();
        let mut rz = r.dot(&z);
        let goal = CG_TOLERANCE * CG_TOLERANCE * rz;
        for _ in 0..CG_STEPS {
            if !(rz > goal) {
                break;
            }
            let mut product = self.apply(fit, &direction);
            for ((q, d), v) in product.poses.iter_mut().zip(&diagonal.poses).zip(&direction.poses) {
                for i in 0..POSE {
                    q[i] += d[i] * v[i];
                }
            }
            for ((q, d), v) in product.molds.iter_mut().zip(&diagonal.molds).zip(&direction.molds) {
                for i in 0..MAX_PARAMETERS {
                    q[i] += d[i] * v[i];
                }
            }
            let curvature = direction.dot(&product);
            if !(curvature > 0.0) {
                break;
            }
            let alpha = rz / curvature;
            x.add(alpha, &direction);
            r.add(-alpha, &product);
            z = precondition(&r);
            let next = r.dot(&z);
            let beta = next / rz;
            rz = next;
            let mut fresh = z.clone();
            fresh.add(beta, &direction);
            direction = fresh;
        }
        x
    }
}

fn design_block(set: &PanelSet, fit: &Fit, p: usize, weight: f64) -> DesignBlock {
    let (points, normals) = set.panel_samples(p);
    let (pose, mold) = (&fit.poses[p], &fit.molds[fit.labels[p]]);
    let to_local = pose.rotation.transpose();
    let mut block = DesignBlock { matrix: [[0.0; SIDE]; SIDE], gradient: [0.0; SIDE] };
    for (x, n) in points.iter().zip(normals) {
        let local: DVec3 = to_local * (*x - pose.origin);
        let (r, pose_rows) = sample_pose_rows(mold, fit.slope_weight, local, to_local * *n);
        let mold_rows = sample_mold_rows(mold, fit.slope_weight, local);
        for k in 0..3 {
            let mut row = [0.0; SIDE];
            row[..POSE].copy_from_slice(&pose_rows[k]);
            row[POSE..].copy_from_slice(&mold_rows[k]);
            for i in 0..SIDE {
                for j in 0..SIDE {
                    block.matrix[i][j] += weight * row[i] * row[j];
                }
                block.gradient[i] += weight * row[i] * r[k];
            }
        }
    }
    block
}
