//! Quadratic programs some unknowns of which are whole numbers.

use rayon::prelude::*;

use crate::error::SolverError;
use crate::linear::{SparseCholesky, SymmetricPattern};

/// Share of the mean diagonal that is added to it, so that what no square touches stays at zero.
const SHIFT: f64 = 1e-13;

/// Minimises a sum of squares `Σ ½ w (a·x − t)²` of which the first unknowns are real and sparsely
/// coupled, and the others, few, are whole numbers.
///
/// The real ones are eliminated by one Cholesky factorisation; what is left is a small dense program
/// of whole numbers, [`Eliminated`].
///
/// # Example
/// ```
/// use gp_solver::MixedQp;
/// // (x − k/2)² + (x − 0.9)² is least at k = 2, x = 0.95.
/// let mut qp = MixedQp::new(1, 1, [[0_u32]].iter())?;
/// qp.square(&[(0, 1.0), (1, -0.5)], 0.0, 2.0);
/// qp.square(&[(0, 1.0)], 0.9, 2.0);
/// let eliminated = qp.eliminate(None)?;
/// let k = eliminated.lattice().minimize();
/// assert_eq!(k, [2.0]);
/// assert!((eliminated.reals(&k)[0] - 0.95).abs() < 1e-12);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
pub struct MixedQp {
    reals: usize,
    integers: usize,
    cholesky: SparseCholesky,
    /// Entries of the real block, as the pattern has them.
    values: Vec<f64>,
    /// `coupling[k * reals + r]`.
    coupling: Vec<f64>,
    /// `block[k * integers + l]`, symmetric.
    block: Vec<f64>,
    gradient: Vec<f64>,
}

impl MixedQp {
    /// A program without squares; each group names real unknowns (sorted) that a square may couple.
    ///
    /// # Errors
    /// [`SolverError::OutOfMemory`], [`SolverError::TooLarge`].
    ///
    /// # Panics
    /// If a group is not sorted or names an unknown that is not real.
    pub fn new<G: AsRef<[u32]>>(
        reals: usize,
        integers: usize,
        groups: impl Iterator<Item = G>,
    ) -> Result<Self, SolverError> {
        let cholesky = SparseCholesky::new(SymmetricPattern::from_cliques(reals, groups))?;
        Ok(Self {
            values: vec![0.0; cholesky.pattern().len()],
            coupling: vec![0.0; reals * integers],
            block: vec![0.0; integers * integers],
            gradient: vec![0.0; reals + integers],
            reals,
            integers,
            cholesky,
        })
    }

    /// Takes all squares out again.
    pub fn clear(&mut self) {
        for list in [&mut self.values, &mut self.coupling, &mut self.block, &mut self.gradient] {
            list.fill(0.0);
        }
    }

    /// Adds `½ weight (Σ entries − target)²`; unknowns from the number of real ones on are whole.
    ///
    /// # Panics
    /// If no group holds the real unknowns of the square.
    pub fn square(&mut self, entries: &[(usize, f64)], target: f64, weight: f64) {
        let (reals, integers) = (self.reals, self.integers);
        for (at, &(i, a)) in entries.iter().enumerate() {
            self.gradient[i] -= weight * target * a;
            for &(j, b) in &entries[..=at] {
                let value = weight * a * b;
                match (i < reals, j < reals) {
                    (true, true) => {
                        let slot = self.cholesky.pattern().slot(i, j);
                        let slot = slot.expect("a group holds the unknowns of a square");
                        self.values[slot] += value;
                    }
                    (true, false) => self.coupling[(j - reals) * reals + i] += value,
                    (false, true) => self.coupling[(i - reals) * reals + j] += value,
                    (false, false) => {
                        let (k, l) = (i - reals, j - reals);
                        self.block[k * integers + l] += value;
                        if k != l {
                            self.block[l * integers + k] += value;
                        }
                    }
                }
            }
        }
    }

