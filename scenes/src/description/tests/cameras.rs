//! Cameras of every type, and what is wrong with some.

use super::{expect, load, replaced};
use crate::camera::{Camera, Crop};
use crate::scene::Scene;
use glam::DVec3;
use sampling::{Vec2, vec2};

/// Line 4 is the first of `keys`.
fn with(keys: &str) -> String {
    replaced("target = [0, 0, 0]\n", &format!("target = [0, 0, 0]\n{keys}\n"))
}

fn read(keys: &str) -> Scene {
    load(&with(keys)).unwrap_or_else(|error| panic!("{keys}: {error}"))
}

#[test]
fn every_type_is_read() {
    for (keys, name) in [
        ("fov = 30", "pinhole, 30.0000 degrees"),
        ("type = \"pinhole\"", "pinhole, 40.0000 degrees"),
        ("type = \"thin_lens\"\nlens_radius = 0.25", "thin_lens, 40.0000 degrees, radius 0.25 m, focused at 3 m"),
        (
            "type = \"thin_lens\"\nlens_radius = 0.25\nfocus_distance = 2\nfov = 30",
            "thin_lens, 30.0000 degrees, radius 0.25 m, focused at 2 m",
        ),
        ("type = \"orthographic\"\nextent = 2.5", "orthographic, 2.5 m"),
        ("type = \"equirectangular\"", "equirectangular"),
        ("type = \"irradiance\"\nrectangle = [2, 0.5]", "irradiance"),
    ] {
        let scene = read(keys);
        assert_eq!(scene.camera.to_string(), name);
        assert_eq!(scene.needs.pinhole, name.starts_with("pinhole") || name.starts_with("equi"), "{name}");
    }
}

#[test]
fn images_are_mirrored_shifted_and_cropped() {
    let seen =
        |keys: &str| read(keys).camera.sample_wi(DVec3::new(0.3, 0.2, 0.0).as_vec3(), Vec2::ZERO).unwrap().raster;
    let plain = seen("");
    assert!(seen("mirrored = false") == plain && plain.x > 128.0 && plain.y < 128.0);
    assert!(seen("mirrored = true").distance(vec2(256.0 - plain.x, plain.y)) < 1e-2);
    assert!(seen("shift = [0.25, 0.5]").distance(plain + vec2(-64.0, 128.0)) < 1e-2);
    assert_eq!(read("").crop, None);
    assert_eq!(read("crop = [10, 0, 246, 7]").crop, Some(Crop { x: 10, y: 0, width: 246, height: 7 }));
    assert!(matches!(read("width = 20\nheight = 10\ncrop = [19, 9, 1, 1]").camera, Camera::Pinhole(_)));
}

/// The hash tells cameras apart, but not how many pixels they have.
#[test]
fn what_changes_the_image_changes_the_hash() {
    let cameras = [
        "",
        "mirrored = true",
        "shift = [0.1, 0]",
        "type = \"thin_lens\"\nlens_radius = 0.1",
        "type = \"thin_lens\"\nlens_radius = 0.2",
        "type = \"orthographic\"\nextent = 1",
        "type = \"equirectangular\"",
        "type = \"irradiance\"",
        "type = \"irradiance\"\ndisk = 0.5",
        "type = \"irradiance\"\nsphere = 0.5",
    ];
    let hashes = cameras.map(|keys| read(keys).hash);
    assert!((0..hashes.len()).all(|i| !hashes[..i].contains(&hashes[i])));
    assert_eq!(read("crop = [0, 0, 5, 5]").hash, hashes[0]);
}

#[test]
fn keys_of_another_type_are_explained() {
    expect(
        &with("lens_radius = 0.1"),
        "4: `camera.lens_radius` is `0.1`; only a camera of type `thin_lens` has `lens_radius`, and this is of type `pinhole`, \
         which has `fov`, `shift`",
    );
    expect(
        &with("len_radius = 0.1"),
        "4: `camera.len_radius` is `0.1`; did you mean `lens_radius`? only a camera of type `thin_lens`",
    );
    expect(
        &with("type = \"orthographic\"\nfov = 40"),
        "5: `camera.fov` is `40`; only a camera of type `pinhole` or `thin_lens` has `fov`",
    );
    expect(
        &with("shift = [0, 1]\ntype = \"equirectangular\""),
        "4: `camera.shift` is `[0, 1]`; only a camera of type `pinhole` or `thin_lens` or `orthographic` has `shift`",
    );
    expect(&with("mirored = true"), "4: unknown key `mirored` in `camera`; did you mean `mirrored`?");
    expect(&with("type = \"thinlens\""), "4: `camera.type` is `\"thinlens\"`; did you mean `thin_lens`?");
}

#[test]
fn a_meter_has_one_pixel_and_one_receiver() {
    let meter = read("type = \"irradiance\"\ndisk = 0.5").camera;
    assert_eq!((meter.width(), meter.height(), meter.weight()), (1, 1, std::f32::consts::PI));
    assert_eq!(read("type = \"irradiance\"\nwidth = 8").camera.width(), 8);
    expect(
        &with("type = \"irradiance\"\ndisk = 1\nsphere = 1"),
        "6: `camera.sphere` is `1`; an irradiance meter is one of `rectangle`, `disk` and `sphere`",
    );
    expect(&with("type = \"irradiance\"\nrectangle = [1]"), "5: `camera.rectangle` is `[1]`; give its two sides");
    let filter = with("type = \"irradiance\"\nfilter = \"gaussian\"");
    expect(&filter, "5: `camera.filter` is `\"gaussian\"`; an irradiance meter has the filter `box`");
}

#[test]
fn values_are_checked() {
    expect(&with("type = \"thin_lens\""), "1: `camera` lacks `lens_radius`; add for example `lens_radius = 0.01`");
    expect(&with("type = \"orthographic\""), "1: `camera` lacks `extent`; add for example `extent = 2.0`");
    for length in ["0", "-1", "1e20"] {
        let expected = |key: &str| format!("5: `camera.{key}` is `{length}`; it is a length between 1e-12 and 1e12 m");
        expect(&with(&format!("type = \"thin_lens\"\nlens_radius = {length}")), &expected("lens_radius"));
        expect(&with(&format!("type = \"orthographic\"\nextent = {length}")), &expected("extent"));
    }
    expect(&with("mirrored = 1"), "4: `camera.mirrored` is `1`; it must be true or false");
    expect(&with("shift = 0.1"), "4: `camera.shift` is `0.1`; it must be how far to the right and up");
    expect(&with("shift = [0, 1e9]"), "4: `camera.shift` is `[0, 1e9]`; a window is shifted by at most 100 times");
    for crop in ["[0, 0, 257, 1]", "[0, 250, 1, 7]", "[256, 0, 1, 1]"] {
        expect(
            &with(&format!("crop = {crop}")),
            &format!("4: `camera.crop` is `{crop}`; it must lie within the 256x256"),
        );
    }
    expect(&with("crop = [0, 0, 0, 1]"), "4: `camera.crop` is `[0, 0, 0, 1]`; a crop has at least one pixel");
    expect(&with("crop = [0, -1, 1, 1]"), "4: `camera.crop[1]` is `-1`; it is a number of pixels, 0 or more");
    expect(&with("crop = [0, 0, 1.5, 1]"), "4: `camera.crop[2]` is `1.5`; it must be a whole number");
    for crop in ["7", "[1, 2, 3]"] {
        expect(
            &with(&format!("crop = {crop}")),
            &format!("4: `camera.crop` is `{crop}`; it must be the column and row"),
        );
    }
}
