//! Energy terms that the solvers of this crate share.

use geom_core::{ClosestPoint, DVec3, Foot, closest_on_segment};
use gp_solver::{Elements, ResidualBlock};
use rayon::prelude::*;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A weight that can change between the stages of a solve, while a block that reads it is owned
/// by the solver.
#[derive(Clone, Debug)]
pub(crate) struct Weight(Arc<AtomicU64>);

impl Weight {
    pub(crate) fn new(value: f64) -> Self {
        Self(Arc::new(AtomicU64::new(value.to_bits())))
    }

    pub(crate) fn get(&self) -> f64 {
        f64::from_bits(self.0.load(Ordering::Relaxed))
    }

    pub(crate) fn set(&self, value: f64) {
        self.0.store(value.to_bits(), Ordering::Relaxed);
    }

    fn factor(&self) -> f64 {
        self.get().sqrt()
    }
}

/// Where the three coordinates of a vertex's vector stand among the unknowns.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Layout {
    pub(crate) stride: usize,
    pub(crate) offset: usize,
}

impl Layout {
    pub(crate) fn column(self, vertex: usize, coordinate: usize) -> usize {
        self.stride * vertex + self.offset + coordinate
    }

    pub(crate) fn get(self, x: &[f64], vertex: usize) -> DVec3 {
        let at = self.column(vertex, 0);
        DVec3::new(x[at], x[at + 1], x[at + 2])
    }
}

/// A block multiplied by the root of a weight.
pub(crate) struct Weighted<B> {
    pub(crate) block: B,
    pub(crate) weight: Weight,
}

impl<B: ResidualBlock> ResidualBlock for Weighted<B> {
    fn name(&self) -> &str {
        self.block.name()
    }

    fn elements(&self) -> &Elements {
        self.block.elements()
    }

    fn refresh(&mut self, x: &[f64]) {
        self.block.refresh(x);
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        self.block.residuals(x, residuals);
        let factor = self.weight.factor();
        residuals.iter_mut().for_each(|r| *r *= factor);
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.block.linearize(x, residuals, jacobian);
        let factor = self.weight.factor();
        residuals.iter_mut().chain(jacobian).for_each(|r| *r *= factor);
    }
}

/// Linear combinations of vertex vectors that are to vanish, one row per coordinate.
pub(crate) struct Combinations {
    name: &'static str,
    elements: Elements,
    coefficients: Vec<f64>,
    constant_weight: bool,
    weight: Weight,
}

impl Combinations {
    /// Each combination is a list of vertices with their coefficients.
    pub(crate) fn new<'a>(
        name: &'static str,
        layout: Layout,
        combinations: impl Iterator<Item = &'a [(usize, f64)]>,
        weight: Weight,
        constant_weight: bool,
    ) -> Self {
        let mut elements = Elements::new();
        let mut coefficients = Vec::new();
        for combination in combinations {
            for c in 0..3 {
                let columns: Vec<usize> =
                    combination.iter().map(|&(v, _)| layout.column(v, c)).collect();
                elements.push(&columns, 1);
                coefficients.extend(combination.iter().map(|&(_, value)| value));
            }
        }
        Self { name, elements, coefficients, constant_weight, weight }
    }
}

impl ResidualBlock for Combinations {
    fn name(&self) -> &str {
        self.name
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        let factor = self.weight.factor();
        for (e, residual) in residuals.iter_mut().enumerate() {
            let row = &self.coefficients[self.elements.jacobian_range(e)];
            let terms = self.elements.columns(e).iter().zip(row);
            *residual = factor * terms.map(|(&c, &value)| value * x[c]).sum::<f64>();
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        let factor = self.weight.factor();
        for (to, &value) in jacobian.iter_mut().zip(&self.coefficients) {
            *to = factor * value;
        }
    }

    fn is_linear(&self) -> bool {
        self.constant_weight
    }
}

/// What a vertex is held to.
#[derive(Clone, Debug)]
pub(crate) enum Target {
    /// The nearest point of the reference surface.
    Surface,
    /// A point, with the tangent plane of the surface near it.
    Anchor(DVec3),
    /// The nearest point of one of the boundary curves, by number; free along it.
    Curve(usize),
}

/// Distance to the tangent plane at the foot of every vertex, and to the foot itself (Shi et al.
/// 2014, §3.2); feet are lagged.
pub(crate) struct Proximity<'a> {
    pub(crate) layout: Layout,
    pub(crate) reference: &'a dyn ClosestPoint,
    pub(crate) targets: Vec<Target>,
    pub(crate) curves: Vec<Vec<DVec3>>,
    /// Per vertex, the roots of the weights of plane and point distance.
    pub(crate) plane: Vec<f64>,
    pub(crate) point: Vec<f64>,
    /// Root of the weight of the distance to a boundary curve.
    pub(crate) curve: f64,
    pub(crate) elements: Elements,
    pub(crate) feet: Vec<(Foot, bool)>,
    /// The unknowns are positions divided by this.
    pub(crate) unit: f64,
}

