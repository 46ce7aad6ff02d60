//! PLY files, in text and in both orders of bytes.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::scene("scene.ply", bytes));
