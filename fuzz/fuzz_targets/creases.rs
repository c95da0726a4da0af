//! Any bytes as a file of creases: refused, or the mesh is refined with them.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| umbilic_fuzz::creases(bytes));
