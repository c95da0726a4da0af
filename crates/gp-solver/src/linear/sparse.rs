//! Sparse Cholesky by faer, which only this module and `dense` know, so that it is compiled once.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side};

use super::SymmetricPattern;
use crate::error::SolverError;

/// Supernodal Cholesky factorisation `A = L Lᵀ` in approximate minimum degree order: the pattern
/// is analysed once, then values are factored any number of times without allocation.
///
/// One thread always: faer's result bits depend on the number of threads, and its parallelism
/// within supernodes does not pay for matrices of our size.
///
/// ```
/// use gp_solver::{SparseCholesky, SymmetricPattern};
/// let pattern = SymmetricPattern::new(2, [(1, 0)])?;
/// let mut cholesky = SparseCholesky::new(pattern)?;
/// cholesky.factor(&[4.0, 2.0, 3.0])?; // columns (4, 2) and (3)
/// let mut x = [8.0, 8.0];
/// cholesky.solve_in_place(&mut x);
/// assert!((x[0] - 1.0).abs() < 1e-15 && (x[1] - 2.0).abs() < 1e-15);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
pub struct SparseCholesky {
    pattern: SymmetricPattern,
    symbolic: Option<(SymbolicSparseColMat<usize>, SymbolicCholesky<usize>)>,
    factor: Vec<f64>,
    memory: MemBuffer,
}

impl SparseCholesky {
    /// Analyses a pattern.
    ///
    /// # Errors
    /// [`SolverError::OutOfMemory`].
    pub fn new(pattern: SymmetricPattern) -> Result<Self, SolverError> {
        let n = pattern.size();
        if n == 0 {
            let memory = MemBuffer::new(faer::dyn_stack::StackReq::EMPTY);
            return Ok(Self { pattern, symbolic: None, factor: Vec::new(), memory });
        }
        let out_of_memory = |_| SolverError::OutOfMemory { size: n };
        let columns = SymbolicSparseColMat::new_checked(
            n,
            n,
            pattern.column_starts().to_vec(),
            None,
            pattern.rows().to_vec(),
        );
        let symbolic = factorize_symbolic_cholesky(
            columns.as_ref(),
            Side::Lower,
            SymmetricOrdering::Amd,
            CholeskySymbolicParams::default(),
        )
        .map_err(out_of_memory)?;
        let need = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let memory = MemBuffer::try_new(need).map_err(|_| SolverError::OutOfMemory { size: n })?;
        let factor = vec![0.0; symbolic.len_val()];
        Ok(Self { pattern, symbolic: Some((columns, symbolic)), factor, memory })
    }

    /// The pattern the values belong to.
    #[must_use]
    pub fn pattern(&self) -> &SymmetricPattern {
        &self.pattern
    }

    /// Number of stored values of the factor.
    #[must_use]
    pub fn factor_len(&self) -> usize {
        self.factor.len()
    }

    /// Multiplications one factorisation takes, as foreseen from the pattern.
    #[must_use]
    pub fn flops(&self) -> f64 {
        let squares = |count: usize, below: usize| -> f64 {
            (0..count).map(|k| ((count - k + below) as f64).powi(2)).sum()
        };
        match self.symbolic.as_ref().map(|(_, s)| s.raw()) {
            None => 0.0,
            Some(SymbolicCholeskyRaw::Simplicial(s)) => {
                s.col_ptr().windows(2).map(|w| ((w[1] - w[0]) as f64).powi(2)).sum()
            }
            Some(SymbolicCholeskyRaw::Supernodal(s)) => (0..s.n_supernodes())
                .map(|k| {
                    let width = s.supernode_end()[k] - s.supernode_begin()[k];
                    let rows = s.col_ptr_for_row_idx()[k + 1] - s.col_ptr_for_row_idx()[k];
                    squares(width, rows)
                })
                .sum(),
        }
    }

    /// Factors the matrix with the given values, one per entry of the pattern.
    ///
    /// # Errors
    /// [`SolverError::NotPositiveDefinite`] names the unknown (in the caller's numbering) whose
    /// pivot failed.
    ///
    /// # Panics
    /// If `values` does not match the pattern.
    pub fn factor(&mut self, values: &[f64]) -> Result<(), SolverError> {
        assert_eq!(values.len(), self.pattern.len(), "one value per entry of the pattern");
        let Some((columns, symbolic)) = &self.symbolic else { return Ok(()) };
        let matrix = SparseColMatRef::new(columns.as_ref(), values);
        let stack = MemStack::new(&mut self.memory);
        let failed = symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                matrix,
                Side::Lower,
                Default::default(),
                Par::Seq,
                stack,
                Default::default(),
            )
            .err();
        if let Some(LltError::NonPositivePivot { index }) = failed {
            // faer 0.24 counts from one in its simplicial code and from zero in the supernodal.
            let index = match symbolic.raw() {
                SymbolicCholeskyRaw::Simplicial(_) => index.saturating_sub(1),
                SymbolicCholeskyRaw::Supernodal(_) => index,
            };
            let variable = symbolic.perm().map_or(index, |perm| perm.arrays().0[index]);
            return Err(SolverError::NotPositiveDefinite { variable });
        }
        // A NaN slips through some comparisons, so the factor's own sum is the witness.
        if !self.factor.iter().sum::<f64>().is_finite() {
            return Err(SolverError::NotPositiveDefinite { variable: self.first_bad(values) });
        }
        Ok(())
    }

    /// The first column with a value that is not finite, else 0.
    fn first_bad(&self, values: &[f64]) -> usize {
        let starts = self.pattern.column_starts();
        (0..self.pattern.size())
            .find(|&j| values[starts[j]..starts[j + 1]].iter().any(|v| !v.is_finite()))
            .unwrap_or(0)
    }

    /// Replaces `rhs` by the solution of `A x = rhs` for the matrix factored last.
    ///
    /// # Panics
    /// If `rhs` has the wrong length.
    pub fn solve_in_place(&self, rhs: &mut [f64]) {
        assert_eq!(rhs.len(), self.pattern.size(), "one value per row");
        let Some((_, symbolic)) = &self.symbolic else { return };
        let n = rhs.len();
        let mut memory = MemBuffer::new(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq));
        LltRef::new(symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(rhs, n, 1),
            Par::Seq,
            MemStack::new(&mut memory),
        );
    }
}
