//! Exact parts of curves and surfaces, and the same ones seen the other way round.

use crate::curve::BsplineCurve;
use crate::error::SplineError;
use crate::fit::transpose;
use crate::knots::{KnotError, KnotVector};
use crate::surface::BsplineSurface;
use glam::DVec3;

/// Knots nearer to an end of a part than this share of its length are taken as that end: a sliver
/// of a span would only carry rounding.
const SLIVER: f64 = 1e-12;

impl KnotVector {
    /// Clamped knots over `[start, end]` with the knots of these splines in between; a periodic
    /// knot vector may be cut anywhere, over at most one period.
    ///
    /// # Errors
    /// [`KnotError::Outside`] if an end lies outside the domain, [`KnotError::EmptyDomain`] if
    /// there is nothing between them.
    pub fn subdomain(&self, start: f64, end: f64) -> Result<Self, KnotError> {
        let (first, last) = self.domain();
        if !(end > start) || !(end - start).is_finite() {
            return Err(KnotError::EmptyDomain { start, end });
        }
        let d = self.degree().get();
        let sliver = SLIVER * (end - start);
        let inside = |t: f64| t > start + sliver && t < end - sliver;
        let mut inner: Vec<f64> = Vec::new();
        if self.is_periodic() {
            let (period, n) = (last - first, self.control_count());
            if end - start > period * (1.0 + SLIVER) {
                return Err(KnotError::Outside { value: end, start, end: start + period });
            }
            let shift = ((start - first) / period).floor();
            for turn in [shift, shift + 1.0, shift + 2.0] {
                let turned = self.knots()[d..d + n].iter().map(|t| t + turn * period);
                inner.extend(turned.filter(|t| inside(*t)));
            }
        } else {
            let slack = SLIVER * (last - first);
            if let Some(value) =
                [start, end].into_iter().find(|t| *t < first - slack || *t > last + slack)
            {
                return Err(KnotError::Outside { value, start: first, end: last });
            }
            inner.extend(self.knots().iter().filter(|t| inside(**t)));
        }
        let mut knots = vec![start; d + 1];
        knots.append(&mut inner);
        knots.extend(std::iter::repeat_n(end, d + 1));
        Self::new(self.degree(), knots)
    }

    /// The knots of the splines run backwards over the same domain: `t` becomes
    /// `start + end − t`.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let (start, end) = self.domain();
        let mirror = |t: &f64| if *t == start { end } else { start + (end - t) };
        let mut knots: Vec<f64> = self.knots().iter().rev().map(mirror).collect();
        // Rounding must not unsort equal or nearly equal knots.
        for i in 1..knots.len() {
            knots[i] = knots[i].max(knots[i - 1]);
        }
        let made = if self.is_periodic() {
            let d = self.degree().get();
            Self::periodic(self.degree(), &knots[d..=d + self.control_count()])
        } else {
            Self::new(self.degree(), knots)
        };
        made.expect("a mirror image has the multiplicities of its original")
    }

    /// The same knots, all moved by `shift`.
    ///
    /// # Errors
    /// [`KnotError`] if the sums round to the same or leave the range of `f64`.
    pub fn shifted(&self, shift: f64) -> Result<Self, KnotError> {
        if shift == 0.0 {
            return Ok(self.clone());
        }
        let knots: Vec<f64> = self.knots().iter().map(|t| t + shift).collect();
        if self.is_periodic() {
            let d = self.degree().get();
            Self::periodic(self.degree(), &knots[d..=d + self.control_count()])
        } else {
            Self::new(self.degree(), knots)
        }
    }

    fn is_whole(&self, start: f64, end: f64) -> bool {
        self.is_clamped() && !self.is_periodic() && self.domain() == (start, end)
    }
}

impl BsplineCurve {
    /// The part over `[start, end]`, exact, with clamped knots; a periodic curve may be cut
    /// anywhere, over at most one period. The whole of a clamped curve is the curve itself.
    ///
    /// # Errors
    /// As [`KnotVector::subdomain`].
    pub fn subdomain(&self, start: f64, end: f64) -> Result<Self, SplineError> {
        if self.knots().is_whole(start, end) {
            return Ok(self.clone());
        }
        self.expressed(&self.knots().subdomain(start, end)?)
    }

