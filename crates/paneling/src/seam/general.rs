//! The joint seam step as a problem of the solver, for blocks of the caller's own.

use crate::blocks::{Assembly, DesignRows, GapRows, KinkRows, ReachRows};
use crate::error::Error;
use crate::fit::state::Fit;
use crate::seam::unknowns::Seams;
use gp_solver::{BlockId, Extra, Options, Problem, Run, Stage, System};
use std::sync::Arc;

/// The seam step at a fit as a problem: the same rows as the matrix-free system, so that its energy
/// is half of that one's, and the gradient half of its gradient.
pub(crate) struct SeamProblem {
    pub(crate) assembly: Arc<Assembly>,
    pub(crate) problem: Problem<'static>,
}

impl SeamProblem {
    pub(crate) fn new(seams: Seams<'_>, fit: &Fit) -> Result<Self, Error> {
        let Seams { set, options, weights, .. } = seams;
        let assembly = Arc::new(Assembly::new(set, &fit.molds, &fit.labels, &fit.poses));
        let mut problem = Problem::new(assembly.variables());
        let gaps = problem.add(GapRows::new(Arc::clone(&assembly), &weights.seams));
        problem.set_weight(gaps, options.gap_weight)?;
        problem.add(KinkRows::new(Arc::clone(&assembly), &weights.seams));
        let design = DesignRows::new(Arc::clone(&assembly), fit.slope_weight);
        let design = problem.add(design.with_weights(&weights.panels));
        problem.set_weight(design, options.design_weight)?;
        let reach = ReachRows::new(Arc::clone(&assembly)).with_weights(&weights.panels);
        let reach = problem.add(reach);
        problem.set_weight(reach, options.design_weight)?;
        Ok(Self { assembly, problem })
    }

    /// Lets the caller change the problem; returns whether that was done.
    pub(crate) fn extend(
        &mut self,
        stage: &Stage,
        extra: &mut Extra<'_, Error>,
    ) -> Result<bool, Error> {
        let before = self.form()?;
        extra(stage, &self.assembly.variables(), &mut self.problem)?;
        Ok(self.form()? != before)
    }

    /// Blocks with their weights, and the fixed unknowns.
    fn form(&self) -> Result<Form, Error> {
        let ids: Vec<_> = self.problem.blocks().map(|(id, _)| id).collect();
        let weighed: Result<_, _> =
            ids.into_iter().map(|id| self.problem.weight(id).map(|weight| (id, weight))).collect();
        Ok((weighed?, self.problem.variables().fixed().to_vec()))
    }

    /// A run of Levenberg-Marquardt on the problem from where the fit stands, which ends as the
    /// matrix-free seam step does: after as many steps, or once a step lowers the energy by less
    /// than the same share.
    pub(crate) fn run(self, seams: Seams<'_>) -> Result<(Run<'static>, Arc<Assembly>), Error> {
        let options = Options {
            max_iterations: seams.options.steps,
            energy_tol: seams.options.stall,
            ..Options::default()
        };
        let x = self.assembly.start();
        let system = System::new(self.problem, options.factorization)?;
        Ok((Run::new(system, &x, &options)?, self.assembly))
    }
}

/// What a caller may have changed: blocks with their weights, and which unknowns are fixed.
type Form = (Vec<(BlockId, f64)>, Vec<bool>);

/// Puts molds and panels of `fit` where the unknowns say.
pub(crate) fn take(assembly: &Assembly, x: &[f64], fit: &mut Fit) {
    for (m, mold) in fit.molds.iter_mut().enumerate() {
        *mold = assembly.mold(x, m);
    }
    for (p, pose) in fit.poses.iter_mut().enumerate() {
        *pose = assembly.pose(x, p);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::clustering::Clusters;
    use crate::pulse::Pulse;
    use crate::seam::step::SeamRun;
    use crate::seam::system::System as MatrixFree;
    use crate::seam::unknowns::{SeamOptions, Weights};
    use crate::{Layout, MoldType, PanelSet, Pattern};
    use geom_core::assert_close;
    use gp_solver::Factorization;

    #[test]
    fn the_problem_has_the_energy_and_gradient_of_the_matrix_free_system() {
        let surface = fixtures::surfaces::Shape::Roof.surface(10, 10, 4, 4);
        let layout = Layout::generate(Pattern::Quad, 4, 4, [false; 2]).unwrap();
        let set = PanelSet::new(&surface, &layout).unwrap();
        let set = set.scaled(1.0 / set.size);
        let mut nobody = ();
        let pulse = &Pulse::new(&mut nobody);
        let weights = Weights {
            seams: (0..set.seams.len()).map(|s| 1.0 + (s % 3) as f64).collect(),
            panels: (0..set.len()).map(|p| 1.0 + (p % 5) as f64).collect(),
        };
        let options =
            SeamOptions { steps: 1, gap_weight: 1.3, design_weight: 0.2, stall: 0.03, hinge: None };
        let incident = set.incident_seams();
        let seams = Seams { set: &set, options: &options, weights: &weights, incident: &incident };
        for kind in MoldType::ALL {
            let labels = (0..16).map(|p| (p / 2) % 3).collect();
            let clusters = Clusters { labels, turned: vec![false; 16], count: 3 };
            let mut fit = Fit::new(&set, &clusters, &[kind; 3], 0.5, pulse).unwrap();
            fit.alternate(&set, 2, pulse).unwrap();
            // One panel out on its mold, where the reach counts.
            let out = 0.3 * fit.poses[5].rotation.x_axis;
            fit.poses[5].origin += out;
            let run = SeamRun::new(seams, &fit, pulse).unwrap();
            let free = MatrixFree::linearize(seams, &fit, pulse).unwrap();
            let SeamProblem { assembly, problem } = SeamProblem::new(seams, &fit).unwrap();
            let mut system = System::new(problem, Factorization::Auto).unwrap();
            let energy = system.linearize(&assembly.start()).unwrap();
            assert_close(2.0 * energy, run.steps.history()[0], 1e-11 * run.steps.history()[0]);
            let side = free.side();
            let size = side.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            for (position, &unknown) in system.order().iter().enumerate() {
                assert_close(system.gradient()[position], -side[unknown], 1e-11 * size);
            }
        }
    }
}