impl Proximity<'_> {
    pub(crate) fn elements_for(layout: Layout, vertices: usize) -> Elements {
        let mut elements = Elements::new();
        for v in 0..vertices {
            elements.push(&[0, 1, 2].map(|c| layout.column(v, c)), 4);
        }
        elements
    }

    fn foot(&self, v: usize, x: &[f64]) -> (Foot, bool) {
        let p = self.layout.get(x, v) * self.unit;
        let (foot, on_curve) = match &self.targets[v] {
            Target::Surface => (self.reference.closest_point(p), false),
            Target::Anchor(at) => {
                (Foot { point: *at, normal: self.reference.closest_point(p).normal }, false)
            }
            Target::Curve(k) => (closest_on_polyline(&self.curves[*k], p), true),
        };
        (Foot { point: foot.point / self.unit, normal: foot.normal }, on_curve)
    }

    fn rows(&self, v: usize) -> [DVec3; 4] {
        let (foot, on_curve) = &self.feet[v];
        let n = foot.normal;
        if *on_curve {
            // Here `normal` is the tangent of the curve; movement along it is free.
            let row = |axis: DVec3| self.curve * (axis - n * n.dot(axis));
            return [DVec3::ZERO, row(DVec3::X), row(DVec3::Y), row(DVec3::Z)];
        }
        let p = self.point[v];
        [n * self.plane[v], DVec3::X * p, DVec3::Y * p, DVec3::Z * p]
    }
}

/// Nearest point of an open or closed polyline, with the unit tangent as `normal`.
pub(crate) fn closest_on_polyline(points: &[DVec3], x: DVec3) -> Foot {
    let mut best = (f64::INFINITY, Foot { point: points[0], normal: DVec3::ZERO });
    for pair in points.windows(2) {
        let point = pair[0].lerp(pair[1], closest_on_segment(x, pair[0], pair[1]));
        let distance = point.distance_squared(x);
        if distance < best.0 {
            best = (distance, Foot { point, normal: (pair[1] - pair[0]).normalize_or_zero() });
        }
    }
    best.1
}

impl ResidualBlock for Proximity<'_> {
    fn name(&self) -> &str {
        "proximity"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn refresh(&mut self, x: &[f64]) {
        self.feet = (0..self.targets.len()).into_par_iter().map(|v| self.foot(v, x)).collect();
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (v, out) in residuals.chunks_exact_mut(4).enumerate() {
            let offset = self.layout.get(x, v) - self.feet[v].0.point;
            for (r, row) in out.iter_mut().zip(self.rows(v)) {
                *r = row.dot(offset);
            }
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        for (v, out) in jacobian.chunks_exact_mut(12).enumerate() {
            for (to, row) in out.chunks_exact_mut(3).zip(self.rows(v)) {
                to.copy_from_slice(&row.to_array());
            }
        }
    }
}

/// Second differences along the curves of a net, and at irregular vertices the distance to the
/// mean of the neighbours (opposite edges belong to different families there).
pub(crate) fn second_differences(net: &crate::QuadNet) -> Vec<Vec<(usize, f64)>> {
    let mut rows: Vec<Vec<(usize, f64)>> =
        net.curve_triples().iter().map(|&[a, v, b]| vec![(a, 1.0), (v, -2.0), (b, 1.0)]).collect();
    for v in net.irregular_vertices() {
        let ring: Vec<usize> = net.ring(v).collect();
        let mut row: Vec<(usize, f64)> =
            ring.iter().map(|&w| (w, 1.0 / ring.len() as f64)).collect();
        row.push((v, -1.0));
        rows.push(row);
    }
    rows
}

/// Third differences along the curves of a net, and second ones where a curve is too short.
pub(crate) fn third_differences(net: &crate::QuadNet) -> Vec<Vec<(usize, f64)>> {
    let mut rows: Vec<Vec<(usize, f64)>> = net
        .curve_quadruples()
        .iter()
        .map(|&[a, b, c, d]| vec![(a, -1.0), (b, 3.0), (c, -3.0), (d, 1.0)])
        .collect();
    for v in net.irregular_vertices() {
        let ring: Vec<usize> = net.ring(v).collect();
        let mut row: Vec<(usize, f64)> =
            ring.iter().map(|&w| (w, 1.0 / ring.len() as f64)).collect();
        row.push((v, -1.0));
        rows.push(row);
    }
    rows
}
