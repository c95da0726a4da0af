//! Minimum-norm Newton steps onto a set of equations that depend on one another.

use gp_solver::{ResidualBlock, SolverError, SparseCholesky, SymmetricPattern};

/// Shift of `J S Sᵀ Jᵀ`, whose rows depend on one another: a net has three equations too many
/// for every closed face loop. Small against the shares of independent rows, which are about 1.
const SHIFT: f64 = 1e-9;

/// Solves `C(z) = 0` by `z ← z − S² Jᵀ (J S² Jᵀ + shift)⁻¹ C`, the shortest step in the scaled
/// unknowns; symbolic work is done once.
pub(crate) struct Polish<'a, B> {
    block: &'a B,
    /// Squared natural size of every unknown; zero where it is fixed.
    sizes: Vec<f64>,
    cholesky: SparseCholesky,
    /// Per product: slot in the matrix, the two Jacobian entries, the unknown.
    products: Vec<[u32; 4]>,
    values: Vec<f64>,
    residuals: Vec<f64>,
    jacobian: Vec<f64>,
}

impl<'a, B: ResidualBlock> Polish<'a, B> {
    pub(crate) fn new(block: &'a B, sizes: Vec<f64>) -> Result<Self, SolverError> {
        let elements = block.elements();
        let rows = elements.rows_total();
        let mut by_column: Vec<Vec<(u32, u32)>> = vec![Vec::new(); sizes.len()];
        for e in 0..elements.len() {
            let (columns, begin) = (elements.columns(e), elements.jacobian_range(e).start);
            for (r, row) in elements.rows(e).enumerate() {
                for (k, &c) in columns.iter().enumerate() {
                    let at = begin + r * columns.len() + k;
                    by_column[c].push((row as u32, at as u32));
                }
            }
        }
        let pairs = by_column.iter().flat_map(|list| {
            (0..list.len())
                .flat_map(move |a| (0..a).map(move |b| (list[a].0 as usize, list[b].0 as usize)))
        });
        let pattern = SymmetricPattern::new(rows, pairs)?;
        let mut products = Vec::new();
        for (c, list) in by_column.iter().enumerate() {
            for (a, &(row, at)) in list.iter().enumerate() {
                for &(other, there) in &list[..=a] {
                    let slot = pattern.slot(row as usize, other as usize).unwrap_or_default();
                    products.push([slot as u32, at, there, c as u32]);
                }
            }
        }
        Ok(Self {
            block,
            sizes,
            values: vec![0.0; pattern.len()],
            residuals: vec![0.0; rows],
            jacobian: vec![0.0; elements.jacobian_len()],
            cholesky: SparseCholesky::new(pattern)?,
            products,
        })
    }

    /// Largest residual at `x`.
    pub(crate) fn residual_max(&mut self, x: &[f64]) -> f64 {
        self.block.residuals(x, &mut self.residuals);
        self.residuals.iter().fold(0.0, |m, r| if r.is_nan() { f64::NAN } else { r.abs().max(m) })
    }

    /// One step; returns the largest residual before it.
    pub(crate) fn step(&mut self, x: &mut [f64]) -> Result<f64, SolverError> {
        self.block.linearize(x, &mut self.residuals, &mut self.jacobian);
        let before = self.residuals.iter().fold(0.0_f64, |m, r| m.max(r.abs()));
        self.values.fill(0.0);
        for &[slot, a, b, c] in &self.products {
            self.values[slot as usize] +=
                self.jacobian[a as usize] * self.jacobian[b as usize] * self.sizes[c as usize];
        }
        for &start in &self.cholesky.pattern().column_starts()[..self.residuals.len()] {
            self.values[start] += SHIFT;
        }
        self.cholesky.factor(&self.values)?;
        self.cholesky.solve_in_place(&mut self.residuals);
        let elements = self.block.elements();
        for e in 0..elements.len() {
            let (columns, begin) = (elements.columns(e), elements.jacobian_range(e).start);
            for (r, row) in elements.rows(e).enumerate() {
                let y = self.residuals[row];
                for (k, &c) in columns.iter().enumerate() {
                    x[c] -= self.sizes[c] * self.jacobian[begin + r * columns.len() + k] * y;
                }
            }
        }
        Ok(before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gp_solver::QuadraticBuilder;

    #[test]
    fn dependent_equations_are_met_by_the_shortest_step() {
        // x y = 1 twice: Newton's shortest step from (1, 0) goes along the gradient (0, 1).
        let mut equations = QuadraticBuilder::new("twice");
        for _ in 0..2 {
            equations.equation(1.0).product(0, 1, 1.0).constant(-1.0);
        }
        let block = equations.build();
        let mut polish = Polish::new(&block, vec![1.0, 1.0]).unwrap();
        let mut x = [1.0, 0.0];
        polish.step(&mut x).unwrap();
        assert!((x[0] - 1.0).abs() < 1e-8 && (x[1] - 1.0).abs() < 1e-8, "{x:?}");
        for _ in 0..4 {
            polish.step(&mut x).unwrap();
        }
        assert!(polish.residual_max(&x) < 1e-15);
    }

    #[test]
    fn unknowns_of_size_zero_stay() {
        let mut equations = QuadraticBuilder::new("product");
        equations.equation(1.0).product(0, 1, 1.0).constant(-2.0);
        let block = equations.build();
        let mut polish = Polish::new(&block, vec![0.0, 1.0]).unwrap();
        let mut x = [4.0, 1.0];
        for _ in 0..4 {
            polish.step(&mut x).unwrap();
        }
        assert_eq!(x[0], 4.0);
        assert!((x[1] - 0.5).abs() < 1e-15);
    }
}
