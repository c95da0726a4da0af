//! Limit points pulled to places.

use geom_core::DVec3;
use gp_solver::{Elements, Group, ResidualBlock};

/// Limit points pulled to places: `r = √(2 w) (Σᵢ sᵢ pᵢ − q)`, so that each adds `w · distance²`.
///
/// `sᵢ` are the weights of the control points `pᵢ` in the limit point and `q` is its place; the
/// derivative by `pᵢ` is `+√(2 w) sᵢ`, one row per coordinate. Lengths are those of the control
/// points (Halstead, Kass and DeRose 1993 interpolate in this way). Linear.
///
/// ```
/// use curvature_variation::blocks::PulledPoints;
/// use geom_core::DVec3;
/// use gp_solver::{ResidualBlock, Variables};
/// let mut variables = Variables::new();
/// let points = variables.add("control points", 2, 3);
/// let mut block = PulledPoints::new(points);
/// block.pull(&[(0, 0.5), (1, 0.5)], DVec3::X, 2.0);
/// let mut r = [0.0; 3];
/// block.residuals(&[1.0, 0.0, 0.0, 3.0, 1.0, 0.0], &mut r);
/// assert_eq!(r, [2.0, 1.0, 0.0]);
/// ```
#[derive(Clone, Debug)]
pub struct PulledPoints {
    points: Group,
    elements: Elements,
    /// One per row.
    rows: Vec<Row>,
}

#[derive(Clone, Debug)]
struct Row {
    /// `√(2 w) sᵢ`.
    factors: Vec<f64>,
    target: f64,
}

impl PulledPoints {
    /// No pull yet.
    ///
    /// # Panics
    /// If the group has not three components.
    #[must_use]
    pub fn new(points: Group) -> Self {
        assert_eq!(points.width(), 3, "control points have three coordinates");
        Self { points, elements: Elements::new(), rows: Vec::new() }
    }

    /// Pulls the point `Σ s p` of the stencil's control points to `place`.
    ///
    /// # Panics
    /// If the weight is negative.
    pub fn pull(&mut self, stencil: &[(u32, f64)], place: DVec3, weight: f64) -> &mut Self {
        assert!(weight >= 0.0, "pulls do not push");
        let root = (2.0 * weight).sqrt();
        for (c, q) in place.to_array().into_iter().enumerate() {
            let columns: Vec<usize> =
                stencil.iter().map(|&(v, _)| self.points.column(v as usize, c)).collect();
            self.elements.push(&columns, 1);
            let factors = stencil.iter().map(|&(_, s)| root * s).collect();
            self.rows.push(Row { factors, target: root * q });
        }
        self
    }
}

impl ResidualBlock for PulledPoints {
    fn name(&self) -> &str {
        "pulled limit points"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (e, (row, r)) in self.rows.iter().zip(residuals).enumerate() {
            let columns = self.elements.columns(e);
            *r = row.factors.iter().zip(columns).map(|(f, &c)| f * x[c]).sum::<f64>() - row.target;
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        for (e, row) in self.rows.iter().enumerate() {
            jacobian[self.elements.jacobian_range(e)].copy_from_slice(&row.factors);
        }
    }

    fn is_linear(&self) -> bool {
        true
    }
}
