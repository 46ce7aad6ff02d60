//! Material libraries of an OBJ.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| fuzz::part("part.mtl", bytes, "mtl.obj"));
