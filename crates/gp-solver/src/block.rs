//! What turns unknowns into energy: residual rows, or energies with their own quadratic model.

use crate::elements::Elements;

/// Residual rows `r(x)` of one kind; the block adds `½ w² |r(x)|²` to the energy, `w` being its
/// weight in the problem (1 unless [set](crate::Problem::set_weight)).
///
/// # What must be written where
/// For row `i` of element `e`, counted within the block, and the `k`-th of the element's columns:
///
/// ```text
/// residuals[elements.rows(e).start + i]                                        = r_i(x)
/// jacobian[elements.jacobian_range(e).start + i * elements.columns(e).len() + k] = ∂r_i / ∂x[elements.columns(e)[k]]
/// ```
///
/// with the sign of the residual itself (`r = x − a` has derivative +1). Every entry of both slices
/// must be written at every call: they hold old values.
///
/// # Promises
/// - [`residuals`](Self::residuals) and [`linearize`](Self::linearize) fill the same residuals to
///   the bit at the same `x`: a step is accepted by comparing the one with the other.
/// - A row reads no unknown but its element's columns.
/// - Both are called on the thread that steps, one block after another. Work inside may be spread
///   over threads if its result does not depend on how (hence `Sync`).
/// - The result may depend on `x`, on what [`refresh`](Self::refresh) saw and on nothing else.
///
/// # Example
/// Edges of a chain of points in the plane that keep length 1:
/// ```
/// use gp_solver::{Elements, Options, Problem, ResidualBlock, check_jacobian, solve};
///
/// struct UnitEdges { elements: Elements }
///
/// impl UnitEdges {
///     fn new(points: usize) -> Self {
///         let mut elements = Elements::new();
///         for p in 1..points {
///             elements.push(&[2 * p - 2, 2 * p - 1, 2 * p, 2 * p + 1], 1);
///         }
///         Self { elements }
///     }
/// }
///
/// impl ResidualBlock for UnitEdges {
///     fn name(&self) -> &str { "unit edges" }
///     fn elements(&self) -> &Elements { &self.elements }
///     fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
///         for (e, r) in residuals.iter_mut().enumerate() {
///             *r = (x[2 * e + 2] - x[2 * e]).hypot(x[2 * e + 3] - x[2 * e + 1]) - 1.0;
///         }
///     }
///     fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
///         self.residuals(x, residuals);
///         for (e, row) in jacobian.chunks_exact_mut(4).enumerate() {
///             let (a, b) = (x[2 * e + 2] - x[2 * e], x[2 * e + 3] - x[2 * e + 1]);
///             let length = a.hypot(b);
///             row.copy_from_slice(&[-a / length, -b / length, a / length, b / length]);
///         }
///     }
/// }
///
/// let mut x = [0.0, 0.0, 0.7, 0.2, 1.1, 0.9];
/// let worst = check_jacobian(&UnitEdges::new(3), &x)?.expect("it has derivatives");
/// assert!(worst.error < 1e-8);
/// let mut problem = Problem::new(6);
/// problem.add(UnitEdges::new(3));
/// let report = solve(problem, &mut x, &Options::default())?;
/// assert!(report.final_energy < 1e-20);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
pub trait ResidualBlock: Send + Sync {
    /// The name its energy has in the report and its rows have in error messages.
    fn name(&self) -> &str;

    /// The sparsity, declared once: it may not change between calls.
    fn elements(&self) -> &Elements;

    /// Called once per iteration, before the linearisation, with the current iterate: the place
    /// for lagged quantities (the last iterate's determinant, foot points, tangent lines).
    fn refresh(&mut self, _x: &[f64]) {}

    /// Whether a trial point may be judged by its energy at all. A step to a point that any block
    /// refuses is not taken but shortened, whatever the energy says: the way to keep an iterate
    /// inside a domain (a positive area, a side of a plane). The start must be admitted.
    fn admits(&self, _x: &[f64]) -> bool {
        true
    }

    /// Fills the residuals of all rows, in the order of the elements.
    fn residuals(&self, x: &[f64], residuals: &mut [f64]);

    /// Fills residuals and Jacobian values, laid out as above.
    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]);

    /// Whether the Jacobian is the same for every `x`; the solver then asks for it once.
    fn is_linear(&self) -> bool {
        false
    }

    /// Whether the rows are equations: to be zero, not small. Stages that are solved exactly, as
    /// quadratic programs, make constraints of linear ones; least squares take them as other rows.
    fn is_equation(&self) -> bool {
        false
    }

    /// Takes a new reference (the values the rows measure against) without a change of the
    /// Jacobian; returns whether the block has one of this length.
    fn set_reference(&mut self, _reference: &[f64]) -> bool {
        false
    }
}

