//! The residual rows of the joint seam step as blocks of a problem, to weigh, to take out, or to
//! combine with rows of one's own.
//!
//! All stand on an [`Assembly`], which says what the unknowns mean. Every block may be called from
//! one thread at a time.

mod assembly;
mod design;
mod seams;

pub use assembly::{Assembly, MOLDS, POSES, variables};
pub use design::{DesignRows, ReachRows};
pub use seams::{GapRows, KinkRows};
