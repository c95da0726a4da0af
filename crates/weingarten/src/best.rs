//! The best iterate of a stage, judged between the samples.

use crate::field::samples;
use crate::grid::SampleGrid;
use crate::level::Level;
use crate::metrics::alignment_rms;
use crate::stall::HELD;
use crate::target::Target;
use crate::variables::coordinates;

/// Iterates are judged this many steps apart, and at the end.
const EVERY: usize = 5;
/// A stage has stalled if none of so many steps has brought a better iterate.
const PATIENCE: usize = 40;
/// By how much better an iterate must be to count as progress.
const PROGRESS: f64 = 1e-3;

/// What judges the iterates of a stage: the midpoints of the cells of a grid twice as dense as the samples,
/// those of [`crate::Metrics`]. Where the energy falls on the samples and the surface grows worse
/// between them, more steps would ruin it.
pub(crate) struct Judge {
    grid: SampleGrid,
    target: Option<Target>,
    /// Whether where the stage begins counts.
    with_start: bool,
    best: Option<Best>,
    /// The iterate seen last.
    seen: usize,
    /// Below this measure there is nothing left to gain.
    held: f64,
}

/// An iterate and its measure.
#[derive(Clone, Debug)]
pub(crate) struct Best {
    pub(crate) value: f64,
    pub(crate) x: Vec<f64>,
    /// When an iterate was last better by more than rounding, and its measure.
    pub(crate) progress: (usize, f64),
}

impl Judge {
    /// For a stage of `level`; the best of before if it is resumed.
    pub(crate) fn new(level: &Level, best: Option<Best>) -> Self {
        let mut judge = Self {
            grid: level.midpoints(),
            target: level.target().map(Target::for_now),
            with_start: level.target().is_some(),
            best,
            seen: 0,
            held: HELD * level.target().map_or(1.0, Target::natural),
        };
        // No relation is worth a surface that is farther from it than the input.
        if judge.with_start {
            judge.see(0, true, &coordinates(&level.reference));
        }
        judge
    }

    /// Looks at an iterate if it is its turn.
    pub(crate) fn see(&mut self, iteration: usize, is_last: bool, x: &[f64]) {
        let is_due = if iteration == 0 { self.with_start } else { iteration.is_multiple_of(EVERY) };
        if !is_due && !is_last {
            return;
        }
        self.seen = iteration;
        let here = samples(&self.grid, x);
        let value = match &self.target {
            Some(target) => target.rms(&here, None),
            None => alignment_rms(&here),
        };
        // NaN is never better.
        if self.best.as_ref().is_none_or(|best| value < best.value) && value.is_finite() {
            let before = self.best.as_ref().map(|best| best.progress);
            let progress = match before {
                Some((_, old)) if value < (1.0 - PROGRESS) * old => (iteration, value),
                Some(before) => before,
                None => (iteration, value),
            };
            self.best = Some(Best { value, x: x.to_vec(), progress });
        }
    }

    /// Whether the steps up to this one have long brought nothing, and there is something to gain.
    pub(crate) fn has_stalled(&self, iteration: usize) -> bool {
        let stuck = |best: &Best| best.value > self.held && iteration >= best.progress.0 + PATIENCE;
        self.best.as_ref().is_some_and(stuck)
    }

    /// The best iterate so far.
    pub(crate) fn best(&self) -> Option<&Best> {
        self.best.as_ref()
    }

    /// The best iterate after the `last` one has been seen too; `None` if that is the best.
    pub(crate) fn other_than(mut self, iteration: usize, last: &[f64]) -> Option<Vec<f64>> {
        if self.seen != iteration {
            self.see(iteration, true, last);
        }
        self.best.map(|best| best.x).filter(|x| x != last)
    }
}
