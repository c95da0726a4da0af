//! Small dense linear algebra for a few dozen unknowns: products, Cholesky, rank-revealing QR.
//!
//! Row-major, serial, no blocking: at these sizes a call into a large library costs more than
//! the arithmetic. Sparse systems belong to the solver crate.

mod affine;
mod cholesky;
mod matrix;

pub use affine::{AffineSpace, affine_space};
pub use cholesky::{Cholesky, minimize_quadratic};
pub use matrix::Matrix;

/// Inner product.
#[must_use]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Euclidean length.
#[must_use]
pub fn norm(a: &[f64]) -> f64 {
    dot(a, a).sqrt()
}

/// `y += a x`.
pub fn axpy(a: f64, x: &[f64], y: &mut [f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += a * x;
    }
}
