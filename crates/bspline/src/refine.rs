//! Exact changes of representation: knot insertion, degree elevation, clamping, Bezier pieces.
//!
//! All of them are one computation. The control points of a spline are values of its blossom (the
//! symmetric multiaffine form of a polynomial piece) at successive knots (Ramshaw 1989), so a
//! richer space takes its control points from the blossom at its own knots.

use crate::curve::BsplineCurve;
use crate::error::SplineError;
use crate::fit::transpose;
use crate::knots::{Degree, KnotError, KnotVector};
use crate::surface::BsplineSurface;
use glam::{DVec3, DVec4};

impl KnotVector {
    /// These knots with `added` among them.
    ///
    /// # Errors
    /// [`KnotError`] if a knot then occurs too often, or lies outside the domain.
    ///
    /// # Example
    /// ```
    /// use bspline::{Degree, KnotVector};
    /// let knots = KnotVector::clamped_uniform(Degree::new(1)?, 2)?.with_knots(&[0.75, 0.25])?;
    /// assert_eq!(knots.knots(), [0.0, 0.0, 0.25, 0.75, 1.0, 1.0]);
    /// assert!(knots.with_knots(&[1.5]).is_err()); // outside the domain
    /// # Ok::<(), bspline::KnotError>(())
    /// ```
    pub fn with_knots(&self, added: &[f64]) -> Result<Self, KnotError> {
        let (start, end) = self.domain();
        if let Some(&value) = added.iter().find(|t| !(start..=end).contains(*t)) {
            return Err(KnotError::Outside { value, start, end });
        }
        let d = self.degree().get();
        let merged = |old: &[f64]| {
            let mut all = old.to_vec();
            all.extend_from_slice(added);
            all.sort_by(f64::total_cmp);
            all
        };
        if self.is_periodic() {
            let n = self.control_count();
            Self::periodic(self.degree(), &merged(&self.knots()[d..=d + n]))
        } else {
            Self::new(self.degree(), merged(self.knots()))
        }
    }

    /// The clamped knots of the same splines over the domain.
    #[must_use]
    pub fn clamped(&self) -> Self {
        self.with_inner_multiplicity(self.degree(), |m| m)
    }

    /// Clamped knots of degree `degree` with the same breaks.
    fn with_inner_multiplicity(&self, degree: Degree, inner: impl Fn(usize) -> usize) -> Self {
        let breaks = self.breaks();
        let last = breaks.len() - 1;
        let mut knots = Vec::new();
        for (i, &t) in breaks.iter().enumerate() {
            let count = if i == 0 || i == last {
                degree.order()
            } else {
                inner(self.multiplicity(t)).min(degree.get())
            };
            knots.extend(std::iter::repeat_n(t, count));
        }
        Self::new(degree, knots).expect("breaks are sorted and no multiplicity is too high")
    }

    /// The knots of the same splines seen as splines of a higher degree.
    fn elevated(&self, degree: Degree) -> Result<Self, KnotError> {
        let added = degree.get() - self.degree().get();
        if self.is_periodic() {
            let d = self.degree().get();
            let period = &self.knots()[d..=d + self.control_count()];
            let mut knots = Vec::new();
            for (i, &t) in period.iter().enumerate() {
                knots.push(t);
                if period.get(i + 1) != Some(&t) {
                    knots.extend(std::iter::repeat_n(t, added));
                }
            }
            // Both ends of the period are the same knot; it must stand once more than before in
            // the whole, so the copies at the far end go.
            knots.truncate(knots.len() - added);
            Self::periodic(degree, &knots)
        } else {
            Ok(self.with_inner_multiplicity(degree, |m| m + added))
        }
    }
}

/// Value at `arguments` of the blossom of the polynomial piece on `span`: de Boor's algorithm
/// with another argument at each level.
fn blossom(
    knots: &KnotVector,
    span: usize,
    control: &impl Fn(usize) -> DVec4,
    arguments: impl Iterator<Item = f64>,
) -> DVec4 {
    let d = knots.degree().get();
    let t = knots.knots();
    let mut points = [DVec4::ZERO; Degree::MAX + 1];
    for (r, point) in points[..=d].iter_mut().enumerate() {
        *point = control(knots.control_index(span, r));
    }
    for (level, x) in (1..=d).zip(arguments) {
        for r in (level..=d).rev() {
            let (low, high) = (t[span - d + r], t[span + 1 + r - level]);
            let s = (x - low) / (high - low);
            points[r] = points[r - 1] * (1.0 - s) + points[r] * s;
        }
    }
    points[d]
}

