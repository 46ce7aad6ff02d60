//! PNG, JPEG and HDR images as textures and environments.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::part("part.png", bytes, "image.toml"));
