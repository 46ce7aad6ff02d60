//! Light-path expressions: whatever can be read has an automaton, or too large a one.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::expressions(bytes));
