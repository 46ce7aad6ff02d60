//! Images of the program's own, as `diff` and references read them.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::layers(bytes));
