//! The exact extent of a surface along the axes, or of the part of it that a trim bounds.
//!
//! An extreme of a coordinate lies inside of the surface, where both derivatives vanish, or on its
//! border. Each that a grid of places shows is followed by Newton's iteration, within the smooth
//! pieces between creases; the border of a trim is searched curve by curve.

use crate::curve::BsplineCurve;
use crate::knots::KnotVector;
use crate::quadrature::{cells, ends};
use crate::region::Region;
use crate::surface::BsplineSurface;
use crate::trim::Trim;
use geom_core::{BoundingBox, DVec3};

/// Newton steps to an extreme.
const STEPS: usize = 40;
/// Halvings of a step that does not rise.
const HALVINGS: usize = 30;
/// Steps of the golden section, each of which leaves 0.62 of an interval: to the square root of
/// the rounding, which is where values no longer change.
const SECTIONS: usize = 44;
/// Places per knot span of a border curve.
const PLACES: usize = 16;
/// Nearer to the border than this share of the domain a place counts as one of the border.
const NEAR: f64 = 1e-9;

impl BsplineSurface {
    /// The smallest box with parallel edges around the surface, or around the part of it that `trim`
    /// bounds; to rounding, where the border is known in space exactly.
    ///
    /// # Example
    /// ```
    /// use bspline::{Elementary, ElementaryKind, Frame};
    /// use geom_core::DVec3;
    /// let frame = Frame::new(DVec3::X, DVec3::new(1.0, 1.0, 0.0), None);
    /// let torus = Elementary { frame, kind: ElementaryKind::Torus { major: 3.0, minor: 1.0 } };
    /// let turn = [0.0, std::f64::consts::TAU];
    /// let bounds = torus.surface(turn, turn)?.bounding_box(None);
    /// // A ring whose axis leans by 45 degrees.
    /// assert!((bounds.max.x - (2.0 + 3.0 * 0.5_f64.sqrt())).abs() < 1e-12);
    /// assert!((bounds.max.z - 4.0).abs() < 1e-12);
    /// # Ok::<(), bspline::SplineError>(())
    /// ```
    #[must_use]
    pub fn bounding_box(&self, trim: Option<&Trim>) -> BoundingBox {
        let mut search = Search::new(self);
        match trim {
            None => search.inside(&|_, _| true),
            Some(trim) => {
                for curve in trim.loops().iter().flat_map(|l| l.curves()) {
                    match &curve.edge {
                        Some(edge) => search.along(edge, &|p| p),
                        None => search.along(&curve.parameters, &|p| self.point(p.x, p.y)),
                    }
                }
                let region = Region::new(trim, self);
                let widths = [self.knots_u(), self.knots_v()].map(|knots| {
                    let (start, end) = knots.domain();
                    NEAR * (end - start)
                });
                // What lies on the border has been searched, and rounding decides on which side it is.
                search.inside(&|u, v| {
                    [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)]
                        .iter()
                        .all(|(a, b)| region.contains(u + a * widths[0], v + b * widths[1]))
                });
            }
        }
        let [x, y, z] = search.reached;
        BoundingBox { min: DVec3::new(-x[1], -y[1], -z[1]), max: DVec3::new(x[0], y[0], z[0]) }
    }
}

struct Search<'s> {
    surface: &'s BsplineSurface,
    /// The largest coordinate of each axis so far, and the largest of its negative.
    reached: [[f64; 2]; 3],
}

impl<'s> Search<'s> {
    fn new(surface: &'s BsplineSurface) -> Self {
        Self { surface, reached: [[f64::NEG_INFINITY; 2]; 3] }
    }

    fn add(&mut self, p: DVec3) {
        for (reached, x) in self.reached.iter_mut().zip(p.to_array()) {
            *reached = [reached[0].max(x), reached[1].max(-x)];
        }
    }

