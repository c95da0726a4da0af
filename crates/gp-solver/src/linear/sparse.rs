//! Sparse Cholesky by faer, which only this module and `dense` know, so that it is compiled once.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltError;
use faer::perm::PermRef;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
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
    symbolic: Option<SymbolicCholesky<u32>>,
    /// The pattern's column starts as faer takes them.
    starts: Vec<u32>,
    /// Whether the rows are eliminated as they come.
    in_order: bool,
    factor: Vec<f64>,
    memory: MemBuffer,
}

impl SparseCholesky {
    /// Analyses a pattern.
    ///
    /// # Errors
    /// [`SolverError::OutOfMemory`].
    pub fn new(pattern: SymmetricPattern) -> Result<Self, SolverError> {
        Self::analysed(pattern, false)
    }

    /// As [`Self::new`] for a pattern whose rows are in a good order for elimination already (see
    /// [`Self::elimination_order`]): this saves the memory of a permuted copy of the matrix.
    ///
    /// # Errors
    /// [`SolverError::OutOfMemory`].
    pub fn in_given_order(pattern: SymmetricPattern) -> Result<Self, SolverError> {
        Self::analysed(pattern, true)
    }

    /// Approximate minimum degree order: row `order[k]` is to be eliminated `k`-th.
    ///
    /// # Errors
    /// [`SolverError::OutOfMemory`].
    pub fn elimination_order(pattern: &SymmetricPattern) -> Result<Vec<usize>, SolverError> {
        let n = pattern.size();
        let out_of_memory = || SolverError::OutOfMemory { size: n };
        let (mut order, mut inverse) = (vec![0_u32; n], vec![0_u32; n]);
        let need = amd::order_scratch::<u32>(n, pattern.len());
        let mut memory = MemBuffer::try_new(need).map_err(|_| out_of_memory())?;
        let control = amd::Control::default();
        let stack = MemStack::new(&mut memory);
        let starts = narrow_starts(pattern)?;
        amd::order(&mut order, &mut inverse, columns(pattern, &starts), control, stack)
            .map_err(|_| out_of_memory())?;
        Ok(order.into_iter().map(|row| row as usize).collect())
    }

    fn analysed(pattern: SymmetricPattern, in_order: bool) -> Result<Self, SolverError> {
        let n = pattern.size();
        if n == 0 {
            let memory = MemBuffer::new(faer::dyn_stack::StackReq::EMPTY);
            let (starts, factor) = (Vec::new(), Vec::new());
            return Ok(Self { pattern, symbolic: None, starts, in_order, factor, memory });
        }
        // faer 0.24 takes its `Identity` for the upper triangle, whatever side it is told.
        let natural: Vec<u32> = (0..n as u32).collect();
        let ordering = match in_order {
            true => SymmetricOrdering::Custom(PermRef::new_checked(&natural, &natural, n)),
            false => SymmetricOrdering::Amd,
        };
        let starts = narrow_starts(&pattern)?;
        let matrix = columns(&pattern, &starts);
        let parameters = CholeskySymbolicParams::default();
        let symbolic = factorize_symbolic_cholesky(matrix, Side::Lower, ordering, parameters)
            .map_err(|_| SolverError::OutOfMemory { size: n })?;
        let need = match symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(supernodes) if in_order => {
                supernodal::factorize_supernodal_numeric_llt_scratch::<u32, f64>(
                    supernodes,
                    Par::Seq,
                    Default::default(),
                )
            }
            _ => symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default()),
        };
        let memory = MemBuffer::try_new(need).map_err(|_| SolverError::OutOfMemory { size: n })?;
        let factor = vec![0.0; symbolic.len_val()];
        Ok(Self { pattern, symbolic: Some(symbolic), starts, in_order, factor, memory })
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
        match self.symbolic.as_ref().map(SymbolicCholesky::raw) {
            None => 0.0,
            Some(SymbolicCholeskyRaw::Simplicial(s)) => {
                s.col_ptr().windows(2).map(|w| ((w[1] - w[0]) as f64).powi(2)).sum()
            }
            Some(SymbolicCholeskyRaw::Supernodal(s)) => (0..s.n_supernodes())
                .map(|k| {
                    let width = s.supernode_end()[k] - s.supernode_begin()[k];
                    let rows = s.col_ptr_for_row_idx()[k + 1] - s.col_ptr_for_row_idx()[k];
                    squares(width as usize, rows as usize)
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
        let Some(symbolic) = &self.symbolic else { return Ok(()) };
        let matrix = SparseColMatRef::new(columns(&self.pattern, &self.starts), values);
        let stack = MemStack::new(&mut self.memory);
        let failed = match symbolic.raw() {
            // The matrix is used in place, which the other way copies.
            SymbolicCholeskyRaw::Supernodal(supernodes) if self.in_order => {
                supernodal::factorize_supernodal_numeric_llt(
                    &mut self.factor,
                    matrix,
                    Default::default(),
                    supernodes,
                    Par::Seq,
                    stack,
                    Default::default(),
                )
                .err()
            }
            _ => symbolic
                .factorize_numeric_llt(
                    &mut self.factor,
                    matrix,
                    Side::Lower,
                    Default::default(),
                    Par::Seq,
                    stack,
                    Default::default(),
                )
                .err(),
        };
        if let Some(LltError::NonPositivePivot { index }) = failed {
            // faer 0.24 counts from one in its simplicial code and from zero in the supernodal.
            let index = match symbolic.raw() {
                SymbolicCholeskyRaw::Simplicial(_) => index.saturating_sub(1),
                SymbolicCholeskyRaw::Supernodal(_) => index,
            };
            let variable = symbolic.perm().map_or(index, |perm| perm.arrays().0[index] as usize);
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
        let Some(symbolic) = &self.symbolic else { return };
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

/// faer's indices are as wide as the rows', which halves the memory of the structure.
fn narrow_starts(pattern: &SymmetricPattern) -> Result<Vec<u32>, SolverError> {
    let narrow = |&start: &usize| u32::try_from(start);
    let starts: Result<_, _> = pattern.column_starts().iter().map(narrow).collect();
    starts.map_err(|_| SolverError::TooLarge { entries: pattern.len() })
}

fn columns<'a>(
    pattern: &'a SymmetricPattern,
    starts: &'a [u32],
) -> SymbolicSparseColMatRef<'a, u32> {
    let n = pattern.size();
    SymbolicSparseColMatRef::new_checked(n, n, starts, None, pattern.rows())
}
