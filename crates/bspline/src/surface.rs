//! Tensor-product B-spline surfaces, polynomial and rational.

use crate::basis::{BasisValues, MAX_DERIVATIVE};
use crate::error::SplineError;
use crate::knots::{Degree, KnotVector};
use crate::rational;
use geom_core::SurfaceJet;
use glam::{DVec3, DVec4};
use rayon::prelude::*;

/// A tensor-product B-spline surface: one finite control point per pair of basis functions,
/// `control_points[i * n_v + j]`, weights positive if there are any (kept by the constructors).
///
/// Parameters outside the domain are clamped to it, or wrapped in a periodic direction.
///
/// # Example
/// ```
/// use bspline::{BsplineSurface, Degree, KnotVector};
/// use geom_core::DVec3;
/// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
/// let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 1.0)];
/// let saddle = BsplineSurface::new(line()?, line()?, corners, None)?; // z = x y
/// assert_eq!(saddle.point(0.5, 0.5), DVec3::new(0.5, 0.5, 0.25));
/// assert_eq!(saddle.jet(0.0, 0.0, 2).gaussian_curvature()?, -1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct BsplineSurface {
    knots_u: KnotVector,
    knots_v: KnotVector,
    control_points: Vec<DVec3>,
    weights: Option<Vec<f64>>,
}

impl BsplineSurface {
    /// A surface; `weights`, if any, are one positive number per control point, in their order.
    ///
    /// # Errors
    /// [`SplineError`] says which count or number is at fault.
    pub fn new(
        knots_u: KnotVector,
        knots_v: KnotVector,
        control_points: Vec<DVec3>,
        weights: Option<Vec<f64>>,
    ) -> Result<Self, SplineError> {
        let needed = knots_u.control_count() * knots_v.control_count();
        crate::error::check_control(needed, &control_points, weights.as_deref())?;
        Ok(Self { knots_u, knots_v, control_points, weights })
    }

    /// The same knots and weights with other control points.
    ///
    /// # Errors
    /// [`SplineError`] if there are too many or too few, or one is not finite.
    pub fn with_control_points(&self, control_points: Vec<DVec3>) -> Result<Self, SplineError> {
        let (u, v) = (self.knots_u.clone(), self.knots_v.clone());
        Self::new(u, v, control_points, self.weights.clone())
    }

    /// Knots in u.
    #[must_use]
    pub fn knots_u(&self) -> &KnotVector {
        &self.knots_u
    }

    /// Knots in v.
    #[must_use]
    pub fn knots_v(&self) -> &KnotVector {
        &self.knots_v
    }

    /// Number of control points in u.
    #[must_use]
    pub fn n_u(&self) -> usize {
        self.knots_u.control_count()
    }

    /// Number of control points in v.
    #[must_use]
    pub fn n_v(&self) -> usize {
        self.knots_v.control_count()
    }

    /// Degree in u.
    #[must_use]
    pub fn degree_u(&self) -> Degree {
        self.knots_u.degree()
    }

    /// Degree in v.
    #[must_use]
    pub fn degree_v(&self) -> Degree {
        self.knots_v.degree()
    }

    /// The control points, `[i * n_v + j]`.
    #[must_use]
    pub fn control_points(&self) -> &[DVec3] {
        &self.control_points
    }

    /// Control point `i` in u, `j` in v.
    #[must_use]
    pub fn control_point(&self, i: usize, j: usize) -> DVec3 {
        self.control_points[i * self.n_v() + j]
    }

    /// The weights in the order of the control points, if the surface is rational.
    #[must_use]
    pub fn weights(&self) -> Option<&[f64]> {
        self.weights.as_deref()
    }

    /// Whether the surface has weights.
    #[must_use]
    pub fn is_rational(&self) -> bool {
        self.weights.is_some()
    }

