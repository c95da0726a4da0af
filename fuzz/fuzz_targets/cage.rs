//! Any bytes as the corners of a cage: refused, or a finite map.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| umbilic_fuzz::cage(bytes));