/// An energy that hands in its own dense gradient and positive semidefinite Hessian per element,
/// so that an energy sampled at many points of a patch need not write a row for each of them.
///
/// Rows of [`Elements`] are not used here: push elements with one row each for every column's
/// worth of Hessian, that is `push(columns, columns.len())`, so that `jacobian_range` describes
/// the row-major square Hessian and `rows` the gradient. The promises are those of
/// [`ResidualBlock`]; the weight of the block multiplies the energy.
///
/// # Example
/// ```
/// use gp_solver::{Elements, EnergyBlock, Options, Problem, check_gradient, solve};
///
/// /// `cosh(x − 3)` of the first unknown.
/// struct Bowl(Elements);
///
/// impl EnergyBlock for Bowl {
///     fn name(&self) -> &str { "bowl" }
///     fn elements(&self) -> &Elements { &self.0 }
///     fn energy(&self, x: &[f64]) -> f64 { (x[0] - 3.0).cosh() }
///     fn quadratic_model(&self, x: &[f64], gradients: &mut [f64], hessians: &mut [f64]) -> f64 {
///         gradients[0] = (x[0] - 3.0).sinh();
///         hessians[0] = (x[0] - 3.0).cosh();
///         self.energy(x)
///     }
/// }
///
/// let mut elements = Elements::new();
/// elements.push(&[0], 1); // one column, hence one row
/// let bowl = Bowl(elements);
/// assert!(check_gradient(&bowl, &[1.0])?.expect("derivatives").error < 1e-8);
/// let mut problem = Problem::new(1);
/// problem.add_energy(bowl);
/// let mut x = [0.0];
/// solve(problem, &mut x, &Options::default())?;
/// assert!((x[0] - 3.0).abs() < 1e-6);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
pub trait EnergyBlock: Send + Sync {
    /// The name its energy has in the report.
    fn name(&self) -> &str;

    /// The sparsity, square elements (see above).
    fn elements(&self) -> &Elements;

    /// Called once per iteration, as [`ResidualBlock::refresh`].
    fn refresh(&mut self, _x: &[f64]) {}

    /// As [`ResidualBlock::admits`].
    fn admits(&self, _x: &[f64]) -> bool {
        true
    }

    /// Whether the Hessian is exact and the same for every `x`, so that a quadratic program can take
    /// the energy.
    fn is_quadratic(&self) -> bool {
        false
    }

    /// The energy at `x`.
    fn energy(&self, x: &[f64]) -> f64;

    /// Fills the element gradients and, row-major, the element Hessians (or a positive
    /// semidefinite stand-in, such as Gauss-Newton's); returns the energy.
    fn quadratic_model(&self, x: &[f64], gradients: &mut [f64], hessians: &mut [f64]) -> f64;
}

/// One block of a problem.
pub(crate) enum Block<'a> {
    Residual(Box<dyn ResidualBlock + 'a>),
    Energy(Box<dyn EnergyBlock + 'a>),
    /// The place of a block that was taken out.
    Removed,
}

/// The elements of a block that was taken out.
static NO_ELEMENTS: Elements = Elements::none();

impl Block<'_> {
    pub(crate) fn name(&self) -> &str {
        match self {
            Self::Residual(block) => block.name(),
            Self::Energy(block) => block.name(),
            Self::Removed => "",
        }
    }

    pub(crate) fn elements(&self) -> &Elements {
        match self {
            Self::Residual(block) => block.elements(),
            Self::Energy(block) => block.elements(),
            Self::Removed => &NO_ELEMENTS,
        }
    }

    pub(crate) fn refresh(&mut self, x: &[f64]) {
        match self {
            Self::Residual(block) => block.refresh(x),
            Self::Energy(block) => block.refresh(x),
            Self::Removed => {}
        }
    }

    pub(crate) fn admits(&self, x: &[f64]) -> bool {
        match self {
            Self::Residual(block) => block.admits(x),
            Self::Energy(block) => block.admits(x),
            Self::Removed => true,
        }
    }

    /// Whether the block's matrix part is the same at every iterate.
    pub(crate) fn is_constant(&self) -> bool {
        matches!(self, Self::Residual(rows) if rows.is_linear())
    }
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
    fn admits(&self, x: &[f64]) -> bool {
        (**self).admits(x)
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
    fn is_equation(&self) -> bool {
        (**self).is_equation()
    }
    fn set_reference(&mut self, reference: &[f64]) -> bool {
        (**self).set_reference(reference)
    }
}
