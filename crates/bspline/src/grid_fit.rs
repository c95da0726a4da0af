//! A surface through a grid of points of which only the order is known.

use crate::fit::{FitError, fit_surface};
use crate::knots::{Degree, KnotVector};
use crate::surface::BsplineSurface;
use geom_core::Normalization;
use glam::DVec3;

/// Control points grow by this factor until the tolerance is met.
const GROWTH: f64 = 1.25;
/// Default tolerance as a share of the size of the points.
const DEFAULT_TOLERANCE: f64 = 1e-3;
/// Gauss-Newton steps of one foot point.
const FOOT_STEPS: usize = 12;

/// Settings of [`fit_grid`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GridFitOptions {
    /// Degree in both directions; 4 without, or lower if there are too few points.
    pub degree: Option<Degree>,
    /// Numbers of control points; without, they grow until the tolerance is met.
    pub control_points: Option<(usize, usize)>,
    /// Largest distance of a point to the surface, a length; without, 0.1 % of the size of the points: the
    /// diameter of the smallest ball around them.
    pub tolerance: Option<f64>,
}

/// A fitted surface with the distances of the points to it.
#[derive(Clone, Debug, PartialEq)]
pub struct GridFit {
    /// The surface, on the domain `[0, 1]²`.
    pub surface: BsplineSurface,
    /// The tolerance that was asked for.
    pub tolerance: f64,
    /// Size of the points: the diameter of the smallest ball around them.
    pub size: f64,
    /// Largest distance of a point to its foot point on the surface.
    pub distance_max: f64,
    /// Mean distance.
    pub distance_mean: f64,
    /// Root of the mean squared distance.
    pub distance_rms: f64,
}

/// Fits a surface to the grid `points[i * n_v + j]` by least squares, at parameters proportional
/// to the mean chord length of all rows, with knots between as many parameters each (Piegl and
/// Tiller 1997, Sec. 9.2.5, 9.4.1). With `closed_u` the surface is periodic in u.
///
/// # Errors
/// [`FitError`] if there are too few points, or rows of points that coincide.
///
/// # Panics
/// If there are not `n_u * n_v` points.
///
/// # Example
/// ```
/// use bspline::{GridFitOptions, fit_grid};
/// use geom_core::DVec3;
/// let points: Vec<DVec3> = (0..81)
///     .map(|k| (f64::from(k / 9) / 8.0, f64::from(k % 9) / 8.0))
///     .map(|(x, y)| DVec3::new(x, y, x * y))
///     .collect();
/// let fit = fit_grid(&points, 9, 9, false, &GridFitOptions::default())?;
/// assert!(fit.distance_max < 1e-12);
/// # Ok::<(), bspline::FitError>(())
/// ```
pub fn fit_grid(
    points: &[DVec3],
    n_u: usize,
    n_v: usize,
    closed_u: bool,
    options: &GridFitOptions,
) -> Result<GridFit, FitError> {
    assert_eq!(points.len(), n_u * n_v, "one point for each place of the grid");
    // Near the origin nothing is lost to rounding.
    let place = Normalization::of(points)?;
    let centred: Vec<DVec3> = points.iter().map(|&p| p - place.center()).collect();
    let points = &centred[..];
    let tolerance = options.tolerance.unwrap_or(DEFAULT_TOLERANCE * place.size());
    // A closed direction of degree d needs d + 1 points, as an open one does.
    let most = n_u.min(n_v).saturating_sub(1).clamp(1, 4);
    let degree = match options.degree {
        Some(degree) => degree,
        None => Degree::new(most).map_err(crate::SplineError::from)?,
    };
    let u = parameters(n_u, closed_u, |i, j| points[i * n_v + j], n_v);
    let v = parameters(n_v, false, |j, i| points[i * n_v + j], n_u);
    let fit = |(count_u, count_v): (usize, usize)| -> Result<GridFit, FitError> {
        let (knots_u, start) = knots(degree, &u, count_u, closed_u, "u")?;
        let (knots_v, _) = knots(degree, &v, count_v, false, "v")?;
        // A period may begin between two parameters.
        let u: Vec<f64> =
            u.iter().map(|t| if *t < start { t - start + 1.0 } else { t - start }).collect();
        let surface = fit_surface(&knots_u, &knots_v, &u, &v, points)?;
        Ok(measured(surface, [tolerance, place.size()], &u, &v, points))
    };
    let back = |fit: GridFit| GridFit { surface: fit.surface.translated(place.center()), ..fit };
    if let Some(counts) = options.control_points {
        return fit(counts).map(back);
    }
    let least = |n: usize| (degree.order() + 1).min(n);
    let mut counts = (least(n_u), least(n_v));
    loop {
        let found = fit(counts)?;
        if found.distance_max <= tolerance || counts == (n_u, n_v) {
            return Ok(back(found));
        }
        let grow = |count: usize, n: usize| ((count as f64 * GROWTH).ceil() as usize).min(n);
        counts = (grow(counts.0, n_u), grow(counts.1, n_v));
    }
}

