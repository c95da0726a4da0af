//! Area and curvatures of a whole surface.

use crate::knots::KnotVector;
use crate::pole::SurfaceCurvature;
use crate::surface::BsplineSurface;
use geom_core::{CurvatureStatistics, SurfaceJet};
use std::ops::Range;

/// Nodes and weights of five-point Gauss-Legendre quadrature on `[0, 1]`, exact to degree 9.
pub(crate) const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_46, 0.239_314_335_249_683_23),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_23),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];
/// Knot spans are cut until a direction has at least this many cells.
pub(crate) const CELLS: usize = 16;

impl BsplineSurface {
    /// Area and curvatures of the surface: area and means by Gauss quadrature with 5 x 5 nodes in
    /// every cell of the knot spans, the extremes over the nodes and over the corners of the cells.
    /// Poles have the curvature of their surroundings, see [`SurfaceCurvature`]; points without
    /// curvature are counted and left out, with the area they stand for.
    ///
    /// # Example
    /// ```
    /// use bspline::{BsplineSurface, Degree, KnotVector};
    /// use geom_core::DVec3;
    /// let line = || KnotVector::clamped_uniform(Degree::new(1)?, 2);
    /// let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::X, DVec3::new(1.0, 1.0, 1.0)];
    /// let saddle = BsplineSurface::new(line()?, line()?, corners, None)?; // z = x y
    /// let curvatures = saddle.curvature_statistics();
    /// assert_eq!(curvatures.gaussian_curvature().unwrap().min, -1.0);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn curvature_statistics(&self) -> CurvatureStatistics {
        let (cells_u, cells_v) = (cells(self.knots_u()), cells(self.knots_v()));
        let (nodes_u, nodes_v) = (nodes(&cells_u), nodes(&cells_v));
        let mut samples = CurvatureSamples::new(self);
        let jets = self.jet_grid(&parameters(&nodes_u), &parameters(&nodes_v), 2);
        for (k, jet) in jets.iter().enumerate() {
            let ((u, a), (v, b)) = (nodes_u[k / nodes_v.len()], nodes_v[k % nodes_v.len()]);
            let area = a * b * jet.first_form().determinant().max(0.0).sqrt();
            samples.statistics.add_area(area);
            samples.add([u, v], jet, area);
        }
        let (ends_u, ends_v) = (ends(&cells_u), ends(&cells_v));
        let corners = self.jet_grid(&ends_u, &ends_v, 2);
        for (k, jet) in corners.iter().enumerate() {
            let at = [ends_u[k / ends_v.len()], ends_v[k % ends_v.len()]];
            samples.add(at, jet, 0.0);
        }
        samples.statistics
    }
}

/// Statistics of one surface while they are gathered.
pub(crate) struct CurvatureSamples<'s> {
    pub(crate) statistics: CurvatureStatistics,
    // None if the surface leaves the range of `f64` next to a pole.
    curvature: Option<SurfaceCurvature<'s>>,
}

impl<'s> CurvatureSamples<'s> {
    pub(crate) fn new(surface: &'s BsplineSurface) -> Self {
        let curvature = SurfaceCurvature::new(surface).ok();
        Self { statistics: CurvatureStatistics::default(), curvature }
    }

    /// Adds the jet at a parameter pair, which stands for `weight` of area.
    pub(crate) fn add(&mut self, [u, v]: [f64; 2], jet: &SurfaceJet, weight: f64) {
        let found = self.curvature.as_ref().and_then(|c| c.of_jet(u, v, jet).ok());
        match found {
            Some((h, k)) => self.statistics.add(jet.position(), weight, h, k),
            None => self.statistics.add_singular(jet.position(), weight),
        }
    }
}

