//! What a problem is made of: unknowns, and blocks that turn them into energy.

use std::fmt;
use std::ops::Range;

use crate::error::SolverError;

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

impl<T: ResidualBlock + ?Sized> ResidualBlock for &mut T {
    fn name(&self) -> &str {
        (**self).name()
    }
    fn elements(&self) -> &Elements {
        (**self).elements()
    }
    fn refresh(&mut self, x: &[f64]) {
        (**self).refresh(x);
    }
    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        (**self).residuals(x, residuals);
    }
    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        (**self).linearize(x, residuals, jacobian);
    }
    fn is_linear(&self) -> bool {
        (**self).is_linear()
    }
}

impl<T: EnergyBlock + ?Sized> EnergyBlock for &mut T {
    fn name(&self) -> &str {
        (**self).name()
    }
    fn elements(&self) -> &Elements {
        (**self).elements()
    }
    fn refresh(&mut self, x: &[f64]) {
        (**self).refresh(x);
    }
    fn energy(&self, x: &[f64]) -> f64 {
        (**self).energy(x)
    }
    fn quadratic_model(&self, x: &[f64], gradients: &mut [f64], hessians: &mut [f64]) -> f64 {
        (**self).quadratic_model(x, gradients, hessians)
    }
}

/// What a block returned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A residual.
    Residual,
    /// A derivative with respect to the unknown of this number.
    Derivative(usize),
    /// An energy.
    Energy,
    /// An entry of a gradient.
    Gradient,
    /// An entry of a Hessian.
    Hessian,
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Residual => f.write_str("the residual"),
            Self::Derivative(unknown) => write!(f, "the derivative by unknown {unknown}"),
            Self::Energy => f.write_str("the energy"),
            Self::Gradient => f.write_str("the gradient entry"),
            Self::Hessian => f.write_str("the Hessian row"),
        }
    }
}

/// One block of a problem.
pub(crate) enum Block<'a> {
    Residual(Box<dyn ResidualBlock + 'a>),
    Energy(Box<dyn EnergyBlock + 'a>),
}

impl Block<'_> {
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Residual(block) => block.name(),
            Self::Energy(block) => block.name(),
        }
    }

    pub(crate) fn elements(&self) -> &Elements {
        match self {
            Self::Residual(block) => block.elements(),
            Self::Energy(block) => block.elements(),
        }
    }

    pub(crate) fn refresh(&mut self, x: &[f64]) {
        match self {
            Self::Residual(block) => block.refresh(x),
            Self::Energy(block) => block.refresh(x),
        }
    }
}

/// Unknowns and the blocks that turn them into the energy `E(x) = Σ ½ |r_b(x)|² + Σ e_b(x)`.
///
/// Blocks may borrow: pass `&mut block` to look at a block again after the solve.
pub struct Problem<'a> {
    pub(crate) unknowns: usize,
    pub(crate) blocks: Vec<Block<'a>>,
    pub(crate) fixed: Vec<bool>,
    pub(crate) scale: Vec<f64>,
    pub(crate) order: Option<Vec<usize>>,
    pub(crate) run: Option<usize>,
}

impl<'a> Problem<'a> {
    /// A problem of `unknowns` unknowns and no block.
    #[must_use]
    pub fn new(unknowns: usize) -> Self {
        Self {
            unknowns,
            blocks: Vec::new(),
            fixed: vec![false; unknowns],
            scale: vec![1.0; unknowns],
            order: None,
            run: None,
        }
    }

    /// Number of unknowns, the fixed ones included.
    #[must_use]
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// Adds residual rows.
    pub fn add(&mut self, block: impl ResidualBlock + 'a) -> &mut Self {
        self.blocks.push(Block::Residual(Box::new(block)));
        self
    }

    /// Adds residual rows behind a box.
    pub fn add_boxed(&mut self, block: Box<dyn ResidualBlock + 'a>) -> &mut Self {
        self.blocks.push(Block::Residual(block));
        self
    }

    /// Adds an energy with its own gradient and Hessian.
    pub fn add_energy(&mut self, block: impl EnergyBlock + 'a) -> &mut Self {
        self.blocks.push(Block::Energy(Box::new(block)));
        self
    }

    /// Fixes an unknown at its start value: it leaves the system.
    ///
    /// # Panics
    /// If there is no such unknown.
    pub fn fix(&mut self, unknown: usize) -> &mut Self {
        self.fixed[unknown] = true;
        self
    }

    /// Gives a group of unknowns its natural size. Levenberg-Marquardt's own scaling follows the
    /// diagonal of the normal matrix; the natural size stands in where that is zero, and weighs
    /// the distance to the last iterate of guided projection.
    ///
    /// # Panics
    /// If the range leaves the unknowns or `size` is not positive and finite.
    pub fn set_scale(&mut self, group: Range<usize>, size: f64) -> &mut Self {
        assert!(size > 0.0 && size.is_finite(), "a natural size is positive and finite");
        self.scale[group].fill(size);
        self
    }

    /// Orders the unknowns where the structure is known: `order[k]` is the unknown that comes
    /// `k`-th. Matters for band matrices: let the shorter side of a control net run fastest.
    pub fn set_order(&mut self, order: Vec<usize>) -> &mut Self {
        self.order = Some(order);
        self
    }

    /// Says that unknowns come in runs of `length`, such as the coordinates of the vertices of a
    /// mesh: large systems are then factored by nested dissection of these runs. An
    /// [order](Self::set_order) of the caller's goes first.
    ///
    /// # Panics
    /// If `length` is zero.
    pub fn set_runs(&mut self, length: usize) -> &mut Self {
        assert!(length > 0, "a run has at least one unknown");
        self.run = Some(length);
        self
    }

    /// The names of the blocks, in order.
    pub fn block_names(&self) -> impl Iterator<Item = &str> {
        self.blocks.iter().map(Block::name)
    }

    /// Checks the blocks against the number of unknowns.
    pub(crate) fn check(&self) -> Result<(), SolverError> {
        let mut seen = vec![usize::MAX; self.unknowns];
        let mut stamp = 0;
        for block in &self.blocks {
            let elements = block.elements();
            for e in 0..elements.len() {
                let columns = elements.columns(e);
                for &column in columns {
                    if column >= self.unknowns {
                        return Err(SolverError::ColumnOutOfRange {
                            block: block.name().to_owned(),
                            element: e,
                            column,
                            unknowns: self.unknowns,
                        });
                    }
                    if seen[column] == stamp {
                        return Err(SolverError::RepeatedColumn {
                            block: block.name().to_owned(),
                            element: e,
                            column,
                        });
                    }
                    seen[column] = stamp;
                }
                if matches!(block, Block::Energy(_)) && elements.rows(e).len() != columns.len() {
                    return Err(SolverError::NotSquare {
                        block: block.name().to_owned(),
                        element: e,
                        rows: elements.rows(e).len(),
                        columns: columns.len(),
                    });
                }
                stamp += 1;
            }
        }
        let Some(order) = &self.order else { return Ok(()) };
        if order.len() != self.unknowns {
            return Err(SolverError::WrongLength {
                what: "the ordering",
                expected: self.unknowns,
                found: order.len(),
            });
        }
        let mut used = vec![false; self.unknowns];
        for (entry, &variable) in order.iter().enumerate() {
            if variable >= self.unknowns || std::mem::replace(&mut used[variable], true) {
                return Err(SolverError::NotAPermutation {
                    entry,
                    variable,
                    unknowns: self.unknowns,
                });
            }
        }
        Ok(())
    }
}