/// Control points over `target` of the spline with knots `source`, for every one of `count`
/// splines whose control points are `control(spline, i)`; the result is `[spline][i]`.
///
/// The splines over `target` must include those over `source`, and the degree may be higher.
fn express(
    source: &KnotVector,
    target: &KnotVector,
    count: usize,
    control: impl Fn(usize, usize) -> DVec4,
) -> Vec<DVec4> {
    let (d, e) = (source.degree().get(), target.degree().get());
    let (start, end) = source.domain();
    let n = target.control_count();
    let t = target.knots();
    // Where the blossom of each new control point is taken: the middle of the knot interval of
    // its support that is nearest to the support's own middle, so that arguments stay close.
    let places: Vec<(usize, f64)> = (0..n)
        .map(|i| {
            let middle = 0.5 * (t[i] + t[i + e + 1]);
            let (mut best, mut distance) = (start, f64::INFINITY);
            for s in i..=i + e {
                let m = 0.5 * (t[s] + t[s + 1]);
                let inside = source.is_periodic() || (t[s] >= start && t[s + 1] <= end);
                if t[s] < t[s + 1] && inside && (m - middle).abs() < distance {
                    (best, distance) = (m, (m - middle).abs());
                }
            }
            let here = source.normalize(best);
            (source.span(here), here - best)
        })
        .collect();
    let mut out = Vec::with_capacity(count * n);
    for k in 0..count {
        let control = |i: usize| control(k, i);
        for (i, &(span, shift)) in places.iter().enumerate() {
            out.push(elevated_blossom(source, span, &control, t, i, e - d, shift));
        }
    }
    out
}

/// The blossom of degree `d + raise` at the knots after index `i`: the mean of the blossom of
/// degree `d` over all ways to leave out `raise` of the arguments.
fn elevated_blossom(
    source: &KnotVector,
    span: usize,
    control: &impl Fn(usize) -> DVec4,
    target_knots: &[f64],
    i: usize,
    raise: usize,
    shift: f64,
) -> DVec4 {
    let e = source.degree().get() + raise;
    let argument = |r: usize| target_knots[i + 1 + r] + shift;
    if raise == 0 {
        return blossom(source, span, control, (0..e).map(argument));
    }
    let mut left_out: Vec<usize> = (0..raise).collect();
    let (mut sum, mut ways) = (DVec4::ZERO, 0.0);
    loop {
        let kept = (0..e).filter(|r| !left_out.contains(r)).map(argument);
        sum += blossom(source, span, control, kept);
        ways += 1.0;
        // The next combination in lexical order.
        let Some(at) = (0..raise).rev().find(|&k| left_out[k] < e - raise + k) else { break };
        left_out[at] += 1;
        for k in at + 1..raise {
            left_out[k] = left_out[k - 1] + 1;
        }
    }
    sum / ways
}

fn homogeneous(points: &[DVec3], weights: Option<&[f64]>) -> Vec<DVec4> {
    match weights {
        None => points.iter().map(|p| p.extend(1.0)).collect(),
        Some(w) => points.iter().zip(w).map(|(p, &w)| (*p * w).extend(w)).collect(),
    }
}

fn projected(points: &[DVec4], is_rational: bool) -> (Vec<DVec3>, Option<Vec<f64>>) {
    if is_rational {
        let weights = points.iter().map(|p| p.w).collect();
        (points.iter().map(|p| p.truncate() / p.w).collect(), Some(weights))
    } else {
        (points.iter().map(|p| p.truncate()).collect(), None)
    }
}

impl BsplineCurve {
    pub(crate) fn expressed(&self, target: &KnotVector) -> Result<Self, SplineError> {
        let control = homogeneous(self.control_points(), self.weights());
        let points = express(self.knots(), target, 1, |_, i| control[i]);
        let (points, weights) = projected(&points, self.weights().is_some());
        Self::new(target.clone(), points, weights)
    }

