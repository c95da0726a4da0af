//! A linearised system as values one can look at: triplets, sparse matrices, Matrix Market files.

use super::system::System;
use crate::block::Block;
use crate::linear::Factor;
#[cfg(feature = "sparse")]
use crate::linear::SymmetricPattern;

/// A matrix as (row, column, value), each place at most once.
pub type Triplets = Vec<(usize, usize, f64)>;

impl System<'_> {
    /// The Jacobian of all residual rows at the last linearisation, weights included: rows in the
    /// order of the blocks, columns by position (the unknown behind each is
    /// [`order`](Self::order)).
    ///
    /// # Example
    /// ```
    /// use gp_solver::{Factorization, Problem, QuadraticBuilder, System};
    /// let mut product = QuadraticBuilder::new("area");
    /// product.equation(1.0).product(0, 1, 1.0).constant(-6.0); // x y = 6
    /// let mut problem = Problem::new(2);
    /// problem.add(product.build());
    /// let mut system = System::new(problem, Factorization::Band)?;
    /// system.linearize(&[2.0, 5.0])?;
    /// let mut entries = system.jacobian_triplets();
    /// entries.iter_mut().for_each(|entry| entry.1 = system.order()[entry.1]); // by unknown
    /// entries.sort_by_key(|entry| entry.1);
    /// assert_eq!(entries, [(0, 0, 5.0), (0, 1, 2.0)]);
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    #[must_use]
    pub fn jacobian_triplets(&self) -> Triplets {
        let mut triplets = Vec::new();
        let mut first = 0;
        for (b, slot) in self.problem().slots.iter().enumerate() {
            let Block::Residual(rows) = &slot.block else { continue };
            let elements = rows.elements();
            let entries = self.plan().triplets(b, elements, self.derivatives(b));
            triplets.extend(entries.map(|(i, j, value)| (first + i, j, value)));
            first += elements.rows_total();
        }
        triplets
    }

    /// The lower triangle of the normal matrix `JᵀJ` (and the Hessians of energies) at the last
    /// linearisation, by position.
    ///
    /// # Example
    /// ```
    /// use gp_solver::{Closeness, Factorization, Problem, System};
    /// let mut problem = Problem::new(2);
    /// problem.add(Closeness::new("target", vec![1.0, 1.0], vec![3.0, 3.0]));
    /// let mut system = System::new(problem, Factorization::Band)?;
    /// system.linearize(&[0.0, 0.0])?;
    /// assert_eq!(system.normal_triplets(), [(0, 0, 9.0), (1, 1, 9.0)]);
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    #[must_use]
    pub fn normal_triplets(&self) -> Triplets {
        let (n, matrix) = (self.variables(), self.matrix());
        #[cfg(feature = "sparse")]
        let columns = |pattern: &SymmetricPattern| -> Triplets {
            let rows = pattern.rows();
            (0..n)
                .flat_map(|j| {
                    let column = pattern.column_starts()[j]..pattern.column_starts()[j + 1];
                    column.map(move |k| (rows[k] as usize, j, matrix[k]))
                })
                .collect()
        };
        match self.factor() {
            Factor::Band(band) => (0..n)
                .flat_map(|j| {
                    let column = j..n.min(j + band.half_bandwidth() + 1);
                    column.map(move |i| (i, j, matrix[band.slot(i, j)]))
                })
                .filter(|entry| entry.2 != 0.0)
                .collect(),
            #[cfg(feature = "sparse")]
            Factor::Sparse { cholesky, .. } => columns(cholesky.pattern()),
            #[cfg(feature = "sparse")]
            Factor::Dissected { cholesky, .. } => columns(cholesky.pattern()),
        }
    }

    /// The Jacobian at the last linearisation as a sparse matrix, see
    /// [`jacobian_triplets`](Self::jacobian_triplets).
    #[cfg(feature = "sparse")]
    #[must_use]
    pub fn jacobian(&self) -> sprs::CsMat<f64> {
        let mut triplets = sprs::TriMat::new((self.rows(), self.variables()));
        self.jacobian_triplets()
            .iter()
            .for_each(|&(i, j, value)| triplets.add_triplet(i, j, value));
        triplets.to_csc()
    }

    /// Jacobian, residuals and gradient at the last linearisation as texts in Matrix Market form,
    /// with the names of their files.
    ///
    /// # Errors
    /// If the text cannot be made (out of memory).
    #[cfg(feature = "sparse")]
    pub fn matrix_market(&self) -> std::io::Result<Vec<(&'static str, Vec<u8>)>> {
        let mut jacobian = Vec::new();
        sprs::io::write_matrix_market_to_bufwrite(&mut jacobian, &self.jacobian())?;
        let vector = |values: &mut dyn Iterator<Item = f64>| {
            let lines: Vec<String> = values.map(|value| format!("{value:e}\n")).collect();
            let head = "%%MatrixMarket matrix array real general\n";
            format!("{head}{} 1\n{}", lines.len(), lines.concat()).into_bytes()
        };
        let slots = self.problem().slots.iter().enumerate();
        let rows = slots.filter(|(_, slot)| matches!(slot.block, Block::Residual(_)));
        let residuals = vector(&mut rows.flat_map(|(b, _)| self.residuals_of(b).iter().copied()));
        let gradient = vector(&mut self.gradient().iter().copied());
        Ok(vec![
            ("jacobian.mtx", jacobian),
            ("residuals.mtx", residuals),
            ("gradient.mtx", gradient),
        ])
    }
}
