//! Small dense linear algebra, SIMD lanes with operators, and dual numbers: the ground floor that
//! every other crate computes on.
//!
//! - Dense algebra for a few dozen unknowns: [`Matrix`]; [`Cholesky`], [`cholesky`] and
//!   [`factor_semidefinite`]; [`least_squares`], [`householder`] and [`minimizers`];
//!   [`lu_solve`] and [`gauss_jordan`]; [`affine_space`] for systems of any rank;
//!   [`right_singular_vectors`] and [`smallest_eigenvector`]. Serial and without blocking: at
//!   these sizes a call into a large library costs more than the arithmetic. Sparse systems belong
//!   to the solver crate.
//! - [`Real`]: what a kernel needs of a number. `f64`, [`Lanes`] (one SIMD register) and [`Dual`]
//!   over either implement it; [`Triple`] is a vector of space over any of them.
//! - [`Number`]: a scalar to write a formula on once, with `f64` for values and [`Dual`] for
//!   derivatives. [`Taylor`] has second derivatives too, [`Series`] all up to some order in one
//!   variable.
//! - [`gauss_legendre`]: nodes and weights of quadrature.
//!
//! Where two functions do the same in another order of arithmetic, results of callers are compared
//! bit by bit and depend on it; the file says so.
//!
//! # Example
//! One Newton step for `x eˣ = y`, with the derivative from a dual number:
//! ```
//! use numerics::{Dual, Number};
//! fn residual<T: Number>(x: T, y: f64) -> T {
//!     x * x.exp() - y
//! }
//! let mut x = 1.0;
//! for _ in 0..8 {
//!     let r = residual(Dual::<1>::variable(x, 0), 10.0);
//!     x -= r.value / r.partials[0];
//! }
//! numerics::assert_close(residual(x, 10.0), 0.0, 1e-13);
//! ```

mod affine;
mod cholesky;
mod close;
mod dual;
mod lanes;
mod least_squares;
mod lu;
mod matrix;
mod number;
mod quadrature;
mod real;
mod series;
mod svd;
mod taylor;
mod vector;

pub use affine::{AffineSpace, affine_space};
pub use cholesky::{
    Cholesky, NotPositiveDefinite, PIVOT_RATIO, add_normal_row, cholesky, factor_semidefinite,
    minimize_quadratic, solve_semidefinite,
};
pub use close::assert_close;
pub use dual::Dual;
pub use lanes::{Aligned, Lanes, align_frame};
pub use least_squares::{RANK_RATIO, RankError, householder, least_squares, minimizers};
pub use lu::{gauss_jordan, gauss_jordan_rows, lu_solve};
pub use matrix::Matrix;
pub use number::Number;
pub use quadrature::gauss_legendre;
pub use real::{Real, Triple};
pub use series::Series;
pub use svd::{right_singular_vectors, smallest_eigenvector};
pub use taylor::Taylor;
pub use vector::{axpy, dot, norm};

/// Runs the example of the README.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
