//! Meshes that become nets, and meshes that are mended or refused.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

mod faults;
mod nets;
mod splines;