    /// Extremes of the surface at places that count.
    fn inside(&mut self, counts: &dyn Fn(f64, f64) -> bool) {
        let (pieces_u, pieces_v) = (pieces(self.surface.knots_u()), pieces(self.surface.knots_v()));
        for u in &pieces_u {
            for v in &pieces_v {
                self.inside_piece(u, v, counts);
            }
        }
    }

    /// Extremes over a piece without creases, given by the lines of its grid.
    fn inside_piece(&mut self, u: &[f64], v: &[f64], counts: &dyn Fn(f64, f64) -> bool) {
        let points = self.surface.point_grid(u, v);
        for (k, p) in points.iter().enumerate() {
            if counts(u[k / v.len()], v[k % v.len()]) {
                self.add(*p);
            }
        }
        for axis in 0..3 {
            for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                let height = |i: usize, j: usize| sign * points[i * v.len() + j][axis];
                for (i, j) in (0..u.len()).flat_map(|i| (0..v.len()).map(move |j| (i, j))) {
                    let Some(rise) = peak([i, j], [u.len(), v.len()], &height) else { continue };
                    // Between the places nothing rises much higher than they fall off.
                    if height(i, j) + rise <= self.reached[axis][side] {
                        continue;
                    }
                    let bounds = [[u[0], u[u.len() - 1]], [v[0], v[v.len() - 1]]];
                    let at = self.climb([u[i], v[j]], bounds, axis, sign);
                    if counts(at[0], at[1]) {
                        let p = self.surface.point(at[0], at[1]);
                        self.add(p);
                    }
                }
            }
        }
    }

    /// Newton's iteration to where `sign` times a coordinate is largest nearby, within bounds.
    fn climb(&self, start: [f64; 2], bounds: [[f64; 2]; 2], axis: usize, sign: f64) -> [f64; 2] {
        let height = |at: [f64; 2]| sign * self.surface.point(at[0], at[1])[axis];
        let kept = |at: [f64; 2]| [0, 1].map(|k| at[k].clamp(bounds[k][0], bounds[k][1]));
        let (mut at, mut reached) = (start, height(start));
        for _ in 0..STEPS {
            let jet = self.surface.jet(at[0], at[1], 2);
            let d = |i: usize, j: usize| sign * jet.d(i, j)[axis];
            let gradient = [d(1, 0), d(0, 1)];
            // A parameter at its bound stays there if the surface rises beyond.
            let held = [0, 1].map(|k| {
                (at[k] <= bounds[k][0] && gradient[k] <= 0.0)
                    || (at[k] >= bounds[k][1] && gradient[k] >= 0.0)
            });
            let Some(mut step) = rising(gradient, [d(2, 0), d(1, 1), d(0, 2)], held, bounds) else {
                break;
            };
            let mut better = None;
            for _ in 0..HALVINGS {
                let next = kept([at[0] + step[0], at[1] + step[1]]);
                let found = height(next);
                if found > reached {
                    better = Some((next, found));
                    break;
                }
                step = step.map(|s| 0.5 * s);
            }
            let Some((next, found)) = better else { break };
            (at, reached) = (next, found);
        }
        at
    }

    /// Extremes of a curve, as it is in space or on the surface.
    fn along(&mut self, curve: &BsplineCurve, point: &dyn Fn(DVec3) -> DVec3) {
        for span in curve.knots().breaks().windows(2) {
            let at = |k: usize| span[0] + (span[1] - span[0]) * k as f64 / PLACES as f64;
            let on = |t: f64| point(curve.point(t));
            let points: Vec<DVec3> = (0..=PLACES).map(|k| on(at(k))).collect();
            points.iter().for_each(|p| self.add(*p));
            for axis in 0..3 {
                for (side, sign) in [1.0, -1.0].into_iter().enumerate() {
                    let height = |k: usize, _: usize| sign * points[k][axis];
                    for k in 0..=PLACES {
                        let Some(rise) = peak([k, 0], [PLACES + 1, 1], &height) else { continue };
                        if height(k, 0) + rise <= self.reached[axis][side] {
                            continue;
                        }
                        let (low, high) = (at(k.saturating_sub(1)), at((k + 1).min(PLACES)));
                        let t = highest(low, high, |t| sign * on(t)[axis]);
                        self.add(on(t));
                    }
                }
            }
        }
    }
}

