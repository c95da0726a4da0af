//! The page and its pictures from the outside.
#![allow(
    clippy::expect_used,
    clippy::unwrap_used,
    reason = "a test may stop at the first surprise"
)]

mod browser;
mod common;
mod hostile;
mod page;
mod pictures;
mod sentences;
