//! The best iterate of a stage, judged between the samples.

use crate::field::samples;
use crate::grid::SampleGrid;
use crate::level::Level;
use crate::metrics::alignment_rms;
use crate::target::Target;
use crate::variables::coordinates;

/// Iterates are judged this many steps apart, and at the end.
const EVERY: usize = 5;

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
}

/// An iterate and its measure.
#[derive(Clone, Debug)]
pub(crate) struct Best {
    pub(crate) value: f64,
    pub(crate) x: Vec<f64>,
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
            self.best = Some(Best { value, x: x.to_vec() });
        }
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
