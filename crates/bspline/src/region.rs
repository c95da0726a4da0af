//! The inside of a trimmed face: crossings with parameter lines, quadrature, curvatures.

use crate::curve::BsplineCurve;
use crate::knots::KnotVector;
use crate::quadrature::{CELLS, CurvatureSamples, GAUSS};
use crate::surface::BsplineSurface;
use crate::trim::Trim;
use geom_core::CurvatureStatistics;

/// Points of a curve per knot span and degree among which turns are looked for.
const PIECES: usize = 8;
/// Levels nearer to one another than this share of the height are one.
const SAME_LEVEL: f64 = 1e-13;
/// Where the slope at an end of a piece is looked at, as a share of the piece.
const NEAR_END: f64 = 1e-6;
/// A curve less steep than this is turning.
const LEVEL_SLOPE: f64 = 1e-3;
/// Most halvings and Newton steps of one crossing.
const STEPS: usize = 80;

/// A piece of a trim curve along which `v` rises or falls all the way.
#[derive(Clone, Debug)]
struct Piece<'a> {
    curve: &'a BsplineCurve,
    /// Parameters at the lower and the upper end.
    t: [f64; 2],
    /// The levels there.
    v: [f64; 2],
}

impl Piece<'_> {
    /// Where the piece crosses a level between its ends.
    fn crossing(&self, v: f64) -> f64 {
        let ([mut low, mut high], [v_low, v_high]) = (self.t, self.v);
        let mut t = low + (high - low) * (v - v_low) / (v_high - v_low);
        for _ in 0..STEPS {
            let d = self.curve.derivatives(t, 1);
            let error = d[0].y - v;
            if error == 0.0 {
                break;
            }
            *(if error < 0.0 { &mut low } else { &mut high }) = t;
            let newton = t - error / d[1].y;
            let (a, b) = (low.min(high), low.max(high));
            let next = if newton > a && newton < b { newton } else { 0.5 * (low + high) };
            if next == t || b - a <= 4.0 * f64::EPSILON * a.abs().max(b.abs()) {
                break;
            }
            t = next;
        }
        self.curve.point(t).x
    }
}

/// A place inside a face with the area of the parameter plane that it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionNode {
    /// The parameters.
    pub at: [f64; 2],
    /// The weight.
    pub weight: f64,
}

/// The part of the parameter plane that a [`Trim`] bounds, cut into pieces that are simple to
/// integrate over.
#[derive(Clone, Debug)]
pub struct Region<'a> {
    pieces: Vec<Piece<'a>>,
    /// Levels at which pieces end or the surface has a knot, rising.
    levels: Vec<f64>,
    /// Levels at which a curve turns, so that its crossings move like a square root.
    turns: Vec<f64>,
    breaks_u: Vec<f64>,
}