    /// The quadratic form of the real unknowns alone and its pattern; that of `held` is coupled to
    /// none.
    #[must_use]
    pub fn real_block(&self, held: Option<usize>) -> (&SymmetricPattern, Vec<f64>) {
        let pattern = self.cholesky.pattern();
        let starts = pattern.column_starts();
        let mut values = self.values.clone();
        if let Some(held) = held {
            for column in 0..self.reals {
                for slot in starts[column]..starts[column + 1] {
                    let row = pattern.rows()[slot] as usize;
                    if held == row || held == column {
                        values[slot] = f64::from(u8::from(row == column));
                    }
                }
            }
        }
        (pattern, values)
    }

    /// Solves for the real unknowns as functions of the whole ones; `held` is a real unknown that
    /// stays at zero.
    ///
    /// # Errors
    /// [`SolverError::NotPositiveDefinite`] if the squares leave real unknowns undetermined.
    pub fn eliminate(&mut self, held: Option<usize>) -> Result<Eliminated, SolverError> {
        let (reals, integers) = (self.reals, self.integers);
        let (pattern, mut values) = self.real_block(held);
        let diagonals = &pattern.column_starts()[..reals];
        let sum: f64 = diagonals.iter().map(|&s| values[s]).sum();
        let shift = (SHIFT * sum / reals.max(1) as f64).max(f64::MIN_POSITIVE);
        diagonals.iter().for_each(|&slot| values[slot] += shift);
        self.cholesky.factor(&values)?;
        let cholesky = &self.cholesky;
        let solved = |right: &[f64]| {
            let mut x = right.to_vec();
            if let Some(held) = held {
                x[held] = 0.0;
            }
            cholesky.solve_in_place(&mut x);
            x
        };
        let (gradient, rest) = self.gradient.split_at(reals);
        let base: Vec<f64> = solved(gradient).into_iter().map(|x| -x).collect();
        let columns: Vec<&[f64]> =
            (0..integers).map(|k| &self.coupling[k * reals..(k + 1) * reals]).collect();
        let response: Vec<Vec<f64>> = columns.par_iter().map(|column| solved(column)).collect();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
        let mut matrix = self.block.clone();
        matrix.par_chunks_mut(integers.max(1)).enumerate().for_each(|(k, row)| {
            row.iter_mut().zip(&response).for_each(|(entry, r)| *entry -= dot(columns[k], r));
        });
        for k in 0..integers {
            for l in 0..k {
                let mean = 0.5 * (matrix[k * integers + l] + matrix[l * integers + k]);
                matrix[k * integers + l] = mean;
                matrix[l * integers + k] = mean;
            }
        }
        let linear = rest.iter().zip(&columns).map(|(g, c)| g + dot(c, &base)).collect();
        Ok(Eliminated { matrix, linear, base, response })
    }
}

/// What is left of a [`MixedQp`] once its real unknowns are functions of the whole ones.
#[derive(Clone, Debug)]
pub struct Eliminated {
    matrix: Vec<f64>,
    linear: Vec<f64>,
    base: Vec<f64>,
    response: Vec<Vec<f64>>,
}

impl Eliminated {
    /// The program of the whole numbers, `½ kᵀS k + gᵀk`.
    #[must_use]
    pub fn lattice(&self) -> super::LatticeQp {
        super::LatticeQp::new(self.matrix.clone(), self.linear.clone())
    }

    /// The real unknowns that belong to these values of the others, whole or not.
    ///
    /// # Panics
    /// If there is not one value for each of the others.
    #[must_use]
    pub fn reals(&self, integers: &[f64]) -> Vec<f64> {
        assert_eq!(integers.len(), self.linear.len(), "one value per whole number");
        let mut x = self.base.clone();
        for (k, response) in integers.iter().zip(&self.response) {
            x.iter_mut().zip(response).for_each(|(x, r)| *x -= k * r);
        }
        x
    }
}
