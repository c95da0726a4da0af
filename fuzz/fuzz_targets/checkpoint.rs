//! Any bytes as a checkpoint: refused, or a run goes on from it.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| umbilic_fuzz::checkpoint(bytes));