impl<'a> Region<'a> {
    /// The inside of `trim` on `surface`.
    #[must_use]
    pub fn new(trim: &'a Trim, surface: &BsplineSurface) -> Self {
        let breaks = |knots: &KnotVector| {
            let (all, cells) = (knots.breaks(), CELLS);
            let pieces = cells.div_ceil(all.len() - 1);
            let mut cut: Vec<f64> = Vec::new();
            for pair in all.windows(2) {
                let step = (pair[1] - pair[0]) / pieces as f64;
                cut.extend((0..pieces).map(|k| pair[0] + step * k as f64));
            }
            cut.extend(all.last());
            cut
        };
        let (breaks_u, breaks_v) = (breaks(surface.knots_u()), breaks(surface.knots_v()));
        let (mut pieces, mut turns) = (Vec::new(), Vec::new());
        for curve in trim.loops().iter().flat_map(|l| l.curves()) {
            cut(&curve.parameters, surface.knots_u(), &mut pieces, &mut turns);
        }
        let ends = pieces.iter().flat_map(|p: &Piece<'_>| p.v);
        let (low, high) =
            ends.clone().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let inner = breaks_v.into_iter().filter(|v| *v > low && *v < high);
        let mut levels: Vec<f64> = ends.chain(inner).collect();
        levels.sort_by(f64::total_cmp);
        let same = SAME_LEVEL * (high - low);
        levels.dedup_by(|b, a| *b - *a <= same);
        Self { pieces, levels, turns, breaks_u }
    }

    /// The turn nearest to a level on one side of it, no further than twice `reach`, the sign of
    /// which is the side.
    fn turn_near(&self, level: f64, reach: f64) -> Option<f64> {
        let slack = 2.0 * SAME_LEVEL * reach.abs().max(level.abs());
        let beyond = |t: &f64| (*t - level) * reach.signum();
        let near = self
            .turns
            .iter()
            .copied()
            .filter(|t| (-slack..=2.0 * reach.abs()).contains(&beyond(t)));
        near.min_by(|a, b| beyond(a).total_cmp(&beyond(b)))
    }

    /// Where the line at level `v` enters and leaves the face: pairs in rising order.
    fn intervals(&self, v: f64, crossings: &mut Vec<f64>) {
        crossings.clear();
        let across = self.pieces.iter().filter(|p| p.v[0] <= v && v < p.v[1]);
        crossings.extend(across.map(|p| p.crossing(v)));
        crossings.sort_by(f64::total_cmp);
        if crossings.len() % 2 == 1 {
            crossings.pop();
        }
    }

    /// Whether a point belongs to the face.
    #[must_use]
    pub fn contains(&self, u: f64, v: f64) -> bool {
        let across = self.pieces.iter().filter(|p| p.v[0] <= v && v < p.v[1]);
        across.filter(|p| p.crossing(v) > u).count() % 2 == 1
    }

    /// Quadrature nodes, all inside the face: strips between the levels of corners, turns and
    /// knots, five Gauss points across each and five in every cell along it. Beside a turn the
    /// strip is taken in the square root of the height, which the crossings are smooth in.
    #[must_use]
    pub fn nodes(&self) -> Vec<RegionNode> {
        let height = self.levels.last().unwrap_or(&0.0) - self.levels.first().unwrap_or(&0.0);
        let widest = self.breaks_u.windows(2).fold(0.0_f64, |m, p| m.max(p[1] - p[0]));
        let (mut nodes, mut crossings) = (Vec::new(), Vec::new());
        for pair in self.levels.windows(2) {
            let (low, high) = (pair[0], pair[1]);
            let middle = 0.5 * (low + high);
            let turns = [self.turn_near(low, low - high), self.turn_near(high, high - low)];
            // A strip between two turns belongs to both.
            let strips: &[([f64; 2], Option<f64>)] = match turns {
                [Some(_), Some(_)] => &[([low, middle], turns[0]), ([middle, high], turns[1])],
                [turn, None] | [None, turn] => &[([low, high], turn)],
            };
            for &([low, high], turn) in strips {
                let cells = ((high - low) / height * CELLS as f64).ceil().max(1.0);
                // From the turn (or the lower end), in the root of the height above it if it is
                // one.
                let from = turn.unwrap_or(low);
                let map = |v: f64| match turn {
                    Some(from) => (v - from).abs().sqrt(),
                    None => v - from,
                };
                let (begin, end) = (map(low), map(high));
                for k in 0..cells as usize {
                    for (x, w) in GAUSS {
                        let s = begin + (end - begin) * (k as f64 + x) / cells;
                        let w = w * (end - begin) / cells;
                        let (height, across) = match turn {
                            Some(turn) => {
                                (s * s * (low - turn + high - turn).signum(), 2.0 * s * w)
                            }
                            None => (s, w),
                        };
                        self.intervals(from + height, &mut crossings);
                        for pair in crossings.chunks_exact(2) {
                            self.along(pair[0], pair[1], widest, |u, along| {
                                let weight = along * across.abs();
                                nodes.push(RegionNode { at: [u, from + height], weight });
                            });
                        }
                    }
                }
            }
        }
        nodes
    }

    /// Gauss points of the interval from `a` to `b`, cut at the knots.
    fn along(&self, a: f64, b: f64, widest: f64, mut visit: impl FnMut(f64, f64)) {
        let inner = self.breaks_u.iter().copied().filter(|t| *t > a && *t < b);
        let mut start = a;
        for end in inner.chain([b]) {
            // Outside the domain, where there are no knots, cells keep their width.
            let pieces = ((end - start) / widest - 1e-9).ceil().max(1.0);
            for k in 0..pieces as usize {
                let length = (end - start) / pieces;
                let from = start + length * k as f64;
                for (x, w) in GAUSS {
                    visit(from + length * x, length * w);
                }
            }
            start = end;
        }
    }
}

/// Cuts a curve where it turns, where it has a knot and where it crosses a knot line in u.
fn cut<'a>(
    curve: &'a BsplineCurve,
    knots_u: &KnotVector,
    pieces: &mut Vec<Piece<'a>>,
    turns: &mut Vec<f64>,
) {
    let breaks_u = knots_u.breaks();
    let straight = curve.control_points().len() == 2;
    let mut ends: Vec<f64> = Vec::new();
    for pair in curve.knots().breaks().windows(2) {
        let (start, end) = (pair[0], pair[1]);
        let count = if straight { 1 } else { PIECES * curve.knots().degree().get() };
        let at = |k: usize| start + (end - start) * k as f64 / count as f64;
        ends.push(start);
        let mut before = curve.derivatives(start, 1);
        for k in 0..count {
            let next = if k + 1 == count { end } else { at(k + 1) };
            // From within the span: the derivative at a knot is that of the next span.
            let inner = next - (next - at(k)) * 1e-9;
            let after = curve.derivatives(inner, 1);
            if before[1].y * after[1].y < 0.0 {
                ends.push(bisect(at(k), inner, |t| curve.derivatives(t, 1)[1].y));
            }
            for line in &breaks_u {
                if (before[0].x - line) * (after[0].x - line) < 0.0 {
                    ends.push(bisect(at(k), inner, |t| curve.point(t).x - line));
                }
            }
            before = curve.derivatives(next, 1);
        }
    }
    ends.push(curve.knots().domain().1);
    ends.sort_by(f64::total_cmp);
    for pair in ends.windows(2) {
        let (a, b) = (curve.point(pair[0]).y, curve.point(pair[1]).y);
        for (t, v, inward) in [(pair[0], a, NEAR_END), (pair[1], b, -NEAR_END)] {
            let d = curve.derivatives(t + inward * (pair[1] - pair[0]), 1)[1];
            if !straight && d.y.abs() < LEVEL_SLOPE * d.x.abs() {
                turns.push(v);
            }
        }
        // A level piece is crossed by no level.
        if a < b {
            pieces.push(Piece { curve, t: [pair[0], pair[1]], v: [a, b] });
        } else if b < a {
            pieces.push(Piece { curve, t: [pair[1], pair[0]], v: [b, a] });
        }
    }
}

