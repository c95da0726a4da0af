//! What a problem is made of: unknowns, and blocks that turn them into energy.

use std::ops::Range;

/// The sparsity of a block: elements, each a list of unknowns and a number of rows.
///
/// Rows that share their unknowns (a knot span of a spline, a patch, an edge, one quadratic
/// equation) come together, because the normal matrix then gets one small dense product per
/// element. The Jacobian of element `e` is a dense row-major block of
/// `rows(e).len() × columns(e).len()` values; the blocks of all elements follow one another in
/// one slice, `jacobian_range(e)` says where.
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

/// Residual rows `r(x)` of one kind; the block adds `½ |r|²` to the energy, weights included in `r`.
pub trait ResidualBlock: Send + Sync {
    /// The name its energy has in the report and its rows have in error messages.
    fn name(&self) -> &str;

    /// The sparsity, declared once: it may not change between calls.
    fn elements(&self) -> &Elements;

    /// Called once per iteration, before the linearisation, with the current iterate: the place
    /// for lagged quantities (the last iterate's determinant, foot points, tangent lines).
    fn refresh(&mut self, _x: &[f64]) {}

    /// Fills the residuals of all rows, in the order of the elements.
    fn residuals(&self, x: &[f64], residuals: &mut [f64]);

    /// Fills residuals and Jacobian values, the latter laid out as [`Elements`] says.
    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]);

    /// Whether the Jacobian is the same for every `x`; the solver then asks for it once.
    fn is_linear(&self) -> bool {
        false
    }
}

/// An energy that hands in its own dense gradient and positive semidefinite Hessian per element,
/// so that an energy sampled at many points of a patch need not write a row for each of them.
///
/// Rows of [`Elements`] are not used here: push elements with one row each for every column's
/// worth of Hessian, that is `push(columns, columns.len())`, so that `jacobian_range` describes
/// the row-major square Hessian and `rows` the gradient.
pub trait EnergyBlock: Send + Sync {
    /// The name its energy has in the report.
    fn name(&self) -> &str;

    /// The sparsity, square elements (see above).
    fn elements(&self) -> &Elements;

    /// Called once per iteration, as [`ResidualBlock::refresh`].
    fn refresh(&mut self, _x: &[f64]) {}

    /// The energy at `x`.
    fn energy(&self, x: &[f64]) -> f64;

    /// Fills the element gradients and, row-major, the element Hessians (or a positive
    /// semidefinite stand-in, such as Gauss-Newton's); returns the energy.
    fn quadratic_model(&self, x: &[f64], gradients: &mut [f64], hessians: &mut [f64]) -> f64;
}
