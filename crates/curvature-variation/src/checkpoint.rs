//! What a checkpoint keeps of the levels that are done.

use gp_solver::{Checkpoint, Report, SolverError, Stage, StageReport};

use crate::level::LevelNumbers;
use crate::status::status_of;

/// The name of the method in checkpoints.
pub(crate) const METHOD: &str = "fair";

/// Counts per level.
const WIDTH: usize = 10;

/// The name of a level's stage.
pub(crate) fn stage_name(vertices: usize) -> String {
    vertices.to_string()
}

/// Adds the levels that are done.
pub(crate) fn with_levels(
    checkpoint: Checkpoint,
    stages: &[StageReport],
    numbers: &[LevelNumbers],
) -> Checkpoint {
    let (mut counts, mut energies) = (Vec::new(), Vec::new());
    for (StageReport { solver, .. }, level) in stages.iter().zip(numbers) {
        let values: [usize; WIDTH - 1] = [
            solver.iterations,
            solver.evaluations,
            solver.factorizations,
            solver.variables,
            level.vertices,
            level.patches,
            level.evaluated_patches,
            level.symmetries,
            level.factor_len,
        ];
        counts.push(solver.status as u64);
        counts.extend(values.map(|n| n as u64));
        energies.extend([solver.initial_energy, solver.final_energy]);
    }
    checkpoint.with_counts("levels", &counts).with_numbers("level energies", &energies)
}

/// The levels that were done, without their histories and times.
pub(crate) fn levels_of(
    checkpoint: &Checkpoint,
    count: usize,
) -> Result<(Vec<StageReport>, Vec<LevelNumbers>), SolverError> {
    let damaged = || SolverError::ForeignCheckpoint {
        what: "a run of another size, or its levels are damaged".to_owned(),
    };
    let counts = checkpoint.counts("levels")?;
    let done = counts.len() / WIDTH;
    if counts.len() != WIDTH * done || done != checkpoint.stage || done >= count {
        return Err(damaged());
    }
    let energies = checkpoint.numbers("level energies", 2 * done)?;
    let (mut stages, mut numbers) = (Vec::new(), Vec::new());
    for (number, (values, energies)) in
        counts.chunks_exact(WIDTH).zip(energies.chunks_exact(2)).enumerate()
    {
        let count_of = |k: usize| values[k] as usize;
        let status = status_of(values[0]).ok_or_else(damaged)?;
        stages.push(StageReport {
            stage: Stage::new(stage_name(count_of(5)), number, count),
            solver: Report {
                iterations: count_of(1),
                evaluations: count_of(2),
                factorizations: count_of(3),
                initial_energy: energies[0],
                final_energy: energies[1],
                ..Report::new(status, count_of(4))
            },
        });
        numbers.push(LevelNumbers {
            vertices: count_of(5),
            patches: count_of(6),
            evaluated_patches: count_of(7),
            symmetries: count_of(8),
            factor_len: count_of(9),
        });
    }
    Ok((stages, numbers))
}
