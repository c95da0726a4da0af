//! The energy of a family of surfaces by a few shares.

use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::surface::SurfaceBlock;
use gp_solver::{Elements, EnergyBlock, Group};

/// The energy of the surface with control points `X + Σ cₖ (Yₖ − X)` by the shares `cₖ`, as Joshi
/// 2008, sec. 8.1, compares functionals on shapes with a few parameters.
///
/// Gradient `Dᵀ g` and Hessian `Dᵀ H D` with those of a [`SurfaceBlock`] and the matrix `D` of the
/// directions `Yₖ − X`. Shares have no unit.
pub struct FamilyBlock {
    surface: SurfaceBlock,
    shares: Range<usize>,
    base: Vec<f64>,
    directions: Vec<Vec<f64>>,
    elements: Elements,
    /// Control points, and gradients and Hessians of the surface's elements.
    buffers: Mutex<[Vec<f64>; 3]>,
}

impl FamilyBlock {
    /// Of a surface block whose control points are the only unknowns; `base` are the coordinates of
    /// `X`, `directions` those of every `Yₖ − X`, `shares` the group of the `cₖ`.
    ///
    /// # Panics
    /// If the numbers of shares and directions, or of their coordinates, differ, or if the shares do
    /// not follow one another.
    #[must_use]
    pub fn new(
        surface: SurfaceBlock,
        shares: Group,
        base: Vec<f64>,
        directions: Vec<Vec<f64>>,
    ) -> Self {
        let Some(range) = shares.range() else { panic!("shares follow one another") };
        assert_eq!(range.len(), directions.len(), "one share per direction");
        assert!(directions.iter().all(|d| d.len() == base.len()), "directions move control points");
        let mut elements = Elements::new();
        elements.push(&range.clone().collect::<Vec<_>>(), range.len());
        let inner = surface.elements();
        let buffers =
            [base.clone(), vec![0.0; inner.rows_total()], vec![0.0; inner.jacobian_len()]];
        Self { surface, shares: range, base, directions, elements, buffers: Mutex::new(buffers) }
    }

    fn buffers(&self) -> MutexGuard<'_, [Vec<f64>; 3]> {
        self.buffers.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn place(&self, x: &[f64], points: &mut [f64]) {
        points.copy_from_slice(&self.base);
        for (direction, share) in self.directions.iter().zip(&x[self.shares.clone()]) {
            points.iter_mut().zip(direction).for_each(|(p, d)| *p += share * d);
        }
    }
}

impl EnergyBlock for FamilyBlock {
    fn name(&self) -> &str {
        "surface energy"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn refresh(&mut self, x: &[f64]) {
        let mut points = self.base.clone();
        self.place(x, &mut points);
        self.surface.refresh(&points);
    }

    fn energy(&self, x: &[f64]) -> f64 {
        let [points, ..] = &mut *self.buffers();
        self.place(x, points);
        self.surface.energy(points)
    }

    fn quadratic_model(&self, x: &[f64], gradients: &mut [f64], hessians: &mut [f64]) -> f64 {
        let [points, inner_gradients, inner_hessians] = &mut *self.buffers();
        self.place(x, points);
        let energy = self.surface.quadratic_model(points, inner_gradients, inner_hessians);
        gradients.fill(0.0);
        hessians.fill(0.0);
        let (inner, m) = (self.surface.elements(), self.directions.len());
        let mut images = vec![0.0; m];
        for e in 0..inner.len() {
            let (columns, gradient) = (inner.columns(e), &inner_gradients[inner.rows(e)]);
            let n = columns.len();
            for (out, direction) in gradients.iter_mut().zip(&self.directions) {
                *out += columns.iter().zip(gradient).map(|(&c, g)| direction[c] * g).sum::<f64>();
            }
            for (row, &r) in inner_hessians[inner.jacobian_range(e)].chunks_exact(n).zip(columns) {
                for (image, direction) in images.iter_mut().zip(&self.directions) {
                    *image = row.iter().zip(columns).map(|(h, &c)| h * direction[c]).sum();
                }
                for (k, direction) in self.directions.iter().enumerate() {
                    for (out, image) in hessians[k * m..(k + 1) * m].iter_mut().zip(&images) {
                        *out += direction[r] * image;
                    }
                }
            }
        }
        energy
    }
}
