//! Surfaces at a distance, fitted.

use crate::error::SplineError;
use crate::fit::{FitError, fit_surface};
use crate::knots::{Degree, KnotVector};
use crate::surface::BsplineSurface;
use glam::DVec3;

/// Lowest degree of the fitted surface.
const DEGREE: usize = 4;
/// Most control points in one direction.
const MOST: usize = 400;
/// Where a normal is taken at a pole, as a share of the domain beside it.
const BESIDE: f64 = 1e-5;
/// Places between two fitted parameters at which the distance is measured.
const CHECKS: usize = 2;

/// Why there is no surface at a distance.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum OffsetError {
    /// A point without a normal inside the surface.
    #[error("the surface has no normal at u = {u}, v = {v}; repair it before it is moved")]
    NoNormal { u: f64, v: f64 },
    /// The finest net misses the accuracy.
    #[error(
        "the surface at a distance is met to within {reached} only, not {accuracy}; \
             it folds or has a crease there"
    )]
    Inaccurate { reached: f64, accuracy: f64 },
    /// A problem with the fit.
    #[error(transparent)]
    Fit(#[from] FitError),
}

impl From<SplineError> for OffsetError {
    fn from(error: SplineError) -> Self {
        Self::Fit(error.into())
    }
}

impl BsplineSurface {
    /// The surface `S + distance · n` with `n` the unit normal `S_u × S_v`, over the same
    /// parameters: a polynomial surface through points of it, finer and finer until it is within
    /// `accuracy` (a length) between them.
    ///
    /// # Errors
    /// [`OffsetError`] if there is no normal, or a crease or fold keeps the accuracy from being
    /// reached with 400 control points in a direction.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
    /// let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 1.0)];
    /// let saddle = BsplineSurface::new(line()?, line()?, corners, None)?; // z = x y
    /// let moved = saddle.offset(0.1, 1e-6)?;
    /// let normal = saddle.jet(0.3, 0.4, 1).normal()?;
    /// assert!(moved.point(0.3, 0.4).distance(saddle.point(0.3, 0.4) + 0.1 * normal) < 1e-6);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn offset(&self, distance: f64, accuracy: f64) -> Result<Self, OffsetError> {
        let mut pieces = [1_usize, 1];
        loop {
            let (u, v) = (finer(self.knots_u(), pieces[0])?, finer(self.knots_v(), pieces[1])?);
            let (at_u, at_v) = (u.greville_points(), v.greville_points());
            let points = self.moved(&at_u, &at_v, distance)?;
            let fitted = fit_surface(&u, &v, &at_u, &at_v, &points)?;
            // Refined in the direction that is to blame.
            let errors = [
                self.largest_gap(&fitted, &between(&at_u), &at_v, distance)?,
                self.largest_gap(&fitted, &at_u, &between(&at_v), distance)?,
            ];
            let both = self.largest_gap(&fitted, &between(&at_u), &between(&at_v), distance)?;
            let reached = errors[0].max(errors[1]).max(both);
            if reached <= accuracy {
                return Ok(fitted);
            }
            let counts = [u.control_count(), v.control_count()];
            let mut grown = false;
            for axis in 0..2 {
                let blamed = errors[axis] >= 0.25 * reached || errors[axis] > accuracy;
                if blamed && 2 * counts[axis] <= MOST {
                    pieces[axis] *= 2;
                    grown = true;
                }
            }
            if !grown {
                return Err(OffsetError::Inaccurate { reached, accuracy });
            }
        }
    }

    fn moved(&self, u: &[f64], v: &[f64], distance: f64) -> Result<Vec<DVec3>, OffsetError> {
        let jets = self.jet_grid(u, v, 1);
        let point = |(k, jet): (usize, &geom_core::SurfaceJet)| {
            let (u, v) = (u[k / v.len()], v[k % v.len()]);
            let beside = |share: f64| {
                let inwards = |knots: &KnotVector, t: f64| {
                    let (a, b) = knots.domain();
                    t + share * (0.5 * (a + b) - t)
                };
                self.jet(inwards(self.knots_u(), u), inwards(self.knots_v(), v), 1).normal()
            };
            // At a pole, from two normals beside it, so that their error is of second order.
            let limit = |near: DVec3| Ok((2.0 * near - beside(2.0 * BESIDE)?).normalize_or(near));
            let normal = jet.normal().or_else(|_| beside(BESIDE).and_then(limit));
            normal
                .map(|n| jet.position() + distance * n)
                .map_err(|_| OffsetError::NoNormal { u, v })
        };
        jets.iter().enumerate().map(point).collect()
    }

    fn largest_gap(
        &self,
        fitted: &Self,
        u: &[f64],
        v: &[f64],
        distance: f64,
    ) -> Result<f64, OffsetError> {
        let wanted = self.moved(u, v, distance)?;
        let found = fitted.point_grid(u, v);
        Ok(wanted.iter().zip(&found).map(|(a, b)| a.distance(*b)).fold(0.0, f64::max))
    }
}

