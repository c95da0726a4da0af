//! Points and normals on a grid of parameters: one direction is summed once for a whole row of the
//! grid instead of for every point.

use crate::basis::BasisValues;
use crate::surface::BsplineSurface;
use glam::{DVec3, DVec4};
use rayon::prelude::*;
use std::ops::{AddAssign, Mul};

impl BsplineSurface {
    /// Points on a grid of parameters, `[i * v.len() + j]`.
    #[must_use]
    pub fn point_grid(&self, u: &[f64], v: &[f64]) -> Vec<DVec3> {
        match self.weights() {
            None => Sums::new(self, self.control_points(), v, 0).rows(u, |[s, ..]| s),
            Some(weights) => {
                let lifted = self.lifted(weights);
                let quotient = |[s, ..]: [DVec4; 3]| s.truncate() / s.w;
                Sums::new(self, &lifted, v, 0).rows(u, quotient)
            }
        }
    }

    /// The area vectors `S_u × S_v` on a grid of parameters, `[i * v.len() + j]`: normals as long as
    /// the area element.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
    /// let corners = vec![DVec3::ZERO, 2.0 * DVec3::Y, 3.0 * DVec3::X, DVec3::new(3.0, 2.0, 0.0)];
    /// let rectangle = BsplineSurface::new(line()?, line()?, corners, None)?;
    /// let areas = rectangle.area_vector_grid(&[0.3], &[0.2, 0.9]);
    /// assert!(areas.iter().all(|area| area.distance(6.0 * DVec3::Z) < 1e-14));
    /// # Ok::<(), bspline::SplineError>(())
    /// ```
    #[must_use]
    pub fn area_vector_grid(&self, u: &[f64], v: &[f64]) -> Vec<DVec3> {
        match self.weights() {
            None => {
                let cross = |[_, s_u, s_v]: [DVec3; 3]| s_u.cross(s_v);
                Sums::new(self, self.control_points(), v, 1).rows(u, cross)
            }
            Some(weights) => {
                let lifted = self.lifted(weights);
                let cross = |[s, s_u, s_v]: [DVec4; 3]| {
                    // (A/w)' = (A' - w' A/w) / w.
                    let point = s.truncate() / s.w;
                    let along = |d: DVec4| (d.truncate() - d.w * point) / s.w;
                    along(s_u).cross(along(s_v))
                };
                Sums::new(self, &lifted, v, 1).rows(u, cross)
            }
        }
    }

    /// Control points times their weights, with them.
    fn lifted(&self, weights: &[f64]) -> Vec<DVec4> {
        self.control_points().iter().zip(weights).map(|(p, &w)| (*p * w).extend(w)).collect()
    }
}

/// The control net summed in v: a curve in u for every parameter v.
struct Sums<'s, T> {
    surface: &'s BsplineSurface,
    order: usize,
    /// `[row of the net][parameter v]`.
    values: Vec<T>,
    /// Derivatives in v, for order one.
    derivatives: Vec<T>,
    columns: usize,
}

impl<'s, T> Sums<'s, T>
where
    T: Copy + Default + AddAssign + Mul<f64, Output = T> + Send + Sync,
{
    /// Sums points, or points and first derivatives.
    fn new(surface: &'s BsplineSurface, net: &[T], v: &[f64], order: usize) -> Self {
        let knots = surface.knots_v();
        let basis: Vec<BasisValues> = v.iter().map(|&t| knots.basis(t, order)).collect();
        let sum = |derivative: usize| -> Vec<T> {
            let along = |row: &[T], b: &BasisValues| {
                let mut sum = T::default();
                for (s, &value) in b.values[derivative][..knots.degree().order()].iter().enumerate()
                {
                    sum += row[knots.control_index(b.span, s)] * value;
                }
                sum
            };
            let rows = net.chunks_exact(surface.n_v());
            rows.flat_map(|row| basis.iter().map(move |b| along(row, b))).collect()
        };
        let derivatives = if order > 0 { sum(1) } else { Vec::new() };
        Self { surface, order, values: sum(0), derivatives, columns: v.len() }
    }

    /// What `of` makes of `[S, S_u, S_v]` (zero beyond the order) at every point, row by row.
    fn rows(&self, u: &[f64], of: impl Fn([T; 3]) -> DVec3 + Sync) -> Vec<DVec3> {
        let knots = self.surface.knots_u();
        let mut out = vec![DVec3::ZERO; u.len() * self.columns];
        let work = |(out, &t): (&mut [DVec3], &f64)| {
            let basis = knots.basis(t, self.order);
            let start = |r: usize| knots.control_index(basis.span, r) * self.columns;
            for (j, out) in out.iter_mut().enumerate() {
                let mut sums = [T::default(); 3];
                for r in 0..knots.degree().order() {
                    let at = start(r) + j;
                    sums[0] += self.values[at] * basis.values[0][r];
                    if self.order > 0 {
                        sums[1] += self.values[at] * basis.values[1][r];
                        sums[2] += self.derivatives[at] * basis.values[0][r];
                    }
                }
                *out = of(sums);
            }
        };
        out.par_chunks_exact_mut(self.columns.max(1)).zip(u.par_iter()).for_each(work);
        out
    }
}

#[cfg(test)]
mod tests {
    use crate::surface::BsplineSurface;
    use crate::{Degree, KnotVector};
    use geom_core::DVec3;

    fn surfaces() -> [BsplineSurface; 2] {
        let u = KnotVector::clamped_uniform(Degree::new(4).unwrap(), 7).unwrap();
        let v = KnotVector::periodic_uniform(Degree::new(3).unwrap(), 8).unwrap();
        let point = |k: usize| {
            let (i, j) = ((k / 8) as f64, (k % 8) as f64);
            DVec3::new(i + 0.2 * (j * 1.7).sin(), j + 0.3 * (i * 0.9).cos(), (i * j * 0.4).sin())
        };
        let weights = (0..56).map(|k| 1.0 + 0.4 * (f64::from(k) * 1.3).sin()).collect();
        let points: Vec<DVec3> = (0..56).map(point).collect();
        let plain = BsplineSurface::new(u.clone(), v.clone(), points.clone(), None).unwrap();
        [plain, BsplineSurface::new(u, v, points, Some(weights)).unwrap()]
    }

    #[test]
    fn grids_are_those_of_single_points() {
        let u = [0.0, 0.13, 0.4, 0.77, 1.0];
        let v = [-0.2, 0.0, 0.31, 0.5, 0.83, 1.0];
        for surface in surfaces() {
            let points = surface.point_grid(&u, &v);
            let areas = surface.area_vector_grid(&u, &v);
            assert_eq!((points.len(), areas.len()), (30, 30));
            for (k, (&point, &area)) in points.iter().zip(&areas).enumerate() {
                let jet = surface.jet(u[k / 6], v[k % 6], 1);
                assert!(point.distance(jet.position()) <= 1e-15 * point.length());
                let wanted = jet.d(1, 0).cross(jet.d(0, 1));
                assert!(area.distance(wanted) <= 1e-14 * wanted.length());
            }
        }
        assert!(surfaces()[0].point_grid(&[], &v).is_empty());
        assert!(surfaces()[0].point_grid(&u, &[]).is_empty());
    }
}