/// A zero of `f` between two parameters at which its signs differ.
pub(crate) fn bisect(mut a: f64, mut b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let rising = f(a) < f(b);
    for _ in 0..STEPS {
        let middle = 0.5 * (a + b);
        if middle == a || middle == b {
            break;
        }
        *(if (f(middle) < 0.0) == rising { &mut a } else { &mut b }) = middle;
    }
    0.5 * (a + b)
}

impl BsplineSurface {
    /// Area and curvatures of the part of the surface that `trim` bounds, as
    /// [`Self::curvature_statistics`] of the whole: no sample lies outside.
    #[must_use]
    pub fn curvature_statistics_within(&self, trim: &Trim) -> CurvatureStatistics {
        let region = Region::new(trim, self);
        let nodes = region.nodes();
        let places: Vec<[f64; 2]> = nodes.iter().map(|n| n.at).collect();
        let mut samples = CurvatureSamples::new(self);
        for (jet, node) in self.jets(&places, 2).iter().zip(&nodes) {
            let area = node.weight * jet.first_form().determinant().max(0.0).sqrt();
            samples.statistics.add_area(area);
            samples.add(node.at, jet, area);
        }
        let border = trim.loops().iter().flat_map(crate::trim::TrimLoop::polygon);
        let border: Vec<[f64; 2]> = border.map(|p| [p.x, p.y]).collect();
        for (jet, at) in self.jets(&border, 2).iter().zip(&border) {
            samples.add(*at, jet, 0.0);
        }
        samples.add_extent(Some(trim));
        samples.statistics
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ArcSpans, Degree, TrimCurve, TrimLoop};
    use geom_core::{DVec3, assert_close};
    use std::f64::consts::{PI, TAU};

