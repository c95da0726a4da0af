//! What a problem is made of: variables and blocks.

use crate::block::{Block, EnergyBlock, ResidualBlock};
use crate::error::SolverError;
use crate::variables::Variables;

/// A block of a problem, to weigh it, to change it or to take it out again.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BlockId(pub(crate) usize);

/// A block and its weight.
pub(crate) struct Slot<'a> {
    pub(crate) block: Block<'a>,
    pub(crate) weight: f64,
}

/// Variables and the blocks that turn them into the energy
/// `E(x) = Σ ½ |w_b r_b(x)|² + Σ w_b e_b(x)`.
///
/// Blocks may borrow: pass `&mut block` to look at a block again after the solve.
///
/// ```
/// use gp_solver::{Closeness, Options, Problem, solve};
/// let mut problem = Problem::new(1);
/// let here = problem.add(Closeness::new("here", vec![1.0], vec![1.0]));
/// problem.add(Closeness::new("there", vec![6.0], vec![1.0]));
/// problem.set_weight(here, 2.0)?;
/// let mut x = [0.0];
/// solve(problem, &mut x, &Options::default())?;
/// assert!((x[0] - 2.0).abs() < 1e-6); // the mean, weighted by the squares
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
pub struct Problem<'a> {
    pub(crate) variables: Variables,
    pub(crate) slots: Vec<Slot<'a>>,
}

impl<'a> Problem<'a> {
    /// A problem without blocks; a number stands for that many unnamed unknowns.
    #[must_use]
    pub fn new(variables: impl Into<Variables>) -> Self {
        Self { variables: variables.into(), slots: Vec::new() }
    }

    /// The variables.
    #[must_use]
    pub fn variables(&self) -> &Variables {
        &self.variables
    }

    /// The variables, to fix some, order them or give their sizes.
    pub fn variables_mut(&mut self) -> &mut Variables {
        &mut self.variables
    }

