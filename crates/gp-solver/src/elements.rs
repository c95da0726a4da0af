//! The sparsity of a block.

use std::ops::Range;

/// The sparsity of a block: elements, each a list of unknowns and a number of rows.
///
/// Rows that share their unknowns (a knot span of a spline, a patch, an edge, one quadratic
/// equation) come together, because the normal matrix then gets one small dense product per
/// element. The Jacobian of element `e` is a dense row-major block of
/// `rows(e).len() × columns(e).len()` values; the blocks of all elements follow one another in
/// one slice, `jacobian_range(e)` says where.
///
/// # Example
/// ```
/// use gp_solver::Elements;
/// // Two edges of a chain of points in the plane, two rows for each.
/// let mut edges = Elements::new();
/// edges.push(&[0, 1, 2, 3], 2);
/// edges.push(&[2, 3, 4, 5], 2);
/// assert_eq!((edges.len(), edges.rows_total(), edges.jacobian_len()), (2, 4, 16));
/// assert_eq!((edges.rows(1), edges.jacobian_range(1)), (2..4, 8..16));
/// ```
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Elements {
    columns: Vec<usize>,
    column_starts: Vec<usize>,
    row_starts: Vec<usize>,
    jacobian_starts: Vec<usize>,
}

impl Elements {
    /// No elements yet.
    #[must_use]
    pub fn new() -> Self {
        Self {
            columns: Vec::new(),
            column_starts: vec![0],
            row_starts: vec![0],
            jacobian_starts: vec![0],
        }
    }

    /// No elements, without memory.
    pub(crate) const fn none() -> Self {
        Self {
            columns: Vec::new(),
            column_starts: Vec::new(),
            row_starts: Vec::new(),
            jacobian_starts: Vec::new(),
        }
    }

    /// Adds an element of `rows` rows that read the unknowns `columns`.
    ///
    /// A column may not occur twice in one element; elements may overlap freely.
    pub fn push(&mut self, columns: &[usize], rows: usize) {
        self.columns.extend_from_slice(columns);
        self.column_starts.push(self.columns.len());
        self.row_starts.push(self.rows_total() + rows);
        self.jacobian_starts.push(self.jacobian_len() + rows * columns.len());
    }

    /// Number of elements.
    #[must_use]
    pub fn len(&self) -> usize {
        self.row_starts.len().saturating_sub(1)
    }

    /// Whether there is no element.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The unknowns element `e` reads.
    #[must_use]
    pub fn columns(&self, e: usize) -> &[usize] {
        &self.columns[self.column_starts[e]..self.column_starts[e + 1]]
    }

    /// The rows of element `e` within the block's residual vector.
    #[must_use]
    pub fn rows(&self, e: usize) -> Range<usize> {
        self.row_starts[e]..self.row_starts[e + 1]
    }

    /// Where the Jacobian of element `e` stands in the block's Jacobian values.
    #[must_use]
    pub fn jacobian_range(&self, e: usize) -> Range<usize> {
        self.jacobian_starts[e]..self.jacobian_starts[e + 1]
    }

    /// Length of the block's residual vector.
    #[must_use]
    pub fn rows_total(&self) -> usize {
        self.row_starts.last().copied().unwrap_or(0)
    }

    /// Length of the block's Jacobian values.
    #[must_use]
    pub fn jacobian_len(&self) -> usize {
        self.jacobian_starts.last().copied().unwrap_or(0)
    }
}
