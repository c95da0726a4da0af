//! Knot vectors, clamped, open and periodic.

use std::fmt;

/// Degree of a spline: 1 to [`Degree::MAX`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Degree(usize);

impl Degree {
    /// The highest degree that is supported.
    pub const MAX: usize = 15;

    /// Checks the degree.
    ///
    /// # Errors
    /// [`KnotError::Degree`] outside 1 to [`Degree::MAX`].
    pub fn new(degree: usize) -> Result<Self, KnotError> {
        if (1..=Self::MAX).contains(&degree) {
            Ok(Self(degree))
        } else {
            Err(KnotError::Degree { degree })
        }
    }

    /// The number.
    #[must_use]
    pub const fn get(self) -> usize {
        self.0
    }

    /// Number of basis functions that are not zero on a knot span.
    #[must_use]
    pub const fn order(self) -> usize {
        self.0 + 1
    }
}

impl fmt::Display for Degree {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// Why a knot vector was refused.
///
/// # Example
/// ```
/// use bspline::{Degree, KnotVector};
/// let fault = KnotVector::new(Degree::new(1)?, vec![0.0, 0.0, 0.7, 0.4, 1.0, 1.0]).unwrap_err();
/// assert_eq!(
///     fault.to_string(),
///     "knot 2 is 0.7 and the next 0.4; knots must be finite and sorted"
/// );
/// # Ok::<(), bspline::KnotError>(())
/// ```
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum KnotError {
    /// A degree that is not supported.
    #[error("degree {degree} is not between 1 and 15; lower it or split the spline into pieces")]
    Degree { degree: usize },
    /// Fewer knots than one polynomial piece needs.
    #[error("degree {degree} needs {needed} knots, found {found}; add knots or lower the degree")]
    TooFew { degree: usize, needed: usize, found: usize },
    /// Fewer control points than one polynomial piece needs.
    #[error(
        "degree {degree} needs at least {needed} control points, found {found}; \
         add control points or lower the degree"
    )]
    TooFewControlPoints { degree: usize, needed: usize, found: usize },
    /// A NaN, an infinity or a step down.
    #[error("knot {index} is {value} and the next {next}; knots must be finite and sorted")]
    NotSorted { index: usize, value: f64, next: f64 },
    /// A knot repeated so often that the spline would fall apart there.
    #[error(
        "knot {value} is repeated {found} times, at most {allowed} are possible there \
         for degree {degree}; drop the surplus knots or split the spline"
    )]
    OverRepeated { value: f64, found: usize, allowed: usize, degree: usize },
    /// A knot to insert that lies outside the domain.
    #[error("knot {value} lies outside the domain [{start}, {end}]; move it inside")]
    Outside { value: f64, start: f64, end: f64 },
    /// A degree below the present one.
    #[error("degree {degree} cannot become {wanted} exactly; refit to lower the degree")]
    Lowered { degree: usize, wanted: usize },
    /// The domain has no length.
    #[error("the domain [{start}, {end}] has no length; spread the knots")]
    EmptyDomain { start: f64, end: f64 },
}

/// Knots of a spline: finite, never decreasing, no knot repeated so often that the spline falls
/// apart, and a domain of positive length (kept by the constructors).
///
/// An open knot vector for `n` control points of degree `d` has `n + d + 1` knots and the domain
/// `[t_d, t_n]`; it is clamped if its first and last `d + 1` knots coincide. A periodic one for
/// `n` control points covers one period with `n` knot intervals, extended by `d` on either side;
/// control point `i + n` is control point `i`.
///
/// # Example
/// ```
/// use bspline::{Degree, KnotVector};
/// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 4)?;
/// assert_eq!(knots.knots(), [0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.0]);
/// assert_eq!(knots.control_count(), 4);
/// # Ok::<(), bspline::KnotError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct KnotVector {
    degree: Degree,
    knots: Vec<f64>,
    is_periodic: bool,
}