    /// Number of unknowns, the fixed ones included.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.variables.len()
    }

    /// Adds residual rows.
    pub fn add(&mut self, block: impl ResidualBlock + 'a) -> BlockId {
        self.push(Block::Residual(Box::new(block)))
    }

    /// Adds an energy with its own gradient and Hessian.
    pub fn add_energy(&mut self, block: impl EnergyBlock + 'a) -> BlockId {
        self.push(Block::Energy(Box::new(block)))
    }

    pub(crate) fn push(&mut self, block: Block<'a>) -> BlockId {
        self.slots.push(Slot { block, weight: 1.0 });
        BlockId(self.slots.len() - 1)
    }

    /// Takes a block out; other handles stay good.
    ///
    /// # Errors
    /// [`SolverError::NoSuchBlock`].
    ///
    /// # Example
    /// ```
    /// use gp_solver::{Closeness, Problem};
    /// let mut problem = Problem::new(1);
    /// let here = problem.add(Closeness::new("here", vec![1.0], vec![1.0]));
    /// let there = problem.add(Closeness::new("there", vec![6.0], vec![1.0]));
    /// problem.remove(here)?;
    /// assert_eq!(problem.blocks().collect::<Vec<_>>(), [(there, "there")]);
    /// assert!(problem.weight(here).is_err());
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    pub fn remove(&mut self, block: BlockId) -> Result<(), SolverError> {
        self.slot(block)?.block = Block::Removed;
        Ok(())
    }

    /// Weighs a block: `weight` multiplies its residuals, or its energy.
    ///
    /// # Errors
    /// [`SolverError::NoSuchBlock`], [`SolverError::BadOption`] unless `0 ≤ weight < ∞`.
    ///
    /// # Example
    /// ```
    /// use gp_solver::{Closeness, Options, Problem, solve};
    /// let mut problem = Problem::new(1);
    /// problem.add(Closeness::new("here", vec![0.0], vec![1.0]));
    /// let there = problem.add(Closeness::new("there", vec![4.0], vec![1.0]));
    /// problem.set_weight(there, 3.0)?;
    /// assert_eq!(problem.weight(there)?, 3.0);
    /// // Least squares: the squares of the weights share the way.
    /// let mut x = [0.0];
    /// solve(problem, &mut x, &Options::default())?;
    /// assert!((x[0] - 4.0 * 9.0 / (1.0 + 9.0)).abs() < 1e-6);
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    pub fn set_weight(&mut self, block: BlockId, weight: f64) -> Result<(), SolverError> {
        if !(weight >= 0.0 && weight.is_finite()) {
            let need = "zero or more, and finite";
            return Err(SolverError::BadOption { name: "weight", value: weight, need });
        }
        self.slot(block)?.weight = weight;
        Ok(())
    }

    /// The weight of a block.
    ///
    /// # Errors
    /// [`SolverError::NoSuchBlock`].
    pub fn weight(&self, block: BlockId) -> Result<f64, SolverError> {
        match self.slots.get(block.0) {
            Some(Slot { block: Block::Residual(_) | Block::Energy(_), weight }) => Ok(*weight),
            _ => Err(SolverError::NoSuchBlock { block: block.0 }),
        }
    }

    /// Gives a block new values to measure against; its Jacobian stays.
    ///
    /// # Errors
    /// [`SolverError::NoSuchBlock`], [`SolverError::NoReference`].
    ///
    /// # Example
    /// ```
    /// use gp_solver::{Closeness, Options, Problem, QuadraticBuilder, solve};
    /// let mut line = QuadraticBuilder::new("line");
    /// line.equation(1.0).linear(0, 1.0).constant(-2.0);
    /// let mut problem = Problem::new(1);
    /// let target = problem.add(Closeness::new("target", vec![0.0], vec![1.0]));
    /// let line = problem.add(line.build());
    /// assert!(problem.set_reference(line, &[3.0]).is_err()); // it measures against nothing
    /// problem.set_reference(target, &[4.0])?;
    /// let mut x = [0.0];
    /// solve(problem, &mut x, &Options::default())?;
    /// assert!((x[0] - 3.0).abs() < 1e-6); // between the line x = 2 and the target
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    pub fn set_reference(&mut self, block: BlockId, reference: &[f64]) -> Result<(), SolverError> {
        let slot = self.slot(block)?;
        let done = match &mut slot.block {
            Block::Residual(rows) => rows.set_reference(reference),
            Block::Energy(_) | Block::Removed => false,
        };
        let fault = || SolverError::NoReference {
            block: slot.block.name().to_owned(),
            values: reference.len(),
        };
        done.then_some(()).ok_or_else(fault)
    }

    /// Names and handles of the blocks, in order.
    pub fn blocks(&self) -> impl Iterator<Item = (BlockId, &str)> {
        let there = self.slots.iter().enumerate();
        there
            .filter(|(_, slot)| !matches!(slot.block, Block::Removed))
            .map(|(b, slot)| (BlockId(b), slot.block.name()))
    }

    pub(crate) fn slot(&mut self, block: BlockId) -> Result<&mut Slot<'a>, SolverError> {
        match self.slots.get_mut(block.0) {
            Some(slot) if !matches!(slot.block, Block::Removed) => Ok(slot),
            _ => Err(SolverError::NoSuchBlock { block: block.0 }),
        }
    }

    /// Checks the blocks against the number of unknowns, and the order.
    ///
    /// # Errors
    /// What [`SolverError`] says of malformed blocks and orderings.
    pub fn check(&self) -> Result<(), SolverError> {
        let mut seen = Seen::new(self.unknowns());
        for slot in &self.slots {
            seen.check(&slot.block)?;
        }
        self.variables.check_order()
    }
}

/// Which unknowns the elements looked at last read.
pub(crate) struct Seen {
    stamps: Vec<usize>,
    stamp: usize,
}

impl Seen {
    pub(crate) fn new(unknowns: usize) -> Self {
        Self { stamps: vec![usize::MAX; unknowns], stamp: 0 }
    }

    /// Checks the columns of a block.
    pub(crate) fn check(&mut self, block: &Block<'_>) -> Result<(), SolverError> {
        let (elements, unknowns) = (block.elements(), self.stamps.len());
        let name = || block.name().to_owned();
        for element in 0..elements.len() {
            let columns = elements.columns(element);
            for &column in columns {
                if column >= unknowns {
                    return Err(SolverError::ColumnOutOfRange {
                        block: name(),
                        element,
                        column,
                        unknowns,
                    });
                }
                if self.stamps[column] == self.stamp {
                    return Err(SolverError::RepeatedColumn { block: name(), element, column });
                }
                self.stamps[column] = self.stamp;
            }
            let (rows, columns) = (elements.rows(element).len(), columns.len());
            if matches!(block, Block::Energy(_)) && rows != columns {
                return Err(SolverError::NotSquare { block: name(), element, rows, columns });
            }
            self.stamp += 1;
        }
        Ok(())
    }
}
