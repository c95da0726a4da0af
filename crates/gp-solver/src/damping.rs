//! How Levenberg-Marquardt's damping follows success and failure.

/// Rule by which the damping `μ` changes from step to step; `ϱ` is the actual over the predicted
/// decrease of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum DampingRule {
    /// After success `μ ← μ max(1/3, 1 − (2ϱ − 1)³)`, after the k-th refusal in a row `μ ← 2ᵏ μ`
    /// (Nielsen 1999). Few refusals.
    #[default]
    Nielsen,
    /// After success `μ ← μ/5` if `ϱ > 1/2`, unchanged if `ϱ > 1/5`, else `5μ/2`; after a refusal
    /// `μ ← 5μ`. Takes a third more factorisations and longer steps: worth it where a stiff term
    /// leaves a narrow curved valley in which damping by the diagonal slows the rest down.
    Fivefold,
}

impl DampingRule {
    /// The factor of the damping after a taken step.
    pub(crate) fn after_success(self, gain: f64) -> f64 {
        match self {
            Self::Nielsen => (1.0 - (2.0 * gain - 1.0).powi(3)).clamp(1.0 / 3.0, 2.0),
            Self::Fivefold if gain > 0.5 => 0.2,
            Self::Fivefold if gain > 0.2 => 1.0,
            Self::Fivefold => 2.5,
        }
    }

    /// The factor of the damping after the first refusal.
    pub(crate) fn first_growth(self) -> f64 {
        match self {
            Self::Nielsen => 2.0,
            Self::Fivefold => 5.0,
        }
    }

    /// The factor after one more refusal, from that of the last.
    pub(crate) fn next_growth(self, growth: f64) -> f64 {
        match self {
            Self::Nielsen => 2.0 * growth,
            Self::Fivefold => growth,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_good_step_lowers_the_damping_and_a_bad_one_raises_it() {
        for rule in [DampingRule::Nielsen, DampingRule::Fivefold] {
            assert!(rule.after_success(1.0) < 0.4);
            assert!(rule.after_success(0.05) > 1.4);
            assert!(rule.next_growth(rule.first_growth()) >= rule.first_growth());
        }
    }
}