    /// The same curve run backwards over the same domain.
    #[must_use]
    pub fn reversed(&self) -> Self {
        let order = reversed_order(self.knots());
        let points = order.iter().map(|&k| self.control_points()[k]).collect();
        let weights = self.weights().map(|w| order.iter().map(|&k| w[k]).collect());
        Self::new(self.knots().reversed(), points, weights)
            .expect("the same control points in another order")
    }

    /// The same curve over moved knots.
    ///
    /// # Errors
    /// As [`KnotVector::shifted`].
    pub fn shifted(&self, shift: f64) -> Result<Self, SplineError> {
        let (points, weights) = (self.control_points().to_vec(), self.weights());
        Self::new(self.knots().shifted(shift)?, points, weights.map(<[f64]>::to_vec))
    }

    /// The same knots and weights with every control point replaced by `map` of it, which is
    /// the image of the curve if `map` is affine.
    ///
    /// # Errors
    /// [`SplineError::NotFinite`] if a coordinate leaves the range of `f64`.
    pub fn mapped(&self, map: impl Fn(DVec3) -> DVec3) -> Result<Self, SplineError> {
        let points = self.control_points().iter().map(|p| map(*p)).collect();
        Self::new(self.knots().clone(), points, self.weights().map(<[f64]>::to_vec))
    }

    /// `self` followed by `next`, which begins where this curve ends; the joint is a knot of full
    /// multiplicity. `next` is moved along the parameter and its weights are scaled to fit.
    ///
    /// # Errors
    /// [`SplineError`] if the degrees differ (as a control point count) or numbers overflow.
    pub fn joined(&self, next: &Self) -> Result<Self, SplineError> {
        let (own, next) = (self.clamped()?, next.clamped()?);
        let (d, n) = (own.knots().degree().get(), own.control_points().len());
        let end = own.knots().domain().1;
        let shift = end - next.knots().domain().0;
        let mut knots = own.knots().knots()[..n].to_vec();
        knots.extend(std::iter::repeat_n(end, d));
        knots.extend(next.knots().knots()[d + 1..].iter().map(|t| t + shift));
        let mut points = own.control_points().to_vec();
        points.extend_from_slice(&next.control_points()[1..]);
        let weights = (own.weights().is_some() || next.weights().is_some()).then(|| {
            let of = |c: &Self| match c.weights() {
                Some(w) => w.to_vec(),
                None => vec![1.0; c.control_points().len()],
            };
            let (mut all, more) = (of(&own), of(&next));
            let scale = all[n - 1] / more[0];
            all.extend(more[1..].iter().map(|w| w * scale));
            all
        });
        Self::new(KnotVector::new(own.knots().degree(), knots)?, points, weights)
    }
}

/// Control points of a spline run backwards: a periodic one begins with the image of the point
/// whose basis function starts the period.
fn reversed_order(knots: &KnotVector) -> Vec<usize> {
    let n = knots.control_count();
    if !knots.is_periodic() {
        return (0..n).rev().collect();
    }
    // The functions of a period number `0 .. n + d`; function `i` becomes `n + d − 1 − i`.
    let last = n + knots.degree().get() - 1;
    (0..n).map(|i| (last - i) % n).collect()
}

