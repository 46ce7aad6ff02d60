//! Mitsuba's `serialized` meshes.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::part("part.serialized", bytes, "serialized.xml"));