    /// The same curve with more knots.
    ///
    /// # Errors
    /// [`KnotError`], as a [`SplineError`], if a knot is outside the domain or repeated too often.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineCurve, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// // A parabola cut in two: the control polygon of both halves by de Casteljau's midpoints.
    /// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 3)?;
    /// let points = vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y];
    /// let parabola = BsplineCurve::new(knots, points, None)?;
    /// let halves = parabola.insert_knots(&[0.5, 0.5])?;
    /// let middle = parabola.point(0.5);
    /// let [_, left, cut, right, _] = halves.control_points() else { panic!("five points") };
    /// assert_eq!((*left, *cut, *right), (0.5 * DVec3::X, middle, DVec3::new(1.0, 0.5, 0.0)));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn insert_knots(&self, added: &[f64]) -> Result<Self, SplineError> {
        self.expressed(&self.knots().with_knots(added)?)
    }

    /// The same curve with clamped knots; a closed curve is cut open at the start of its period.
    ///
    /// # Errors
    /// [`SplineError`] if the numbers of an extreme curve leave the range of `f64`.
    pub fn clamped(&self) -> Result<Self, SplineError> {
        if self.knots().is_clamped() {
            return Ok(self.clone());
        }
        self.expressed(&self.knots().clamped())
    }

    /// The same curve with a higher degree (or the same).
    ///
    /// # Errors
    /// [`KnotError`], as a [`SplineError`], if `degree` is below the present one.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineCurve, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let knots = KnotVector::clamped_uniform(Degree::new(1)?, 2)?;
    /// let line = BsplineCurve::new(knots, vec![DVec3::ZERO, DVec3::X], None)?;
    /// let parabola = line.elevated(Degree::new(2)?)?;
    /// assert_eq!(parabola.control_points(), [DVec3::ZERO, 0.5 * DVec3::X, DVec3::X]);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn elevated(&self, degree: Degree) -> Result<Self, SplineError> {
        self.expressed(&elevated_knots(self.knots(), degree)?)
    }
}

fn elevated_knots(knots: &KnotVector, degree: Degree) -> Result<KnotVector, KnotError> {
    if degree < knots.degree() {
        let (degree, wanted) = (knots.degree().get(), degree.get());
        return Err(KnotError::Lowered { degree, wanted });
    }
    knots.elevated(degree)
}

impl BsplineSurface {
    pub(crate) fn expressed(
        &self,
        target_u: &KnotVector,
        target_v: &KnotVector,
    ) -> Result<Self, SplineError> {
        let (n_u, n_v) = (self.n_u(), self.n_v());
        let control = homogeneous(self.control_points(), self.weights());
        // In u first: one spline per column, which leaves [j * new_u + i].
        let columns = express(self.knots_u(), target_u, n_v, |j, i| control[i * n_v + j]);
        let new_u = target_u.control_count();
        debug_assert_eq!(control.len(), n_u * n_v);
        let rows = transpose(&columns, n_v, new_u);
        let points = express(self.knots_v(), target_v, new_u, |i, j| rows[i * n_v + j]);
        let (points, weights) = projected(&points, self.is_rational());
        Self::new(target_u.clone(), target_v.clone(), points, weights)
    }

