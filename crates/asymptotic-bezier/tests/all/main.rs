//! The crate from the outside: nets, patches, refusals, invariances.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

mod common;
mod errors;
mod extended;
mod fixtures;
mod interruption;
mod invariance;
mod joins;
mod properties;
mod reference;
mod relaxed;
mod special;
mod verification;
mod warnings;
