//! A problem as a plain function: energy, gradient and element matrices without a plan.
//!
//! For callers that join blocks to a function of their own, such as an objective of L-BFGS.

use crate::block::Block;
use crate::problem::Problem;

/// Is shown an element: its unknowns, its gradient and its Hessian, row-major.
pub type ElementVisitor<'v> = dyn FnMut(&[usize], &[f64], &[f64]) + 'v;

impl Problem<'_> {
    /// Lets the blocks update their lagged quantities.
    pub fn refresh(&mut self, x: &[f64]) {
        self.slots.iter_mut().for_each(|slot| slot.block.refresh(x));
    }

    /// Whether every block admits `x`, see [`ResidualBlock::admits`](crate::ResidualBlock::admits).
    #[must_use]
    pub fn admits(&self, x: &[f64]) -> bool {
        self.slots.iter().all(|slot| slot.block.admits(x))
    }

    /// The energy at `x`: infinite where a block does not admit `x`.
    #[must_use]
    pub fn energy(&self, x: &[f64]) -> f64 {
        if !self.admits(x) {
            return f64::INFINITY;
        }
        let of = |(block, weight): (&Block<'_>, f64)| match block {
            Block::Residual(rows) => {
                let mut residuals = vec![0.0; rows.elements().rows_total()];
                rows.residuals(x, &mut residuals);
                0.5 * weight * weight * residuals.iter().map(|r| r * r).sum::<f64>()
            }
            Block::Energy(energy) => weight * energy.energy(x),
            Block::Removed => 0.0,
        };
        self.slots.iter().map(|slot| of((&slot.block, slot.weight))).sum()
    }

    /// The energy at `x`, as [`energy`](Self::energy); adds its gradient.
    ///
    /// # Panics
    /// If a slice is shorter than the number of unknowns.
    ///
    /// ```
    /// use gp_solver::{Closeness, Problem};
    /// let mut problem = Problem::new(2);
    /// problem.add(Closeness::new("here", vec![1.0, 2.0], vec![1.0, 1.0]));
    /// let mut gradient = [0.0; 2];
    /// assert_eq!(problem.add_gradient(&[1.5, 2.0], &mut gradient), 0.125);
    /// assert_eq!(gradient, [0.5, 0.0]);
    /// ```
    pub fn add_gradient(&self, x: &[f64], gradient: &mut [f64]) -> f64 {
        if !self.admits(x) {
            return f64::INFINITY;
        }
        self.quadratic_models(x, &mut |columns, element, _| {
            for (&column, g) in columns.iter().zip(element) {
                gradient[column] += g;
            }
        })
    }

    /// The energy at `x` with its quadratic model, element by element: `visit` is shown the
    /// unknowns of every element, its gradient and its Hessian (Gauss-Newton's for residual
    /// rows), row-major, weights included.
    pub fn quadratic_models(&self, x: &[f64], visit: &mut ElementVisitor<'_>) -> f64 {
        let mut total = 0.0;
        for slot in &self.slots {
            let elements = slot.block.elements();
            let mut values = vec![0.0; elements.rows_total()];
            let mut derivatives = vec![0.0; elements.jacobian_len()];
            let (mut gradient, mut hessian) = (Vec::new(), Vec::new());
            let weight = slot.weight;
            match &slot.block {
                Block::Residual(rows) => {
                    rows.linearize(x, &mut values, &mut derivatives);
                    total += 0.5 * weight * weight * values.iter().map(|r| r * r).sum::<f64>();
                    for e in 0..elements.len() {
                        let columns = elements.columns(e);
                        let n = columns.len();
                        let jacobian = &derivatives[elements.jacobian_range(e)];
                        reset(&mut gradient, n);
                        reset(&mut hessian, n * n);
                        for (row, r) in jacobian.chunks(n.max(1)).zip(&values[elements.rows(e)]) {
                            for (i, a) in row.iter().enumerate() {
                                let a = weight * weight * a;
                                gradient[i] += a * r;
                                for (h, b) in hessian[i * n..(i + 1) * n].iter_mut().zip(row) {
                                    *h += a * b;
                                }
                            }
                        }
                        visit(columns, &gradient, &hessian);
                    }
                }
                Block::Energy(energy) => {
                    total += weight * energy.quadratic_model(x, &mut values, &mut derivatives);
                    values.iter_mut().chain(&mut derivatives).for_each(|v| *v *= weight);
                    for e in 0..elements.len() {
                        let hessian = &derivatives[elements.jacobian_range(e)];
                        visit(elements.columns(e), &values[elements.rows(e)], hessian);
                    }
                }
                Block::Removed => {}
            }
        }
        total
    }

    /// The unknowns of every element of every block.
    pub fn elements(&self) -> impl Iterator<Item = &[usize]> {
        self.slots.iter().flat_map(|slot| {
            let elements = slot.block.elements();
            (0..elements.len()).map(move |e| elements.columns(e))
        })
    }
}

fn reset(values: &mut Vec<f64>, len: usize) {
    values.clear();
    values.resize(len, 0.0);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Factorization, QuadraticBuilder, System};

    #[test]
    fn values_are_those_of_the_planned_system() {
        let mut rows = QuadraticBuilder::new("rows");
        rows.equation(2.0).product(0, 1, 1.0).linear(2, -1.0).constant(0.5);
        rows.equation(1.0).quadratic(1, 1, 3.0).linear(0, 1.0);
        let made = || {
            let mut problem = Problem::new(3);
            let block = problem.add(rows.clone().build());
            problem.set_weight(block, 1.5).unwrap();
            problem
        };
        let x = [0.3, -0.7, 1.1];
        let problem = made();
        let mut gradient = vec![0.0; 3];
        let energy = problem.add_gradient(&x, &mut gradient);
        let mut matrix = [[0.0; 3]; 3];
        problem.quadratic_models(&x, &mut |columns, _, hessian| {
            for (i, &row) in columns.iter().enumerate() {
                for (j, &column) in columns.iter().enumerate() {
                    matrix[row][column] += hessian[i * columns.len() + j];
                }
            }
        });
        let mut system = System::new(made(), Factorization::Auto).unwrap();
        let want = system.linearize(&x).unwrap();
        assert!((energy - want).abs() < 1e-14 && (problem.energy(&x) - want).abs() < 1e-14);
        for (position, &unknown) in system.order().iter().enumerate() {
            assert!((gradient[unknown] - system.gradient()[position]).abs() < 1e-14);
        }
        for (i, j, value) in system.normal_triplets() {
            let (i, j) = (system.order()[i], system.order()[j]);
            assert!((matrix[i][j] - value).abs() < 1e-13, "{i} {j}");
        }
    }
}