    /// The point at `(u, v)`.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let knots = KnotVector::clamped_uniform(Degree::new(1)?, 2)?;
    /// let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 4.0)];
    /// let saddle = BsplineSurface::new(knots.clone(), knots, corners, None)?;
    /// assert_eq!(saddle.point(0.5, 0.5), DVec3::new(0.5, 0.5, 1.0));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn point(&self, u: f64, v: f64) -> DVec3 {
        self.jet(u, v, 0).position()
    }

    /// Position and exact derivatives up to the total order `order`.
    ///
    /// # Panics
    /// If `order` exceeds [`MAX_DERIVATIVE`].
    #[must_use]
    pub fn jet(&self, u: f64, v: f64, order: usize) -> SurfaceJet {
        self.jet_of(&self.knots_u.basis(u, order), &self.knots_v.basis(v, order), order)
    }

    /// Jets at any number of parameter pairs, in their order; computed in parallel.
    ///
    /// # Panics
    /// If `order` exceeds [`MAX_DERIVATIVE`].
    #[must_use]
    pub fn jets(&self, parameters: &[[f64; 2]], order: usize) -> Vec<SurfaceJet> {
        parameters.par_iter().with_min_len(64).map(|&[u, v]| self.jet(u, v, order)).collect()
    }

    /// Jets on a grid of parameters, `[i * v.len() + j]`; the basis functions are evaluated once
    /// per row and column. Computed in parallel.
    ///
    /// # Panics
    /// If `order` exceeds [`MAX_DERIVATIVE`].
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
    /// let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 1.0)];
    /// let saddle = BsplineSurface::new(line()?, line()?, corners, None)?; // z = x y
    /// let jets = saddle.jet_grid(&[0.0, 1.0], &[0.0, 0.5, 1.0], 2);
    /// // K = −1 / (1 + x² + y²)²; the last corner is (1, 1).
    /// assert_eq!(jets.len(), 6);
    /// assert!((jets[5].gaussian_curvature()? + 1.0 / 9.0).abs() < 1e-15);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn jet_grid(&self, u: &[f64], v: &[f64], order: usize) -> Vec<SurfaceJet> {
        let basis_v: Vec<BasisValues> = v.iter().map(|&t| self.knots_v.basis(t, order)).collect();
        u.par_iter()
            .flat_map_iter(|&t| {
                let basis_u = self.knots_u.basis(t, order);
                basis_v.iter().map(move |bv| self.jet_of(&basis_u, bv, order))
            })
            .collect()
    }

    /// The jet from basis values already at hand.
    fn jet_of(&self, basis_u: &BasisValues, basis_v: &BasisValues, order: usize) -> SurfaceJet {
        match &self.weights {
            None => self.polynomial_jet(basis_u, basis_v, order),
            Some(weights) => {
                rational::surface(&self.homogeneous_jet(weights, basis_u, basis_v, order), order)
            }
        }
    }

    fn polynomial_jet(&self, bu: &BasisValues, bv: &BasisValues, order: usize) -> SurfaceJet {
        let n_v = self.n_v();
        let mut jet = SurfaceJet::default();
        for r in 0..self.degree_u().order() {
            let row = self.knots_u.control_index(bu.span, r) * n_v;
            let mut inner = [DVec3::ZERO; MAX_DERIVATIVE + 1];
            for s in 0..self.degree_v().order() {
                let point = self.control_points[row + self.knots_v.control_index(bv.span, s)];
                for b in 0..=order {
                    inner[b] += bv.values[b][s] * point;
                }
            }
            for total in 0..=order {
                for b in 0..=total {
                    jet.derivatives[SurfaceJet::index(total - b, b)] +=
                        bu.values[total - b][r] * inner[b];
                }
            }
        }
        jet
    }

    fn homogeneous_jet(
        &self,
        weights: &[f64],
        bu: &BasisValues,
        bv: &BasisValues,
        order: usize,
    ) -> [DVec4; SurfaceJet::LEN] {
        let n_v = self.n_v();
        let mut sums = [DVec4::ZERO; SurfaceJet::LEN];
        for r in 0..self.degree_u().order() {
            let row = self.knots_u.control_index(bu.span, r) * n_v;
            let mut inner = [DVec4::ZERO; MAX_DERIVATIVE + 1];
            for s in 0..self.degree_v().order() {
                let i = row + self.knots_v.control_index(bv.span, s);
                let point = (self.control_points[i] * weights[i]).extend(weights[i]);
                for b in 0..=order {
                    inner[b] += bv.values[b][s] * point;
                }
            }
            for total in 0..=order {
                for b in 0..=total {
                    sums[SurfaceJet::index(total - b, b)] += bu.values[total - b][r] * inner[b];
                }
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom_core::assert_close;

    fn knots(degree: usize, n: usize) -> KnotVector {
        KnotVector::clamped_uniform(Degree::new(degree).unwrap(), n).unwrap()
    }

    /// A surface with nothing special about it.
    fn generic(ku: KnotVector, kv: KnotVector, rational: bool) -> BsplineSurface {
        let (n_u, n_v) = (ku.control_count(), kv.control_count());
        let point = |k: usize| {
            let (i, j) = ((k / n_v) as f64, (k % n_v) as f64);
            DVec3::new(i + 0.2 * (j * 1.7).sin(), j + 0.3 * (i * 0.9).cos(), (i * j * 0.4).sin())
        };
        let weights = (0..n_u * n_v).map(|k| 1.0 + 0.4 * (k as f64 * 1.3).sin()).collect();
        let points = (0..n_u * n_v).map(point).collect();
        BsplineSurface::new(ku, kv, points, rational.then_some(weights)).unwrap()
    }

    #[test]
    fn derivatives_match_differences_of_the_order_below() {
        let periodic = KnotVector::periodic_uniform(Degree::new(4).unwrap(), 7).unwrap();
        for surface in [
            generic(knots(4, 7), knots(5, 8), false),
            generic(knots(4, 7), knots(5, 8), true),
            generic(periodic.clone(), knots(4, 6), false),
            generic(knots(2, 5), periodic, true),
        ] {
            let (u, v, h) = (0.53, 0.47, 1e-5);
            let here = surface.jet(u, v, 4);
            let (west, east) = (surface.jet(u - h, v, 4), surface.jet(u + h, v, 4));
            let (south, north) = (surface.jet(u, v - h, 4), surface.jet(u, v + h, 4));
            for total in 1..=4 {
                for b in 0..=total {
                    let a = total - b;
                    let difference = if a > 0 {
                        (east.d(a - 1, b) - west.d(a - 1, b)) / (2.0 * h)
                    } else {
                        (north.d(a, b - 1) - south.d(a, b - 1)) / (2.0 * h)
                    };
                    let error = (here.d(a, b) - difference).length();
                    assert_close(error / here.d(a, b).length().max(1.0), 0.0, 1e-6);
                }
            }
        }
    }

    #[test]
    fn grid_and_batch_agree_with_single_points() {
        let surface = generic(knots(3, 6), knots(4, 7), true);
        let (us, vs) = ([0.0, 0.3, 1.0], [0.2, 0.9]);
        let grid = surface.jet_grid(&us, &vs, 3);
        let pairs: Vec<[f64; 2]> = us.iter().flat_map(|&u| vs.map(|v| [u, v])).collect();
        assert_eq!(grid, surface.jets(&pairs, 3));
        for (jet, [u, v]) in grid.iter().zip(&pairs) {
            assert_eq!(*jet, surface.jet(*u, *v, 3));
            assert_eq!(jet.position(), surface.point(*u, *v));
        }
    }

    #[test]
    fn equal_weights_change_nothing() {
        let plain = generic(knots(3, 6), knots(4, 7), false);
        let weighted = BsplineSurface::new(
            plain.knots_u.clone(),
            plain.knots_v.clone(),
            plain.control_points.clone(),
            Some(vec![2.5; 42]),
        )
        .unwrap();
        let (a, b) = (plain.jet(0.4, 0.7, 4), weighted.jet(0.4, 0.7, 4));
        for k in 0..SurfaceJet::LEN {
            let scale = a.derivatives[k].length().max(1.0);
            assert_close((a.derivatives[k] - b.derivatives[k]).length() / scale, 0.0, 1e-12);
        }
    }

    #[test]
    fn periodic_surface_joins_smoothly() {
        let periodic = KnotVector::periodic_uniform(Degree::new(4).unwrap(), 7).unwrap();
        let surface = generic(periodic, knots(3, 5), false);
        let start = surface.jet(0.0, 0.3, 3);
        let end = surface.jet(1.0 - 1e-9, 0.3, 3);
        for k in 0..10 {
            let scale = start.derivatives[k].length().max(1.0);
            let error = (start.derivatives[k] - end.derivatives[k]).length() / scale;
            assert_close(error, 0.0, 1e-6);
        }
    }
}
