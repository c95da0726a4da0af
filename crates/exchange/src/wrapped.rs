//! Periodic surfaces in formats that know only open knots: the first control points are repeated
//! at the end of the net.

use bspline::{BsplineCurve, BsplineSurface, Degree, KnotVector, SplineError};
use geom_core::DVec3;

/// Control point numbers as a file lists them: a periodic direction repeats its first ones.
pub(crate) fn wrapped(knots: &KnotVector) -> Vec<usize> {
    let n = knots.control_count();
    let functions = knots.knots().len() - knots.degree().order();
    (0..functions).map(|i| i % n).collect()
}

/// One direction of a surface as a file lists it.
pub(crate) struct Direction {
    knots: KnotVector,
    /// The same knots as a period, if the file calls the direction closed and they repeat.
    periodic: Option<KnotVector>,
    count: usize,
}

impl Direction {
    /// Knots for the `n` control points of the file; `closed` lets them be periodic.
    pub(crate) fn new(
        degree: Degree,
        knots: Vec<f64>,
        closed: bool,
        n: usize,
    ) -> Result<Self, SplineError> {
        let d = degree.get();
        let open = KnotVector::new(degree, knots)?;
        let mut periodic = None;
        // Knots for another number of points are refused later, with both numbers.
        if closed && !open.is_clamped() && n > 2 * d && open.control_count() == n {
            let period = KnotVector::periodic(degree, &open.knots()[d..=n]).ok();
            periodic = period.filter(|p| p.knots() == open.knots());
        }
        Ok(Self { knots: open, periodic, count: n })
    }
}

impl Direction {
    /// Number of control points the knots need in the file.
    pub(crate) fn control_count(&self) -> usize {
        self.knots.control_count()
    }

    /// Whether the knots repeat, so that repeated control points make the direction periodic.
    pub(crate) fn may_close(&self) -> bool {
        self.periodic.is_some()
    }
}

/// The curve, periodic if its first control points come back at the end.
pub(crate) fn unwrap_curve(
    along: &Direction,
    points: &[DVec3],
    weights: Option<&[f64]>,
) -> Result<BsplineCurve, SplineError> {
    let repeats = |n: usize| {
        let same =
            |a: usize, b: usize| points[a] == points[b] && weights.is_none_or(|w| w[a] == w[b]);
        points.len() == along.count && (n..points.len()).all(|i| same(i, i - n))
    };
    let periodic = along.periodic.clone().filter(|p| repeats(p.control_count()));
    let knots = periodic.unwrap_or_else(|| along.knots.clone());
    let kept = knots.control_count().min(points.len());
    BsplineCurve::new(knots, points[..kept].to_vec(), weights.map(|w| w[..kept].to_vec()))
}

/// The surface, periodic in the directions where the first control points come back at the end.
pub(crate) fn unwrap(
    u: &Direction,
    v: &Direction,
    points: &[DVec3],
    weights: Option<&[f64]>,
) -> Result<BsplineSurface, SplineError> {
    let n_v = v.count;
    let needed = u.count * n_v;
    if points.len() != needed {
        return Err(SplineError::ControlPointCount { needed, found: points.len() });
    }
    if let Some(weights) = weights.filter(|w| w.len() != needed) {
        return Err(SplineError::WeightCount { points: needed, found: weights.len() });
    }
    let same = |a: usize, b: usize| points[a] == points[b] && weights.is_none_or(|w| w[a] == w[b]);
    let repeats_u =
        |n: usize| (n..u.count).all(|i| (0..n_v).all(|j| same(i * n_v + j, (i - n) * n_v + j)));
    let repeats_v =
        |n: usize| (0..u.count).all(|i| (n..n_v).all(|j| same(i * n_v + j, i * n_v + j - n)));
    let pick = |direction: &Direction, repeats: &dyn Fn(usize) -> bool| {
        let periodic = direction.periodic.clone().filter(|p| repeats(p.control_count()));
        periodic.unwrap_or_else(|| direction.knots.clone())
    };
    let (knots_u, knots_v) = (pick(u, &repeats_u), pick(v, &repeats_v));
    let (rows, columns) = (knots_u.control_count(), knots_v.control_count());
    let kept = (0..rows).flat_map(|i| (0..columns).map(move |j| i * n_v + j));
    let kept_points = kept.clone().map(|k| points[k]).collect();
    let kept_weights = weights.map(|w| kept.map(|k| w[k]).collect());
    BsplineSurface::new(knots_u, knots_v, kept_points, kept_weights)
}
