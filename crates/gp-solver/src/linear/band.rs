//! Our band Cholesky factorisation.

use rayon::prelude::*;

use super::band_kernel::{
    BackwardGroup, FactorDiagonal, ForwardGroup, Layout, PANELS, UpdateGroups, group_rows,
};
use crate::error::SolverError;

/// Updates with at least this many multiplications are split over the threads: below that, waking
/// a second thread takes longer than what it saves.
const PARALLEL_WORK: usize = 4_000_000;

/// Cholesky factorisation `A = L Lᵀ` of a band matrix.
///
/// A matrix is given by columns: entry `(i, j)` with `j ≤ i ≤ j + half_bandwidth` stands at
/// [`slot(i, j)`](Self::slot), one step down a column being one step in memory. A dense matrix is
/// one with `half_bandwidth = size − 1`.
///
/// The factor is kept in groups of rows, each group contiguous and by columns, so that every
/// inner product streams through memory and fills the vector registers: a left-looking method
/// whose tiles of three vectors by three or eight columns never leave the registers, with some
/// panels formed at a time so that the factor is fetched from memory less often.
/// The result is the same bit for bit whatever the number of threads.
///
/// ```
/// use gp_solver::BandCholesky;
/// let mut cholesky = BandCholesky::new(3, 1);
/// let mut values = vec![0.0; cholesky.values_len()];
/// for i in 0..3 {
///     values[cholesky.slot(i, i)] = 2.0;
///     if i > 0 {
///         values[cholesky.slot(i, i - 1)] = -1.0;
///     }
/// }
/// cholesky.factor(&values, &[0.0; 3])?;
/// let mut x = [1.0, 0.0, 1.0];
/// cholesky.solve_in_place(&mut x);
/// assert!(x.iter().all(|v| (v - 1.0).abs() < 1e-15));
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug)]
pub struct BandCholesky {
    size: usize,
    half_bandwidth: usize,
    layout: Layout,
    /// The groups of the factor, from [`begin`](Self::begin) on.
    factor: Vec<f64>,
    /// Where the factor begins, so that its vectors do not straddle cache lines.
    begin: usize,
}

impl BandCholesky {
    /// Room for matrices of this size and half-bandwidth.
    #[must_use]
    pub fn new(size: usize, half_bandwidth: usize) -> Self {
        let half_bandwidth = half_bandwidth.min(size.saturating_sub(1));
        let layout = Layout::new(size, half_bandwidth, group_rows());
        Self { size, half_bandwidth, layout, factor: Vec::new(), begin: 0 }
    }

    /// Number of rows.
    #[must_use]
    pub fn size(&self) -> usize {
        self.size
    }

    /// Rows below the diagonal that a column reaches.
    #[must_use]
    pub fn half_bandwidth(&self) -> usize {
        self.half_bandwidth
    }

    /// Length of the values of a matrix.
    #[must_use]
    pub fn values_len(&self) -> usize {
        (self.half_bandwidth + 1) * self.size
    }

    /// Where entry `(i, j)`, `i ≥ j`, stands: at `j · half_bandwidth + i`.
    ///
    /// # Example
    /// ```
    /// let band = gp_solver::BandCholesky::new(3, 1);
    /// // Column by column: the diagonal, and what is below it.
    /// let slots = [(0, 0), (1, 0), (1, 1), (2, 1), (2, 2)].map(|(i, j)| band.slot(i, j));
    /// assert_eq!(slots, [0, 1, 2, 3, 4]);
    /// ```
    #[must_use]
    pub fn slot(&self, i: usize, j: usize) -> usize {
        j * self.half_bandwidth + i
    }

    /// Factors `A + diag(shift)`; `values` is laid out as [`slot`](Self::slot) says.
    ///
    /// # Errors
    /// [`SolverError::NotPositiveDefinite`] names the row.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn factor(&mut self, values: &[f64], shift: &[f64]) -> Result<(), SolverError> {
        assert_eq!(values.len(), self.values_len(), "values in band storage");
        assert_eq!(shift.len(), self.size, "one shift per row");
        let layout = self.layout;
        if self.factor.is_empty() {
            self.factor = vec![0.0; layout.groups() * layout.group_len() + 8];
            self.begin = self.factor.as_ptr().align_offset(64).min(8);
        }
        let arch = pulp::Arch::new();
        let threads = rayon::current_num_threads();
        let all = &mut self.factor[self.begin..];
        let length = layout.group_len();
        for begin in (0..layout.groups()).step_by(PANELS) {
            let end = layout.groups().min(begin + PANELS);
            for panel in begin..end {
                let (done, group) = all.split_at_mut(panel * length);
                let group = &mut group[..length];
                let (panels, own) = (begin..panel, &done[begin * length..]);
                let groups = &mut *group;
                let first = panel;
                arch.dispatch(UpdateGroups { layout, values, panels, own, first, groups });
                let pivots = FactorDiagonal { layout, values, shift, panel, group };
                if let Err(variable) = arch.dispatch(pivots) {
                    return Err(SolverError::NotPositiveDefinite { variable });
                }
            }
            let (done, rest) = all.split_at_mut(end * length);
            let own = &done[begin * length..];
            let below = layout.groups_end(end - 1) - end;
            let rest = &mut rest[..below * length];
            let update = |first: usize, groups: &mut [f64]| {
                let panels = begin..end;
                arch.dispatch(UpdateGroups { layout, values, panels, own, first, groups });
            };
            let work = PANELS * below * layout.rows * self.half_bandwidth / 2 * layout.rows;
            if threads > 1 && work >= PARALLEL_WORK {
                // Every group of rows is its own computation, so the split changes no bit.
                let share = below.div_ceil(2 * threads);
                rest.par_chunks_mut(share * length)
                    .enumerate()
                    .for_each(|(k, groups)| update(end + k * share, groups));
            } else {
                update(end, rest);
            }
        }
        Ok(())
    }

    /// Replaces `rhs` by the solution of the system factored last.
    ///
    /// # Panics
    /// If `rhs` has the wrong length or nothing was factored.
    pub fn solve_in_place(&self, rhs: &mut [f64]) {
        assert_eq!(rhs.len(), self.size, "one value per row");
        assert!(self.size == 0 || !self.factor.is_empty(), "factor a matrix first");
        let layout = self.layout;
        let arch = pulp::Arch::new();
        let mut x = vec![0.0; layout.groups() * layout.rows];
        x[..self.size].copy_from_slice(rhs);
        let group = |k: usize| {
            let start = self.begin + k * layout.group_len();
            &self.factor[start..start + layout.group_len()]
        };
        for k in 0..layout.groups() {
            arch.dispatch(ForwardGroup { layout, index: k, group: group(k), x: &mut x });
        }
        for k in (0..layout.groups()).rev() {
            arch.dispatch(BackwardGroup { layout, index: k, group: group(k), x: &mut x });
        }
        rhs.copy_from_slice(&x[..self.size]);
    }
}
