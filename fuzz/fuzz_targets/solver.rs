//! Any bytes as a system of quadratic equations: solved or refused with a reason, never worse than
//! the start, never NaN.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| umbilic_fuzz::solve(bytes));
