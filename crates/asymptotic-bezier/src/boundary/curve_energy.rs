//! The energy of the boundary curves as a quadratic function of the vertex torsions.

use gp_solver::{Elements, EnergyBlock, Group, Variables};

use crate::stages::TORSIONS;

/// The energy of one curve between two torsions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurveShare {
    /// Vertices at its start and end.
    pub ends: [usize; 2],
    /// The matrix `E` of the energy `tᵀ E t` with `t = (1, τ_start, τ_end)`, symmetric, for the
    /// torsions of the vertices.
    pub energy: [[f64; 3]; 3],
}

/// Half of `Σ ∫ |r″|² dt` (or of `Σ ∫ |r‴|² dt`) with everything but the vertex torsions minimised
/// out: `½ tᵀ E t` a curve, `t = (1, τ_start, τ_end)`. Gradient and Hessian are exact.
///
/// Wang et al. 2019, Eq. 3.4, whose four free parameters are the corner torsions here.
#[derive(Clone, Debug)]
pub struct CurveEnergy {
    curves: Vec<CurveShare>,
    elements: Elements,
}

/// One torsion per vertex.
pub(crate) fn torsion_variables(vertices: usize) -> (Variables, Group) {
    let mut variables = Variables::new();
    let torsions = variables.add(TORSIONS, vertices, 1);
    (variables, torsions)
}

impl CurveEnergy {
    /// The energy of the curves in the group of the torsions, one per vertex.
    #[must_use]
    pub fn new(curves: Vec<CurveShare>, torsions: Group) -> Self {
        let mut elements = Elements::new();
        curves.iter().for_each(|c| elements.push(&c.ends.map(|v| torsions.column(v, 0)), 2));
        Self { curves, elements }
    }
}

impl EnergyBlock for CurveEnergy {
    fn name(&self) -> &str {
        "curves"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn is_quadratic(&self) -> bool {
        true
    }

    fn energy(&self, x: &[f64]) -> f64 {
        let share = |(e, curve): (usize, &CurveShare)| {
            let columns = self.elements.columns(e);
            let t = [1.0, x[columns[0]], x[columns[1]]];
            let pairs = (0..9).map(|k| (k / 3, k % 3));
            0.5 * pairs.map(|(a, b)| curve.energy[a][b] * t[a] * t[b]).sum::<f64>()
        };
        self.curves.iter().enumerate().map(share).sum()
    }

    fn quadratic_model(&self, x: &[f64], gradients: &mut [f64], hessians: &mut [f64]) -> f64 {
        for (e, curve) in self.curves.iter().enumerate() {
            let columns = self.elements.columns(e);
            let t = [1.0, x[columns[0]], x[columns[1]]];
            let own = self.elements.rows(e);
            for (a, g) in gradients[own].iter_mut().enumerate() {
                *g = (0..3).map(|b| curve.energy[1 + a][b] * t[b]).sum();
            }
            let own = self.elements.jacobian_range(e);
            for (k, h) in hessians[own].iter_mut().enumerate() {
                *h = curve.energy[1 + k / 2][1 + k % 2];
            }
        }
        self.energy(x)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gp_solver::check_gradient;

    #[test]
    fn gradient_agrees_with_differences() {
        let (_, torsions) = torsion_variables(3);
        let energy = [[2.0, 0.3, -0.4], [0.3, 1.5, 0.2], [-0.4, 0.2, 0.9]];
        let curves = vec![CurveShare { ends: [0, 2], energy }, CurveShare { ends: [2, 1], energy }];
        let block = CurveEnergy::new(curves, torsions);
        let worst = check_gradient(&block, &[0.4, -0.7, 1.3]).unwrap().unwrap();
        assert!(worst.error < 1e-8, "{worst:?}");
    }
}