impl BsplineSurface {
    /// The part over `u × v`, exact, with clamped knots in the directions that are cut; a periodic
    /// direction may be cut anywhere, over at most one period.
    ///
    /// # Errors
    /// As [`KnotVector::subdomain`].
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
    /// let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 1.0)];
    /// let saddle = BsplineSurface::new(line()?, line()?, corners, None)?; // z = x y
    /// let part = saddle.subdomain([0.5, 1.0], [0.0, 0.5])?;
    /// assert_eq!(part.control_point(1, 1), DVec3::new(1.0, 0.5, 0.5));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn subdomain(&self, u: [f64; 2], v: [f64; 2]) -> Result<Self, SplineError> {
        let part = |knots: &KnotVector, [a, b]: [f64; 2]| {
            if knots.is_whole(a, b) { Ok(knots.clone()) } else { knots.subdomain(a, b) }
        };
        let (knots_u, knots_v) = (part(self.knots_u(), u)?, part(self.knots_v(), v)?);
        if knots_u == *self.knots_u() && knots_v == *self.knots_v() {
            return Ok(self.clone());
        }
        self.expressed(&knots_u, &knots_v)
    }

    /// The same surface with the parameters swapped, which turns its normal over.
    #[must_use]
    pub fn swapped(&self) -> Self {
        let (n_u, n_v) = (self.n_u(), self.n_v());
        let points = transpose(self.control_points(), n_u, n_v);
        let weights = self.weights().map(|w| transpose(w, n_u, n_v));
        Self::new(self.knots_v().clone(), self.knots_u().clone(), points, weights)
            .expect("the same control points in another order")
    }

    /// The same surface run backwards in u over the same domain, which turns its normal over.
    #[must_use]
    pub fn reversed_u(&self) -> Self {
        let (order, n_v) = (reversed_order(self.knots_u()), self.n_v());
        let pick = |k: &usize| k * n_v..(k + 1) * n_v;
        let points = order.iter().flat_map(|k| &self.control_points()[pick(k)]).copied().collect();
        let weights =
            self.weights().map(|w| order.iter().flat_map(|k| &w[pick(k)]).copied().collect());
        Self::new(self.knots_u().reversed(), self.knots_v().clone(), points, weights)
            .expect("the same control points in another order")
    }

    /// A surface that closes in u, cut open at `u` and joined where it was open before: the
    /// domain becomes `[u, u + length]`. A periodic one may be cut anywhere; of a clamped one the
    /// first and last rows must be the same curve.
    ///
    /// # Errors
    /// [`SplineError`] if `u` lies outside the domain, or the rows differ in their weights.
    pub fn with_seam_at_u(&self, u: f64) -> Result<Self, SplineError> {
        let (start, end) = self.knots_u().domain();
        let v = self.knots_v().domain();
        if self.knots_u().is_periodic() {
            return self.subdomain([u, u + (end - start)], [v.0, v.1]);
        }
        let whole = self.subdomain([start, end], [v.0, v.1])?;
        if u == start {
            return Ok(whole);
        }
        let (first, second) =
            (whole.subdomain([u, end], [v.0, v.1])?, whole.subdomain([start, u], [v.0, v.1])?);
        let (d, n, n_v) = (whole.degree_u().get(), first.n_u(), whole.n_v());
        let mut knots = first.knots_u().knots()[..n].to_vec();
        knots.extend(std::iter::repeat_n(end, d));
        knots.extend(second.knots_u().knots()[d + 1..].iter().map(|t| t + (end - start)));
        let mut points = first.control_points().to_vec();
        points.extend_from_slice(&second.control_points()[n_v..]);
        let weights = first.weights().zip(second.weights()).map(|(a, b)| {
            let scale = a[(n - 1) * n_v] / b[0];
            a.iter().copied().chain(b[n_v..].iter().map(|w| w * scale)).collect()
        });
        let knots_u = KnotVector::new(whole.degree_u(), knots)?;
        Self::new(knots_u, whole.knots_v().clone(), points, weights)
    }

    /// The same knots and weights with every control point replaced by `map` of it, which is the
    /// image of the surface if `map` is affine.
    ///
    /// # Errors
    /// [`SplineError::NotFinite`] if a coordinate leaves the range of `f64`.
    pub fn mapped(&self, map: impl Fn(DVec3) -> DVec3) -> Result<Self, SplineError> {
        self.with_control_points(self.control_points().iter().map(|p| map(*p)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Degree;
    use geom_core::assert_close;

    fn degree(d: usize) -> Degree {
        Degree::new(d).unwrap()
    }

    fn surface(ku: KnotVector, kv: KnotVector) -> BsplineSurface {
        let n = ku.control_count() * kv.control_count();
        let point = |k: usize| {
            let t = k as f64;
            DVec3::new((t * 0.9).sin(), (t * 0.4).cos(), (t * 1.7).sin())
        };
        let weights = (0..n).map(|k| 1.3 + (k as f64 * 0.8).cos()).collect();
        BsplineSurface::new(ku, kv, (0..n).map(point).collect(), Some(weights)).unwrap()
    }

    fn samples() -> Vec<BsplineSurface> {
        let clamped = KnotVector::clamped_uniform(degree(3), 7).unwrap();
        let periodic = KnotVector::periodic(degree(2), &[0.0, 0.1, 0.35, 0.35, 0.7, 1.0]).unwrap();
        vec![
            surface(clamped.clone(), periodic.clone()),
            surface(periodic.clone(), clamped.clone()),
            surface(periodic, KnotVector::clamped_uniform(degree(1), 3).unwrap()),
        ]
    }

    #[test]
    fn parts_are_the_surface_itself() {
        for surface in samples() {
            for (u, v) in [([0.2, 0.7], [0.11, 0.95]), ([0.0, 0.25], [0.25, 1.0])] {
                let part = surface.subdomain(u, v).unwrap();
                assert_eq!(part.knots_u().domain(), (u[0], u[1]));
                for (s, t) in [(0.0, 0.0), (0.3, 0.8), (1.0, 1.0), (0.55, 0.0)] {
                    let (a, b) = (u[0] + s * (u[1] - u[0]), v[0] + t * (v[1] - v[0]));
                    assert_close(part.point(a, b).distance(surface.point(a, b)), 0.0, 1e-13);
                }
            }
        }
    }

    #[test]
    fn a_period_is_cut_anywhere() {
        let surface = samples().remove(1);
        let part = surface.subdomain([0.8, 1.6], [0.0, 1.0]).unwrap();
        for u in [0.8, 0.9, 1.0, 1.2, 1.34, 1.36, 1.599] {
            assert_close(part.point(u, 0.4).distance(surface.point(u, 0.4)), 0.0, 1e-13);
        }
        assert!(surface.subdomain([0.8, 1.9], [0.0, 1.0]).is_err());
        assert!(surface.subdomain([0.5, 0.5], [0.0, 1.0]).is_err());
        assert!(surface.subdomain([0.0, 1.0], [0.5, 1.2]).is_err());
    }

    #[test]
    fn a_seam_moves_and_the_surface_stays() {
        let periodic = samples().remove(1);
        let clamped = periodic.clamped().unwrap();
        for closed in [periodic.clone(), clamped] {
            let moved = closed.with_seam_at_u(0.4).unwrap();
            assert_eq!(moved.knots_u().domain(), (0.4, 1.4));
            for u in [0.4, 0.5, 0.99, 1.0, 1.01, 1.39] {
                assert_close(moved.point(u, 0.3).distance(periodic.point(u, 0.3)), 0.0, 1e-13);
            }
        }
    }

    #[test]
    fn backwards_and_swapped_run_through_the_same_points() {
        for surface in samples() {
            let (back, swapped) = (surface.reversed_u(), surface.swapped());
            for (u, v) in [(0.0, 0.3), (0.21, 0.35), (0.5, 0.9), (0.77, 0.1)] {
                let wanted = surface.point(u, v);
                assert_close(back.point(1.0 - u, v).distance(wanted), 0.0, 1e-13);
                assert_close(swapped.point(v, u).distance(wanted), 0.0, 1e-15);
            }
            assert_eq!(swapped.swapped(), surface);
        }
    }

    #[test]
    fn curves_are_cut_turned_and_joined() {
        let surface = samples().remove(1);
        let points: Vec<DVec3> = (0..5).map(|i| surface.control_point(i, 2)).collect();
        let curve = BsplineCurve::new(
            surface.knots_u().clone(),
            points,
            Some(vec![1.0, 0.5, 2.0, 1.0, 1.5]),
        )
        .unwrap();
        let (first, second) =
            (curve.subdomain(0.2, 0.6).unwrap(), curve.subdomain(0.6, 1.1).unwrap());
        let joined = first.joined(&second).unwrap();
        assert_eq!(joined.knots().domain(), (0.2, 1.1));
        for t in [0.2, 0.3, 0.5999, 0.6, 0.8, 1.05] {
            assert_close(joined.point(t).distance(curve.point(t)), 0.0, 1e-13);
            assert_close(joined.reversed().point(1.3 - t).distance(curve.point(t)), 0.0, 1e-12);
        }
    }
}
