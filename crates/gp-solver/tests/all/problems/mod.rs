//! Public test problems for nonlinear least squares, with derivatives by dual numbers.
#![allow(dead_code, reason = "each test program uses its part")]
#![allow(unreachable_pub, reason = "a module shared by test programs, not a library")]

pub mod lifted;
pub mod mgh;
pub mod minpack;
pub mod nist;
pub mod quadratic;

use gp_solver::{Elements, Options, Problem, Report, ResidualBlock, SolverError, solve};

/// A number with one derivative.
pub type Dual = numerics::Dual<1>;

/// Residuals as a function of the unknowns.
pub type Function = Box<dyn Fn(&[Dual]) -> Vec<Dual> + Send + Sync>;

/// A dense problem: one element that reads every unknown.
pub struct Dense {
    pub name: String,
    pub start: Vec<f64>,
    pub rows: usize,
    function: Function,
    elements: Elements,
}

impl Dense {
    pub fn new(
        name: impl Into<String>,
        start: Vec<f64>,
        function: impl Fn(&[Dual]) -> Vec<Dual> + Send + Sync + 'static,
    ) -> Self {
        let x: Vec<Dual> = start.iter().map(|&v| Dual::from(v)).collect();
        let rows = function(&x).len();
        let mut elements = Elements::new();
        elements.push(&(0..start.len()).collect::<Vec<_>>(), rows);
        Self { name: name.into(), start, rows, function: Box::new(function), elements }
    }

    /// Sum of squares.
    pub fn sum_of_squares(&self, x: &[f64]) -> f64 {
        let mut r = vec![0.0; self.rows];
        self.residuals(x, &mut r);
        r.iter().map(|r| r * r).sum()
    }

    /// Solves from `x` with the default options.
    pub fn solve(&self, x: &mut [f64]) -> Result<Report, SolverError> {
        self.solve_with(x, &Options::default())
    }

    pub fn solve_with(&self, x: &mut [f64], options: &Options) -> Result<Report, SolverError> {
        let mut problem = Problem::new(x.len());
        problem.add(Shared(self));
        solve(problem, x, options)
    }
}

/// A problem used by reference, so that it can be solved many times.
pub struct Shared<'p>(pub &'p Dense);

impl ResidualBlock for Shared<'_> {
    fn name(&self) -> &str {
        &self.0.name
    }
    fn elements(&self) -> &Elements {
        &self.0.elements
    }
    fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        self.0.residuals(x, residuals);
    }
    fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        self.0.linearize(x, residuals, jacobian);
    }
}

impl Dense {
    pub fn residuals(&self, x: &[f64], residuals: &mut [f64]) {
        let x: Vec<Dual> = x.iter().map(|&v| Dual::from(v)).collect();
        for (to, from) in residuals.iter_mut().zip((self.function)(&x)) {
            *to = from.value;
        }
    }

    pub fn linearize(&self, x: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        let n = x.len();
        let mut x: Vec<Dual> = x.iter().map(|&v| Dual::from(v)).collect();
        for k in 0..n {
            x[k].partials[0] = 1.0;
            for (i, r) in (self.function)(&x).into_iter().enumerate() {
                residuals[i] = r.value;
                jacobian[i * n + k] = r.partials[0];
            }
            x[k].partials[0] = 0.0;
        }
    }
}
