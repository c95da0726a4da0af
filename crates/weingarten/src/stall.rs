//! When a level has got as far as it gets.

use gp_solver::{Progress, System};

/// Steps over which the energy must fall to count as progress.
const WINDOW: usize = 10;
/// No step before this one ends a level.
const EARLIEST: usize = 20;
/// Share of the energy that must be gained over the window.
const LEAST_GAIN: f64 = 1e-3;
/// A relation or an alignment whose rows have a root mean square below this holds: a level that is
/// flat there slides along the surfaces wanted, and has not stalled. A share of the curvatures'
/// size for relations, a sine for alignments.
pub(crate) const HELD: f64 = 0.01;

/// The last energies of a level.
#[derive(Clone, Debug, Default)]
pub(crate) struct Recent {
    energies: Vec<f64>,
    /// The name, the weight and the number of the rows that matter.
    name: &'static str,
    rows: f64,
}

impl Recent {
    /// Of a level whose term `name` has rows that weigh `weight` and are as good as `count` rows.
    pub(crate) fn new(name: &'static str, weight: f64, count: usize) -> Self {
        Self { energies: Vec::new(), name, rows: count as f64 * weight * weight }
    }

    /// The energies kept, for checkpoints.
    pub(crate) fn energies(&self) -> &[f64] {
        &self.energies
    }

    /// The same with the energies of a checkpoint.
    pub(crate) fn resumed(self, energies: Option<&Vec<f64>>) -> Self {
        Self { energies: energies.cloned().unwrap_or_default(), ..self }
    }

    /// Takes a step note, and says whether the level has stalled: over the last ten steps the energy
    /// has stayed within a thousandth of itself, and the rows that matter are not small.
    pub(crate) fn has_stalled(&mut self, progress: &Progress<'_>) -> bool {
        if self.energies.len() > WINDOW {
            self.energies.remove(0);
        }
        self.energies.push(progress.energy);
        if progress.iteration < EARLIEST || self.energies.len() <= WINDOW {
            return false;
        }
        let low = self.energies.iter().copied().fold(f64::INFINITY, f64::min);
        let high = self.energies.iter().copied().fold(0.0, f64::max);
        high - low <= LEAST_GAIN * low && progress.system.is_some_and(|s| self.miss(s) > HELD)
    }

    /// The root mean square of the rows that matter.
    fn miss(&self, system: &System<'_>) -> f64 {
        let energy =
            system.terms().iter().find(|term| term.name == self.name).map_or(0.0, |t| t.energy);
        if self.rows > 0.0 { (2.0 * energy / self.rows).sqrt() } else { 0.0 }
    }
}
