//! Faces that cover a part of their surface: closed loops in the parameter plane.

use crate::curve::BsplineCurve;
use crate::error::SplineError;
use glam::{DVec2, DVec3};

/// Points of a curve per knot span and degree when only its rough course matters.
const ROUGH: usize = 8;

/// Why loops do not bound a face.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the messages spell out every field")]
pub enum TrimError {
    /// A loop without curves, or a face without loops.
    #[error("a loop without curves bounds nothing; give it curves or leave it out")]
    Empty,
    /// Two curves that do not meet.
    #[error(
        "curve {index} ends {gap} (in parameters) away from the next of its loop; \
         make the ends meet"
    )]
    Open { index: usize, gap: f64 },
    /// A curve outside the plane z = 0.
    #[error("curve {index} leaves the parameter plane; its control points are (u, v, 0)")]
    NotPlanar { index: usize },
    /// A problem with a curve.
    #[error(transparent)]
    Spline(#[from] SplineError),
}

/// One curve of the border of a face: `(u, v, 0)` as a spline with clamped knots (kept by
/// [`TrimLoop::new`]), and the same curve in space where it is known, in the same direction.
#[derive(Clone, Debug, PartialEq)]
pub struct TrimCurve {
    /// In the parameter plane of the surface; the third coordinate is zero.
    pub parameters: BsplineCurve,
    /// In space, for neighbours to share; its parameter need not be that of the other.
    pub edge: Option<BsplineCurve>,
}

impl TrimCurve {
    fn end(&self, last: bool) -> DVec2 {
        let points = self.parameters.control_points();
        points[if last { points.len() - 1 } else { 0 }].truncate()
    }

    fn reversed(&self) -> Self {
        let edge = self.edge.as_ref().map(BsplineCurve::reversed);
        Self { parameters: self.parameters.reversed(), edge }
    }

    /// A course of points along the curve without its last point.
    fn rough(&self) -> Vec<DVec2> {
        let (knots, mut points) = (self.parameters.knots(), Vec::new());
        let pieces = if self.is_straight() { 1 } else { ROUGH * knots.degree().get() };
        for pair in knots.breaks().windows(2) {
            points.extend((0..pieces).map(|k| {
                let t = pair[0] + (pair[1] - pair[0]) * k as f64 / pieces as f64;
                self.parameters.point(t).truncate()
            }));
        }
        points
    }

    /// Whether the curve is one straight line in the parameter plane.
    #[must_use]
    pub fn is_straight(&self) -> bool {
        self.parameters.control_points().len() == 2
    }
}

/// Curves one after the other, the last of which ends where the first begins (kept by
/// [`TrimLoop::new`], to the last bit).
#[derive(Clone, Debug, PartialEq)]
pub struct TrimLoop {
    curves: Vec<TrimCurve>,
}

impl TrimLoop {
    /// A loop of curves that meet to within `slack` (in parameters); where they do not meet to
    /// the last bit, both ends move to the middle.
    ///
    /// # Errors
    /// [`TrimError`] names the first curve at fault.
    pub fn new(curves: Vec<TrimCurve>, slack: f64) -> Result<Self, TrimError> {
        let n = curves.len();
        if n == 0 {
            return Err(TrimError::Empty);
        }
        let mut made = Vec::with_capacity(n);
        for (index, TrimCurve { parameters, edge }) in curves.into_iter().enumerate() {
            if parameters.control_points().iter().any(|p| p.z != 0.0) {
                return Err(TrimError::NotPlanar { index });
            }
            made.push(TrimCurve { parameters: parameters.clamped()?, edge });
        }
        for index in 0..n {
            let next = (index + 1) % n;
            let (a, b) = (made[index].end(true), made[next].end(false));
            if a == b {
                continue;
            }
            let gap = a.distance(b);
            if !(gap <= slack) {
                return Err(TrimError::Open { index, gap });
            }
            let middle = 0.5 * (a + b);
            made[index].parameters = with_end(&made[index].parameters, true, middle)?;
            made[next].parameters = with_end(&made[next].parameters, false, middle)?;
        }
        Ok(Self { curves: made })
    }

    /// The curves in their order.
    #[must_use]
    pub fn curves(&self) -> &[TrimCurve] {
        &self.curves
    }

