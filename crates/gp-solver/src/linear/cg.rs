//! Preconditioned conjugate gradients without a matrix.
//!
//! For systems whose matrix is cheaper to apply than to factor: shared unknowns that would fill a
//! factorisation with a dense border, couplings known as products of small blocks.

use crate::observer::Observer;
use crate::report::Status;

/// A symmetric positive definite matrix that is known by what it does.
///
/// It may keep scratch space of its own, hence `&mut`. Work inside may be spread over threads if
/// the result does not depend on how.
pub trait LinearOperator {
    /// Writes the product with `x` to `out`, which holds old values.
    fn apply(&mut self, x: &[f64], out: &mut [f64]);

    /// The product `aᵀ b`. An operator whose vectors have parts may add part by part; it must stay
    /// this product but for rounding.
    fn dot(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }
}

/// An approximate inverse of a [`LinearOperator`], itself symmetric and positive definite. `()` is
/// the identity.
pub trait Preconditioner {
    /// Writes the product with `residual` to `out`, which holds old values.
    fn precondition(&mut self, residual: &[f64], out: &mut [f64]);
}

impl Preconditioner for () {
    fn precondition(&mut self, residual: &[f64], out: &mut [f64]) {
        out.copy_from_slice(residual);
    }
}

/// When conjugate gradients stop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CgOptions {
    /// Converged once `√(rᵀ M⁻¹ r) ≤ rel_tol · √(bᵀ M⁻¹ b)`, with `r = b − A x` and `M⁻¹` the
    /// preconditioner.
    pub rel_tol: f64,
    /// Stops with [`IterationLimit`](Status::IterationLimit) once the number of iterations
    /// `≥ max_iterations`.
    pub max_iterations: usize,
}

impl Default for CgOptions {
    fn default() -> Self {
        Self { rel_tol: 1e-10, max_iterations: 1000 }
    }
}

/// What conjugate gradients did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CgReport {
    /// [`Converged`](Status::Converged), [`IterationLimit`](Status::IterationLimit),
    /// [`Interrupted`](Status::Interrupted), or [`Stalled`](Status::Stalled) where a direction has
    /// no positive curvature: the operator or the preconditioner is not positive definite, or not
    /// finite.
    pub status: Status,
    /// Products with the operator.
    pub iterations: usize,
    /// `√(bᵀ M⁻¹ b)`.
    pub initial_residual: f64,
    /// `√(rᵀ M⁻¹ r)` at the end, as the recurrence has it.
    pub final_residual: f64,
}

/// Conjugate gradients with their working vectors, which are used again from solve to solve.
///
/// ```
/// use gp_solver::{CgOptions, ConjugateGradients, LinearOperator, Status};
/// /// `(A x)ᵢ = 2 xᵢ − xᵢ₋₁ − xᵢ₊₁`, the second difference between two fixed ends.
/// struct SecondDifference;
/// impl LinearOperator for SecondDifference {
///     fn apply(&mut self, x: &[f64], out: &mut [f64]) {
///         for i in 0..x.len() {
///             let before = if i > 0 { x[i - 1] } else { 0.0 };
///             out[i] = 2.0 * x[i] - before - x.get(i + 1).unwrap_or(&0.0);
///         }
///     }
/// }
/// let b = [1.0; 9];
/// let mut x = [0.0; 9];
/// let mut solver = ConjugateGradients::new();
/// let report =
///     solver.solve(&mut SecondDifference, &mut (), &b, &mut x, &CgOptions::default(), &mut ());
/// assert_eq!(report.status, Status::Converged);
/// // A parabola: xᵢ = (i + 1)(9 − i)/2.
/// assert!((x[4] - 12.5).abs() < 1e-9);
/// ```
#[derive(Clone, Debug, Default)]
pub struct ConjugateGradients {
    residual: Vec<f64>,
    preconditioned: Vec<f64>,
    direction: Vec<f64>,
    product: Vec<f64>,
}

impl ConjugateGradients {
    /// Working vectors that take their length from the first system.
    #[must_use]
    pub fn new() -> Self {
        Self::default()
    }