impl KnotVector {
    /// An open knot vector; takes ownership of `knots` after checking them.
    ///
    /// # Errors
    /// [`KnotError`] names the first knot at fault.
    pub fn new(degree: Degree, knots: Vec<f64>) -> Result<Self, KnotError> {
        let (needed, found) = (2 * degree.order(), knots.len());
        if found < needed {
            return Err(KnotError::TooFew { degree: degree.get(), needed, found });
        }
        check_sorted(&knots)?;
        let made = Self { degree, knots, is_periodic: false };
        let (start, end) = made.domain();
        if !(end > start) {
            return Err(KnotError::EmptyDomain { start, end });
        }
        for (value, multiplicity) in made.multiplicities() {
            let at_end = value <= start || value >= end;
            let allowed = if at_end { degree.order() } else { degree.get() };
            if multiplicity > allowed {
                return Err(KnotError::OverRepeated {
                    value,
                    found: multiplicity,
                    allowed,
                    degree: degree.get(),
                });
            }
        }
        Ok(made)
    }

    /// Clamped knots at equal distances on `[0, 1]` for `n` control points.
    ///
    /// # Errors
    /// [`KnotError::TooFewControlPoints`] if `n` is below `degree + 1`.
    ///
    /// # Example
    /// ```
    /// use bspline::{Degree, KnotVector};
    /// let knots = KnotVector::clamped_uniform(Degree::new(1)?, 3)?;
    /// assert_eq!(knots.knots(), [0.0, 0.0, 0.5, 1.0, 1.0]);
    /// # Ok::<(), bspline::KnotError>(())
    /// ```
    pub fn clamped_uniform(degree: Degree, n: usize) -> Result<Self, KnotError> {
        let d = degree.get();
        if n < degree.order() {
            return Err(too_few_control_points(degree, n));
        }
        let spans = n - d;
        let mut knots = vec![0.0; d];
        knots.extend((0..=spans).map(|i| i as f64 / spans as f64));
        knots.extend(std::iter::repeat_n(1.0, d));
        Self::new(degree, knots)
    }

    /// Periodic knots from the knots of one period, both ends included: `period_knots` has one
    /// entry more than there are control points.
    ///
    /// # Errors
    /// [`KnotError`] names the first knot at fault; one period needs at least `degree + 1`
    /// control points, so that no basis function overlaps itself.
    ///
    /// # Example
    /// ```
    /// use bspline::{Degree, KnotVector};
    /// let knots = KnotVector::periodic(Degree::new(2)?, &[0.0, 0.5, 1.0, 2.0])?;
    /// assert_eq!((knots.control_count(), knots.domain()), (3, (0.0, 2.0)));
    /// assert_eq!(knots.normalize(2.75), 0.75); // the next period
    /// # Ok::<(), bspline::KnotError>(())
    /// ```
    pub fn periodic(degree: Degree, period_knots: &[f64]) -> Result<Self, KnotError> {
        let d = degree.get();
        let n = period_knots.len().saturating_sub(1);
        if n < degree.order() {
            return Err(too_few_control_points(degree, n));
        }
        check_sorted(period_knots)?;
        let (start, end) = (period_knots[0], period_knots[n]);
        if !(end > start) {
            return Err(KnotError::EmptyDomain { start, end });
        }
        let period = end - start;
        let mut knots = Vec::with_capacity(n + 2 * d + 1);
        knots.extend(period_knots[n - d..n].iter().map(|t| t - period));
        knots.extend_from_slice(period_knots);
        knots.extend(period_knots[1..=d].iter().map(|t| t + period));
        let made = Self { degree, knots, is_periodic: true };
        for (value, found) in made.multiplicities() {
            if found > d {
                return Err(KnotError::OverRepeated { value, found, allowed: d, degree: d });
            }
        }
        Ok(made)
    }

    /// Periodic knots at equal distances with period `[0, 1]` for `n` control points.
    ///
    /// # Errors
    /// [`KnotError::TooFewControlPoints`] if `n` is below `degree + 1`.
    pub fn periodic_uniform(degree: Degree, n: usize) -> Result<Self, KnotError> {
        if n < degree.order() {
            return Err(too_few_control_points(degree, n));
        }
        let knots: Vec<f64> = (0..=n).map(|i| i as f64 / n as f64).collect();
        Self::periodic(degree, &knots)
    }

