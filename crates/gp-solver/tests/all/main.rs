//! The solver from the outside: against dense references, public test sets and invariances.
#![allow(clippy::unwrap_used, reason = "a test may stop at the first surprise")]

mod dense_reference;
mod least_squares;
mod lifted;
mod linear;
mod mgh;
mod nist;
mod normal;
mod problems;
mod properties;
mod qp;
mod quadratic;
mod stop_rules;
