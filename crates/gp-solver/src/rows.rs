//! All rows of a problem as one block.

use crate::block::{Block, ResidualBlock};
use crate::elements::Elements;
use crate::error::SolverError;
use crate::problem::{BlockId, Problem, Slot};
use crate::variables::Variables;

/// The residual rows of all blocks of a problem, weights included, one block after the other: the
/// equations that [`MinNormProjection`](crate::MinNormProjection) solves may come from several
/// blocks.
///
/// ```
/// use gp_solver::{Closeness, Problem, ResidualBlock, Rows};
/// let mut problem = Problem::new(2);
/// let first = problem.add(Closeness::new("first", vec![1.0, 2.0], vec![1.0; 2]));
/// problem.add(Closeness::new("second", vec![5.0, 5.0], vec![1.0; 2]));
/// problem.set_weight(first, 3.0)?;
/// let rows = Rows::of(problem)?;
/// let mut residuals = [0.0; 4];
/// rows.residuals(&[2.0, 2.0], &mut residuals);
/// assert_eq!(residuals, [3.0, 0.0, -3.0, -3.0]);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
pub struct Rows<'a> {
    problem: Problem<'a>,
    elements: Elements,
}

impl<'a> Rows<'a> {
    /// The rows of `problem`.
    ///
    /// # Errors
    /// What [`SolverError`] says of malformed blocks, [`SolverError::NoRows`] for energies.
    pub fn of(problem: Problem<'a>) -> Result<Self, SolverError> {
        problem.check()?;
        let mut elements = Elements::new();
        for slot in &problem.slots {
            if let Block::Energy(block) = &slot.block {
                return Err(SolverError::NoRows { block: block.name().to_owned() });
            }
            let own = slot.block.elements();
            for e in 0..own.len() {
                elements.push(own.columns(e), own.rows(e).len());
            }
        }
        Ok(Self { problem, elements })
    }

    /// The variables of the problem.
    #[must_use]
    pub fn variables(&self) -> &Variables {
        self.problem.variables()
    }

    /// Names and handles of the blocks, in order.
    pub fn blocks(&self) -> impl Iterator<Item = (BlockId, &str)> {
        self.problem.blocks()
    }

    /// Weighs a block so that the longest gradient among its rows, `max |S ∇r|` with the sizes
    /// `scale` of the unknowns, is 1 at `x`: to first order a row then says how far, in these sizes,
    /// the unknowns are from satisfying it, whatever unit it is written in. A block whose gradients
    /// all vanish keeps its weight.
    ///
    /// # Errors
    /// [`SolverError::NoSuchBlock`], [`SolverError::BadOption`] if a gradient is not finite.
    ///
    /// # Panics
    /// If there is not one size and one value for every unknown.
    pub fn normalize(
        &mut self,
        block: BlockId,
        x: &[f64],
        scale: &[f64],
    ) -> Result<(), SolverError> {
        let unknowns = self.problem.unknowns();
        assert!(x.len() == unknowns && scale.len() == unknowns, "one value per unknown");
        let slot = self.problem.slot(block)?;
        let Block::Residual(rows) = &slot.block else { return Ok(()) };
        let elements = rows.elements();
        let mut residuals = vec![0.0; elements.rows_total()];
        let mut jacobian = vec![0.0; elements.jacobian_len()];
        rows.linearize(x, &mut residuals, &mut jacobian);
        let mut longest = 0.0_f64;
        for e in 0..elements.len() {
            let columns = elements.columns(e);
            let values = &jacobian[elements.jacobian_range(e)];
            for row in values.chunks_exact(columns.len().max(1)) {
                let square = |(&value, &c): (&f64, &usize)| (value * scale[c]).powi(2);
                longest = longest.max(row.iter().zip(columns).map(square).sum::<f64>());
            }
        }
        if longest > 0.0 {
            self.problem.set_weight(block, 1.0 / longest.sqrt())?;
        }
        Ok(())
    }

    fn each(&self, mut visit: impl FnMut(&dyn ResidualBlock, f64, usize, usize)) {
        let (mut row, mut value) = (0, 0);
        for Slot { block, weight } in &self.problem.slots {
            if let Block::Residual(rows) = block {
                visit(&**rows, *weight, row, value);
                row += rows.elements().rows_total();
                value += rows.elements().jacobian_len();
            }
        }
    }
}

impl ResidualBlock for Rows<'_> {
    fn name(&self) -> &str {
        "equations"
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn refresh(&mut self, x: &[f64]) {
        self.problem.slots.iter_mut().for_each(|slot| slot.block.refresh(x));
    }

    fn admits(&self, x: &[f64]) -> bool {
        self.problem.slots.iter().all(|slot| slot.block.admits(x))
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        self.each(|block, weight, row, _| {
            let own = &mut residuals[row..][..block.elements().rows_total()];
            block.residuals(x, own);
            own.iter_mut().for_each(|r| *r *= weight);
        });
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.each(|block, weight, row, value| {
            let own = &mut residuals[row..][..block.elements().rows_total()];
            let values = &mut jacobian[value..][..block.elements().jacobian_len()];
            block.linearize(x, own, values);
            own.iter_mut().chain(values).for_each(|r| *r *= weight);
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::check::check_jacobian;
    use crate::quadratic::QuadraticBuilder;

    #[test]
    fn rows_of_two_blocks_have_their_weights_and_derivatives() {
        let circle = |size: f64| {
            let mut rows = QuadraticBuilder::new("circle");
            let row = rows.equation(1.0).constant(-size);
            row.product(0, 0, size).product(1, 1, size);
            rows.build()
        };
        let mut problem = Problem::new(3);
        problem.add(circle(1.0));
        let large = problem.add(circle(1e6));
        problem.set_weight(large, 0.25).unwrap();
        let mut rows = Rows::of(problem).unwrap();
        let x = [0.6, 0.9, 2.0];
        assert!(check_jacobian(&rows, &x).unwrap().unwrap().error < 1e-8);
        // In units of its own gradient a row does not depend on how it is written.
        let mut residuals = [0.0; 2];
        let ids: Vec<BlockId> = rows.blocks().map(|(id, _)| id).collect();
        for id in ids {
            rows.normalize(id, &x, &[1.0, 1.0, 1.0]).unwrap();
        }
        rows.residuals(&x, &mut residuals);
        assert!((residuals[0] - residuals[1]).abs() < 1e-12);
        assert!((residuals[0] - 0.17 / (1.2_f64.hypot(1.8))).abs() < 1e-12);
    }
}
