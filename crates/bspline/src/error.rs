//! Why a curve or a surface was refused.

use glam::DVec3;

/// Why a curve or a surface was refused.
///
/// # Example
/// ```
/// use bspline::{BsplineCurve, Degree, KnotVector};
/// use geom_core::DVec3;
/// let knots = KnotVector::clamped_uniform(Degree::new(1)?, 2)?;
/// let fault = BsplineCurve::new(knots, vec![DVec3::ZERO], None).unwrap_err();
/// assert_eq!(
///     fault.to_string(),
///     "the knots need 2 control points, found 1; change the knots or the control points"
/// );
/// # Ok::<(), bspline::KnotError>(())
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum SplineError {
    /// The number of control points does not fit the knots.
    #[error(
        "the knots need {needed} control points, found {found}; \
         change the knots or the control points"
    )]
    ControlPointCount { needed: usize, found: usize },
    /// A coordinate is NaN or infinite.
    #[error("control point {index} is {point}; coordinates must be finite")]
    NotFinite { index: usize, point: DVec3 },
    /// The number of weights does not fit the control points.
    #[error("{points} control points have {found} weights; give one weight for each, or none")]
    WeightCount { points: usize, found: usize },
    /// A weight is zero, negative, NaN or infinite.
    #[error("weight {index} is {weight}; weights must be positive and finite")]
    Weight { index: usize, weight: f64 },
    /// A problem with the knots.
    #[error(transparent)]
    Knots(#[from] crate::knots::KnotError),
}

pub(crate) fn check_control(
    needed: usize,
    points: &[DVec3],
    weights: Option<&[f64]>,
) -> Result<(), SplineError> {
    let found = points.len();
    if found != needed {
        return Err(SplineError::ControlPointCount { needed, found });
    }
    if let Some(index) = points.iter().position(|p| !p.is_finite()) {
        return Err(SplineError::NotFinite { index, point: points[index] });
    }
    if let Some(weights) = weights {
        if weights.len() != found {
            return Err(SplineError::WeightCount { points: found, found: weights.len() });
        }
        if let Some(index) = weights.iter().position(|w| !(*w > 0.0 && w.is_finite())) {
            return Err(SplineError::Weight { index, weight: weights[index] });
        }
    }
    Ok(())
}