/// Parameters in `[0, 1]` proportional to the chord lengths summed over all rows; a closed
/// direction ends before 1.
fn parameters(
    n: usize,
    closed: bool,
    point: impl Fn(usize, usize) -> DVec3,
    rows: usize,
) -> Vec<f64> {
    let chord = |i: usize| (0..rows).map(|j| point(i, j).distance(point((i + 1) % n, j))).sum();
    let chords: Vec<f64> = (0..if closed { n } else { n - 1 }).map(chord).collect();
    let total: f64 = chords.iter().sum();
    let mut sum = 0.0;
    let mut parameters = vec![0.0];
    for (i, chord) in chords.iter().enumerate() {
        sum += chord;
        parameters.push(if i + 1 == chords.len() { 1.0 } else { sum / total });
    }
    parameters.truncate(n);
    parameters
}

/// Knots with about equally many parameters in every span, and the parameter where they begin.
fn knots(
    degree: Degree,
    parameters: &[f64],
    count: usize,
    closed: bool,
    direction: &'static str,
) -> Result<(KnotVector, f64), FitError> {
    let (d, n) = (degree.get(), parameters.len());
    if count > n {
        return Err(FitError::TooFewData { direction, parameters: n, control_points: count });
    }
    // The parameter at a broken index; beyond a period it goes on.
    let at = |index: f64| {
        let (k, share) = (index.floor() as usize, index.fract());
        let value =
            |k: usize| if k < n { parameters[k] } else { 1.0 + parameters[(k - n).min(n - 1)] };
        value(k) + share * (value(k + 1) - value(k))
    };
    let mut start = 0.0;
    let made = if closed {
        // Between the parameters for even degrees, on them for odd ones, so that a spline with as
        // many control points as parameters can interpolate.
        let shift = if d.is_multiple_of(2) { 0.5 } else { 0.0 };
        let step = n as f64 / count as f64;
        let mut period: Vec<f64> = (0..count).map(|i| at((i as f64 + shift) * step)).collect();
        start = period[0];
        period.iter_mut().for_each(|t| *t -= start);
        period.push(1.0);
        KnotVector::periodic(degree, &period)
    } else if count < degree.order() {
        KnotVector::clamped_uniform(degree, count)
    } else {
        let mut knots = vec![0.0; d + 1];
        let spans = count - d;
        if count == n {
            knots.extend((1..spans).map(|j| parameters[j..j + d].iter().sum::<f64>() / d as f64));
        } else {
            let step = n as f64 / spans as f64;
            // Counted from the middles between parameters, so that a grid read from its other end has
            // the same knots.
            knots.extend((1..spans).map(|j| at(j as f64 * step - 0.5)));
        }
        knots.extend(vec![1.0; d + 1]);
        KnotVector::new(degree, knots)
    };
    let made = made.map_err(crate::SplineError::from)?;
    Ok((made, start))
}

fn measured(
    surface: BsplineSurface,
    [tolerance, size]: [f64; 2],
    u: &[f64],
    v: &[f64],
    points: &[DVec3],
) -> GridFit {
    let distance = |(k, p): (usize, &DVec3)| {
        let start = [u[k / v.len()], v[k % v.len()]];
        surface.foot_point(*p, start).1
    };
    let distances: Vec<f64> = points.iter().enumerate().map(distance).collect();
    let count = distances.len().max(1) as f64;
    GridFit {
        tolerance,
        size,
        distance_max: distances.iter().copied().fold(0.0, f64::max),
        distance_mean: distances.iter().sum::<f64>() / count,
        distance_rms: (distances.iter().map(|d| d * d).sum::<f64>() / count).sqrt(),
        surface,
    }
}

