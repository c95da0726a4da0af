//! Smooth skins of rational bilinear patches on asymptotic nets, and their Darboux transforms.

mod error;
mod join;
mod patch;

pub use error::{NetError, PatchError};
pub use join::EdgeJoin;
pub use patch::{BilinearPatch, PatchJet, Quadric};
