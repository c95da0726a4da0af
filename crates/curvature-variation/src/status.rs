//! Statuses as numbers, for checkpoints.

use gp_solver::Status;

/// The status of this number; an interrupted level makes no checkpoint.
pub(crate) fn status_of(number: u64) -> Option<Status> {
    const ALL: [Status; 4] =
        [Status::Converged, Status::Stalled, Status::IterationLimit, Status::Infeasible];
    ALL.into_iter().find(|status| *status as u64 == number)
}
