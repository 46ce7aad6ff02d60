//! glTF, in text and in its binary container.
#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    fuzz::scene(if bytes.starts_with(b"glTF") { "scene.glb" } else { "scene.gltf" }, bytes)
});
