//! How Levenberg-Marquardt's damping follows success and failure.

use crate::least_squares::{StepModel, System};

/// Rule by which the damping `μ` changes from step to step; `ϱ` is the actual over the predicted
/// decrease of a step.
///
/// # Example
/// ```
/// use gp_solver::{Closeness, DampingRule, Options, Problem, solve};
/// let mut problem = Problem::new(1);
/// problem.add(Closeness::new("target", vec![4.0], vec![1.0]));
/// let options = Options { damping_rule: DampingRule::Fivefold, ..Options::default() };
/// let report = solve(problem, &mut [0.0], &options)?;
/// // Every step of a linear problem succeeds, and each divides the damping by five.
/// let damping: Vec<f64> = report.history.iter().map(|step| step.damping).collect();
/// assert!((damping[1] - 1e-3).abs() < 1e-15 && (damping[2] - 2e-4).abs() < 1e-15);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub enum DampingRule {
    /// The damping is steered by the length of the step in the norm of `D`, the largest `diag A` so
    /// far, as in a trust region (Moré 1978), but with one factorisation a trial: the ratio `ϱ`
    /// gives the length wanted next (four times this one if `ϱ > 3/4`, half if `ϱ < 1/4`), and one
    /// Newton step on the length as a function of `μ` gives the damping. The robust choice: it
    /// follows curved valleys and finds back from far starts.
    #[default]
    StepLength,
    /// `D = diag A` of the iterate (of [vectors](crate::Variables::set_vectors) its mean over all
    /// systems of axes). After success `μ ← μ/5` if `ϱ > 1/2`, unchanged if `ϱ > 1/5`,
    /// else `5μ/2`; after a refusal `μ ← 5μ`. For a stiff term whose diagonal changes much from
    /// step to step, where the largest one so far would slow the rest down.
    Fivefold,
}

/// Shares of the predicted decrease below and above which the model is poor and good.
const POOR_GAIN: f64 = 0.25;
const GOOD_GAIN: f64 = 0.75;
/// How far a good model lets the next step grow, and a poor one shrinks it at most and at least.
const WIDEN: f64 = 4.0;
const SHORTEN: (f64, f64) = (0.1, 0.5);
/// By what factor a taken step may change the damping, and a refused one.
const TAKEN_CHANGE: (f64, f64) = (1e-3, 10.0);
const REFUSED_CHANGE: (f64, f64) = (1.5, 1e3);

impl DampingRule {
    /// Whether the scaling is the largest diagonal so far.
    pub(crate) fn keeps_scaling(self) -> bool {
        self == Self::StepLength
    }

    /// The damping this rule does not go below.
    pub(crate) fn least_damping(self) -> f64 {
        match self {
            // Far below rounding, because the scaling may have been set by a start where the
            // diagonal was many orders larger.
            Self::StepLength => 1e-60,
            Self::Fivefold => 1e-16,
        }
    }

    /// The damping after a taken step.
    pub(crate) fn after_success(
        self,
        system: &mut System<'_>,
        damping: f64,
        model: StepModel,
        gain: f64,
    ) -> f64 {
        match self {
            Self::StepLength => {
                let share = if gain > GOOD_GAIN {
                    WIDEN
                } else if gain < POOR_GAIN {
                    SHORTEN.1
                } else {
                    1.0
                };
                let wanted = system.damping_for_radius(damping, share * model.scaled_norm);
                damping * (wanted / damping).clamp(TAKEN_CHANGE.0, TAKEN_CHANGE.1)
            }
            Self::Fivefold if gain > 0.5 => 0.2 * damping,
            Self::Fivefold if gain > 0.2 => damping,
            Self::Fivefold => 2.5 * damping,
        }
    }

    /// The damping after a refused step.
    pub(crate) fn after_refusal(
        self,
        system: &mut System<'_>,
        damping: f64,
        model: StepModel,
        decrease: f64,
    ) -> f64 {
        match self {
            Self::StepLength => {
                // Minimum of the parabola through both energies and the slope.
                let slope = system.slope();
                let share = 0.5 * slope / (slope + decrease);
                let share = if share.is_finite() { share } else { SHORTEN.0 };
                let radius = share.clamp(SHORTEN.0, SHORTEN.1) * model.scaled_norm;
                let wanted = system.damping_for_radius(damping, radius);
                let (least, most) = (REFUSED_CHANGE.0 * damping, REFUSED_CHANGE.1 * damping);
                if wanted.is_finite() { wanted.clamp(least, most) } else { most }
            }
            Self::Fivefold => 5.0 * damping,
        }
    }
}