/// Grid lines of the pieces of a direction between which a surface may have a crease.
fn pieces(knots: &KnotVector) -> Vec<Vec<f64>> {
    let lines = ends(&cells(knots));
    let mut found = vec![Vec::new()];
    for (k, t) in lines.iter().enumerate() {
        if let Some(last) = found.last_mut() {
            last.push(*t);
        }
        let inner = k > 0 && k + 1 < lines.len();
        if inner && knots.multiplicity(*t) >= knots.degree().get() {
            found.push(vec![*t]);
        }
    }
    found
}

/// Whether a place of a grid is as high as all its neighbours (and higher than those before it, so
/// that a level line counts once), and how far the neighbours fall off at most.
fn peak(
    [i, j]: [usize; 2],
    [rows, columns]: [usize; 2],
    height: &dyn Fn(usize, usize) -> f64,
) -> Option<f64> {
    let own = height(i, j);
    let mut fall = 0.0_f64;
    for p in i.saturating_sub(1)..=(i + 1).min(rows - 1) {
        for q in j.saturating_sub(1)..=(j + 1).min(columns - 1) {
            let other = height(p, q);
            if other > own || (other == own && (p, q) < (i, j)) {
                return None;
            }
            fall = fall.max(own - other);
        }
    }
    Some(fall)
}

/// A step that rises: Newton's where the surface bends down, else along the slope.
fn rising(
    gradient: [f64; 2],
    [uu, uv, vv]: [f64; 3],
    held: [bool; 2],
    bounds: [[f64; 2]; 2],
) -> Option<[f64; 2]> {
    let free = [0, 1].map(|k| if held[k] { 0.0 } else { gradient[k] });
    if free == [0.0; 2] {
        return None;
    }
    let step = match held {
        [false, false] => {
            let determinant = uu * vv - uv * uv;
            let newton = [uv * free[1] - vv * free[0], uv * free[0] - uu * free[1]];
            (uu < 0.0 && determinant > 0.0).then(|| newton.map(|x| x / determinant))
        }
        [false, true] => (uu < 0.0).then(|| [-free[0] / uu, 0.0]),
        _ => (vv < 0.0).then(|| [0.0, -free[1] / vv]),
    };
    // Up the slope, a sixteenth of the piece in the direction that rises faster.
    let widths = bounds.map(|[low, high]| high - low);
    let slope = || {
        let rise = [0, 1].map(|k| free[k] * widths[k]);
        let steepest = rise[0].abs().max(rise[1].abs());
        [0, 1].map(|k| rise[k] / steepest * widths[k] / 16.0)
    };
    Some(step.unwrap_or_else(slope))
}