    /// The same surface with more knots in u and v.
    ///
    /// # Errors
    /// [`KnotError`], as a [`SplineError`], if a knot is outside the domain or repeated too often.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
    /// let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 1.0)];
    /// let saddle = BsplineSurface::new(line()?, line()?, corners, None)?;
    /// let finer = saddle.insert_knots(&[0.5], &[])?;
    /// assert_eq!((finer.n_u(), finer.n_v()), (3, 2));
    /// assert_eq!(finer.control_point(1, 1), DVec3::new(0.5, 1.0, 0.5));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn insert_knots(&self, u: &[f64], v: &[f64]) -> Result<Self, SplineError> {
        self.expressed(&self.knots_u().with_knots(u)?, &self.knots_v().with_knots(v)?)
    }

    /// The same surface with clamped knots; a closed surface is cut open at the start of its
    /// period. Formats without periodic splines want this form.
    ///
    /// # Errors
    /// [`SplineError`] if the numbers of an extreme surface leave the range of `f64`.
    pub fn clamped(&self) -> Result<Self, SplineError> {
        if self.knots_u().is_clamped() && self.knots_v().is_clamped() {
            return Ok(self.clone());
        }
        self.expressed(&self.knots_u().clamped(), &self.knots_v().clamped())
    }

    /// The same surface with higher degrees (or the same).
    ///
    /// # Errors
    /// [`KnotError`], as a [`SplineError`], if a degree is below the present one.
    pub fn elevated(&self, degree_u: Degree, degree_v: Degree) -> Result<Self, SplineError> {
        let u = elevated_knots(self.knots_u(), degree_u)?;
        let v = elevated_knots(self.knots_v(), degree_v)?;
        self.expressed(&u, &v)
    }

    /// The polynomial (or rational) pieces between the knots as Bezier patches.
    ///
    /// # Errors
    /// [`SplineError`] if the numbers of an extreme surface leave the range of `f64`.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// // A folded strip: two flat pieces that meet at u = 1/2.
    /// let u = KnotVector::clamped_uniform(Degree::new(1)?, 3)?;
    /// let v = KnotVector::clamped_uniform(Degree::new(1)?, 2)?;
    /// let fold = [DVec3::ZERO, DVec3::new(1.0, 0.0, 1.0), DVec3::new(2.0, 0.0, 0.0)];
    /// let points = fold.iter().flat_map(|&p| [p, p + DVec3::Y]).collect();
    /// let strip = BsplineSurface::new(u, v, points, None)?;
    /// let pieces = strip.bezier_patches()?;
    /// assert_eq!((pieces.len(), pieces[1].u), (2, [0.5, 1.0]));
    /// assert_eq!(pieces[1].patch.point(0.0, 1.0), strip.point(0.5, 1.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn bezier_patches(&self) -> Result<Vec<BezierPiece>, SplineError> {
        let (d_u, d_v) = (self.degree_u(), self.degree_v());
        let target_u = self.knots_u().with_inner_multiplicity(d_u, |_| d_u.get());
        let target_v = self.knots_v().with_inner_multiplicity(d_v, |_| d_v.get());
        let whole = self.expressed(&target_u, &target_v)?;
        let (breaks_u, breaks_v) = (target_u.breaks(), target_v.breaks());
        let (bernstein_u, bernstein_v) = (
            KnotVector::clamped_uniform(d_u, d_u.order())?,
            KnotVector::clamped_uniform(d_v, d_v.order())?,
        );
        let n_v = whole.n_v();
        let mut pieces = Vec::new();
        for (p, u) in breaks_u.windows(2).enumerate() {
            for (q, v) in breaks_v.windows(2).enumerate() {
                let index = |k: usize| {
                    let (r, s) = (k / d_v.order(), k % d_v.order());
                    (p * d_u.get() + r) * n_v + q * d_v.get() + s
                };
                let count = d_u.order() * d_v.order();
                let points = (0..count).map(|k| whole.control_points()[index(k)]).collect();
                let weights =
                    whole.weights().map(|w| (0..count).map(|k| w[index(k)]).collect::<Vec<f64>>());
                let patch = Self::new(bernstein_u.clone(), bernstein_v.clone(), points, weights)?;
                pieces.push(BezierPiece { patch, u: [u[0], u[1]], v: [v[0], v[1]] });
            }
        }
        Ok(pieces)
    }
}

/// One polynomial piece of a surface in Bezier form.
#[derive(Clone, Debug, PartialEq)]
pub struct BezierPiece {
    /// The piece, over `[0, 1]²`, with Bernstein polynomials as basis.
    pub patch: BsplineSurface,
    /// Start and end of the piece in the surface's first parameter.
    pub u: [f64; 2],
    /// Start and end of the piece in the surface's second parameter.
    pub v: [f64; 2],
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    fn degree(d: usize) -> Degree {
        Degree::new(d).unwrap()
    }

    fn surfaces() -> Vec<BsplineSurface> {
        let open = KnotVector::new(
            degree(3),
            vec![-0.3, -0.2, -0.1, 0.0, 0.2, 0.2, 0.6, 1.0, 1.3, 1.4, 1.5],
        )
        .unwrap();
        let clamped = KnotVector::clamped_uniform(degree(4), 7).unwrap();
        let periodic = KnotVector::periodic(degree(2), &[0.0, 0.1, 0.35, 0.35, 0.7, 1.0]).unwrap();
        let mut result = Vec::new();
        for (u, v) in [(&open, &clamped), (&periodic, &open), (&clamped, &periodic)] {
            for rational in [false, true] {
                let n = u.control_count() * v.control_count();
                let point = |k: usize| {
                    let t = k as f64;
                    DVec3::new((t * 0.9).sin(), (t * 0.4).cos(), (t * 1.7).sin())
                };
                let weights = (0..n).map(|k| 1.2 + (k as f64).cos()).collect();
                let points = (0..n).map(point).collect();
                let weights = if rational { Some(weights) } else { None };
                let made = BsplineSurface::new(u.clone(), v.clone(), points, weights);
                result.push(made.unwrap());
            }
        }
        result
    }

