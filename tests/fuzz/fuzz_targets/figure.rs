//! Figures of crops.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::figure(bytes));
