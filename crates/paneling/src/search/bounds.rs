//! What is allowed at a seam.

use crate::seam::measure::Measures;

/// What is allowed at a seam.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Bounds {
    /// Largest kink, in radians.
    pub(crate) max_kink: Option<f64>,
    /// Largest gap.
    pub(crate) max_gap: Option<f64>,
}

impl Bounds {
    /// How many times a kink or gap exceeds its bound; at most 1 if neither does.
    pub(crate) fn excess(&self, kink: f64, gap: f64) -> f64 {
        let of = |value: f64, bound: Option<f64>| bound.map_or(0.0, |b| value / b);
        of(kink, self.max_kink).max(of(gap, self.max_gap))
    }

    /// How many times the worst seam exceeds the bounds; at most 1 if all are within.
    pub(crate) fn worst_excess(&self, measures: &Measures) -> f64 {
        measures.seams.iter().map(|s| self.excess(s.max_kink(), s.max_gap())).fold(0.0, f64::max)
    }
}
