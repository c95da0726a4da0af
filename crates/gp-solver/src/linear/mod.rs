//! Factorisations of symmetric positive definite matrices, chosen by structure.

mod band;
mod band_kernel;
#[cfg(feature = "sparse")]
mod dense;
#[cfg(feature = "sparse")]
mod dissection;
mod factor;
#[cfg(feature = "sparse")]
mod multifrontal;
mod ordering;
mod pattern;
#[cfg(feature = "sparse")]
mod sparse;

pub use band::BandCholesky;
pub(crate) use factor::{Factor, Storage};
#[cfg(feature = "sparse")]
pub use multifrontal::MultifrontalCholesky;
pub use pattern::SymmetricPattern;
#[cfg(feature = "sparse")]
pub use sparse::SparseCholesky;
