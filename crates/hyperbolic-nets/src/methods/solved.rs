//! What a method hands back.

use gp_solver::{RunReport, StageReport, Status};

use crate::net::HyperbolicNet;

/// What a method hands back.
pub(crate) struct Solved {
    pub(crate) result: HyperbolicNet,
    pub(crate) report: RunReport,
    /// Largest violation of the exact equations before the polishing and at the end.
    pub(crate) violation: Option<[f64; 2]>,
}

/// The report of a run with these stages, after `before` steps of earlier ones.
pub(crate) fn run_report(status: Status, before: usize, stages: Vec<StageReport>) -> RunReport {
    let report = RunReport::of_stages(stages);
    RunReport { status, iterations: before + report.iterations, ..report }
}
