//! One mold and the poses of all its panels, moved together.
//!
//! The alternation creeps where a change of the mold can nearly be undone by the poses. Here both
//! move in one damped Gauss-Newton step. Poses of different panels do not meet in any residual, so
//! they are eliminated panel by panel and a system in the mold's parameters remains.

use crate::fit::normal::{Matrix, Row, design_block};
use crate::fit::residuals::{POSE, panel_energy};
use crate::fit::retraction::moved_on;
use crate::fit::state::Fit;
use crate::layout::panels::{PanelSet, Pose};
use crate::mold::shape::{MAX_PARAMETERS, Mold};
use gp_solver::{
    Attempt, DampedModel, DampedOptions, DampedRun, DampingPolicy, Descending, Observer,
    SolverError, Status, Step, Verdict,
};
use numerics::{PIVOT_RATIO, factor_semidefinite, solve_semidefinite};
use rayon::prelude::*;

/// A mold whose step lowers the energy of its panels by less than this share stays as it is.
const STALL: f64 = 1e-3;
/// Tries per step.
const TRIES: usize = 4;
/// How the damping grows from one try to the next, and shrinks after a step.
const REFUSED: f64 = 10.0;
const TAKEN: f64 = 0.1;
/// Damping to start with, a share of the diagonal.
pub(crate) const FIRST_DAMPING: f64 = 1e-3;
const LEAST_DAMPING: f64 = 1e-9;
/// Share of the mean of a pose's diagonal that is always added to it.
const FREE: f64 = 1e-12;

/// A mold and its panels after a step.
pub(crate) struct Moved {
    pub(crate) mold: Mold,
    /// Pose and energy of each panel of the mold.
    pub(crate) panels: Vec<(Pose, f64)>,
}

/// A step of mold `m` that lowers the energy of its panels, or `None` if none was found. `damping`
/// is that of its next step; `None` once there is none or one has changed too little.
pub(crate) fn step(
    set: &PanelSet,
    fit: &Fit,
    m: usize,
    damping: &mut Option<f64>,
) -> Option<Moved> {
    let before = fit.members[m].iter().map(|&p| fit.energies[p]).sum();
    let mut model = MoldModel { set, fit, m, blocks: Vec::new(), energy: before, moved: None };
    // A run of this mold alone, beside those of the other molds.
    let mut run = DampedRun::new(&[(*damping)?]);
    let options = DampedOptions { stall: STALL, exact: f64::NEG_INFINITY, ..Default::default() };
    let ended = run.step(&mut model, &mut Tenfold { tries: 0 }, &options, &mut ());
    *damping = (ended == Ok(Step::Taken)).then(|| run.damping()[0]);
    model.moved.filter(|_| run.history().len() > 1)
}

/// Normal equations of every panel in its pose and the mold's parameters.
fn linearized(set: &PanelSet, fit: &Fit, m: usize) -> Vec<(Matrix, Row)> {
    let members = &fit.members[m];
    members
        .par_iter()
        .with_min_len(32)
        .map_init(Vec::new, |rows, &p| {
            design_block(set, p, &fit.molds[m], &fit.poses[p], fit.slope_weight, rows)
        })
        .collect()
}

/// A mold and its panels, linearised.
struct MoldModel<'m> {
    set: &'m PanelSet,
    fit: &'m Fit,
    m: usize,
    blocks: Vec<(Matrix, Row)>,
    /// Where it stands, or leads once it is taken.
    energy: f64,
    moved: Option<Moved>,
}

impl Descending for MoldModel<'_> {
    fn energy(&self) -> f64 {
        self.energy
    }

    fn linearize(&mut self, _: &mut dyn Observer) -> Result<Result<(), Status>, SolverError> {
        self.blocks = linearized(self.set, self.fit, self.m);
        Ok(Ok(()))
    }

    /// The caller puts the step into the fit.
    fn take(&mut self) {
        self.energy = self.moved.iter().flat_map(|moved| &moved.panels).map(|p| p.1).sum();
    }
}

