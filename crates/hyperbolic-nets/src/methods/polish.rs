//! Newton steps onto the exact equations.

use gp_solver::{
    MinNormProjection, Observer, Problem, ProjectionOptions, Report, ResidualBlock, Rows,
    SolverError, Stage, Status,
};

/// How much more reluctantly than the others vertices of a fixed boundary move where they must.
const FIXED_SHARE: f64 = 0.1;

/// Shift of `J S Sᵀ Jᵀ` relative to its diagonal. Its rows depend on one another, since a net has
/// an equation too many for every face.
const POLISH_SHIFT: f64 = 1e-9;

/// The equations of the first block, those a caller has added, and how willingly unknowns move.
pub(super) struct Polish<'p> {
    pub(super) problem: Problem<'p>,
    /// Unknowns that stay if the equations allow it.
    pub(super) reluctant: Vec<bool>,
    pub(super) steps: usize,
    /// Largest violation of an exact net.
    pub(super) tolerance: f64,
}

impl Polish<'_> {
    /// Moves `x` onto the equations: the report and the largest violation at the start and at the
    /// end.
    pub(super) fn run(
        self,
        x: &mut [f64],
        stage: &Stage,
        observer: &mut dyn Observer,
    ) -> Result<(Report, [f64; 2]), SolverError> {
        let variables = self.problem.variables();
        let held = variables.fixed().to_vec();
        let sizes = variables.sizes().to_vec();
        let scale = |willing: f64| -> Vec<f64> {
            let of = |i: usize| match (held[i], self.reluctant[i]) {
                (true, _) => 0.0,
                (_, true) => willing * sizes[i],
                _ => sizes[i],
            };
            (0..sizes.len()).map(of).collect()
        };
        let mut rows = Rows::of(self.problem)?;
        rows.refresh(x);
        // Rows of a caller may be in any unit.
        let added: Vec<_> = rows.blocks().skip(1).map(|(id, _)| id).collect();
        for id in added {
            rows.normalize(id, x, &sizes)?;
        }
        let mut projection = MinNormProjection::new(&rows, x.len(), 3)?;
        // Aimed below what counts as exact; round-off may end it before that.
        let options = ProjectionOptions {
            shift: POLISH_SHIFT,
            tolerance: 0.1 * self.tolerance,
            max_iterations: self.steps,
        };
        let before = x.to_vec();
        let mut report = projection.project(&rows, x, &scale(0.0), &options, stage, observer)?;
        let missed = report.gradient_norm > self.tolerance;
        if missed && report.status != Status::Interrupted && self.reluctant.contains(&true) {
            // No exact net has this boundary polygon, or none that is near.
            x.copy_from_slice(&before);
            report =
                projection.project(&rows, x, &scale(FIXED_SHARE), &options, stage, observer)?;
        }
        let violation = [report.history[0].gradient_norm, report.gradient_norm];
        Ok((report, violation))
    }
}
