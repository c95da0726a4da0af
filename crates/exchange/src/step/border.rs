//! The four border curves of a surface, and which of them coincide or collapse.

use bspline::{BsplineSurface, KnotVector};
use geom_core::DVec3;

/// A border curve: the control points of a curve over the knots of the other direction.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Border {
    pub(crate) points: Vec<DVec3>,
    pub(crate) weights: Option<Vec<f64>>,
}

/// A side of the parameter rectangle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Side {
    UStart,
    UEnd,
    VStart,
    VEnd,
}

impl Border {
    /// The border of `surface` on a side, with the control points of the surface itself where the
    /// knots are clamped.
    pub(crate) fn of(surface: &BsplineSurface, side: Side) -> Self {
        let across_u = matches!(side, Side::UStart | Side::UEnd);
        let knots = if across_u { surface.knots_u() } else { surface.knots_v() };
        let (n, n_v) = (if across_u { surface.n_v() } else { surface.n_u() }, surface.n_v());
        let index = |row: usize, k: usize| if across_u { row * n_v + k } else { k * n_v + row };
        let at_end = matches!(side, Side::UEnd | Side::VEnd);
        let blend = blend(knots, at_end);
        let (mut points, mut weights) = (Vec::with_capacity(n), Vec::with_capacity(n));
        for k in 0..n {
            let weight_of = |row: usize| surface.weights().map_or(1.0, |w| w[index(row, k)]);
            if let [(row, _)] = blend[..] {
                points.push(surface.control_points()[index(row, k)]);
                weights.push(weight_of(row));
                continue;
            }
            let weight: f64 = blend.iter().map(|&(row, b)| b * weight_of(row)).sum();
            let point: DVec3 = blend
                .iter()
                .map(|&(row, b)| b * weight_of(row) * surface.control_points()[index(row, k)])
                .sum();
            points.push(point / weight);
            weights.push(weight);
        }
        Self { points, weights: surface.is_rational().then_some(weights) }
    }

    /// Whether the whole side is one point (a pole).
    pub(crate) fn is_collapsed(&self) -> bool {
        self.points.windows(2).all(|pair| pair[0] == pair[1])
    }
}

/// The rows that matter at an end of the domain with their basis values; one row if clamped there.
fn blend(knots: &KnotVector, at_end: bool) -> Vec<(usize, f64)> {
    let (d, all) = (knots.degree().get(), knots.knots());
    let (start, end) = knots.domain();
    if !knots.is_periodic() {
        let ends = if at_end { &all[all.len() - d - 1..] } else { &all[..=d] };
        if ends.iter().all(|t| *t == ends[0]) {
            return vec![(if at_end { knots.control_count() - 1 } else { 0 }, 1.0)];
        }
    }
    let basis = knots.basis(if at_end { end } else { start }, 0);
    (0..=d).map(|r| (knots.control_index(basis.span, r), basis.values[0][r])).collect()
}