    /// The loop run the other way.
    #[must_use]
    pub fn reversed(&self) -> Self {
        Self { curves: self.curves.iter().rev().map(TrimCurve::reversed).collect() }
    }

    /// A course of points around the loop.
    #[must_use]
    pub fn polygon(&self) -> Vec<DVec2> {
        self.curves.iter().flat_map(TrimCurve::rough).collect()
    }

    /// The area of the polygon inside, negative if the loop runs clockwise.
    #[must_use]
    pub fn signed_area(&self) -> f64 {
        signed_area(&self.polygon())
    }
}

pub(crate) fn signed_area(polygon: &[DVec2]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    // From a corner, so that a small loop far away keeps its digits.
    let origin = polygon.first().copied().unwrap_or_default();
    0.5 * polygon.iter().zip(next).map(|(a, b)| (*a - origin).perp_dot(*b - origin)).sum::<f64>()
}

/// Whether a point is inside a polygon: an odd number of its edges pass to the right.
pub(crate) fn is_inside(polygon: &[DVec2], point: DVec2) -> bool {
    let next = polygon.iter().cycle().skip(1);
    let crosses = |(a, b): &(&DVec2, &DVec2)| {
        (a.y > point.y) != (b.y > point.y)
            && point.x < a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x)
    };
    polygon.iter().zip(next).filter(crosses).count() % 2 == 1
}

/// The same clamped curve with another first or last control point.
pub(crate) fn with_end(
    curve: &BsplineCurve,
    last: bool,
    to: DVec2,
) -> Result<BsplineCurve, SplineError> {
    let mut points = curve.control_points().to_vec();
    let at = if last { points.len() - 1 } else { 0 };
    points[at] = DVec3::new(to.x, to.y, 0.0);
    BsplineCurve::new(curve.knots().clone(), points, curve.weights().map(<[f64]>::to_vec))
}

/// The loops that bound a face: outer ones counter-clockwise, holes clockwise (kept by
/// [`Trim::new`]), so that the face lies to the left of every curve.
///
/// # Example
/// ```
/// use bspline::{ArcSpans, BsplineCurve, Trim, TrimCurve, TrimLoop};
/// use geom_core::DVec3;
/// let ring = ArcSpans::new(0.0, std::f64::consts::TAU);
/// let circle = BsplineCurve::arc(DVec3::new(0.5, 0.5, 0.0), 0.25 * DVec3::Y, 0.25 * DVec3::X, ring)?;
/// let clockwise = TrimLoop::new(vec![TrimCurve { parameters: circle, edge: None }], 1e-12)?;
/// assert!(clockwise.signed_area() < 0.0);
/// let disc = Trim::new(vec![clockwise])?;
/// assert!(disc.loops()[0].signed_area() > 0.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Trim {
    loops: Vec<TrimLoop>,
}

impl Trim {
    /// A face bounded by loops that do not cross, in any order and direction: a loop inside an
    /// odd number of others is a hole.
    ///
    /// # Errors
    /// [`TrimError::Empty`] without loops.
    pub fn new(loops: Vec<TrimLoop>) -> Result<Self, TrimError> {
        if loops.is_empty() {
            return Err(TrimError::Empty);
        }
        let polygons: Vec<Vec<DVec2>> = loops.iter().map(TrimLoop::polygon).collect();
        let depth = |k: usize| {
            let around = |j: &usize| *j != k && is_inside(&polygons[*j], polygons[k][0]);
            (0..polygons.len()).filter(around).count()
        };
        let mut sorted: Vec<(usize, TrimLoop)> = loops
            .into_iter()
            .enumerate()
            .map(|(k, made)| {
                let (hole, depth) = (depth(k) % 2 == 1, depth(k));
                let turned = (signed_area(&polygons[k]) < 0.0) != hole;
                (depth, if turned { made.reversed() } else { made })
            })
            .collect();
        // Outer loops first; the sort is stable.
        sorted.sort_by_key(|(depth, _)| *depth);
        Ok(Self { loops: sorted.into_iter().map(|(_, made)| made).collect() })
    }

    /// The loops, outer ones before the holes in them.
    #[must_use]
    pub fn loops(&self) -> &[TrimLoop] {
        &self.loops
    }

