//! Linear combinations of vertex vectors.

use gp_solver::{Elements, Group, ResidualBlock};

/// Linear combinations of vertex vectors that are to vanish, such as second differences:
///
/// ```text
/// residual[3 k + c] = Σ_i a_ki · v_i,c        jacobian = a_ki
/// ```
///
/// with `v_i` the vector of vertex `i` in a group of three components. The unit is that of the
/// vectors. Fairness of positions and of normals (Shi et al. 2014, §3.2: `f_fair`), and
/// `ν₀ + ν₂ − ν₁ − ν₃` of every face, which pulls shape parameters to 1, are of this kind.
///
/// ```
/// use gp_solver::{ResidualBlock, Variables};
/// use hyperbolic_nets::blocks::Combinations;
/// let mut variables = Variables::new();
/// let positions = variables.add("positions", 3, 3);
/// let straight = Combinations::new("fairness", positions, [&[(0, 1.0), (1, -2.0), (2, 1.0)][..]]);
/// let mut residuals = [0.0; 3];
/// straight.residuals(&[0.0, 0.0, 0.0, 1.0, 0.5, 0.0, 2.0, 0.0, 0.0], &mut residuals);
/// assert_eq!(residuals, [0.0, -1.0, 0.0]);
/// ```
#[derive(Clone, Debug)]
pub struct Combinations {
    name: &'static str,
    elements: Elements,
    coefficients: Vec<f64>,
    has_steady_weight: bool,
}

impl Combinations {
    /// Each combination is a list of vertices with their coefficients.
    ///
    /// # Panics
    /// If the vectors of the group have not three components.
    pub fn new<'a>(
        name: &'static str,
        vectors: Group,
        combinations: impl IntoIterator<Item = &'a [(usize, f64)]>,
    ) -> Self {
        assert_eq!(vectors.width(), 3, "vectors have three components");
        let mut elements = Elements::new();
        let mut coefficients = Vec::new();
        for combination in combinations {
            for c in 0..3 {
                let columns: Vec<usize> =
                    combination.iter().map(|&(v, _)| vectors.column(v, c)).collect();
                elements.push(&columns, 1);
                coefficients.extend(combination.iter().map(|&(_, value)| value));
            }
        }
        Self { name, elements, coefficients, has_steady_weight: true }
    }

    /// For a block that is weighed anew every few steps: its part of the matrix is then formed with
    /// that of the other blocks rather than kept.
    #[must_use]
    pub fn with_changing_weight(self) -> Self {
        Self { has_steady_weight: false, ..self }
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
        for (e, residual) in residuals.iter_mut().enumerate() {
            let row = &self.coefficients[self.elements.jacobian_range(e)];
            let terms = self.elements.columns(e).iter().zip(row);
            *residual = terms.map(|(&c, &value)| value * x[c]).sum::<f64>();
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        jacobian.copy_from_slice(&self.coefficients);
    }

    fn is_linear(&self) -> bool {
        self.has_steady_weight
    }
}
