//! Any text as an energy: refused, or an energy that prints as itself.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| umbilic_fuzz::energy(bytes));