fn cells(knots: &KnotVector) -> Vec<Range<f64>> {
    let breaks = knots.breaks();
    let pieces = CELLS.div_ceil(breaks.len() - 1);
    let cut = |pair: &[f64]| {
        let (a, b) = (pair[0], pair[1]);
        let at =
            move |i: usize| if i == pieces { b } else { a + (b - a) * i as f64 / pieces as f64 };
        (0..pieces).map(move |i| at(i)..at(i + 1))
    };
    breaks.windows(2).flat_map(cut).collect()
}

fn nodes(cells: &[Range<f64>]) -> Vec<(f64, f64)> {
    let of = |cell: &Range<f64>| {
        let (start, length) = (cell.start, cell.end - cell.start);
        GAUSS.map(|(x, w)| (start + length * x, length * w))
    };
    cells.iter().flat_map(of).collect()
}

fn parameters(nodes: &[(f64, f64)]) -> Vec<f64> {
    nodes.iter().map(|(t, _)| *t).collect()
}

fn ends(cells: &[Range<f64>]) -> Vec<f64> {
    let starts = cells.iter().map(|cell| cell.start);
    starts.chain(cells.last().map(|cell| cell.end)).collect()
}

#[cfg(test)]
mod tests {
    use crate::{BsplineSurface, Degree, KnotVector};
    use geom_core::{DVec3, assert_close};

    /// A quarter of a cylinder of radius 2 and height 3, exact.
    fn quarter_cylinder() -> BsplineSurface {
        let knots = |d: usize| KnotVector::clamped_uniform(Degree::new(d).unwrap(), d + 1).unwrap();
        let arc = [(2.0, 0.0), (2.0, 2.0), (0.0, 2.0)];
        let points =
            arc.iter().flat_map(|&(x, y)| [DVec3::new(x, y, 0.0), DVec3::new(x, y, 3.0)]).collect();
        let s = std::f64::consts::FRAC_1_SQRT_2;
        let weights = vec![1.0, 1.0, s, s, 1.0, 1.0];
        BsplineSurface::new(knots(2), knots(1), points, Some(weights)).unwrap()
    }

    #[test]
    fn a_cylinder_has_its_area_and_curvature() {
        let statistics = quarter_cylinder().curvature_statistics();
        assert_close(statistics.area, 3.0 * std::f64::consts::PI, 1e-12);
        let (h, k) = (statistics.mean_curvature(), statistics.gaussian_curvature());
        assert_close(h.unwrap().min, -0.25, 1e-13);
        assert_close(h.unwrap().mean_abs, 0.25, 1e-13);
        assert!(k.unwrap().max.abs() < 1e-13);
        assert_close(statistics.principal_curvature().unwrap().min, -0.5, 1e-13);
        assert_eq!(statistics.singular, 0);
        assert!(
            (statistics.bounding_box.unwrap().size() - DVec3::new(2.0, 2.0, 3.0)).length() < 1e-14
        );
    }

    #[test]
    fn a_pole_is_as_flat_as_its_surroundings() {
        let line = || KnotVector::clamped_uniform(Degree::new(1).unwrap(), 2).unwrap();
        let corners = vec![DVec3::ZERO, DVec3::Y, DVec3::ZERO, DVec3::X];
        let triangle = BsplineSurface::new(line(), line(), corners, None).unwrap();
        let statistics = triangle.curvature_statistics();
        assert_close(statistics.area, 0.5, 1e-12);
        // The triangle is plane at its pole too.
        assert_eq!(statistics.singular, 0);
        assert!(statistics.principal_curvature().unwrap().max.abs() < 1e-12);
    }

    #[test]
    fn a_cusp_is_counted_and_left_out() {
        // Both tangents point the same way at the corner where three points lie on a line.
        let line = || KnotVector::clamped_uniform(Degree::new(1).unwrap(), 2).unwrap();
        let corners = vec![DVec3::ZERO, DVec3::X, 2.0 * DVec3::X, DVec3::Y];
        let patch = BsplineSurface::new(line(), line(), corners, None).unwrap();
        assert!(patch.curvature_statistics().singular > 0);
    }
}
