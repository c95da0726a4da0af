//! Interpolation and least-squares fit of curves and surfaces.

use crate::curve::BsplineCurve;
use crate::error::SplineError;
use crate::knots::KnotVector;
use crate::surface::BsplineSurface;
use glam::DVec3;
use numerics::{RankError, least_squares};

/// Parameters per control point and direction at which a refit samples the given surface.
const REFIT_SAMPLES: usize = 4;

/// Why a fit was refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum FitError {
    /// Fewer data than unknowns.
    #[error(
        "{parameters} parameters in {direction} do not determine {control_points} control points; \
         give more data or ask for fewer control points"
    )]
    TooFewData { direction: &'static str, parameters: usize, control_points: usize },
    /// The number of points does not fit the parameters.
    #[error("{parameters} parameters have {points} points; give one point for each")]
    PointCount { parameters: usize, points: usize },
    /// A parameter outside the domain or not a number.
    #[error("parameter {index} in {direction} is {value}, outside the domain [{start}, {end}]")]
    Parameter { direction: &'static str, index: usize, value: f64, start: f64, end: f64 },
    /// No parameter in the support of a basis function.
    #[error(
        "control point {index} in {direction} is not determined by the data: too few parameters \
         near it; spread the parameters or ask for fewer control points"
    )]
    Undetermined { direction: &'static str, index: usize },
    /// Points without extent, too large, too small or too far away.
    #[error(transparent)]
    Size(#[from] geom_core::NormalizationError),
    /// The result is not a spline (data that is not finite).
    #[error(transparent)]
    Spline(#[from] SplineError),
}

/// The curve nearest to `points` at `parameters` in the least-squares sense; it passes through
/// them if there are as many as control points (at [`KnotVector::greville_points`], say).
///
/// # Errors
/// [`FitError`] says which data are missing or at fault.
///
/// # Example
/// ```
/// use bspline::{Degree, KnotVector, fit_curve};
/// use geom_core::DVec3;
/// // Through as many points as there are control points.
/// let knots = KnotVector::clamped_uniform(Degree::new(3)?, 6)?;
/// let t = knots.greville_points();
/// let points: Vec<DVec3> = t.iter().map(|t| DVec3::new(t.cos(), t.sin(), *t)).collect();
/// let helix = fit_curve(&knots, &t, &points)?;
/// assert!(helix.point(t[2]).distance(points[2]) < 1e-13);
/// assert!(fit_curve(&knots, &t[1..], &points[1..]).is_err()); // one point too few
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fit_curve(
    knots: &KnotVector,
    parameters: &[f64],
    points: &[DVec3],
) -> Result<BsplineCurve, FitError> {
    if parameters.len() != points.len() {
        return Err(FitError::PointCount { parameters: parameters.len(), points: points.len() });
    }
    let control = solve(knots, "the curve", parameters, points, 1)?;
    Ok(BsplineCurve::new(knots.clone(), control, None)?)
}

/// The surface nearest to the grid `points[i * v.len() + j]` at parameters `u[i], v[j]` in the
/// least-squares sense; it passes through the points if there are as many as control points in
/// both directions.
///
/// The problem separates: a fit in u of every column, then a fit in v of every row of the result,
/// is the least-squares solution of the whole.
///
/// # Errors
/// [`FitError`] says which data are missing or at fault.
///
/// # Example
/// ```
/// use bspline::{Degree, KnotVector, fit_surface};
/// use geom_core::DVec3;
/// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 3)?;
/// let t = knots.uniform_parameters(5);
/// let grid: Vec<DVec3> =
///     t.iter().flat_map(|&u| t.iter().map(move |&v| DVec3::new(u, v, u * v * v))).collect();
/// let surface = fit_surface(&knots, &knots, &t, &t, &grid)?;
/// assert!(surface.point(0.3, 0.7).distance(DVec3::new(0.3, 0.7, 0.147)) < 1e-14);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn fit_surface(
    knots_u: &KnotVector,
    knots_v: &KnotVector,
    u: &[f64],
    v: &[f64],
    points: &[DVec3],
) -> Result<BsplineSurface, FitError> {
    let (parameters, found) = (u.len() * v.len(), points.len());
    if parameters != found {
        return Err(FitError::PointCount { parameters, points: found });
    }
    // Checked first because the fit in u of no columns would hide it.
    check_parameters(knots_v, "v", v)?;
    let rows = solve(knots_u, "u", u, points, v.len())?;
    let n_u = knots_u.control_count();
    let transposed = transpose(&rows, n_u, v.len());
    let columns = solve(knots_v, "v", v, &transposed, n_u)?;
    let control = transpose(&columns, knots_v.control_count(), n_u);
    Ok(BsplineSurface::new(knots_u.clone(), knots_v.clone(), control, None)?)
}

impl BsplineSurface {
    /// The polynomial surface over other knots that is nearest to this one in the least-squares
    /// sense at four parameters per new control point and direction: the refinement of the
    /// multiresolution workflow of Pellis et al. 2021, Sec. 4.1.1. Inner knots may differ; the
    /// domains should agree.
    ///
    /// # Errors
    /// [`FitError`] if the new knots leave a control point without samples.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
    /// let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 1.0)];
    /// let saddle = BsplineSurface::new(line()?, line()?, corners, None)?; // z = x y
    /// let finer = KnotVector::clamped_uniform(Degree::new(3)?, 6)?;
    /// let refitted = saddle.refit(&finer, &finer)?;
    /// assert!(refitted.point(0.3, 0.7).distance(DVec3::new(0.3, 0.7, 0.21)) < 1e-13);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn refit(&self, knots_u: &KnotVector, knots_v: &KnotVector) -> Result<Self, FitError> {
        let u = knots_u.uniform_parameters(REFIT_SAMPLES * knots_u.control_count());
        let v = knots_v.uniform_parameters(REFIT_SAMPLES * knots_v.control_count());
        fit_surface(knots_u, knots_v, &u, &v, &self.point_grid(&u, &v))
    }
}

