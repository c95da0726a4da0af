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

pub(crate) fn recompute(surfaces: &[Spline], values: &mut Values) {
    let range = || [f64::INFINITY, f64::NEG_INFINITY];
    let (mut mean, mut gaussian, mut principal) = (range(), range(), range());
    let (mut area, mut sums) = (0.0, [0.0; 3]);
    let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    for s in surfaces {
        let cells = [0, 1].map(|k| cells(&s.breaks(k)));
        let rules = [0, 1].map(|k| piecewise(NODES, &cells[k]));
        let nodes = [0, 1].map(|k| rules[k].iter().map(|(t, _)| *t).collect::<Vec<_>>());
        let weights = rules[0].iter().flat_map(|(_, a)| rules[1].iter().map(move |(_, b)| a * b));
        let inside = s.jets(&nodes[0], &nodes[1], 2);
        let corners = s.jets(&cells[0], &cells[1], 2);
        let all = inside.iter().zip(weights.map(Some).chain(std::iter::repeat(None)));
        for (jet, weight) in all.chain(corners.iter().map(|jet| (jet, None))) {
            let shape = Shape::new(jet);
            (low, high) = (low.min(jet.d[0][0]), high.max(jet.d[0][0]));
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