    /// The same face of the surface with its parameters swapped
    /// ([`crate::BsplineSurface::swapped`]).
    #[must_use]
    pub fn swapped(&self) -> Self {
        let swap = |curve: &TrimCurve| {
            let turned = curve.parameters.mapped(|p| DVec3::new(p.y, p.x, 0.0));
            let parameters = turned.expect("the same numbers in another place");
            TrimCurve { parameters, edge: curve.edge.clone() }.reversed()
        };
        let loops = self.loops.iter();
        let turned =
            |made: &TrimLoop| TrimLoop { curves: made.curves.iter().rev().map(swap).collect() };
        Self { loops: loops.map(turned).collect() }
    }

    /// The same face with every edge in space mapped, as by a placement.
    ///
    /// # Errors
    /// [`SplineError::NotFinite`] if a coordinate leaves the range of `f64`.
    pub fn with_mapped_edges(&self, map: impl Fn(DVec3) -> DVec3) -> Result<Self, SplineError> {
        let mut moved = self.clone();
        for curve in moved.loops.iter_mut().flat_map(|l| &mut l.curves) {
            if let Some(edge) = &curve.edge {
                curve.edge = Some(edge.mapped(&map)?);
            }
        }
        Ok(moved)
    }

    /// The same face without the curves in space, as after a change of the surface.
    #[must_use]
    pub fn without_edges(&self) -> Self {
        let mut bare = self.clone();
        bare.loops.iter_mut().flat_map(|l| &mut l.curves).for_each(|curve| curve.edge = None);
        bare
    }

    /// Whether a point of the parameter plane belongs to the face, to within the chords of a
    /// rough polygon around it.
    #[must_use]
    pub fn contains(&self, u: f64, v: f64) -> bool {
        let inside = |made: &&TrimLoop| is_inside(&made.polygon(), DVec2::new(u, v));
        self.loops.iter().filter(inside).count() % 2 == 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    fn line(a: (f64, f64), b: (f64, f64)) -> TrimCurve {
        let at = |p: (f64, f64)| DVec3::new(p.0, p.1, 0.0);
        let parameters = BsplineCurve::segment(at(a), at(b), 0.0, 1.0).unwrap();
        TrimCurve { parameters, edge: None }
    }

    fn square(corner: f64, side: f64, clockwise: bool) -> TrimLoop {
        let (a, b) = (corner, corner + side);
        let corners = [(a, a), (b, a), (b, b), (a, b)];
        let lines = (0..4).map(|k| line(corners[k], corners[(k + 1) % 4])).collect();
        let made = TrimLoop::new(lines, 0.0).unwrap();
        if clockwise { made.reversed() } else { made }
    }

    #[test]
    fn loops_are_put_in_order() {
        let trim = Trim::new(vec![
            square(0.3, 0.1, false),
            square(0.25, 0.5, false),
            square(0.0, 1.0, true),
            square(0.5, 0.1, true),
        ])
        .unwrap();
        let areas: Vec<f64> = trim.loops().iter().map(TrimLoop::signed_area).collect();
        for (area, wanted) in areas.iter().zip([1.0, -0.25, 0.01, 0.01]) {
            assert_close(*area, wanted, 1e-15);
        }
        for (u, inside) in [(0.1, true), (0.27, false), (0.35, true), (0.9, true), (1.1, false)] {
            assert_eq!(trim.contains(u, u), inside, "{u}");
        }
        let swapped = trim.swapped();
        assert!(swapped.loops()[0].signed_area() > 0.0);
        assert_eq!(swapped.swapped(), trim);
    }

    #[test]
    fn ends_must_meet() {
        let lines = |gap: f64| vec![line((0.0, 0.0), (1.0, 0.0)), line((1.0, gap), (0.0, 0.0))];
        assert!(TrimLoop::new(lines(0.0), 0.0).is_ok());
        let snapped = TrimLoop::new(lines(1e-9), 1e-8).unwrap();
        assert_eq!(snapped.curves()[0].end(true), snapped.curves()[1].end(false));
        let error = TrimLoop::new(lines(1e-3), 1e-8).unwrap_err();
        assert_eq!(
            error.to_string(),
            "curve 0 ends 0.001 (in parameters) away from the next of its loop; make the ends meet"
        );
        assert_eq!(TrimLoop::new(vec![], 0.0), Err(TrimError::Empty));
        assert_eq!(Trim::new(vec![]), Err(TrimError::Empty));
    }
}