    fn ring(center: [f64; 2], radii: [f64; 2], start: f64) -> TrimLoop {
        let spans = ArcSpans::new(start, start + TAU);
        let center = DVec3::new(center[0], center[1], 0.0);
        let arc = BsplineCurve::arc(center, radii[0] * DVec3::X, radii[1] * DVec3::Y, spans);
        TrimLoop::new(vec![TrimCurve { parameters: arc.unwrap(), edge: None }], 1e-12).unwrap()
    }

    fn flat(n: usize) -> BsplineSurface {
        let knots = KnotVector::clamped_uniform(Degree::new(1).unwrap(), n).unwrap();
        let t = knots.uniform_parameters(n);
        let points =
            t.iter().flat_map(|u| t.iter().map(move |v| DVec3::new(*u, *v, 0.0))).collect();
        BsplineSurface::new(knots.clone(), knots, points, None).unwrap()
    }

    #[test]
    fn areas_of_discs_and_rings_are_closed_forms() {
        for (n, start) in [(2, 0.0), (2, 0.7), (4, 0.3)] {
            let plane = flat(n);
            let disc = Trim::new(vec![ring([0.5, 0.45], [0.3, 0.2], start)]).unwrap();
            let area = plane.curvature_statistics_within(&disc).area;
            assert_close(area, PI * 0.06, 1e-9);
            let hole = ring([0.5, 0.5], [0.1, 0.1], 0.0);
            let trim = Trim::new(vec![hole, ring([0.5, 0.45], [0.3, 0.2], start)]).unwrap();
            let area = plane.curvature_statistics_within(&trim).area;
            assert_close(area, PI * 0.05, 1e-9);
            let region = Region::new(&trim, &plane);
            assert!(region.nodes().iter().all(|node| node.weight > 0.0));
            assert!(region.contains(0.75, 0.45) && !region.contains(0.5, 0.5));
            assert!(!region.contains(0.85, 0.45));
        }
    }

    #[test]
    fn a_polygon_on_a_curved_surface_has_the_area_of_its_halves() {
        // Cut along a slanted line, the two parts together are the whole.
        let knots = KnotVector::clamped_uniform(Degree::new(3).unwrap(), 6).unwrap();
        let t = knots.greville_points();
        let point = |u: f64, v: f64| DVec3::new(u, v, 0.3 * (3.0 * u).sin() * (2.0 * v).cos());
        let points = t.iter().flat_map(|u| t.iter().map(move |v| point(*u, *v))).collect();
        let surface = BsplineSurface::new(knots.clone(), knots, points, None).unwrap();
        let polygon = |corners: &[(f64, f64)]| {
            let at = |k: usize| {
                let (u, v) = corners[k % corners.len()];
                DVec3::new(u, v, 0.0)
            };
            let line = |k: usize| BsplineCurve::segment(at(k), at(k + 1), 0.0, 1.0).unwrap();
            let curves =
                (0..corners.len()).map(|k| TrimCurve { parameters: line(k), edge: None }).collect();
            Trim::new(vec![TrimLoop::new(curves, 0.0).unwrap()]).unwrap()
        };
        let left = polygon(&[(0.0, 0.0), (0.3, 0.0), (0.8, 1.0), (0.0, 1.0)]);
        let right = polygon(&[(0.3, 0.0), (1.0, 0.0), (1.0, 1.0), (0.8, 1.0)]);
        let whole = surface.curvature_statistics().area;
        let parts = [left, right].map(|trim| surface.curvature_statistics_within(&trim).area);
        assert_close(parts[0] + parts[1], whole, 1e-10);
    }
}
