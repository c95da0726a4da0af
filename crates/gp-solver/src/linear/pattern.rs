//! The sparsity of a symmetric matrix.

use crate::error::SolverError;

/// Lower triangle of a symmetric pattern, compressed by columns: the rows of a column are sorted
/// and start with the diagonal, which is always there (kept by `new`).
///
/// # Example
/// ```
/// use gp_solver::{SolverError, SymmetricPattern};
/// // Second differences on three points.
/// let pattern = SymmetricPattern::new(3, [(0, 1), (2, 1)])?;
/// assert_eq!(pattern.column_starts(), [0, 2, 4, 5]);
/// assert_eq!(pattern.rows(), [0, 1, 1, 2, 2]);
/// let mut image = [0.0; 3];
/// pattern.multiply(&[2.0, -1.0, 2.0, -1.0, 2.0], &[1.0, 1.0, 1.0], &mut image);
/// assert_eq!(image, [1.0, 0.0, 1.0]);
/// # Ok::<(), SolverError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SymmetricPattern {
    column_starts: Vec<usize>,
    rows: Vec<u32>,
}

impl SymmetricPattern {
    /// Pattern of a `size × size` matrix with the given entries and the diagonal. Entries of either
    /// triangle are taken and stand for both; repetitions are merged.
    ///
    /// # Errors
    /// [`SolverError::EntryOutOfRange`].
    ///
    /// # Panics
    /// If `size` needs more than 32 bits.
    pub fn new(
        size: usize,
        entries: impl IntoIterator<Item = (usize, usize)>,
    ) -> Result<Self, SolverError> {
        let rows = u32::try_from(size).expect("fewer than 2³² rows");
        let mut columns: Vec<Vec<u32>> = (0..rows).map(|j| vec![j]).collect();
        for (row, column) in entries {
            if row >= size || column >= size {
                return Err(SolverError::EntryOutOfRange { row, column, size });
            }
            if row != column {
                columns[row.min(column)].push(row.max(column) as u32);
            }
        }
        let mut pattern = Self { column_starts: vec![0], rows: Vec::new() };
        for column in &mut columns {
            column.sort_unstable();
            column.dedup();
            pattern.rows.extend_from_slice(column);
            pattern.column_starts.push(pattern.rows.len());
            *column = Vec::new();
        }
        pattern.rows.shrink_to_fit();
        Ok(pattern)
    }

    /// Pattern in which each group's members are pairwise coupled.
    ///
    /// # Panics
    /// If a group is not sorted or names a row out of range.
    ///
    /// # Example
    /// ```
    /// use gp_solver::SymmetricPattern;
    /// // Two triangles with a common edge 1–2 couple all pairs but 0 and 3.
    /// let pattern = SymmetricPattern::from_cliques(4, [[0_u32, 1, 2], [1, 2, 3]].iter());
    /// assert_eq!((pattern.len(), pattern.slot(0, 3)), (4 + 5, None));
    /// assert_eq!(pattern.slot(0, 2), pattern.slot(2, 0));
    /// ```
    pub fn from_cliques<G: AsRef<[u32]>>(size: usize, groups: impl Iterator<Item = G>) -> Self {
        let mut columns: Vec<Vec<u32>> = (0..size as u32).map(|j| vec![j]).collect();
        for group in groups {
            let group = group.as_ref();
            assert!(group.is_sorted(), "a group is sorted");
            for (k, &j) in group.iter().enumerate() {
                let column = &mut columns[j as usize];
                column.extend_from_slice(&group[k..]);
                // Merging now and then keeps the memory near that of the final pattern.
                if column.len() > 1024 && column.len().is_power_of_two() {
                    column.sort_unstable();
                    column.dedup();
                }
            }
        }
        let mut pattern = Self { column_starts: vec![0], rows: Vec::new() };
        for mut column in columns {
            column.sort_unstable();
            column.dedup();
            pattern.rows.extend_from_slice(&column);
            pattern.column_starts.push(pattern.rows.len());
        }
        pattern
    }

    /// Number of rows and columns.
    #[must_use]
    pub fn size(&self) -> usize {
        self.column_starts.len() - 1
    }

    /// Number of stored entries (lower triangle).
    #[must_use]
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// Whether the matrix has no row.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Where each column's entries begin, and the total at the end.
    #[must_use]
    pub fn column_starts(&self) -> &[usize] {
        &self.column_starts
    }

    /// Row of every stored entry.
    #[must_use]
    pub fn rows(&self) -> &[u32] {
        &self.rows
    }

    /// Where the value of entry `(row, column)` or its mirror image stands.
    ///
    /// # Example
    /// ```
    /// use gp_solver::SymmetricPattern;
    /// let pattern = SymmetricPattern::new(3, [(1, 0)])?;
    /// assert_eq!(pattern.slot(0, 1), pattern.slot(1, 0));
    /// assert_eq!(pattern.slot(0, 2), None);
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    #[must_use]
    pub fn slot(&self, row: usize, column: usize) -> Option<usize> {
        let (i, j) = (row.max(column), row.min(column));
        let start = *self.column_starts.get(j)?;
        let end = *self.column_starts.get(j + 1)?;
        self.rows[start..end].binary_search(&(i as u32)).ok().map(|k| start + k)
    }

    /// `out = A x` for the matrix with these stored values.
    ///
    /// # Panics
    /// If a slice has the wrong length.
    pub fn multiply(&self, values: &[f64], x: &[f64], out: &mut [f64]) {
        assert_eq!(values.len(), self.len(), "one value per stored entry");
        assert!(x.len() == self.size() && out.len() == self.size(), "one value per row");
        out.fill(0.0);
        for j in 0..self.size() {
            let start = self.column_starts[j];
            out[j] += values[start] * x[j];
            for k in start + 1..self.column_starts[j + 1] {
                let i = self.rows[k] as usize;
                out[i] += values[k] * x[j];
                out[j] += values[k] * x[i];
            }
        }
    }
}
