//! The same problems through the `levenberg-marquardt` crate, a port of MINPACK.

use super::Dense;
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::{DMatrix, DVector, Dyn, VecStorage};

struct Port<'p> {
    problem: &'p Dense,
    x: DVector<f64>,
}

impl LeastSquaresProblem<f64, Dyn, Dyn> for Port<'_> {
    type ResidualStorage = VecStorage<f64, Dyn, nalgebra::U1>;
    type JacobianStorage = VecStorage<f64, Dyn, Dyn>;
    type ParameterStorage = VecStorage<f64, Dyn, nalgebra::U1>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x.copy_from(x);
    }
    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }
    fn residuals(&self) -> Option<DVector<f64>> {
        let mut r = vec![0.0; self.problem.rows];
        self.problem.residuals(self.x.as_slice(), &mut r);
        r.iter().all(|v| v.is_finite()).then(|| DVector::from_vec(r))
    }
    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let (m, n) = (self.problem.rows, self.x.len());
        let (mut r, mut j) = (vec![0.0; m], vec![0.0; m * n]);
        self.problem.linearize(self.x.as_slice(), &mut r, &mut j);
        j.iter().all(|v| v.is_finite()).then(|| DMatrix::from_row_slice(m, n, &j))
    }
}

/// Final sum of squares and whether the port reports success, with tolerances near rounding.
pub fn run(problem: &Dense, start: &[f64]) -> (f64, bool) {
    let x = DVector::from_column_slice(start);
    let solver = LevenbergMarquardt::new().with_tol(1e-15).with_gtol(1e-14).with_patience(400);
    let (done, report) = solver.minimize(Port { problem, x });
    // Tolerances below what rounding allows end as "no improvement possible": that is success too.
    let ok = report.termination.was_successful()
        || matches!(
            report.termination,
            levenberg_marquardt::TerminationReason::NoImprovementPossible(_)
        );
    (problem.sum_of_squares(done.x.as_slice()), ok)
}