/// Clamped knots of a degree that can follow, the breaks with the continuity they have less the
/// derivative that the normal takes, every span cut into `pieces`.
fn finer(knots: &KnotVector, pieces: usize) -> Result<KnotVector, SplineError> {
    let d = knots.degree().get();
    let degree = Degree::new((d + 1).clamp(DEGREE, Degree::MAX))?;
    let e = degree.get();
    let breaks = knots.breaks();
    let mut all = vec![breaks[0]; e + 1];
    for (k, pair) in breaks.windows(2).enumerate() {
        if k > 0 {
            let smooth = d.saturating_sub(knots.multiplicity(pair[0])).saturating_sub(1);
            all.extend(std::iter::repeat_n(pair[0], e - smooth.min(e - 1)));
        }
        let step = (pair[1] - pair[0]) / pieces as f64;
        all.extend((1..pieces).map(|i| pair[0] + step * i as f64));
    }
    all.extend(std::iter::repeat_n(breaks[breaks.len() - 1], e + 1));
    Ok(KnotVector::new(degree, all)?)
}

fn between(t: &[f64]) -> Vec<f64> {
    let cut = |pair: &[f64]| {
        let (a, b) = (pair[0], pair[1]);
        (1..=CHECKS).map(move |k| a + (b - a) * k as f64 / (CHECKS + 1) as f64)
    };
    t.windows(2).flat_map(cut).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ArcSpans, Axis, BsplineCurve};
    use geom_core::assert_close;
    use std::f64::consts::{PI, TAU};

    #[test]
    fn a_sphere_at_a_distance_is_a_sphere() {
        let meridian = ArcSpans::new(-0.5 * PI, 0.5 * PI);
        let arc = BsplineCurve::arc(DVec3::ZERO, 2.0 * DVec3::X, 2.0 * DVec3::Z, meridian);
        let axis = Axis { origin: DVec3::ZERO, direction: DVec3::Z };
        let sphere =
            BsplineSurface::revolution(&arc.unwrap(), axis, ArcSpans::new(0.0, TAU)).unwrap();
        let moved = sphere.offset(-0.5, 1e-7).unwrap();
        for k in 0..400 {
            let (u, v) = (0.31 * f64::from(k) % TAU, -1.5 + 3.0 * f64::from(k) / 400.0);
            assert_close(moved.point(u, v).length(), 1.5, 1.2e-7);
        }
    }

    #[test]
    fn a_surface_without_normals_says_where() {
        let line = || KnotVector::clamped_uniform(Degree::new(1).unwrap(), 2).unwrap();
        let flat = vec![DVec3::ZERO, DVec3::X, DVec3::X, 2.0 * DVec3::X];
        let degenerate = BsplineSurface::new(line(), line(), flat, None).unwrap();
        let error = degenerate.offset(1.0, 1e-6).unwrap_err();
        assert!(error.to_string().starts_with("the surface has no normal at u = 0"), "{error}");
    }
}
