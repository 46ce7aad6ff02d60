//! OBJ files.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::scene("scene.obj", bytes));