    /// Solves `A x = b` from `x = 0`; what `x` holds before is not read. `observer` is asked before
    /// every product whether to stop. Sums run in order: the result has the same bytes for any
    /// number of threads.
    ///
    /// # Panics
    /// If `b` and `x` have different lengths.
    pub fn solve(
        &mut self,
        operator: &mut (impl LinearOperator + ?Sized),
        preconditioner: &mut (impl Preconditioner + ?Sized),
        b: &[f64],
        x: &mut [f64],
        options: &CgOptions,
        observer: &mut dyn Observer,
    ) -> CgReport {
        assert_eq!(b.len(), x.len(), "one value per unknown");
        let Self { residual: r, preconditioned: z, direction, product } = self;
        for vector in [&mut *r, &mut *z, &mut *direction, &mut *product] {
            vector.resize(b.len(), 0.0);
        }
        r.copy_from_slice(b);
        x.fill(0.0);
        preconditioner.precondition(r, z);
        direction.copy_from_slice(z);
        let mut rz = operator.dot(r, z);
        let initial = rz;
        let goal = options.rel_tol * options.rel_tol * rz;
        let mut iterations = 0;
        let status = loop {
            if rz <= goal {
                break Status::Converged;
            }
            if iterations >= options.max_iterations {
                break Status::IterationLimit;
            }
            if observer.stop_requested() {
                break Status::Interrupted;
            }
            iterations += 1;
            operator.apply(direction, product);
            let curvature = operator.dot(direction, product);
            // NaN as well.
            if !(curvature > 0.0) {
                break Status::Stalled;
            }
            let length = rz / curvature;
            x.iter_mut().zip(&*direction).for_each(|(x, d)| *x += length * d);
            r.iter_mut().zip(&*product).for_each(|(r, p)| *r += -length * p);
            preconditioner.precondition(r, z);
            let next = operator.dot(r, z);
            let factor = next / rz;
            direction.iter_mut().zip(&*z).for_each(|(d, z)| *d = factor * *d + z);
            rz = next;
        };
        CgReport { status, iterations, initial_residual: initial.sqrt(), final_residual: rz.sqrt() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    struct Dense(DMatrix<f64>);

    impl LinearOperator for Dense {
        fn apply(&mut self, x: &[f64], out: &mut [f64]) {
            let product = &self.0 * DVector::from_column_slice(x);
            out.copy_from_slice(product.as_slice());
        }
    }

    /// The inverse of the diagonal.
    struct Jacobi(Vec<f64>);

    impl Preconditioner for Jacobi {
        fn precondition(&mut self, residual: &[f64], out: &mut [f64]) {
            for ((o, r), d) in out.iter_mut().zip(residual).zip(&self.0) {
                *o = r / d;
            }
        }
    }

    fn spd(values: &[f64], n: usize) -> DMatrix<f64> {
        let a = DMatrix::from_column_slice(n, n, values);
        &a * a.transpose() + DMatrix::identity(n, n)
    }

    proptest! {
        #[test]
        fn the_solution_is_that_of_a_dense_cholesky(
            values in prop::collection::vec(-1.0..1.0_f64, 49),
            b in prop::collection::vec(-1.0..1.0_f64, 7),
        ) {
            let matrix = spd(&values, 7);
            let want = matrix.clone().cholesky().unwrap().solve(&DVector::from_vec(b.clone()));
            let mut jacobi = Jacobi(matrix.diagonal().as_slice().to_vec());
            let mut x = vec![f64::NAN; 7];
            let mut solver = ConjugateGradients::new();
            let options = CgOptions { rel_tol: 1e-12, max_iterations: 100 };
            let report =
                solver.solve(&mut Dense(matrix), &mut jacobi, &b, &mut x, &options, &mut ());
            prop_assert_eq!(report.status, Status::Converged);
            prop_assert!(report.final_residual <= 1e-12 * report.initial_residual);
            for (got, want) in x.iter().zip(&want) {
                prop_assert!((got - want).abs() < 1e-10, "{} {}", got, want);
            }
        }

        #[test]
        fn a_system_with_few_eigenvalues_takes_as_many_steps(
            b in prop::collection::vec(-1.0..1.0_f64, 12),
        ) {
            // Three different eigenvalues: exact after three steps.
            let diagonal = DVector::from_fn(12, |i, _| [1.0, 2.5, 7.0][i % 3]);
            let mut operator = Dense(DMatrix::from_diagonal(&diagonal));
            let mut x = vec![0.0; 12];
            let options = CgOptions::default();
            let mut solver = ConjugateGradients::new();
            let report = solver.solve(&mut operator, &mut (), &b, &mut x, &options, &mut ());
            prop_assert!(report.iterations <= 3);
            for i in 0..12 {
                prop_assert!((x[i] * diagonal[i] - b[i]).abs() < 1e-9);
            }
        }
    }

    /// The five-point Laplacian on the inner points of a square grid, spacing `1/(n + 1)`.
    struct Poisson(usize);

    impl LinearOperator for Poisson {
        fn apply(&mut self, x: &[f64], out: &mut [f64]) {
            let n = self.0;
            let at = |i: usize, j: usize| if i < n && j < n { x[i * n + j] } else { 0.0 };
            let h = 1.0 / (n + 1) as f64;
            for (k, out) in out.iter_mut().enumerate() {
                let (i, j) = (k / n, k % n);
                let around = at(i.wrapping_sub(1), j)
                    + at(i + 1, j)
                    + at(i, j.wrapping_sub(1))
                    + at(i, j + 1);
                *out = (4.0 * x[k] - around) / (h * h);
            }
        }
    }

    #[test]
    fn poissons_equation_has_its_closed_solution() {
        use std::f64::consts::PI;
        // sin(πx) sin(πy) is an eigenvector of the five-point Laplacian, with this eigenvalue.
        let n = 20;
        let h = 1.0 / (n + 1) as f64;
        let wave = |k: usize| (PI * h * (k + 1) as f64).sin();
        let eigenvalue = 8.0 * (0.5 * PI * h).sin().powi(2) / (h * h);
        let other = |k: usize| (3.0 * PI * h * (k + 1) as f64).sin();
        let second = 8.0 * (1.5 * PI * h).sin().powi(2) / (h * h);
        let b: Vec<f64> =
            (0..n * n).map(|k| wave(k / n) * wave(k % n) + other(k / n) * other(k % n)).collect();
        let mut x = vec![0.0; n * n];
        let mut solver = ConjugateGradients::new();
        let options = CgOptions { rel_tol: 1e-12, ..CgOptions::default() };
        let report = solver.solve(&mut Poisson(n), &mut (), &b, &mut x, &options, &mut ());
        assert_eq!((report.status, report.iterations), (Status::Converged, 2));
        for k in 0..n * n {
            let want =
                wave(k / n) * wave(k % n) / eigenvalue + other(k / n) * other(k % n) / second;
            assert!((x[k] - want).abs() < 1e-12, "{} {want}", x[k]);
        }
    }

    struct Stop;
    impl Observer for Stop {
        fn stop_requested(&mut self) -> bool {
            true
        }
    }

    #[test]
    fn ends_have_their_names() {
        let b = [1.0; 400];
        let mut x = [0.0; 400];
        let mut solver = ConjugateGradients::new();
        let mut run = |b: &[f64], options: &CgOptions, observer: &mut dyn Observer| {
            solver.solve(&mut Poisson(20), &mut (), b, &mut x, options, observer)
        };
        let few = CgOptions { max_iterations: 3, ..CgOptions::default() };
        let report = run(&b, &few, &mut ());
        assert_eq!((report.status, report.iterations), (Status::IterationLimit, 3));
        let report = run(&b, &CgOptions::default(), &mut Stop);
        assert_eq!((report.status, report.iterations), (Status::Interrupted, 0));
        let report = run(&[0.0; 400], &CgOptions::default(), &mut ());
        assert_eq!((report.status, report.iterations), (Status::Converged, 0));
        let mut negative = Dense(DMatrix::from_diagonal_element(2, 2, -1.0));
        let mut solver = ConjugateGradients::new();
        let options = CgOptions::default();
        let mut x = [0.0; 2];
        let report = solver.solve(&mut negative, &mut (), &[1.0, 0.0], &mut x, &options, &mut ());
        assert_eq!(report.status, Status::Stalled);
    }
}
