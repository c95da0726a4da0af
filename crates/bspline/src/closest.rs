//! The nearest point of a curve or surface, and its parameters.

use crate::curve::BsplineCurve;
use crate::knots::KnotVector;
use crate::surface::BsplineSurface;
use geom_core::SurfaceJet;
use glam::DVec3;

/// Steps of one search.
const STEPS: usize = 60;
/// A step below this share of the domain changes nothing.
const SMALLEST_STEP: f64 = 1e-15;
/// Places of the coarse grid from which a search without a hint starts.
const STARTS: usize = 4;
/// Most points of the coarse grid in one direction.
const MOST_SAMPLES: usize = 160;

impl BsplineCurve {
    /// The parameter of the point of the curve that is nearest to `point`: Newton steps from the
    /// nearest of a few points in every knot span.
    #[must_use]
    pub fn closest_parameter(&self, point: DVec3) -> f64 {
        let samples = samples(self.knots());
        let distance = |t: f64| self.point(t).distance_squared(point);
        let (start, end) = self.knots().domain();
        let mut best = start;
        let mut least = f64::INFINITY;
        for &t in &samples {
            if distance(t) < least {
                (best, least) = (t, distance(t));
            }
        }
        let mut step_limit = (end - start) / samples.len() as f64;
        for _ in 0..STEPS {
            let d = self.derivatives(best, 2);
            let (r, slope) = (d[0] - point, (d[0] - point).dot(d[1]));
            // Newton where the distance is convex, else Gauss and Newton's step, which always is
            // downhill.
            let bend = d[1].dot(d[1]) + r.dot(d[2]);
            let bend = if bend > 0.1 * d[1].dot(d[1]) { bend } else { d[1].dot(d[1]) };
            if !(bend > 0.0) {
                break;
            }
            let step = (-slope / bend).clamp(-step_limit, step_limit);
            let next = (best + step).clamp(start, end);
            if (next - best).abs() <= SMALLEST_STEP * (end - start) {
                break;
            }
            if distance(next) <= least {
                (best, least) = (next, distance(next));
            } else {
                step_limit = 0.25 * step.abs();
            }
        }
        best
    }
}

/// Finds the parameters of points on a surface, again and again.
#[derive(Clone, Debug)]
pub struct SurfaceLocator<'a> {
    surface: &'a BsplineSurface,
    closed: [bool; 2],
    u: Vec<f64>,
    v: Vec<f64>,
    points: Vec<DVec3>,
}

impl<'a> SurfaceLocator<'a> {
    /// Samples the surface; in a `closed` direction a search runs on across the seam.
    #[must_use]
    pub fn new(surface: &'a BsplineSurface, closed: [bool; 2]) -> Self {
        let (u, v) = (samples(surface.knots_u()), samples(surface.knots_v()));
        let points = surface.point_grid(&u, &v);
        Self { surface, closed, u, v, points }
    }

    /// Parameters of the nearest point found, and its distance: from `hint` if that leads to
    /// within `enough` of the point, else from the nearest points of a grid over the surface.
    #[must_use]
    pub fn locate(&self, point: DVec3, hint: Option<[f64; 2]>, enough: f64) -> ([f64; 2], f64) {
        let mut best = ([f64::NAN; 2], f64::INFINITY);
        if let Some(hint) = hint {
            best = self.descend(point, hint);
            if best.1 <= enough {
                return best;
            }
        }
        for start in self.starts(point) {
            let found = self.descend(point, start);
            if found.1 < best.1 {
                best = found;
            }
            if best.1 <= enough {
                break;
            }
        }
        best
    }

    /// The nearest places of the grid.
    fn starts(&self, point: DVec3) -> Vec<[f64; 2]> {
        let mut nearest: Vec<(f64, usize)> = Vec::with_capacity(STARTS + 1);
        for (k, p) in self.points.iter().enumerate() {
            let distance = p.distance_squared(point);
            if nearest.len() == STARTS && distance >= nearest[STARTS - 1].0 {
                continue;
            }
            let at = nearest.partition_point(|n| n.0 <= distance);
            nearest.insert(at, (distance, k));
            nearest.truncate(STARTS);
        }
        let n_v = self.v.len();
        nearest.iter().map(|&(_, k)| [self.u[k / n_v], self.v[k % n_v]]).collect()
    }

