//! Claims of `analyze` on spline surfaces: it writes no geometry, so the input is what is measured.

use crate::claims::Values;
use crate::quadrature::piecewise;
use crate::shape::Shape;
use crate::spline::Spline;
use glam::DVec3;

/// Knot spans are cut until a direction has at least this many cells.
const CELLS: usize = 16;
/// Gauss points of a cell and direction.
const NODES: usize = 5;
/// How often the neighbourhood of the outermost place is halved, and places across it.
const ROUNDS: usize = 26;
/// See [`ROUNDS`].
const ACROSS: usize = 5;

pub(crate) fn recompute(surfaces: &[Spline], values: &mut Values) {
    let range = || [f64::INFINITY, f64::NEG_INFINITY];
    let (mut mean, mut gaussian, mut principal) = (range(), range(), range());
    let (mut area, mut sums) = (0.0, [0.0; 3]);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for s in surfaces {
        let bounds = extent(s);
        (low, high) = (low.min(bounds[0]), high.max(bounds[1]));
        let cells = [0, 1].map(|k| cells(&s.breaks(k)));
        let rules = [0, 1].map(|k| piecewise(NODES, &cells[k]));
        let nodes = [0, 1].map(|k| rules[k].iter().map(|(t, _)| *t).collect::<Vec<_>>());
        let weights = rules[0].iter().flat_map(|(_, a)| rules[1].iter().map(move |(_, b)| a * b));
        let inside = s.jets(&nodes[0], &nodes[1], 2);
        let corners = s.jets(&cells[0], &cells[1], 2);
        let all = inside.iter().zip(weights.map(Some).chain(std::iter::repeat(None)));
        for (jet, weight) in all.chain(corners.iter().map(|jet| (jet, None))) {
            let shape = Shape::new(jet);
            let [k1, k2] = shape.principal();
            for (range, (a, b)) in [&mut mean, &mut gaussian, &mut principal].into_iter().zip([
                (shape.mean, shape.mean),
                (shape.gaussian, shape.gaussian),
                (k2, k1),
            ]) {
                *range = [range[0].min(a), range[1].max(b)];
            }
            if let Some(weight) = weight {
                let weight = weight * shape.delta.sqrt();
                area += weight;
                let sizes = [shape.mean.abs(), shape.gaussian.abs(), 0.5 * (k1.abs() + k2.abs())];
                sums.iter_mut().zip(sizes).for_each(|(sum, size)| *sum += weight * size);
            }
        }
    }
    values.number("area", area);
    let names = ["mean_curvature", "gaussian_curvature", "principal_curvature"];
    for ((name, range), sum) in names.into_iter().zip([mean, gaussian, principal]).zip(sums) {
        values.number(&format!("{name}_min"), range[0]);
        values.number(&format!("{name}_max"), range[1]);
        values.number(&format!("{name}_mean_abs"), sum / area);
    }
    values.place("bounding_box.0", low);
    values.place("bounding_box.1", high);
}

/// Lowest and highest coordinates of a surface: from every place of a grid that lies further out than
/// its neighbours on, in ever smaller neighbourhoods.
fn extent(s: &Spline) -> [DVec3; 2] {
    let lines = [0, 1].map(|k| cells(&s.breaks(k)));
    let points: Vec<DVec3> =
        s.jets(&lines[0], &lines[1], 0).iter().map(|jet| jet.d[0][0]).collect();
    let [rows, columns] = [0, 1].map(|k| lines[k].len());
    let mut reached = [[f64::NEG_INFINITY; 3]; 2];
    for (side, sign) in [-1.0, 1.0].into_iter().enumerate() {
        for axis in 0..3 {
            let at = |i: usize, j: usize| sign * points[i * columns + j][axis];
            let best = &mut reached[side][axis];
            *best = points.iter().fold(*best, |m, p| m.max(sign * p[axis]));
            for (i, j) in (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j))) {
                let around = |k: usize, n: usize| k.saturating_sub(1)..=(k + 1).min(n - 1);
                let near = around(i, rows).flat_map(|p| around(j, columns).map(move |q| (p, q)));
                let (least, most) = near.fold((at(i, j), at(i, j)), |(a, b), (p, q)| {
                    (a.min(at(p, q)), b.max(at(p, q)))
                });
                // Nothing nearby rises further above this place than its neighbours lie below.
                if most > at(i, j) || at(i, j) + (at(i, j) - least) <= *best {
                    continue;
                }
                let within = [(i, rows, &lines[0]), (j, columns, &lines[1])]
                    .map(|(k, n, t)| [t[k.saturating_sub(1)], t[(k + 1).min(n - 1)]]);
                *best = best.max(outermost(s, within, |p| sign * p[axis]));
            }
        }
    }
    [-DVec3::from_array(reached[0]), DVec3::from_array(reached[1])]
}

/// The largest height near the middle of a rectangle of parameters.
fn outermost(s: &Spline, bounds: [[f64; 2]; 2], height: impl Fn(DVec3) -> f64) -> f64 {
    let (mut within, mut best) = (bounds, f64::NEG_INFINITY);
    for _ in 0..ROUNDS {
        let lines = within.map(|[a, b]| {
            (0..ACROSS).map(|k| a + (b - a) * k as f64 / (ACROSS - 1) as f64).collect::<Vec<_>>()
        });
        let heights: Vec<f64> =
            s.jets(&lines[0], &lines[1], 0).iter().map(|jet| height(jet.d[0][0])).collect();
        let top = (0..heights.len()).max_by(|a, b| heights[*a].total_cmp(&heights[*b]));
        let top = top.unwrap_or(0);
        best = best.max(heights[top]);
        let middle = [lines[0][top / ACROSS], lines[1][top % ACROSS]];
        within = [0, 1].map(|k| {
            let quarter = 0.25 * (within[k][1] - within[k][0]);
            [(middle[k] - quarter).max(bounds[k][0]), (middle[k] + quarter).min(bounds[k][1])]
        });
    }
    best
}

fn cells(breaks: &[f64]) -> Vec<f64> {
    let pieces = CELLS.div_ceil(breaks.len() - 1);
    let mut out = vec![breaks[0]];
    for pair in breaks.windows(2) {
        let (a, b) = (pair[0], pair[1]);
        out.extend((1..pieces).map(|k| a + (b - a) * k as f64 / pieces as f64));
        out.push(b);
    }
    out
}