impl BsplineSurface {
    /// The foot point of `point` on the surface that is found from the parameters `start`, and its
    /// distance: Gauss-Newton steps that never increase the distance, within the domain. The
    /// distance is at most that of the start.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
    /// let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::X + DVec3::Y];
    /// let square = BsplineSurface::new(line()?, line()?, corners, None)?;
    /// let ([u, v], distance) = square.foot_point(DVec3::new(0.25, 0.75, 2.0), [0.5, 0.5]);
    /// assert!((u - 0.25).abs() < 1e-12 && (v - 0.75).abs() < 1e-12);
    /// assert!((distance - 2.0).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn foot_point(&self, point: DVec3, start: [f64; 2]) -> ([f64; 2], f64) {
        let [mut u, mut v] = start;
        let mut jet = self.jet(u, v, 1);
        let mut best = jet.position().distance(point);
        for _ in 0..FOOT_STEPS {
            let gap = point - jet.position();
            let form = jet.first_form();
            let Ok(determinant) = form.check() else { break };
            let (a, b) = (gap.dot(jet.d(1, 0)), gap.dot(jet.d(0, 1)));
            let (mut du, mut dv) =
                ((form.g * a - form.f * b) / determinant, (form.e * b - form.f * a) / determinant);
            // At a border that the step would leave, the other parameter moves alone.
            if leaves(self.knots_u(), u, du) {
                (du, dv) = (0.0, b / form.g);
            } else if leaves(self.knots_v(), v, dv) {
                (du, dv) = (a / form.e, 0.0);
            }
            let mut step = 1.0;
            let improved = loop {
                let (un, vn) = (
                    self.knots_u().normalize(u + step * du),
                    self.knots_v().normalize(v + step * dv),
                );
                let next = self.jet(un, vn, 1);
                let distance = next.position().distance(point);
                if distance < best {
                    break Some((un, vn, next, distance));
                }
                step *= 0.5;
                if step < 1e-3 {
                    break None;
                }
            };
            let Some((un, vn, next, distance)) = improved else { break };
            let gained = best - distance;
            (u, v, jet, best) = (un, vn, next, distance);
            if gained <= 1e-12 * best {
                break;
            }
        }
        ([u, v], best)
    }
}