    /// The degree.
    #[must_use]
    pub fn degree(&self) -> Degree {
        self.degree
    }

    /// All knots, those beyond the period included.
    #[must_use]
    pub fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// Whether control point `n + i` is control point `i`.
    #[must_use]
    pub fn is_periodic(&self) -> bool {
        self.is_periodic
    }

    /// Whether the first and the last `degree + 1` knots coincide, so that the spline passes
    /// through its end control points.
    #[must_use]
    pub fn is_clamped(&self) -> bool {
        let (k, d) = (&self.knots, self.degree.get());
        k[0] == k[d] && k[k.len() - 1] == k[k.len() - 1 - d]
    }

    /// Number of different control points.
    #[must_use]
    pub fn control_count(&self) -> usize {
        let d = self.degree.get();
        let functions = self.knots.len() - d - 1;
        if self.is_periodic { functions - d } else { functions }
    }

    /// Start and end of the domain; of one period if the knots are periodic.
    #[must_use]
    pub fn domain(&self) -> (f64, f64) {
        let d = self.degree.get();
        (self.knots[d], self.knots[self.knots.len() - 1 - d])
    }

    /// Knots of the domain without repetition, both ends included: the ends of the polynomial
    /// pieces.
    ///
    /// # Example
    /// ```
    /// use bspline::{Degree, KnotVector};
    /// let knots = KnotVector::new(Degree::new(2)?, vec![0.0, 0.0, 0.0, 0.5, 0.5, 2.0, 2.0, 2.0])?;
    /// assert_eq!(knots.breaks(), [0.0, 0.5, 2.0]);
    /// assert_eq!((knots.domain(), knots.multiplicity(0.5)), ((0.0, 2.0), 2));
    /// # Ok::<(), bspline::KnotError>(())
    /// ```
    #[must_use]
    pub fn breaks(&self) -> Vec<f64> {
        let d = self.degree.get();
        let mut breaks = self.knots[d..self.knots.len() - d].to_vec();
        breaks.dedup();
        breaks
    }

    /// Every different knot with the number of times it occurs, in rising order.
    ///
    /// # Example
    /// ```
    /// use bspline::{Degree, KnotVector};
    /// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 4)?;
    /// assert_eq!(knots.multiplicities(), [(0.0, 3), (0.5, 1), (1.0, 3)]);
    /// # Ok::<(), bspline::KnotError>(())
    /// ```
    #[must_use]
    pub fn multiplicities(&self) -> Vec<(f64, usize)> {
        let mut result: Vec<(f64, usize)> = Vec::new();
        for &t in &self.knots {
            match result.last_mut() {
                Some((value, count)) if *value == t => *count += 1,
                _ => result.push((t, 1)),
            }
        }
        result
    }

    /// How often `t` occurs among the knots.
    #[must_use]
    pub fn multiplicity(&self, t: f64) -> usize {
        self.knots.iter().filter(|&&k| k == t).count()
    }

    /// The parameter within the domain that stands for `t`: wrapped if periodic, else clamped.
    #[must_use]
    pub fn normalize(&self, t: f64) -> f64 {
        let (start, end) = self.domain();
        if !self.is_periodic {
            return t.clamp(start, end);
        }
        if (start..end).contains(&t) {
            return t;
        }
        let wrapped = start + (t - start).rem_euclid(end - start);
        // Rounding may carry a value just below the start up to the end itself.
        if wrapped < end { wrapped } else { start }
    }