/// Where a function with one peak between two places is largest, by the golden section.
fn highest(mut low: f64, mut high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let share = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut a, mut b) = (high - share * (high - low), low + share * (high - low));
    let (mut at_a, mut at_b) = (f(a), f(b));
    for _ in 0..SECTIONS {
        if at_a < at_b {
            (low, a, at_a) = (a, b, at_b);
            b = low + share * (high - low);
            at_b = f(b);
        } else {
            (high, b, at_b) = (b, a, at_a);
            a = high - share * (high - low);
            at_a = f(a);
        }
    }
    if at_a < at_b { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ArcSpans, Degree, Elementary, ElementaryKind, Frame, TrimCurve, TrimLoop};
    use geom_core::assert_close;
    use std::f64::consts::{FRAC_PI_2, TAU};

    fn leaning(kind: ElementaryKind) -> (Elementary, DVec3) {
        let axis = DVec3::new(1.0, 2.0, -0.5);
        (
            Elementary { frame: Frame::new(DVec3::new(5.0, -3.0, 1.0), axis, None), kind },
            axis.normalize(),
        )
    }

    #[test]
    fn a_leaning_torus_and_a_sphere_have_their_boxes() {
        let (torus, axis) = leaning(ElementaryKind::Torus { major: 3.0, minor: 1.0 });
        let bounds = torus.surface([0.0, TAU], [0.0, TAU]).unwrap().bounding_box(None);
        for k in 0..3 {
            // The circle in the middle reaches as far as its plane leans, the tube one more.
            let reach = 3.0 * (1.0 - axis[k] * axis[k]).sqrt() + 1.0;
            let middle = [5.0, -3.0, 1.0][k];
            assert_close(bounds.max[k], middle + reach, 1e-12);
            assert_close(bounds.min[k], middle - reach, 1e-12);
        }
        let (sphere, _) = leaning(ElementaryKind::Sphere { radius: 2.0 });
        let bounds =
            sphere.surface([0.0, TAU], [-FRAC_PI_2, FRAC_PI_2]).unwrap().bounding_box(None);
        assert_close((bounds.size() - DVec3::splat(4.0)).length(), 0.0, 1e-12);
    }

    #[test]
    fn a_trimmed_paraboloid_ends_at_its_border() {
        // z = x² + y² over [-1, 1]², cut to a disc beside the axis.
        let knots = || KnotVector::clamped_uniform(Degree::new(2).unwrap(), 3).unwrap();
        let (x, square) = ([-1.0, 0.0, 1.0], [1.0, -1.0, 1.0]);
        let at = |k: usize| DVec3::new(x[k / 3], x[k % 3], square[k / 3] + square[k % 3]);
        let surface =
            BsplineSurface::new(knots(), knots(), (0..9).map(at).collect(), None).unwrap();
        let whole = surface.bounding_box(None);
        assert_close(whole.min.z, 0.0, 1e-15);
        assert_close(whole.max.z, 2.0, 1e-15);
        let disc = |center: f64, radius: f64| {
            let spans = ArcSpans::new(0.3, 0.3 + TAU);
            // In parameters, which run half as fast.
            let middle = DVec3::new(0.5 * (center + 1.0), 0.5, 0.0);
            let r = 0.5 * radius;
            let arc = BsplineCurve::arc(middle, r * DVec3::X, r * DVec3::Y, spans).unwrap();
            let curve = TrimCurve { parameters: arc, edge: None };
            Trim::new(vec![TrimLoop::new(vec![curve], 1e-12).unwrap()]).unwrap()
        };
        let beside = surface.bounding_box(Some(&disc(0.5, 0.3)));
        assert_close(beside.min.z, 0.04, 1e-12);
        assert_close(beside.max.z, 0.64, 1e-12);
        assert_close(beside.max.x, 0.8, 1e-12);
        assert_close(beside.min.y, -0.3, 1e-12);
        // The lowest point lies inside.
        assert_close(surface.bounding_box(Some(&disc(0.2, 0.5))).min.z, 0.0, 1e-15);
    }

    #[test]
    fn a_crease_is_an_edge_of_its_pieces() {
        // A roof: z is highest along the crease in the middle.
        let u = KnotVector::clamped_uniform(Degree::new(1).unwrap(), 3).unwrap();
        let v = KnotVector::clamped_uniform(Degree::new(2).unwrap(), 3).unwrap();
        let heights = [0.0, 1.0, 0.2];
        let at = |k: usize| {
            let (i, j) = (k / 3, k % 3);
            DVec3::new(i as f64, j as f64, heights[i] + [0.0, 1.0, 0.5][j])
        };
        let surface = BsplineSurface::new(u, v, (0..9).map(at).collect(), None).unwrap();
        // 2 t (1 − t) + t² / 2 is largest at t = 2/3.
        assert_close(surface.bounding_box(None).max.z, 1.0 + 2.0 / 3.0, 1e-14);
    }
}
