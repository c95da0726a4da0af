//! Area and curvatures of a whole surface.

use crate::quadrature::{CurvatureSamples, cells, ends, nodes, parameters};
use crate::region::Region;
use crate::surface::BsplineSurface;
use crate::trim::Trim;
use geom_core::{CurvatureStatistics, DVec3, SurfaceJet};

impl BsplineSurface {
    /// Area and curvatures of the surface: area and means by Gauss quadrature with 5 x 5 nodes in
    /// every cell of the knot spans, the extremes over the nodes and over the corners of the cells,
    /// the box as [`Self::bounding_box`] finds it.
    /// Poles have the curvature of their surroundings, see [`SurfaceCurvature`](crate::SurfaceCurvature); points without
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
        samples.add_extent(None);
        samples.statistics
    }

    /// The volume between the surface (or the part that `trim` bounds) and a point, by the same
    /// quadrature: `∫ (S − apex) · (S_u × S_v) / 3 du dv`. Over all faces of a closed shell with
    /// the normals outside the sum is its volume, whatever the point (Gauss's theorem).
    ///
    /// # Example
    /// ```
    /// use bspline::{Elementary, ElementaryKind, Frame};
    /// use geom_core::DVec3;
    /// let frame = Frame::new(DVec3::X, DVec3::Z, None);
    /// let torus = Elementary { frame, kind: ElementaryKind::Torus { major: 3.0, minor: 1.0 } };
    /// let turn = [0.0, std::f64::consts::TAU];
    /// let volume = torus.surface(turn, turn)?.cone_volume(None, DVec3::ZERO);
    /// assert!((volume - 6.0 * std::f64::consts::PI.powi(2)).abs() < 1e-9);
    /// # Ok::<(), bspline::SplineError>(())
    /// ```
    #[must_use]
    pub fn cone_volume(&self, trim: Option<&Trim>, apex: DVec3) -> f64 {
        let share =
            |jet: &SurfaceJet| (jet.position() - apex).dot(jet.d(1, 0).cross(jet.d(0, 1))) / 3.0;
        if let Some(trim) = trim {
            let nodes = Region::new(trim, self).nodes();
            let places: Vec<[f64; 2]> = nodes.iter().map(|n| n.at).collect();
            let jets = self.jets(&places, 1);
            return jets.iter().zip(&nodes).map(|(jet, node)| node.weight * share(jet)).sum();
        }
        let (nodes_u, nodes_v) = (nodes(&cells(self.knots_u())), nodes(&cells(self.knots_v())));
        let jets = self.jet_grid(&parameters(&nodes_u), &parameters(&nodes_v), 1);
        let weight = |k: usize| nodes_u[k / nodes_v.len()].1 * nodes_v[k % nodes_v.len()].1;
        jets.iter().enumerate().map(|(k, jet)| weight(k) * share(jet)).sum()
    }
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
