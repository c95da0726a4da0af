//! Nearness to a surface, to points and to curves.

use geom_core::{ClosestPoint, DVec3, Foot};
use gp_solver::{Elements, Group, ResidualBlock};
use rayon::prelude::*;

use super::targets::{Target, Targets, closest_on_polyline};
use crate::vectors::vector;

/// Roots of the weights of [`Proximity`].
#[derive(Clone, Debug, PartialEq)]
pub struct ProximityWeights {
    /// Of the distance to the tangent plane, for each vertex.
    pub plane: Vec<f64>,
    /// Of the distance to the foot itself, for each vertex.
    pub point: Vec<f64>,
    /// Of the distance to a boundary curve.
    pub curve: f64,
}

/// Distance to the tangent plane at the foot of every vertex, and to the foot itself (Shi et al.
/// 2014, §3.2: `f_prox`). For vertex `v` at `x_v` with the foot `q`, the unit normal `n`:
///
/// ```text
/// residual[4 v]         = plane_v n·(x_v − q)       jacobian = plane_v n
/// residual[4 v + 1 + c] = point_v (x_v − q)_c       jacobian = point_v e_c
/// ```
///
/// A vertex that is held to a curve with the unit tangent `t` has instead
///
/// ```text
/// residual[4 v]         = 0
/// residual[4 v + 1 + c] = curve (e_c − t t_c)·(x_v − q)      jacobian = curve (e_c − t t_c)
/// ```
///
/// Feet, normals and tangents are those of the last [`refresh`](ResidualBlock::refresh), so that
/// derivatives are those of a fixed foot. The unit is that of the unknowns, which are positions of
/// the model divided by `unit`.
pub struct Proximity<'a> {
    positions: Group,
    reference: &'a dyn ClosestPoint,
    targets: Targets,
    weights: ProximityWeights,
    unit: f64,
    elements: Elements,
    /// Foot of every vertex, and whether it is one on a curve.
    feet: Vec<(Foot, bool)>,
}

impl<'a> Proximity<'a> {
    /// Vertices in the group `positions`, counted in `unit` lengths of the model, near `reference`
    /// or the target of each.
    ///
    /// # Panics
    /// If there is not one target and one weight of each kind for every vertex.
    #[must_use]
    pub fn new(
        positions: Group,
        unit: f64,
        reference: &'a dyn ClosestPoint,
        targets: Targets,
        weights: ProximityWeights,
    ) -> Self {
        let counts = [targets.of_vertices.len(), weights.plane.len(), weights.point.len()];
        assert_eq!(counts, [positions.len(); 3], "one target and two weights for every vertex");
        let mut elements = Elements::new();
        for v in 0..positions.len() {
            elements.push(&positions.columns::<3>(v), 4);
        }
        let feet = Vec::new();
        Self { positions, reference, targets, weights, unit, elements, feet }
    }

    fn foot(&self, v: usize, x: &[f64]) -> (Foot, bool) {
        let p = vector(self.positions, x, v) * self.unit;
        let (foot, on_curve) = match &self.targets.of_vertices[v] {
            Target::Surface => (self.reference.closest_point(p), false),
            Target::Anchor(at) => {
                (Foot { point: *at, normal: self.reference.closest_point(p).normal }, false)
            }
            Target::Curve(k) => (closest_on_polyline(&self.targets.curves[*k], p), true),
        };
        (Foot { point: foot.point / self.unit, normal: foot.normal }, on_curve)
    }

    fn rows(&self, v: usize) -> [DVec3; 4] {
        let (foot, on_curve) = &self.feet[v];
        let n = foot.normal;
        if *on_curve {
            // Here `normal` is the tangent of the curve; movement along it is free.
            let row = |axis: DVec3| self.weights.curve * (axis - n * n.dot(axis));
            return [DVec3::ZERO, row(DVec3::X), row(DVec3::Y), row(DVec3::Z)];
        }
        let p = self.weights.point[v];
        [n * self.weights.plane[v], DVec3::X * p, DVec3::Y * p, DVec3::Z * p]
    }
}

impl ResidualBlock for Proximity<'_> {
    fn name(&self) -> &str {
        "proximity"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn refresh(&mut self, x: &[f64]) {
        self.feet = (0..self.positions.len()).into_par_iter().map(|v| self.foot(v, x)).collect();
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (v, out) in residuals.chunks_exact_mut(4).enumerate() {
            let offset = vector(self.positions, x, v) - self.feet[v].0.point;
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
