//! Staying close to given values: the regulariser of guided projection.

use crate::block::ResidualBlock;
use crate::elements::Elements;

/// Rows `wᵢ (xᵢ − x⁰ᵢ)`, one for each of the first unknowns, or with `x⁰` the last iterate (Tang et
/// al. 2014; Pellis et al. 2021, Eq. 11).
///
/// ```
/// use gp_solver::{Closeness, Options, Problem, solve};
///
/// // Two wishes for one unknown: the result is their mean, weighted by the squares.
/// let mut problem = Problem::new(1);
/// problem.add(Closeness::new("here", vec![1.0], vec![2.0]));
/// problem.add(Closeness::new("there", vec![6.0], vec![1.0]));
/// let mut x = [0.0];
/// solve(problem, &mut x, &Options::default())?;
/// assert!((x[0] - 2.0).abs() < 1e-6);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Closeness {
    name: String,
    elements: Elements,
    reference: Vec<f64>,
    weights: Vec<f64>,
    to_last_iterate: bool,
}

impl Closeness {
    /// Closeness to `reference`, which has the values of the first unknowns.
    ///
    /// # Panics
    /// If there is not one weight for each of them.
    #[must_use]
    pub fn new(name: impl Into<String>, reference: Vec<f64>, weights: Vec<f64>) -> Self {
        assert_eq!(reference.len(), weights.len(), "one weight per value");
        let mut elements = Elements::new();
        for k in 0..reference.len() {
            elements.push(&[k], 1);
        }
        Self { name: name.into(), elements, reference, weights, to_last_iterate: false }
    }

    /// Closeness to the last iterate, at first `x`.
    #[must_use]
    pub fn to_last_iterate(x: &[f64], weight: f64) -> Self {
        let block = Self::new("last_iterate", x.to_vec(), vec![weight; x.len()]);
        Self { to_last_iterate: true, ..block }
    }
}

impl ResidualBlock for Closeness {
    fn name(&self) -> &str {
        &self.name
    }

    fn elements(&self) -> &Elements {
        &self.elements
    }

    fn refresh(&mut self, x: &[f64]) {
        if self.to_last_iterate {
            let values = self.reference.len();
            self.reference.copy_from_slice(&x[..values]);
        }
    }

    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        let wanted = self.reference.iter().zip(&self.weights);
        for ((r, x), (x0, weight)) in residuals.iter_mut().zip(x).zip(wanted) {
            *r = weight * (x - x0);
        }
    }

    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.residuals(x, residuals);
        jacobian.copy_from_slice(&self.weights);
    }

    fn is_linear(&self) -> bool {
        true
    }

    fn set_reference(&mut self, reference: &[f64]) -> bool {
        let fits = reference.len() == self.reference.len();
        if fits {
            self.reference.copy_from_slice(reference);
        }
        fits
    }
}