fn check_parameters(
    knots: &KnotVector,
    direction: &'static str,
    parameters: &[f64],
) -> Result<(), FitError> {
    let control_points = knots.control_count();
    if parameters.len() < control_points {
        let parameters = parameters.len();
        return Err(FitError::TooFewData { direction, parameters, control_points });
    }
    let (start, end) = knots.domain();
    match parameters.iter().position(|t| !(start..=end).contains(t)) {
        Some(index) => {
            Err(FitError::Parameter { direction, index, value: parameters[index], start, end })
        }
        None => Ok(()),
    }
}

/// Fits `count` curves at once: `points[i * count + k]` belongs to parameter `i` of curve `k`,
/// the result likewise to control point `i`.
fn solve(
    knots: &KnotVector,
    direction: &'static str,
    parameters: &[f64],
    points: &[DVec3],
    count: usize,
) -> Result<Vec<DVec3>, FitError> {
    check_parameters(knots, direction, parameters)?;
    let n = knots.control_count();
    // Rows in the order of the parameters keep the matrix banded whatever order they came in.
    let mut order: Vec<usize> = (0..parameters.len()).collect();
    order.sort_by(|&a, &b| parameters[a].total_cmp(&parameters[b]));
    let mut matrix = vec![0.0; parameters.len() * n];
    let mut right = Vec::with_capacity(parameters.len() * count * 3);
    for (row, &i) in order.iter().enumerate() {
        let basis = knots.basis(parameters[i], 0);
        for r in 0..knots.degree().order() {
            matrix[row * n + knots.control_index(basis.span, r)] = basis.values[0][r];
        }
        for p in &points[i * count..(i + 1) * count] {
            right.extend_from_slice(&p.to_array());
        }
    }
    least_squares(&mut matrix, n, &mut right, 3 * count)
        .map_err(|RankError { column }| FitError::Undetermined { direction, index: column })?;
    Ok(right[..n * count * 3].chunks_exact(3).map(DVec3::from_slice).collect())
}