    /// Index `k` of the knot span `[t_k, t_{k+1})` of positive length that holds `t`, which must
    /// lie in the domain; the end of the domain belongs to the last span.
    ///
    /// # Example
    /// ```
    /// use bspline::{Degree, KnotVector};
    /// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 4)?; // 0 0 0 1/2 1 1 1
    /// assert_eq!([0.25, 0.5, 1.0].map(|t| knots.span(t)), [2, 3, 3]);
    /// # Ok::<(), bspline::KnotError>(())
    /// ```
    #[must_use]
    pub fn span(&self, t: f64) -> usize {
        let d = self.degree.get();
        let end = self.knots.len() - d - 1;
        let inner = &self.knots[d..end];
        let mut k = d + inner.partition_point(|&knot| knot <= t).max(1) - 1;
        // At the end of the domain, and there only, the span would be empty.
        while self.knots[k] == self.knots[k + 1] {
            k -= 1;
        }
        k
    }

    /// The control point that basis function `local` (0 to degree) of span `span` belongs to.
    #[must_use]
    pub fn control_index(&self, span: usize, local: usize) -> usize {
        let i = span - self.degree.get() + local;
        if self.is_periodic && i >= self.control_count() { i - self.control_count() } else { i }
    }

    /// Greville points: the averages of `degree` successive knots, one for each control point.
    ///
    /// Interpolation at them is well conditioned, and a straight line has its control points
    /// there. Those of a periodic knot vector are wrapped into the period, unsorted.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineCurve, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 4)?;
    /// assert_eq!(knots.greville_points(), [0.0, 0.25, 0.75, 1.0]);
    /// // The graph of 3 t has its control points there.
    /// let line = knots.greville_points().iter().map(|&t| DVec3::new(t, 3.0 * t, 0.0)).collect();
    /// let line = BsplineCurve::new(knots, line, None)?;
    /// assert!(line.point(0.4).distance(DVec3::new(0.4, 1.2, 0.0)) < 1e-15);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn greville_points(&self) -> Vec<f64> {
        let d = self.degree.get();
        let (start, end) = self.domain();
        (0..self.control_count())
            .map(|i| {
                let mean = self.knots[i + 1..=i + d].iter().sum::<f64>() / d as f64;
                if self.is_periodic { self.normalize(mean) } else { mean.clamp(start, end) }
            })
            .collect()
    }

    /// `count` parameters at equal distances over the domain; the end is left out if periodic.
    ///
    /// # Example
    /// ```
    /// use bspline::{Degree, KnotVector};
    /// let knots = KnotVector::clamped_uniform(Degree::new(2)?, 5)?;
    /// assert_eq!(knots.uniform_parameters(3), [0.0, 0.5, 1.0]);
    /// let closed = KnotVector::periodic_uniform(Degree::new(2)?, 5)?;
    /// assert_eq!(closed.uniform_parameters(2), [0.0, 0.5]);
    /// # Ok::<(), bspline::KnotError>(())
    /// ```
    #[must_use]
    pub fn uniform_parameters(&self, count: usize) -> Vec<f64> {
        let (start, end) = self.domain();
        let intervals = if self.is_periodic { count } else { count.saturating_sub(1).max(1) };
        let at = |i: usize| {
            let s = i as f64 / intervals as f64;
            // The end exactly, without the rounding of the interpolation.
            if i == intervals { end } else { start + (end - start) * s }
        };
        (0..count).map(at).collect()
    }

    /// The middles of `count` equal cells of the domain.
    #[must_use]
    pub fn cell_midpoints(&self, count: usize) -> Vec<f64> {
        let (start, end) = self.domain();
        (0..count).map(|i| start + (end - start) * (i as f64 + 0.5) / count as f64).collect()
    }
}

fn check_sorted(knots: &[f64]) -> Result<(), KnotError> {
    // The step is NaN or infinite whenever a knot is, so one test refuses all three faults.
    let faulty = |pair: &[f64]| !(0.0..f64::INFINITY).contains(&(pair[1] - pair[0]));
    match knots.windows(2).position(faulty) {
        Some(i) => Err(KnotError::NotSorted { index: i, value: knots[i], next: knots[i + 1] }),
        None => Ok(()),
    }
}

