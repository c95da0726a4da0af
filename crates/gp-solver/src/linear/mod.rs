//! Factorisations of symmetric positive definite matrices, chosen by structure.

mod band;
mod band_kernel;
mod dense;
mod dissection;
mod factor;
mod multifrontal;
mod ordering;
mod pattern;
mod sparse;

pub use band::BandCholesky;
pub(crate) use factor::{Factor, Storage};
pub use multifrontal::MultifrontalCholesky;
pub use pattern::SymmetricPattern;
pub use sparse::SparseCholesky;
