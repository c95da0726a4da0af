//! The six rational models of NIST StRD as quadratic systems: the fitted value `f` of each
//! observation becomes an unknown, bound to the parameters by `f q − p = 0`.

use super::nist::{self, Nist};
use gp_solver::{
    Elements, Options, Problem, QuadraticBuilder, QuadraticConstraints, Report, ResidualBlock,
    SolverError, solve,
};
use nalgebra::{DMatrix, DVector};

pub const NAMES: [&str; 6] = ["Misra1b", "Kirby2", "Hahn1", "Misra1d", "MGH09", "Thurber"];

/// Unknowns are the parameters, then `width` for every observation, the fitted value last; each
/// observation has as many equations as unknowns.
pub struct Lifted {
    pub set: Nist,
    width: usize,
}

impl Lifted {
    pub fn new(name: &'static str) -> Self {
        Self { set: nist::read(name), width: if name == "Misra1b" { 2 } else { 1 } }
    }

    fn parameters(&self) -> usize {
        self.set.certified.len()
    }

    fn fitted(&self, observation: usize) -> usize {
        self.parameters() + self.width * observation + self.width - 1
    }

    pub fn unknowns(&self) -> usize {
        self.parameters() + self.width * self.set.data.len()
    }

    /// The equations, each multiplied by `weight`.
    pub fn constraints(&self, weight: f64) -> QuadraticConstraints {
        let mut rows = QuadraticBuilder::new("model");
        for (i, data) in self.set.data.iter().enumerate() {
            let (f, x) = (self.fitted(i), data[1]);
            match self.set.name {
                // b₀ (1 − u⁻¹) with the auxiliary power u = (1 + b₁ x / 2)², whose equation is
                // brought to the size of the response.
                "Misra1b" => {
                    let u = f - 1;
                    let row = rows.equation(100.0 * weight).linear(u, 1.0).constant(-1.0);
                    row.linear(1, -x).product(1, 1, -0.25 * x * x);
                    rows.equation(weight).product(f, u, 1.0).product(0, u, -1.0).linear(0, 1.0);
                }
                "Misra1d" => {
                    let row = rows.equation(weight).linear(f, 1.0);
                    row.product(f, 1, x).product(0, 1, -x);
                }
                "MGH09" => {
                    let row = rows.equation(weight).linear(f, x * x);
                    row.product(f, 2, x).product(f, 3, 1.0);
                    row.linear(0, -x * x).product(0, 1, -x);
                }
                name => {
                    let above = if name == "Kirby2" { 3 } else { 4 };
                    let row = rows.equation(weight).linear(f, 1.0);
                    for b in 0..above {
                        row.linear(b, -x.powi(b as i32));
                    }
                    for b in above..self.parameters() {
                        row.product(f, b, x.powi((b - above) as i32 + 1));
                    }
                }
            }
        }
        rows.build()
    }

    /// The auxiliary unknowns that meet the equations exactly for parameters `b`, and their
    /// derivatives by the parameters (implicit function theorem).
    fn eliminate(&self, constraints: &QuadraticConstraints, b: &[f64]) -> (Vec<f64>, DMatrix<f64>) {
        let (p, k, n) = (self.parameters(), self.width, self.unknowns());
        let elements = constraints.elements();
        let mut x = b.to_vec();
        x.resize(n, 1.0);
        let mut r = vec![0.0; elements.rows_total()];
        let mut values = vec![0.0; elements.jacobian_len()];
        let mut slopes = DMatrix::zeros(n - p, p);
        // Each equation is linear in its own unknown, so Newton needs one step per unknown; the
        // last pass leaves the derivatives at the solution and removes rounding.
        for _ in 0..k + 2 {
            constraints.linearize(&x, &mut r, &mut values);
            for i in 0..self.set.data.len() {
                let mut own = DMatrix::zeros(k, k);
                let mut by_parameters = DMatrix::zeros(k, p);
                for row in 0..k {
                    let e = k * i + row;
                    let entries = &values[elements.jacobian_range(e)];
                    for (&column, &value) in elements.columns(e).iter().zip(entries) {
                        match column.checked_sub(p + k * i) {
                            Some(c) => own[(row, c)] = value,
                            None => by_parameters[(row, column)] = value,
                        }
                    }
                }
                let inverse = own.try_inverse().expect("the denominator is not zero");
                let step = &inverse * DVector::from_row_slice(&r[k * i..k * (i + 1)]);
                for c in 0..k {
                    x[p + k * i + c] -= step[c];
                }
                slopes.rows_mut(k * i, k).copy_from(&(-&inverse * by_parameters));
            }
        }
        (x, slopes)
    }

    /// Least squares in the parameters alone, the equations met exactly.
    pub fn solve_eliminated(&self, b: &mut [f64]) -> Result<Report, SolverError> {
        let mut elements = Elements::new();
        elements.push(&(0..b.len()).collect::<Vec<_>>(), self.set.data.len());
        let mut problem = Problem::new(b.len());
        problem.add(Eliminated { lifted: self, constraints: self.constraints(1.0), elements });
        solve(problem, b, &Options::default())
    }

    /// Least squares in all unknowns, the equations as rows of weight `w`. Starts where the
    /// auxiliary unknowns fit the parameters `b`, which then hold the result.
    pub fn solve_soft(&self, w: f64, b: &mut [f64]) -> Result<Report, SolverError> {
        let constraints = self.constraints(w);
        let (mut x, _) = self.eliminate(&constraints, b);
        let mut data = QuadraticBuilder::new("data");
        for (i, row) in self.set.data.iter().enumerate() {
            data.equation(1.0).linear(self.fitted(i), 1.0).constant(-row[0]);
        }
        let mut problem = Problem::new(self.unknowns());
        problem.add(data.build());
        problem.add(constraints);
        let report = solve(problem, &mut x, &Options::default());
        b.copy_from_slice(&x[..b.len()]);
        report
    }

    /// Largest relative error of a parameter.
    pub fn error(&self, b: &[f64]) -> f64 {
        let error = |(b, c): (&f64, &f64)| (b - c).abs() / c.abs();
        b.iter().zip(&self.set.certified).map(error).fold(0.0, f64::max)
    }
}

/// Residuals of the fitted values after elimination.
struct Eliminated<'l> {
    lifted: &'l Lifted,
    constraints: QuadraticConstraints,
    elements: Elements,
}

impl ResidualBlock for Eliminated<'_> {
    fn name(&self) -> &str {
        "eliminated"
    }
    fn elements(&self) -> &Elements {
        &self.elements
    }
    fn residuals(&self, b: &[f64], residuals: &mut [f64]) {
        let mut unused = vec![0.0; self.elements.jacobian_len()];
        self.linearize(b, residuals, &mut unused);
    }
    fn linearize(&self, b: &[f64], residuals: &mut [f64], jacobian: &mut [f64]) {
        let (x, slopes) = self.lifted.eliminate(&self.constraints, b);
        for (i, row) in self.lifted.set.data.iter().enumerate() {
            let f = self.lifted.fitted(i);
            residuals[i] = x[f] - row[0];
            for (k, value) in jacobian[i * b.len()..(i + 1) * b.len()].iter_mut().enumerate() {
                *value = slopes[(f - b.len(), k)];
            }
        }
    }
}