    #[track_caller]
    fn assert_same(a: &BsplineSurface, b: &BsplineSurface) {
        assert_eq!(a.knots_u().domain(), b.knots_u().domain());
        for u in [0.0, 0.15, 0.2, 0.55, 0.83, 0.999] {
            for v in [0.0, 0.11, 0.35, 0.62, 0.97] {
                assert_close(a.point(u, v).distance(b.point(u, v)), 0.0, 2e-13);
            }
        }
    }

    #[test]
    fn knot_insertion_changes_no_point() {
        for surface in surfaces() {
            let finer = surface.insert_knots(&[0.05, 0.5, 0.5], &[0.3, 0.9]).unwrap();
            assert_eq!((finer.n_u(), finer.n_v()), (surface.n_u() + 3, surface.n_v() + 2));
            assert_same(&surface, &finer);
        }
    }

    #[test]
    fn degree_elevation_changes_no_point() {
        for surface in surfaces() {
            let (d_u, d_v) = (surface.degree_u().get(), surface.degree_v().get());
            let raised = surface.elevated(degree(d_u + 1), degree(d_v + 2)).unwrap();
            assert_eq!((raised.degree_u().get(), raised.degree_v().get()), (d_u + 1, d_v + 2));
            assert_eq!(raised.knots_u().is_periodic(), surface.knots_u().is_periodic());
            assert_same(&surface, &raised);
            assert!(surface.elevated(degree(d_u - 1), degree(d_v)).is_err());
        }
    }

    #[test]
    fn clamping_changes_no_point() {
        for surface in surfaces() {
            let clamped = surface.clamped().unwrap();
            assert!(clamped.knots_u().is_clamped() && clamped.knots_v().is_clamped());
            assert!(!clamped.knots_u().is_periodic());
            assert_same(&surface, &clamped);
        }
    }

    #[test]
    fn bezier_pieces_cover_the_surface() {
        for surface in surfaces() {
            let pieces = surface.bezier_patches().unwrap();
            let count = |k: &KnotVector| k.breaks().len() - 1;
            assert_eq!(pieces.len(), count(surface.knots_u()) * count(surface.knots_v()));
            for piece in pieces {
                for (s, t) in [(0.0, 0.2), (0.4, 0.9), (0.7, 0.5)] {
                    let u = piece.u[0] + s * (piece.u[1] - piece.u[0]);
                    let v = piece.v[0] + t * (piece.v[1] - piece.v[0]);
                    let distance = piece.patch.point(s, t).distance(surface.point(u, v));
                    assert_close(distance, 0.0, 2e-13);
                }
            }
        }
    }

    #[test]
    fn curves_follow_the_same_rules() {
        let knots = KnotVector::periodic_uniform(degree(3), 5).unwrap();
        let points = (0..5).map(|k| DVec3::new(f64::from(k).sin(), f64::from(k * k), 1.0));
        let curve = BsplineCurve::new(knots, points.collect(), None).unwrap();
        let changed = [
            curve.insert_knots(&[0.1, 0.77]).unwrap(),
            curve.elevated(degree(5)).unwrap(),
            curve.clamped().unwrap(),
        ];
        for other in changed {
            for t in [0.0, 0.1, 0.33, 0.8, 0.95] {
                assert_close(curve.point(t).distance(other.point(t)) / 16.0, 0.0, 1e-14);
            }
        }
    }

    #[test]
    fn knots_outside_or_too_many_are_refused() {
        let knots = KnotVector::clamped_uniform(degree(2), 4).unwrap();
        assert!(knots.with_knots(&[1.5]).is_err());
        assert!(knots.with_knots(&[f64::NAN]).is_err());
        assert!(knots.with_knots(&[0.5]).is_ok());
        assert!(matches!(knots.with_knots(&[0.5, 0.5]), Err(KnotError::OverRepeated { .. })));
    }
}
