//! Points all over a surface: its size, and where it stands.

use crate::surface::BsplineSurface;
use geom_core::{DVec3, Normalization, NormalizationError};

/// Points per control point in one direction: ten times the samples of an optimiser, which takes two.
const PER_CONTROL_POINT: usize = 20;
/// Points in one direction, at most for small nets and at least for large ones.
const PER_DIRECTION: usize = 400;

impl BsplineSurface {
    /// Parameters of the check grid in u and in v: 20 per control point, 400 at most (and two per
    /// control point where the net has more), evenly spaced with both ends.
    #[must_use]
    pub fn check_parameters(&self) -> [Vec<f64>; 2] {
        [self.knots_u(), self.knots_v()].map(|knots| {
            let n = knots.control_count();
            let cells = (PER_CONTROL_POINT * n).min(PER_DIRECTION.max(2 * n));
            let (start, end) = knots.domain();
            // Both ends to the bit.
            let at = |k: usize| {
                if k == cells { end } else { start + (end - start) * (k as f64 / cells as f64) }
            };
            (0..=cells).map(at).collect()
        })
    }

    /// Where the surface stands and how large it is, by the points of its
    /// [check grid](Self::check_parameters).
    ///
    /// # Errors
    /// [`NormalizationError`] for a surface without extent, or beyond what can be computed with.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let knots = KnotVector::clamped_uniform(Degree::new(1)?, 2)?;
    /// let corner = |k: usize| DVec3::new(3.0 * (k / 2) as f64, 4.0 * (k % 2) as f64, 0.0);
    /// let net = (0..4).map(corner).collect();
    /// let rectangle = BsplineSurface::new(knots.clone(), knots, net, None)?;
    /// assert!((rectangle.normalization()?.size() - 5.0).abs() < 1e-12);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn normalization(&self) -> Result<Normalization, NormalizationError> {
        // Control points that cannot be squared make points that are not numbers.
        let [u, v] = self.check_parameters();
        let net = self.control_points();
        let largest = net.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max);
        if !(largest < 1e100) {
            return Normalization::of(net);
        }
        Normalization::of(&self.point_grid(&u, &v))
    }

    /// The surface moved by a vector.
    ///
    /// # Panics
    /// If the moved control points are not finite.
    #[must_use]
    pub fn translated(&self, by: DVec3) -> Self {
        let points = self.control_points().iter().map(|&p| p + by).collect();
        self.with_control_points(points).expect("finite points, as many as before")
    }
}

/// What is wrong with a deformed surface between the samples it was deformed by.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum FlawKind {
    /// The area element has all but vanished: a spike, a cusp, a tear.
    Spike,
    /// The normal turns by more than a right angle from one check point to the next.
    Fold,
    /// A position or derivative is not a number.
    NotFinite,
}

impl FlawKind {
    /// The word for it in lower snake case.
    #[must_use]
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Spike => "spike",
            Self::Fold => "fold",
            Self::NotFinite => "not_finite",
        }
    }
}

/// A check point where a deformed surface is at fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Flaw {
    /// What is wrong.
    pub kind: FlawKind,
    /// Where, in the domain.
    pub u: f64,
    /// Where, in the domain.
    pub v: f64,
}

/// Least area element a deformed surface may have, as a share of that of its start.
pub const LEAST_AREA_RATIO: f64 = 0.05;

impl BsplineSurface {
    /// Compares the surface, deformed from `start` over the same domain, with it on the
    /// [check grid](Self::check_parameters), ten times as dense as the samples of an optimiser:
    /// where its area element `|S_u × S_v|` is below [`LEAST_AREA_RATIO`] of the median of the
    /// start's (or of the start's own there, if that is smaller), where its normal turns by more than
    /// a right angle between neighbours and the start's does not, and where it is not finite. In the
    /// order of the grid; empty for a sound surface.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, FlawKind, KnotVector};
    /// use geom_core::DVec3;
    /// let knots = KnotVector::clamped_uniform(Degree::new(3)?, 8)?;
    /// let point = |k: usize| DVec3::new((k / 8) as f64, (k % 8) as f64, 0.0);
    /// let flat: Vec<DVec3> = (0..64).map(point).collect();
    /// let start = BsplineSurface::new(knots.clone(), knots, flat.clone(), None)?;
    /// assert!(start.flaws_against(&start).is_empty());
    /// // One control point pulled over its neighbours folds the surface back.
    /// let mut pulled = flat;
    /// pulled[27].x += 4.0;
    /// let flaws = start.with_control_points(pulled)?.flaws_against(&start);
    /// assert!(flaws.iter().any(|flaw| flaw.kind == FlawKind::Fold));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn flaws_against(&self, start: &Self) -> Vec<Flaw> {
        let [u, v] = start.check_parameters();
        let (before, after) = (start.area_vector_grid(&u, &v), self.area_vector_grid(&u, &v));
        let mut areas: Vec<f64> = before.iter().map(|n| n.length()).collect();
        let middle = areas.len() / 2;
        let median = *areas.select_nth_unstable_by(middle, f64::total_cmp).1;
        // Poles have no area to begin with, and no normal.
        let is_pole = |k: usize| before[k].length() <= 1e-6 * median;
        let turns = |normals: &[DVec3], a: usize, b: usize| normals[a].dot(normals[b]) < 0.0;
        let mut flaws = Vec::new();
        for (k, normal) in after.iter().enumerate() {
            let (i, j) = (k / v.len(), k % v.len());
            let neighbours = [(i > 0).then(|| k - v.len()), (j > 0).then(|| k - 1)];
            let folds = |b: usize| turns(&after, k, b) && !turns(&before, k, b) && !is_pole(b);
            let kind = if !normal.is_finite() {
                FlawKind::NotFinite
            } else if is_pole(k) {
                continue;
            } else if normal.length() < LEAST_AREA_RATIO * median.min(before[k].length()) {
                FlawKind::Spike
            } else if neighbours.into_iter().flatten().any(folds) {
                FlawKind::Fold
            } else {
                continue;
            };
            flaws.push(Flaw { kind, u: u[i], v: v[j] });
        }
        flaws
    }
}
