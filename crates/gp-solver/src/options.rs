//! Settings of the least-squares solvers.

use crate::damping::DampingRule;
use crate::error::SolverError;
use crate::linear::Factorization;

/// How a step is made from the linearised problem.
///
/// # Example
/// ```
/// use gp_solver::{Closeness, Method, Options, Problem, Regularization, solve};
/// let mut problem = Problem::new(1);
/// problem.add(Closeness::new("target", vec![4.0], vec![1.0]));
/// // A linear problem is solved by one step, but for the regularisation.
/// let method = Method::GaussNewton { regularization: Regularization::Diagonal(1e-12) };
/// let options = Options { method, max_iterations: 1, ..Options::default() };
/// let mut x = [0.0];
/// solve(problem, &mut x, &options)?;
/// assert!((x[0] - 4.0).abs() < 1e-11);
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Method {
    /// Levenberg-Marquardt: `(A + μ D) s = −g` with `D` the diagonal of `A` or the
    /// largest it has been; steps that raise the energy are refused, and the damping `μ` follows
    /// a [`DampingRule`].
    LevenbergMarquardt,
    /// Undamped guided projection (Pellis et al. 2021, Eq. 11): `(A + ε² I) s = −g`, every step
    /// taken. Nothing keeps the energy from rising.
    GuidedProjection {
        /// Weight `ε` of the distance to the last iterate, in units of the unknowns' scale.
        epsilon: f64,
    },
    /// Gauss-Newton with a fixed regularisation: the full step is halved until the energy does not
    /// rise, at most to 10⁻⁴ of it ([`Stalled`](crate::Status::Stalled) then).
    GaussNewton {
        /// What makes the normal equations regular.
        regularization: Regularization,
    },
}

/// How the normal equations of Gauss-Newton steps are made regular.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Regularization {
    /// By this share `μ` of their diagonal: `(A + μ D) s = −g`.
    Diagonal(f64),
    /// By the square of this weight of the distance to the last iterate, in units of the unknowns'
    /// scale: `(A + ε² I) s = −g`.
    Constant(f64),
}

/// Settings of a least-squares solve. The defaults suit every problem of the published test sets
/// this crate is proven on.
///
/// # Example
/// ```
/// use gp_solver::{Closeness, Options, Problem, Status, solve};
/// let mut problem = Problem::new(1);
/// problem.add(Closeness::new("target", vec![4.0], vec![1.0]));
/// let options = Options { max_iterations: 1, gradient_tol: 0.0, ..Options::default() };
/// let report = solve(problem, &mut [0.0], &options)?;
/// assert_eq!((report.status, report.iterations), (Status::IterationLimit, 1));
/// # Ok::<(), gp_solver::SolverError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Step rule.
    pub method: Method,
    /// Stops with [`IterationLimit`](crate::Status::IterationLimit) once the number of taken
    /// steps `≥ max_iterations`.
    pub max_iterations: usize,
    /// First damping `μ` of Levenberg-Marquardt, a fraction of the diagonal.
    pub initial_damping: f64,
    /// How the damping follows success and failure.
    pub damping_rule: DampingRule,
    /// Converged if `max_i |g_i| / √(A_ii · 2E) ≤ gradient_tol`: the largest cosine of an angle
    /// between the residual and a column of the Jacobian.
    pub gradient_tol: f64,
    /// Converged if a taken step has `‖s‖_D ≤ step_tol · ‖x‖_D`, with `D` the largest
    /// `diag A` so far; not if only the damping kept it small (`μ‖s‖²_D > s·A s`) while the
    /// gradient is large.
    pub step_tol: f64,
    /// Converged if both the predicted and the actual decrease of a taken step are
    /// `≤ energy_tol · E`; not if only the damping kept them small, as above. A refused step this
    /// small, or too short to change the iterate, ends the solve likewise:
    /// [`Stalled`](crate::Status::Stalled) if the gradient is large.
    pub energy_tol: f64,
    /// Converged if `E ≤ abs_energy_tol`.
    pub abs_energy_tol: f64,
    /// Which factorisation to use.
    pub factorization: Factorization,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            method: Method::LevenbergMarquardt,
            max_iterations: 1000,
            initial_damping: 1e-3,
            damping_rule: DampingRule::default(),
            gradient_tol: 1e-10,
            step_tol: 1e-14,
            energy_tol: 1e-14,
            abs_energy_tol: 0.0,
            factorization: Factorization::Auto,
        }
    }
}

impl Options {
    /// Guided projection as published, with weight `epsilon` of the last iterate.
    ///
    /// # Example
    /// ```
    /// use gp_solver::{Options, Problem, QuadraticBuilder, solve};
    /// // A point near the circle of radius 5, brought onto it.
    /// let mut circle = QuadraticBuilder::new("circle");
    /// circle.equation(1.0).product(0, 0, 1.0).product(1, 1, 1.0).constant(-25.0);
    /// let mut problem = Problem::new(2);
    /// problem.add(circle.build());
    /// let mut x = [3.3, 4.4];
    /// solve(problem, &mut x, &Options::guided_projection(1e-3))?;
    /// assert!((x[0] - 3.0).abs() < 1e-6 && (x[1] - 4.0).abs() < 1e-6);
    /// # Ok::<(), gp_solver::SolverError>(())
    /// ```
    #[must_use]
    pub fn guided_projection(epsilon: f64) -> Self {
        Self { method: Method::GuidedProjection { epsilon }, ..Self::default() }
    }

    pub(crate) fn check(&self) -> Result<(), SolverError> {
        let not_negative = [
            ("gradient_tol", self.gradient_tol),
            ("step_tol", self.step_tol),
            ("energy_tol", self.energy_tol),
            ("abs_energy_tol", self.abs_energy_tol),
        ];
        for (name, value) in not_negative {
            if !(value >= 0.0) {
                return Err(SolverError::BadOption { name, value, need: "zero or more" });
            }
        }
        let (name, value) = match self.method {
            Method::LevenbergMarquardt => ("initial_damping", self.initial_damping),
            Method::GuidedProjection { epsilon } => ("epsilon", epsilon),
            Method::GaussNewton { regularization } => match regularization {
                Regularization::Diagonal(share) => ("share of the diagonal", share),
                Regularization::Constant(epsilon) => ("epsilon", epsilon),
            },
        };
        if !(value > 0.0 && value.is_finite()) {
            return Err(SolverError::BadOption { name, value, need: "positive and finite" });
        }
        Ok(())
    }
}