fn too_few_control_points(degree: Degree, found: usize) -> KnotError {
    KnotError::TooFewControlPoints { degree: degree.get(), needed: degree.order(), found }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn degree(d: usize) -> Degree {
        Degree::new(d).unwrap()
    }

    #[test]
    fn every_fault_has_its_message() {
        let message = |result: Result<KnotVector, KnotError>| result.unwrap_err().to_string();
        assert_eq!(
            Degree::new(0).unwrap_err().to_string(),
            "degree 0 is not between 1 and 15; lower it or split the spline into pieces"
        );
        assert!(Degree::new(16).is_err());
        assert_eq!(
            message(KnotVector::new(degree(3), vec![0.0, 1.0])),
            "degree 3 needs 8 knots, found 2; add knots or lower the degree"
        );
        assert_eq!(
            message(KnotVector::clamped_uniform(degree(3), 3)),
            "degree 3 needs at least 4 control points, found 3; \
             add control points or lower the degree"
        );
        assert!(KnotVector::periodic_uniform(degree(3), 3).is_err());
        assert_eq!(
            message(KnotVector::new(degree(1), vec![0.0, 0.5, 0.2, 1.0])),
            "knot 1 is 0.5 and the next 0.2; knots must be finite and sorted"
        );
        for bad in [f64::NAN, f64::INFINITY] {
            let knots = vec![0.0, 0.0, bad, 1.0, 1.0];
            assert!(matches!(
                KnotVector::new(degree(1), knots),
                Err(KnotError::NotSorted { index: 1, .. })
            ));
        }
        assert_eq!(
            message(KnotVector::new(degree(1), vec![0.0, 0.0, 0.5, 0.5, 1.0, 1.0])),
            "knot 0.5 is repeated 2 times, at most 1 are possible there for degree 1; \
             drop the surplus knots or split the spline"
        );
        assert!(matches!(
            KnotVector::new(degree(1), vec![0.0, 0.0, 0.0, 1.0, 1.0]),
            Err(KnotError::EmptyDomain { .. } | KnotError::OverRepeated { .. })
        ));
        assert_eq!(
            message(KnotVector::new(degree(1), vec![1.0; 4])),
            "the domain [1, 1] has no length; spread the knots"
        );
        assert!(KnotVector::periodic(degree(1), &[0.0, 0.5, 0.5, 1.0]).is_err());
    }

    #[test]
    fn spans_hold_their_parameters() {
        let knots = KnotVector::new(degree(2), vec![0.0, 0.0, 0.0, 0.25, 0.25, 0.5, 1.0, 1.0, 1.0])
            .unwrap();
        for (t, span) in [(0.0, 2), (0.1, 2), (0.25, 4), (0.4, 4), (0.5, 5), (0.9, 5), (1.0, 5)] {
            assert_eq!(knots.span(t), span, "t = {t}");
        }
        assert_eq!(knots.breaks(), [0.0, 0.25, 0.5, 1.0]);
        assert!(knots.is_clamped() && !knots.is_periodic());
    }

    #[test]
    fn periodic_parameters_wrap() {
        let knots = KnotVector::periodic_uniform(degree(3), 8).unwrap();
        assert_eq!(knots.control_count(), 8);
        assert_eq!(knots.domain(), (0.0, 1.0));
        assert_eq!(knots.normalize(1.0), 0.0);
        assert_eq!(knots.normalize(-0.25), 0.75);
        assert_eq!(knots.normalize(2.5), 0.5);
        assert!(knots.normalize(-1e-30) < 1.0);
        assert_eq!(knots.control_index(knots.span(0.99), 3), 2);
        assert_eq!(knots.uniform_parameters(4), [0.0, 0.25, 0.5, 0.75]);
        assert!(!knots.is_clamped());
    }

    #[test]
    fn greville_points_of_clamped_knots_reach_from_end_to_end() {
        let knots = KnotVector::clamped_uniform(degree(4), 9).unwrap();
        let greville = knots.greville_points();
        assert_eq!(greville.len(), 9);
        assert_eq!((greville[0], greville[8]), (0.0, 1.0));
        assert!(greville.windows(2).all(|p| p[0] < p[1]));
    }
}
