//! pbrt's scenes.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::scene("scene.pbrt", bytes));