    /// Damped Gauss-Newton steps (Levenberg and Marquardt) within the domain.
    fn descend(&self, point: DVec3, start: [f64; 2]) -> ([f64; 2], f64) {
        let domains = [self.surface.knots_u().domain(), self.surface.knots_v().domain()];
        let lengths = domains.map(|(a, b)| b - a);
        let residual = |at: [f64; 2]| -> (SurfaceJet, DVec3) {
            let jet = self.surface.jet(at[0], at[1], 1);
            (jet, jet.position() - point)
        };
        let bring = |mut at: [f64; 2]| {
            for axis in 0..2 {
                let (a, b) = domains[axis];
                at[axis] = if self.closed[axis] && !(a..=b).contains(&at[axis]) {
                    a + (at[axis] - a).rem_euclid(b - a)
                } else {
                    at[axis].clamp(a, b)
                };
            }
            at
        };
        let mut at = bring(start);
        let (mut jet, mut r) = residual(at);
        let mut damping = 0.0;
        for _ in 0..STEPS {
            let tangents = [jet.d(1, 0) * lengths[0], jet.d(0, 1) * lengths[1]];
            let mut slope = tangents.map(|t| -t.dot(r));
            let mut held = [false; 2];
            for axis in 0..2 {
                // At an end of the domain that it presses against, a parameter stays.
                let (a, b) = domains[axis];
                held[axis] = !self.closed[axis]
                    && ((at[axis] <= a && slope[axis] < 0.0)
                        || (at[axis] >= b && slope[axis] > 0.0));
                if held[axis] {
                    slope[axis] = 0.0;
                }
            }
            let coupling = if held[0] || held[1] { 0.0 } else { tangents[0].dot(tangents[1]) };
            let diagonal = tangents.map(|t| t.length_squared() * (1.0 + damping));
            let step = solve(diagonal, coupling, slope);
            let next = bring([at[0] + step[0] * lengths[0], at[1] + step[1] * lengths[1]]);
            let (next_jet, next_r) = residual(next);
            if next_r.length_squared() < r.length_squared() {
                (at, jet, r) = (next, next_jet, next_r);
                damping *= 0.1;
            } else if damping > 1e8 {
                break;
            } else {
                damping = (10.0 * damping).max(1e-3);
            }
            if step[0].abs().max(step[1].abs()) <= SMALLEST_STEP {
                break;
            }
        }
        (at, r.length())
    }
}

/// The solution of a symmetric system of two equations, by the pseudoinverse's rule where a row is
/// zero.
fn solve(diagonal: [f64; 2], coupling: f64, right: [f64; 2]) -> [f64; 2] {
    let determinant = diagonal[0] * diagonal[1] - coupling * coupling;
    if determinant > 1e-14 * diagonal[0] * diagonal[1] {
        return [
            (diagonal[1] * right[0] - coupling * right[1]) / determinant,
            (diagonal[0] * right[1] - coupling * right[0]) / determinant,
        ];
    }
    let one = |k: usize| if diagonal[k] > 0.0 { right[k] / diagonal[k] } else { 0.0 };
    if diagonal[0] >= diagonal[1] { [one(0), 0.0] } else { [0.0, one(1)] }
}

/// A few parameters in every knot span, both ends of the domain included.
fn samples(knots: &KnotVector) -> Vec<f64> {
    let breaks = knots.breaks();
    let spans = breaks.len() - 1;
    let wanted = 2 * knots.degree().get() + 1;
    let pieces = wanted.min((MOST_SAMPLES / spans).max(1));
    let mut all = Vec::with_capacity(spans * pieces + 1);
    for pair in breaks.windows(2) {
        all.extend((0..pieces).map(|k| pair[0] + (pair[1] - pair[0]) * k as f64 / pieces as f64));
    }
    all.extend(breaks.last());
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ArcSpans, Axis, Degree};
    use geom_core::assert_close;
    use std::f64::consts::TAU;

    #[test]
    fn points_of_a_curve_are_found_again() {
        let knots = KnotVector::clamped_uniform(Degree::new(3).unwrap(), 9).unwrap();
        let points = (0..9).map(|k| {
            let t = f64::from(k);
            DVec3::new(t, (1.3 * t).sin(), (0.7 * t).cos())
        });
        let curve = BsplineCurve::new(knots, points.collect(), None).unwrap();
        for k in 0..=50 {
            let t = f64::from(k) / 50.0;
            assert_close(curve.closest_parameter(curve.point(t)), t, 1e-9);
        }
    }

    #[test]
    fn points_of_a_torus_are_found_again_across_its_seams() {
        let ring = BsplineCurve::arc(3.0 * DVec3::X, DVec3::X, DVec3::Z, ArcSpans::new(0.0, TAU));
        let axis = Axis { origin: DVec3::ZERO, direction: DVec3::Z };
        let torus =
            BsplineSurface::revolution(&ring.unwrap(), axis, ArcSpans::new(0.0, TAU)).unwrap();
        let locator = SurfaceLocator::new(&torus, [true, true]);
        for k in 0..60 {
            let (u, v) = (0.37 * f64::from(k) % TAU, 0.91 * f64::from(k) % TAU);
            let point = torus.point(u, v);
            for hint in [None, Some([(u + 6.0) % TAU, (v + 0.4) % TAU])] {
                let (found, distance) = locator.locate(point, hint, 1e-9);
                assert_close(distance, 0.0, 1e-9);
                assert_close(torus.point(found[0], found[1]).distance(point), 0.0, 1e-9);
            }
        }
    }
}
