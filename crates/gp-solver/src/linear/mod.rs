//! Symmetric positive definite systems: factorisations chosen by structure, and conjugate gradients
//! for matrices that are not formed.

mod band;
mod band_kernel;
mod cg;
#[cfg(feature = "sparse")]
mod dense;
#[cfg(feature = "sparse")]
mod dissection;
mod factor;
#[cfg(feature = "sparse")]
mod metric;
#[cfg(feature = "sparse")]
mod multifrontal;
mod ordering;
mod pattern;
#[cfg(feature = "sparse")]
mod rows;
#[cfg(feature = "sparse")]
mod sparse;

pub use band::BandCholesky;
pub use cg::{CgOptions, CgReport, ConjugateGradients, LinearOperator, Preconditioner};
pub use factor::Factorization;
pub(crate) use factor::{Factor, Storage};
#[cfg(feature = "sparse")]
pub use metric::SparseMetric;
#[cfg(feature = "sparse")]
pub use multifrontal::MultifrontalCholesky;
pub use pattern::SymmetricPattern;
#[cfg(feature = "sparse")]
pub use rows::solve_rows;
#[cfg(feature = "sparse")]
pub use sparse::SparseCholesky;
