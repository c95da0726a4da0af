//! Rounds of L-BFGS with a metric that stays.

use super::conditioned::Conditioned;
use crate::options::Method;
use gp_solver::{
    LbfgsOptions, Metric, Objective, Observer, Renewed, RoundOptions, SolverError, Status,
};

/// Weight of the Sobolev norm next to a Gauss-Newton Hessian.
pub(super) const DAMPING: f64 = 1e-3;
/// Steps between two factorisations.
const REFRESH: usize = 40;
/// A round with a Gauss-Newton metric ends once the gain that the metric foresees is this share of
/// the tolerance; without this test steps would go on down to the rounding errors.
const SETTLED: f64 = 0.01;
/// Steps L-BFGS remembers.
const MEMORY: usize = 20;

/// How the rounds of a method go.
pub(super) fn round_options(method: Method, iterations: usize, tolerance: f64) -> RoundOptions {
    let (steps, memory) = match method {
        Method::LaggedGaussNewton | Method::GaussNewton => (REFRESH, MEMORY),
        Method::Sobolev => (REFRESH, MEMORY / 2),
        // The thesis keeps ten steps and never stops for a new metric.
        Method::Lbfgs => (iterations, MEMORY / 2),
    };
    RoundOptions {
        lbfgs: LbfgsOptions {
            memory,
            max_iterations: steps,
            gradient_tol: 1e-10,
            energy_tol: 0.2 * tolerance,
            ..LbfgsOptions::default()
        },
        max_iterations: iterations,
        tolerance,
        settled: (method == Method::LaggedGaussNewton).then_some(SETTLED * tolerance),
    }
}

/// A level in rounds: every one begins at unit area with a new barrier and a new metric.
pub(super) struct Descent<'d, 'a> {
    pub(super) of: &'d mut Conditioned<'a>,
    pub(super) method: Method,
}

impl Renewed for Descent<'_, '_> {
    fn renew(
        &mut self,
        y: &mut [f64],
        observer: &mut dyn Observer,
    ) -> Result<Result<usize, Status>, SolverError> {
        self.of.energy.renormalise(y);
        self.of.energy.set_barrier(y);
        // The conditions' images need no memory while the matrix is there.
        self.of.keep(Vec::new(), false);
        let made = match self.method {
            Method::LaggedGaussNewton | Method::GaussNewton => {
                self.of.factor(y, true, DAMPING, observer)?
            }
            Method::Sobolev => self.of.factor(y, false, 1.0, observer)?,
            Method::Lbfgs => Ok(0),
        };
        if made.is_ok() {
            let rows = self.of.condition_rows(y);
            self.of.energy.refresh(y);
            self.of.keep(rows, self.method != Method::Lbfgs);
        }
        Ok(made)
    }

    fn parts(&mut self) -> (&mut dyn Objective, &mut dyn Metric) {
        (&mut self.of.energy, &mut self.of.steering)
    }
}
