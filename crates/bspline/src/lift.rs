//! Curves on a surface, from the parameter plane into space.

use crate::curve::BsplineCurve;
use crate::error::SplineError;
use crate::fit::fit_curve;
use crate::knots::{Degree, KnotVector};
use crate::region::bisect;
use crate::surface::BsplineSurface;
use glam::{DVec3, DVec4};

/// Degree of fitted curves.
const DEGREE: usize = 5;
/// Most control points of a fitted curve.
const MOST_POINTS: usize = 1500;
/// Places per fitted control point at which the error is measured.
const CHECKS: usize = 3;
/// Points per knot span and degree among which crossings of knot lines are looked for.
const CROSSING_PIECES: usize = 4;
/// Places nearer than this share of the domain are one.
const SAME_PLACE: f64 = 1e-9;

impl BsplineSurface {
    /// The curve `S(u, ·)` along v, exact, with the control points of the surface itself where
    /// the knots are clamped there.
    ///
    /// # Errors
    /// [`SplineError`] if the numbers of an extreme surface leave the range of `f64`.
    pub fn curve_at_u(&self, u: f64) -> Result<BsplineCurve, SplineError> {
        let n_v = self.n_v();
        self.iso_curve(self.knots_u(), self.knots_v(), u, |row, k| row * n_v + k)
    }

    /// The curve `S(·, v)` along u, exact, as [`Self::curve_at_u`].
    ///
    /// # Errors
    /// As [`Self::curve_at_u`].
    pub fn curve_at_v(&self, v: f64) -> Result<BsplineCurve, SplineError> {
        let n_v = self.n_v();
        self.iso_curve(self.knots_v(), self.knots_u(), v, |row, k| k * n_v + row)
    }

    fn iso_curve(
        &self,
        across: &KnotVector,
        along: &KnotVector,
        t: f64,
        index: impl Fn(usize, usize) -> usize,
    ) -> Result<BsplineCurve, SplineError> {
        let blend = blend(across, t);
        let (mut points, mut weights) = (Vec::new(), Vec::new());
        for k in 0..along.control_count() {
            let control = |row: usize| {
                let weight = self.weights().map_or(1.0, |w| w[index(row, k)]);
                (self.control_points()[index(row, k)], weight)
            };
            if let [(row, _)] = blend[..] {
                let (point, weight) = control(row);
                points.push(point);
                weights.push(weight);
                continue;
            }
            let mut sum = DVec4::ZERO;
            for &(row, b) in &blend {
                let (point, weight) = control(row);
                sum += b * (point * weight).extend(weight);
            }
            points.push(sum.truncate() / if self.is_rational() { sum.w } else { 1.0 });
            weights.push(sum.w);
        }
        BsplineCurve::new(along.clone(), points, self.is_rational().then_some(weights))
    }

    /// The curve `S(c(t))` in space, over the parameters of `c`: exact along a straight line of
    /// constant u or v (with the parameter of that direction), else fitted to within `accuracy`,
    /// a length, with the distance reached.
    ///
    /// # Errors
    /// [`SplineError`] if a number leaves the range of `f64`.
    pub fn curve_on(
        &self,
        c: &BsplineCurve,
        accuracy: f64,
    ) -> Result<(BsplineCurve, f64), SplineError> {
        if let [a, b] = *c.control_points() {
            let exact = if a.x == b.x && a.y != b.y {
                Some((self.curve_at_u(a.x)?, a.y, b.y))
            } else if a.y == b.y && a.x != b.x {
                Some((self.curve_at_v(a.y)?, a.x, b.x))
            } else {
                None
            };
            if let Some((curve, from, to)) = exact {
                let part = curve.subdomain(from.min(to), from.max(to))?;
                return Ok((if from < to { part } else { part.reversed() }, 0.0));
            }
        }
        let at = |t: f64| {
            let p = c.point(t);
            self.point(p.x, p.y)
        };
        fit_to(&crossings(c, self), at, accuracy)
    }
}

/// The rows that matter at a parameter with their basis values; one row if the knots are clamped
/// there.
fn blend(knots: &KnotVector, t: f64) -> Vec<(usize, f64)> {
    let d = knots.degree().get();
    let basis = knots.basis(t, 0);
    let row = |r: usize| (knots.control_index(basis.span, r), basis.values[0][r]);
    if let Some(r) = (0..=d).find(|&r| (basis.values[0][r] - 1.0).abs() < 1e-15) {
        return vec![(row(r).0, 1.0)];
    }
    (0..=d).map(row).collect()
}

/// Parameters at which a curve in the parameter plane has a knot or crosses a knot line of the
/// surface, where what it maps to may have a corner or a jump; both ends of its domain included.
fn crossings(c: &BsplineCurve, surface: &BsplineSurface) -> Vec<f64> {
    let lines = [surface.knots_u().breaks(), surface.knots_v().breaks()];
    let (start, end) = c.knots().domain();
    let mut all = c.knots().breaks();
    for pair in c.knots().breaks().windows(2) {
        let pieces = CROSSING_PIECES * c.knots().degree().get();
        let at = |k: usize| pair[0] + (pair[1] - pair[0]) * k as f64 / pieces as f64;
        for k in 0..pieces {
            let (a, b) = (at(k), at(k + 1));
            for (axis, lines) in lines.iter().enumerate() {
                let coordinate = |t: f64| c.point(t)[axis];
                let (from, to) = (coordinate(a), coordinate(b));
                let crossed = lines.iter().filter(|l| (from - **l) * (to - **l) < 0.0);
                all.extend(crossed.map(|line| bisect(a, b, |t| coordinate(t) - line)));
            }
        }
    }
    all.sort_by(f64::total_cmp);
    let near = SAME_PLACE * (end - start);
    all.dedup_by(|b, a| *b - *a <= near);
    // The ends stay what they are.
    let last = all.len() - 1;
    (all[0], all[last]) = (start, end);
    all
}

