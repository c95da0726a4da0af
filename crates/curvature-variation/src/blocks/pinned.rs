//! Pinned limit points and tangent planes as penalties.

use geom_core::DVec3;
use gp_solver::{Elements, Group, ResidualBlock};

/// Linear conditions on the limit surface as rows: `r = Σᵢ sᵢ (d · pᵢ) − t`.
///
/// For a pinned limit point `sᵢ` are its weights, `d` an axis and `t` the coordinate of its place;
/// for a pinned tangent plane `sᵢ` are the weights of a tangent, `d` is the normal and `t = 0`. The
/// derivative by `pᵢ` is `+sᵢ d`; lengths are those of the control points. [`crate::solve`] keeps the
/// conditions exactly; in a problem of blocks they are kept by a weight (Halstead, Kass and DeRose
/// 1993). Linear.
#[derive(Clone, Debug)]
pub struct PinnedLimits {
    points: Group,
    elements: Elements,
    factors: Vec<f64>,
    targets: Vec<f64>,
}

impl PinnedLimits {
    /// No condition yet.
    ///
    /// # Panics
    /// If the group has not three components.
    #[must_use]
    pub fn new(points: Group) -> Self {
        assert_eq!(points.width(), 3, "control points have three coordinates");
        let (factors, targets) = (Vec::new(), Vec::new());
        Self { points, elements: Elements::new(), factors, targets }
    }

    /// Asks for `Σ s (direction · p) = target`.
    pub fn pin(&mut self, stencil: &[(u32, f64)], direction: DVec3, target: f64) -> &mut Self {
        let mut columns = Vec::with_capacity(3 * stencil.len());
        for (c, d) in direction.to_array().into_iter().enumerate().filter(|(_, d)| *d != 0.0) {
            for &(v, s) in stencil {
                columns.push(self.points.column(v as usize, c));
                self.factors.push(s * d);
            }
        }
        self.elements.push(&columns, 1);
        self.targets.push(target);
        self
    }
}

impl ResidualBlock for PinnedLimits {
    fn name(&self) -> &str {
        "pinned limits"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        for (e, (target, r)) in self.targets.iter().zip(residuals).enumerate() {
            // One row an element, so that the factors lie as the Jacobian does.
            let factors = &self.factors[self.elements.jacobian_range(e)];
            let columns = self.elements.columns(e);
            *r = factors.iter().zip(columns).map(|(f, &c)| f * x[c]).sum::<f64>() - target;
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        jacobian.copy_from_slice(&self.factors);
    }

    fn is_linear(&self) -> bool {
        true
    }
}
