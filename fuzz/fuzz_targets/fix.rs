//! Any bytes as a file of constraints: refused, or a mesh is faired under them.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| umbilic_fuzz::constraints(bytes));
