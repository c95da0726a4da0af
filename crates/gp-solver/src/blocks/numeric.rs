//! A block from a function of an element's unknowns, with derivatives by differences.

use crate::block::ResidualBlock;
use crate::elements::Elements;

/// Step of the differences relative to the unknowns of the element: it balances the rounding of
/// fourth-order differences, `ε / h`, against what they leave out, `h⁴`.
const STEP: f64 = 7e-4;

/// Residual rows given as a function of the unknowns of each element, with derivatives by central
/// differences of fourth order, `(8 (f(x+h) − f(x−h)) − (f(x+2h) − f(x−2h))) / 12h`: right to about
/// ten digits for smooth rows, at four evaluations per column. For trying something out; a
/// [`DualBlock`](crate::DualBlock) is exact and faster, an own [`ResidualBlock`] fastest.
///
/// ```
/// use gp_solver::{Elements, NumericBlock, Options, Problem, solve};
/// // Three points of the plane, neighbours at distance 1.
/// let mut elements = Elements::new();
/// elements.push(&[0, 1, 2, 3], 1);
/// elements.push(&[2, 3, 4, 5], 1);
/// let edges = NumericBlock::new("edges", elements, |_edge, x, rows| {
///     rows[0] = (x[2] - x[0]).hypot(x[3] - x[1]) - 1.0;
/// });
/// let mut problem = Problem::new(6);
/// problem.add(edges);
/// let mut x = [0.0, 0.0, 0.5, 0.1, 0.9, 0.4];
/// solve(problem, &mut x, &Options::default())?;
/// assert!(((x[2] - x[0]).hypot(x[3] - x[1]) - 1.0).abs() < 1e-9);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug)]
pub struct NumericBlock<F> {
    name: String,
    elements: Elements,
    function: F,
}

impl<F: Fn(usize, &[f64], &mut [f64]) + Send + Sync> NumericBlock<F> {
    /// `function(e, x, rows)` fills the rows of element `e` from the values `x` of its columns.
    #[must_use]
    pub fn new(name: impl Into<String>, elements: Elements, function: F) -> Self {
        Self { name: name.into(), elements, function }
    }
}

impl<F: Fn(usize, &[f64], &mut [f64]) + Send + Sync> ResidualBlock for NumericBlock<F> {
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
            (self.function)(e, &local, &mut residuals[self.elements.rows(e)]);
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        let (mut local, mut rows) = (Vec::new(), [const { Vec::new() }; 4]);
        for e in 0..self.elements.len() {
            let columns = self.elements.columns(e);
            local.clear();
            local.extend(columns.iter().map(|&c| x[c]));
            let size = local.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let step = STEP * if size > 0.0 { size } else { 1.0 };
            rows.iter_mut().for_each(|r| r.resize(self.elements.rows(e).len(), 0.0));
            let values = &mut jacobian[self.elements.jacobian_range(e)];
            for k in 0..columns.len() {
                let here = local[k];
                for (at, out) in [1.0, -1.0, 2.0, -2.0].into_iter().zip(&mut rows) {
                    local[k] = here + at * step;
                    (self.function)(e, &local, out);
                }
                local[k] = here;
                for (i, row) in values.chunks_exact_mut(columns.len()).enumerate() {
                    let [a, b, c, d] = [0, 1, 2, 3].map(|s: usize| rows[s][i]);
                    row[k] = (8.0 * (a - b) - (c - d)) / (12.0 * step);
                }
            }
        }
    }
}