/// Whether a step from `t` goes beyond an open end of the domain that `t` is at.
fn leaves(knots: &KnotVector, t: f64, step: f64) -> bool {
    let (start, end) = knots.domain();
    !knots.is_periodic() && ((t <= start && step < 0.0) || (t >= end && step > 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;
    use std::f64::consts::TAU;

    fn wave(n_u: usize, n_v: usize) -> Vec<DVec3> {
        (0..n_u * n_v)
            // Uneven on purpose.
            .map(|k| ((k / n_v) as f64 / (n_u - 1) as f64, (k % n_v) as f64 / (n_v - 1) as f64))
            .map(|(a, b)| DVec3::new(a + 0.3 * a * a, b, 0.2 * (3.0 * a).sin() * (2.0 * b).cos()))
            .collect()
    }

    #[test]
    fn the_tolerance_is_met_with_few_control_points() {
        let points = wave(31, 25);
        let options = GridFitOptions { tolerance: Some(1e-4), ..GridFitOptions::default() };
        let fit = fit_grid(&points, 31, 25, false, &options).unwrap();
        assert!(fit.distance_max <= 1e-4, "{}", fit.distance_max);
        assert!(fit.surface.n_u() < 14 && fit.surface.n_v() < 14);
        assert!(fit.distance_mean <= fit.distance_rms && fit.distance_rms <= fit.distance_max);
    }

    #[test]
    fn as_many_control_points_as_points_interpolate() {
        for degree in 1..=5 {
            let options = GridFitOptions {
                degree: Some(Degree::new(degree).unwrap()),
                control_points: Some((9, 8)),
                tolerance: None,
            };
            let fit = fit_grid(&wave(9, 8), 9, 8, false, &options).unwrap();
            assert!(fit.distance_max < 1e-12, "degree {degree}: {}", fit.distance_max);
        }
    }

    #[test]
    fn a_grid_read_from_another_corner_has_the_same_surface() {
        let (n_u, n_v) = (23, 17);
        let points = wave(n_u, n_v);
        let options = GridFitOptions { control_points: Some((9, 8)), ..GridFitOptions::default() };
        let fit = fit_grid(&points, n_u, n_v, false, &options).unwrap();
        let turned: Vec<DVec3> = points.iter().rev().copied().collect();
        let other = fit_grid(&turned, n_u, n_v, false, &options).unwrap();
        for (u, v) in [(0.0, 0.0), (0.31, 0.77), (0.5, 0.08), (0.93, 1.0)] {
            let (here, there) = (fit.surface.point(u, v), other.surface.point(1.0 - u, 1.0 - v));
            assert!(here.distance(there) < 1e-12, "{here} and {there}");
        }
        assert_close(fit.distance_max, other.distance_max, 1e-12);
    }

    #[test]
    fn a_tube_is_periodic() {
        let points: Vec<DVec3> = (0..24 * 9)
            .map(|k| (TAU * f64::from(k / 9) / 24.0, f64::from(k % 9)))
            .map(|(a, z)| DVec3::new(a.cos(), a.sin(), 0.3 * z))
            .collect();
        for degree in 3..=4 {
            let options =
                GridFitOptions { degree: Degree::new(degree).ok(), ..GridFitOptions::default() };
            let fit = fit_grid(&points, 24, 9, true, &options).unwrap();
            assert!(fit.surface.knots_u().is_periodic());
            assert!(fit.distance_max <= fit.tolerance);
            let all = GridFitOptions { control_points: Some((24, 9)), ..options };
            let fit = fit_grid(&points, 24, 9, true, &all).unwrap();
            assert!(fit.distance_max < 1e-12, "degree {degree}: {}", fit.distance_max);
        }
    }

    #[test]
    fn too_few_points_are_named() {
        let options = GridFitOptions { control_points: Some((10, 5)), ..GridFitOptions::default() };
        let error = fit_grid(&wave(9, 8), 9, 8, false, &options).unwrap_err();
        assert!(error.to_string().starts_with("9 parameters in u do not determine 10"), "{error}");
        let same = vec![DVec3::ONE; 30];
        assert!(fit_grid(&same, 6, 5, false, &GridFitOptions::default()).is_err());
    }

    #[test]
    fn beyond_a_border_the_foot_is_the_nearest_point_of_it() {
        let fit = fit_grid(&wave(9, 8), 9, 8, false, &GridFitOptions::default()).unwrap();
        // Beyond the side u = 0 and askew, so that a step along both parameters leaves it.
        let jet = fit.surface.jet(0.0, 0.4, 1);
        let point = jet.position() - 0.2 * jet.d(1, 0) + 0.05 * jet.d(0, 1);
        let ([u, v], distance) = fit.surface.foot_point(point, [0.0, 0.3]);
        assert_eq!(u, 0.0);
        let foot = fit.surface.jet(u, v, 1);
        let gap = point - foot.position();
        assert!(gap.dot(foot.d(0, 1)).abs() < 1e-5 * distance * foot.d(0, 1).length());
        let nearest = (0..=1000)
            .map(|k| fit.surface.point(0.0, 1e-3 * f64::from(k)).distance(point))
            .fold(f64::INFINITY, f64::min);
        assert!(distance <= nearest, "{distance} {nearest}");
    }

    #[test]
    fn the_foot_point_is_perpendicular() {
        let fit = fit_grid(&wave(9, 8), 9, 8, false, &GridFitOptions::default()).unwrap();
        let normal = fit.surface.jet(0.4, 0.6, 1).normal().unwrap();
        let point = fit.surface.point(0.4, 0.6) + 0.05 * normal;
        let ([u, v], distance) = fit.surface.foot_point(point, [0.35, 0.66]);
        assert_close(u, 0.4, 1e-5);
        assert_close(v, 0.6, 1e-5);
        assert_close(distance, 0.05, 1e-10);
    }
}
