//! The curve a curvature diagram follows.

use crate::curve::{CONTROL, DiagramCurve};
use crate::error::Error;
use crate::grid::SampleGrid;
use crate::input::Input;
use crate::sampled::{curvature_size, regular_samples, sample_counts};
use crate::target::Spread;
use crate::variables::coordinates;

/// Control points `[H, K]` of the cubic B-spline curve nearest to the curvature diagram of a surface, eight
/// of them, as [`crate::Relation::Curve`] takes them; `None` where both curvatures are constant. Distances
/// are in standard deviations of `H` and `K`. Of a Weingarten surface it is the relation it has, to be
/// edited and asked for.
///
/// # Errors
/// [`Error::Singular`] at a pole, and [`Error::NothingInside`].
///
/// # Example
/// ```
/// use weingarten::{Options, Relation, fitted_curve, solve};
/// let torus = fixtures::surfaces::torus_patch(4, 3);
/// let control = fitted_curve(&torus)?.expect("curvatures vary");
/// let relation = Relation::Curve(control);
/// let options = Options { relation, iterations: 0, ..Options::default() };
/// // In units of the spread of the curvatures.
/// assert!(solve(&torus, &options, &mut ())?.metrics.relation_rms < 1e-3);
/// # Ok::<(), weingarten::Error>(())
/// ```
pub fn fitted_curve<'a>(input: impl Into<Input<'a>>) -> Result<Option<Vec<[f64; 2]>>, Error> {
    let input = input.into();
    // Far from the origin rounding would eat derivatives.
    let place = input.surface.normalization()?;
    let surface = input.surface.translated(-place.center());
    let counts = sample_counts(&surface, None).map(|m| 2 * m);
    let grid = SampleGrid::midpoints(&surface, counts).within(input.trim, &surface);
    let here = regular_samples(&grid, &coordinates(&surface))?;
    let curvature = curvature_size(&surface, &here).unwrap_or(1.0 / place.size());
    let [h, k] = Spread::of(&here, curvature).deviation;
    let points: Vec<[f64; 2]> = here.iter().map(|s| [s.jet.h / h, s.jet.k / k]).collect();
    let curve = DiagramCurve::fit(&points, CONTROL);
    Ok(curve.map(|curve| curve.control().iter().map(|p| [p[0] * h, p[1] * k]).collect()))
}
