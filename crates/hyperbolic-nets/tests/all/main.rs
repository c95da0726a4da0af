//! Nets and their images from the outside: equations, invariances, checkpoints.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

mod equations;
mod joint;
mod properties;
mod published;
mod resume;
