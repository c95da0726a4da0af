//! Levels that hold the border of the input: the last one exactly, coarser ones as well as they can.

use bspline::{BsplineSurface, FitError, KnotVector, SplineError, fit_curve};
use glam::DVec3;
use numerics::least_squares;

/// Data per control point of a border that is fitted.
const DATA: usize = 8;

/// The same surface with knots inserted until it has at least `n` control points per direction: every
/// span is cut into as many equal pieces as are needed.
pub(crate) fn refined(
    input: &BsplineSurface,
    n: [usize; 2],
) -> Result<BsplineSurface, SplineError> {
    input.insert_knots(&cuts(input.knots_u(), n[0]), &cuts(input.knots_v(), n[1]))
}

/// Knots to insert for at least `n` control points.
fn cuts(knots: &KnotVector, n: usize) -> Vec<f64> {
    let breaks = knots.breaks();
    let spans = breaks.len() - 1;
    let missing = n.saturating_sub(knots.control_count());
    let pieces = 1 + missing.div_ceil(spans);
    let within = |ends: &[f64]| {
        let (start, length) = (ends[0], ends[1] - ends[0]);
        (1..pieces).map(move |k| start + length * (k as f64 / pieces as f64))
    };
    breaks.windows(2).flat_map(within).collect()
}

/// The surface with the open sides of its net on the best fit of the sides of `input`, corners exactly.
/// Its knots must be clamped where it is open.
pub(crate) fn with_border_of(
    surface: &BsplineSurface,
    input: &BsplineSurface,
) -> Result<BsplineSurface, FitError> {
    let (n_u, n_v) = (surface.n_u(), surface.n_v());
    let mut points = surface.control_points().to_vec();
    let (u, v) = (input.knots_u().domain(), input.knots_v().domain());
    if !surface.knots_v().is_periodic() {
        for (j, t) in [(0, v.0), (n_v - 1, v.1)] {
            let side = side(surface.knots_u(), |s| input.point(s, t))?;
            for (i, p) in side.into_iter().enumerate() {
                points[i * n_v + j] = p;
            }
        }
    }
    if !surface.knots_u().is_periodic() {
        for (i, s) in [(0, u.0), (n_u - 1, u.1)] {
            let side = side(surface.knots_v(), |t| input.point(s, t))?;
            points[i * n_v..(i + 1) * n_v].copy_from_slice(&side);
        }
    }
    Ok(surface.with_control_points(points)?)
}

/// Control points of the curve nearest to `curve`, with its ends if it has any.
fn side(knots: &KnotVector, curve: impl Fn(f64) -> DVec3) -> Result<Vec<DVec3>, FitError> {
    let n = knots.control_count();
    let t = knots.uniform_parameters(DATA * n);
    let data: Vec<DVec3> = t.iter().map(|&t| curve(t)).collect();
    if knots.is_periodic() {
        return Ok(fit_curve(knots, &t, &data)?.control_points().to_vec());
    }
    let (first, last) = (data[0], data[data.len() - 1]);
    let inner = n - 2;
    let mut points = vec![first];
    if inner > 0 {
        let mut matrix = vec![0.0; t.len() * inner];
        let mut right = Vec::with_capacity(3 * t.len());
        for (row, (&t, &p)) in t.iter().zip(&data).enumerate() {
            let basis = knots.basis(t, 0);
            let mut rest = p;
            for (r, &value) in basis.values[0][..knots.degree().order()].iter().enumerate() {
                match knots.control_index(basis.span, r) {
                    0 => rest -= value * first,
                    i if i == n - 1 => rest -= value * last,
                    i => matrix[row * inner + i - 1] = value,
                }
            }
            right.extend_from_slice(&rest.to_array());
        }
        least_squares(&mut matrix, inner, &mut right, 3).map_err(|fault| {
            FitError::Undetermined { direction: "the border", index: fault.column + 1 }
        })?;
        points.extend(right[..3 * inner].chunks_exact(3).map(DVec3::from_slice));
    }
    points.push(last);
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;
    use fixtures::surfaces::Shape;

    #[test]
    fn refinement_is_the_same_surface_with_enough_control_points() {
        for (shape, wanted, got) in [
            (Shape::Roof, [25, 18], [28, 20]),
            (Shape::Roof, [3, 8], [10, 8]),
            (Shape::Tube, [21, 9], [30, 12]),
        ] {
            let surface = shape.surface(10, 8, 4, 4);
            let finer = refined(&surface, wanted).unwrap();
            assert_eq!([finer.n_u(), finer.n_v()], got, "{shape:?}");
            for (u, v) in [(0.0, 0.0), (0.13, 0.77), (0.5, 1.0), (0.9, 0.31)] {
                assert!(finer.point(u, v).distance(surface.point(u, v)) < 1e-13);
            }
        }
    }

    #[test]
    fn a_fitted_border_has_the_corners_and_is_nearer_than_the_fit_of_the_surface() {
        let surface = Shape::Eggbox.surface(14, 13, 4, 4);
        let knots = |n| KnotVector::clamped_uniform(bspline::Degree::new(4).unwrap(), n).unwrap();
        let fitted = surface.refit(&knots(8), &knots(7)).unwrap();
        let held = with_border_of(&fitted, &surface).unwrap();
        for (u, v) in [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)] {
            assert_eq!(held.point(u, v), surface.point(u, v));
        }
        let miss = |s: &BsplineSurface| -> f64 {
            let t = (0..=100).map(|k| f64::from(k) / 100.0);
            t.map(|t| s.point(t, 0.0).distance_squared(surface.point(t, 0.0))).sum()
        };
        assert!(miss(&held) < miss(&fitted), "{} {}", miss(&held), miss(&fitted));
    }
}
