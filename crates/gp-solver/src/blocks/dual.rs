//! A block from a function of an element's unknowns, with exact derivatives by dual numbers.

use numerics::{Dual, Number};

use crate::block::ResidualBlock;
use crate::elements::Elements;

/// Derivatives taken in one sweep.
const LANES: usize = 8;

/// Residual rows of an element as a function of its unknowns, written once for any kind of number:
/// for `f64` it gives the rows, for dual numbers also their derivatives.
pub trait ElementFunction: Send + Sync {
    /// Fills the rows of element `element` from the values `x` of its columns.
    fn rows<T: Number>(&self, element: usize, x: &[T], rows: &mut [T]);
}

/// Residual rows given as a function of the unknowns of each element, with derivatives by forward
/// dual numbers: exact to rounding, at one evaluation per eight columns.
///
/// ```
/// use gp_solver::{DualBlock, ElementFunction, Elements, Options, Problem, check_jacobian, solve};
/// use numerics::Number;
///
/// /// Distance of two points of the plane, less one.
/// struct UnitEdge;
///
/// impl ElementFunction for UnitEdge {
///     fn rows<T: Number>(&self, _edge: usize, x: &[T], rows: &mut [T]) {
///         let (a, b) = (x[2] - x[0], x[3] - x[1]);
///         rows[0] = (a * a + b * b).sqrt() - T::from(1.0);
///     }
/// }
///
/// let mut elements = Elements::new();
/// elements.push(&[0, 1, 2, 3], 1);
/// let edge = DualBlock::new("edge", elements, UnitEdge);
/// let mut x = [0.0, 0.0, 0.5, 0.1];
/// assert!(check_jacobian(&edge, &x)?.expect("derivatives").error < 1e-8);
/// let mut problem = Problem::new(4);
/// problem.add(edge);
/// solve(problem, &mut x, &Options::default())?;
/// assert!(((x[2] - x[0]).hypot(x[3] - x[1]) - 1.0).abs() < 1e-9);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug)]
pub struct DualBlock<F> {
    name: String,
    elements: Elements,
    function: F,
}

impl<F: ElementFunction> DualBlock<F> {
    /// Rows of `elements` by `function`.
    #[must_use]
    pub fn new(name: impl Into<String>, elements: Elements, function: F) -> Self {
        Self { name: name.into(), elements, function }
    }
}

impl<F: ElementFunction> ResidualBlock for DualBlock<F> {
    fn name(&self) -> &str {
        &self.name
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        let mut local = Vec::new();
        for e in 0..self.elements.len() {
            local.clear();
            local.extend(self.elements.columns(e).iter().map(|&c| x[c]));
            self.function.rows(e, &local, &mut residuals[self.elements.rows(e)]);
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        // Values from plain numbers, so that both ways of asking agree to the bit.
        self.residuals(x, residuals);
        let (mut local, mut rows) = (Vec::new(), Vec::new());
        for e in 0..self.elements.len() {
            let columns = self.elements.columns(e);
            rows.clear();
            rows.resize(self.elements.rows(e).len(), Dual::<LANES>::from(0.0));
            let values = &mut jacobian[self.elements.jacobian_range(e)];
            for first in (0..columns.len()).step_by(LANES) {
                local.clear();
                local.extend(columns.iter().enumerate().map(|(k, &c)| {
                    match k.checked_sub(first).filter(|lane| *lane < LANES) {
                        Some(lane) => Dual::<LANES>::variable(x[c], lane),
                        None => Dual::from(x[c]),
                    }
                }));
                self.function.rows(e, &local, &mut rows);
                let count = LANES.min(columns.len() - first);
                for (row, out) in rows.iter().zip(values.chunks_exact_mut(columns.len())) {
                    out[first..first + count].copy_from_slice(&row.partials[..count]);
                }
            }
        }
    }
}