/// A curve of degree five through `at` over the domain of `breaks`, at which it is continuous
/// only, with finer and finer knots between them until the distance is within `accuracy`; with
/// the distance reached.
pub(crate) fn fit_to(
    breaks: &[f64],
    at: impl Fn(f64) -> DVec3,
    accuracy: f64,
) -> Result<(BsplineCurve, f64), SplineError> {
    let degree = Degree::new(DEGREE)?;
    let mut pieces = 1;
    let mut best: Option<(BsplineCurve, f64)> = None;
    loop {
        let mut all = vec![breaks[0]];
        for pair in breaks.windows(2) {
            all.extend([pair[0]; DEGREE]);
            let step = (pair[1] - pair[0]) / f64::from(pieces);
            all.extend((1..pieces).map(|i| pair[0] + step * f64::from(i)));
        }
        all.extend([breaks[breaks.len() - 1]; DEGREE + 1]);
        let fine = KnotVector::new(degree, all)?;
        let n = fine.control_count();
        let places = fine.greville_points();
        let points: Vec<DVec3> = places.iter().map(|t| at(*t)).collect();
        let fitted = match fit_curve(&fine, &places, &points) {
            Ok(curve) => with_ends(&curve, points[0], points[n - 1])?,
            Err(crate::FitError::Spline(error)) => return Err(error),
            // Greville points determine every control point.
            Err(_) => return Err(SplineError::NotFinite { index: 0, point: points[0] }),
        };
        let checks = places.windows(2).flat_map(|p| {
            (1..=CHECKS).map(move |k| p[0] + (p[1] - p[0]) * k as f64 / (CHECKS + 1) as f64)
        });
        let error = checks.map(|t| fitted.point(t).distance(at(t))).fold(0.0, f64::max);
        if best.as_ref().is_none_or(|(_, least)| error < *least) {
            best = Some((fitted, error));
        }
        if let Some((curve, error)) = &best
            && (*error <= accuracy || 2 * n > MOST_POINTS)
        {
            return Ok((curve.clone(), *error));
        }
        pieces *= 2;
    }
}

fn with_ends(curve: &BsplineCurve, first: DVec3, last: DVec3) -> Result<BsplineCurve, SplineError> {
    let mut points = curve.control_points().to_vec();
    let end = points.len() - 1;
    (points[0], points[end]) = (first, last);
    BsplineCurve::new(curve.knots().clone(), points, None)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ArcSpans, Axis};
    use geom_core::assert_close;
    use std::f64::consts::TAU;

    fn torus() -> BsplineSurface {
        let spans = ArcSpans::new(0.0, TAU);
        let ring = BsplineCurve::arc(3.0 * DVec3::X, DVec3::X, DVec3::Z, spans).unwrap();
        let axis = Axis { origin: DVec3::ZERO, direction: DVec3::Z };
        BsplineSurface::revolution(&ring, axis, spans).unwrap()
    }

    #[test]
    fn lines_of_constant_parameter_are_exact() {
        let torus = torus();
        let line = |a: (f64, f64), b: (f64, f64)| {
            let at = |p: (f64, f64)| DVec3::new(p.0, p.1, 0.0);
            BsplineCurve::segment(at(a), at(b), 0.0, 1.0).unwrap()
        };
        for (a, b) in [((1.0, 0.3), (1.0, 4.0)), ((5.0, 2.0), (0.5, 2.0)), ((0.0, 0.0), (TAU, 0.0))]
        {
            let (curve, error) = torus.curve_on(&line(a, b), 1e-9).unwrap();
            assert_eq!(error, 0.0);
            let (start, end) = curve.knots().domain();
            assert_close(curve.point(start).distance(torus.point(a.0, a.1)), 0.0, 1e-14);
            assert_close(curve.point(end).distance(torus.point(b.0, b.1)), 0.0, 1e-14);
            for k in 0..20 {
                let p = curve.point(start + (end - start) * f64::from(k) / 20.0);
                assert_close((p.x.hypot(p.y) - 3.0).hypot(p.z), 1.0, 1e-14);
            }
        }
    }

    #[test]
    fn other_curves_keep_the_accuracy() {
        let torus = torus();
        let spans = ArcSpans::new(0.0, TAU);
        let circle =
            BsplineCurve::arc(DVec3::new(3.0, 3.0, 0.0), DVec3::X, DVec3::Y, spans).unwrap();
        for accuracy in [1e-4, 1e-8, 1e-11] {
            let (curve, error) = torus.curve_on(&circle, accuracy).unwrap();
            assert!(error <= accuracy, "{error:e}");
            for k in 0..=200 {
                let t = TAU * f64::from(k) / 200.0;
                let at = circle.point(t);
                let distance = curve.point(t).distance(torus.point(at.x, at.y));
                assert!(distance <= 1.5 * accuracy, "{distance:e} for {accuracy:e}");
            }
        }
    }
}
