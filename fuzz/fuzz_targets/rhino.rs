//! Any bytes as a `3dm` file: read or refused, and what is read can be written and read again.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| umbilic_fuzz::round_trip("3dm", bytes));