/// Turns `values[i * columns + j]` into `[j * rows + i]`.
pub(crate) fn transpose<T: Copy>(values: &[T], rows: usize, columns: usize) -> Vec<T> {
    (0..rows * columns).map(|k| values[(k % rows) * columns + k / rows]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Degree;
    use geom_core::assert_close;
    use std::f64::consts::TAU;

    fn degree(d: usize) -> Degree {
        Degree::new(d).unwrap()
    }

    #[test]
    fn interpolation_at_greville_points_passes_through_the_data() {
        for knots in [
            KnotVector::clamped_uniform(degree(4), 9).unwrap(),
            KnotVector::periodic_uniform(degree(3), 9).unwrap(),
        ] {
            let t = knots.greville_points();
            let points: Vec<DVec3> =
                t.iter().map(|&t| DVec3::new((TAU * t).cos(), (TAU * t).sin(), t * t)).collect();
            let curve = fit_curve(&knots, &t, &points).unwrap();
            for (&t, p) in t.iter().zip(&points) {
                assert_close(curve.point(t).distance(*p), 0.0, 1e-14);
            }
        }
    }

    #[test]
    fn fit_error_of_degree_four_falls_with_the_fifth_power() {
        let error = |n: usize| {
            let knots = KnotVector::clamped_uniform(degree(4), n + 4).unwrap();
            let t = knots.uniform_parameters(8 * n);
            let f = |t: f64| DVec3::new(t, (4.0 * t).sin(), (3.0 * t).cos());
            let points: Vec<DVec3> = t.iter().map(|&t| f(t)).collect();
            let curve = fit_curve(&knots, &t, &points).unwrap();
            (0..500)
                .map(|i| f64::from(i) / 499.0)
                .map(|t| curve.point(t).distance(f(t)))
                .fold(0.0, f64::max)
        };
        let order = (error(8) / error(16)).log2();
        assert!(order > 4.5, "observed order {order}");
    }

    #[test]
    fn a_surface_in_the_space_is_reproduced_by_refit() {
        let (ku, kv) = (
            KnotVector::periodic_uniform(degree(3), 6).unwrap(),
            KnotVector::clamped_uniform(degree(4), 6).unwrap(),
        );
        let point = |k: usize| DVec3::new((k as f64).sin(), (k as f64 * 0.7).cos(), k as f64);
        let surface = BsplineSurface::new(ku, kv, (0..36).map(point).collect(), None).unwrap();
        let finer_u = KnotVector::periodic_uniform(degree(3), 12).unwrap();
        let finer_v = KnotVector::clamped_uniform(degree(4), 8).unwrap(); // knots at quarters
        let refit = surface.refit(&finer_u, &finer_v).unwrap();
        for (u, v) in [(0.0, 0.0), (0.13, 0.7), (0.99, 1.0)] {
            assert_close(refit.point(u, v).distance(surface.point(u, v)) / 35.0, 0.0, 1e-13);
        }
    }

    #[test]
    fn missing_data_are_named() {
        let knots = KnotVector::clamped_uniform(degree(1), 4).unwrap();
        let fit = |t: &[f64]| {
            let points = vec![DVec3::ZERO; t.len()];
            fit_curve(&knots, t, &points).unwrap_err().to_string()
        };
        assert_eq!(
            fit(&[0.0, 0.5]),
            "2 parameters in the curve do not determine 4 control points; \
             give more data or ask for fewer control points"
        );
        assert_eq!(
            fit(&[0.0, 0.1, 0.2, 0.3, 0.31]),
            "control point 2 in the curve is not determined by the data: too few parameters \
             near it; spread the parameters or ask for fewer control points"
        );
        assert_eq!(
            fit(&[0.0, 0.1, 0.2, 1.5]),
            "parameter 3 in the curve is 1.5, outside the domain [0, 1]"
        );
        assert!(fit(&[0.0, 0.1, 0.2, f64::NAN]).contains("NaN"));
        let error = fit_curve(&knots, &[0.0], &[]).unwrap_err();
        assert_eq!(error, FitError::PointCount { parameters: 1, points: 0 });
    }
}
