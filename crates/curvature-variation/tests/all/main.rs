//! Fairing from the outside: closed forms, invariances, checkpoints.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

mod blocks;
mod cad;
mod energies;
mod extra;
mod fairing;
mod invariance;
mod resume;
mod sphere;
mod tori;
