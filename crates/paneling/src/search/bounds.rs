//! What is allowed at a seam, and how far from the design a panel may lie.

use crate::seam::measure::Measures;

/// What is allowed at a seam, and how far from the design a panel may lie.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Bounds {
    /// Largest kink, in radians.
    pub(crate) max_kink: Option<f64>,
    /// Largest gap.
    pub(crate) max_gap: Option<f64>,
    /// Largest distance of a panel from the design.
    pub(crate) max_deviation: Option<f64>,
}

fn times(value: f64, bound: Option<f64>) -> f64 {
    // NaN, beyond the reach of a round mold, is infinitely bad.
    bound.map_or(0.0, |b| if value.is_nan() { f64::INFINITY } else { value / b })
}

impl Bounds {
    /// How many times a kink or gap exceeds its bound; at most 1 if neither does.
    pub(crate) fn excess(&self, kink: f64, gap: f64) -> f64 {
        times(kink, self.max_kink).max(times(gap, self.max_gap))
    }

    /// How many times a distance from the design exceeds its bound.
    pub(crate) fn design_excess(&self, deviation: f64) -> f64 {
        times(deviation, self.max_deviation)
    }

    /// How many times the worst seam and the worst panel exceed the bounds.
    pub(crate) fn judge(&self, measures: &Measures) -> Excess {
        let seams = measures.seams.iter().map(|s| self.excess(s.max_kink(), s.max_gap()));
        let design = measures.deviations.iter().map(|d| self.design_excess(*d));
        Excess { seams: seams.fold(0.0, f64::max), design: design.fold(0.0, f64::max) }
    }
}

/// How many times bounds are exceeded: at most 1 where they are kept, 0 where there are none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Excess {
    /// At the worst seam.
    pub(crate) seams: f64,
    /// By the panel furthest from the design.
    pub(crate) design: f64,
}

impl Excess {
    pub(crate) const NONE: Self = Self { seams: 0.0, design: 0.0 };
    pub(crate) const UNKNOWN: Self = Self { seams: f64::INFINITY, design: f64::INFINITY };

    pub(crate) fn worst(&self) -> f64 {
        self.seams.max(self.design)
    }

    pub(crate) fn is_within(&self) -> bool {
        self.worst() <= 1.0
    }

    /// Whether this is nearer to the bounds: what leaves the design is worse than any kink or gap.
    pub(crate) fn is_less(&self, other: &Self) -> bool {
        let key = |e: &Self| (e.design.max(1.0), e.worst());
        key(self) < key(other)
    }
}