impl DampedModel for MoldModel<'_> {
    fn attempt(&mut self, damping: &[f64]) -> Result<Attempt, SolverError> {
        let Self { set, fit, .. } = *self;
        let mold = &fit.molds[self.m];
        let (change, changes) = solve(&self.blocks, damping[0]);
        let mut trial = *mold;
        trial.parameters.iter_mut().zip(change).for_each(|(p, s)| *p += s);
        let panels: Vec<(Pose, f64)> = fit.members[self.m]
            .par_iter()
            .with_min_len(32)
            .zip(&changes)
            .map(|(&p, change)| {
                let pose = moved_on(set, p, &fit.poses[p], change, mold, &trial);
                let (points, normals) = set.panel_samples(p);
                (pose, panel_energy(&trial, fit.slope_weight, &pose, points, normals))
            })
            .collect();
        let decrease = self.energy - panels.iter().map(|p| p.1).sum::<f64>();
        self.moved = Some(Moved { mold: trial, panels });
        // The policy asks only whether the energy falls.
        Ok(Attempt { decrease, ..Attempt::default() })
    }
}

/// Any decrease will do; damping grows and shrinks tenfold.
struct Tenfold {
    tries: usize,
}

impl DampingPolicy<MoldModel<'_>> for Tenfold {
    fn judge(&mut self, _: &mut MoldModel<'_>, attempt: &Attempt, damping: &mut [f64]) -> Verdict {
        // NaN, a panel beyond the reach of a round mold, is refused too.
        if attempt.decrease > 0.0 {
            damping[0] = (TAKEN * damping[0]).max(LEAST_DAMPING);
            return Verdict::Accept;
        }
        damping[0] *= REFUSED;
        self.tries += 1;
        if self.tries < TRIES { Verdict::Retry } else { Verdict::End(Status::Stalled) }
    }

    fn mend(&mut self, _: &mut MoldModel<'_>, _: &mut [f64]) -> Verdict {
        // The small Cholesky leaves out what has no pivot and never fails.
        Verdict::End(Status::Stalled)
    }
}

/// The damped step of the mold and of every pose.
fn solve(blocks: &[(Matrix, Row)], damping: f64) -> ([f64; MAX_PARAMETERS], Vec<[f64; POSE]>) {
    // Per panel: the factored pose block, and pose block⁻¹ · cross, a column per mold parameter.
    let eliminated: Vec<_> = blocks
        .par_iter()
        .with_min_len(64)
        .map(|(block, _)| {
            let mut pose = [[0.0; POSE]; POSE];
            pose.iter_mut().zip(block).for_each(|(p, b)| p.copy_from_slice(&b[..POSE]));
            let mean = (0..POSE).map(|i| pose[i][i]).sum::<f64>() / POSE as f64;
            // Each by its own size, for a slide changes much less than a lift; and a little of the
            // mean, for a plane is free to slide and a sphere to turn.
            for (i, row) in pose.iter_mut().enumerate() {
                row[i] += damping * row[i] + FREE * mean;
            }
            factor_semidefinite(&mut pose, PIVOT_RATIO);
            let mut through = [[0.0; POSE]; MAX_PARAMETERS];
            for (column, cross) in through.iter_mut().zip(&block[POSE..]) {
                column.copy_from_slice(&cross[..POSE]);
                solve_semidefinite(&pose, column);
            }
            (pose, through)
        })
        .collect();
    let mut matrix = [[0.0; MAX_PARAMETERS]; MAX_PARAMETERS];
    let mut change = [0.0; MAX_PARAMETERS];
    for ((block, side), (_, through)) in blocks.iter().zip(&eliminated) {
        for i in 0..MAX_PARAMETERS {
            for j in 0..=i {
                matrix[i][j] += block[POSE + i][POSE + j] - dot(&block[POSE + i], &through[j]);
            }
            matrix[i][i] += damping * block[POSE + i][POSE + i];
            change[i] += side[POSE + i] - dot(side, &through[i]);
        }
    }
    factor_semidefinite(&mut matrix, PIVOT_RATIO);
    solve_semidefinite(&matrix, &mut change);
    let poses = blocks.iter().zip(&eliminated).map(|((block, side), (pose, _))| {
        let mut out = [0.0; POSE];
        out.copy_from_slice(&side[..POSE]);
        for (cross, change) in block[POSE..].iter().zip(change) {
            out.iter_mut().zip(cross).for_each(|(o, c)| *o -= c * change);
        }
        solve_semidefinite(pose, &mut out);
        out
    });
    (change, poses.collect())
}

/// The product of the pose part of a row with a pose.
fn dot(row: &Row, pose: &[f64; POSE]) -> f64 {
    row.iter().zip(pose).map(|(x, y)| x * y).sum()
}
