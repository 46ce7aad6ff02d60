use super::{BALL, CAMERA, Origin, WHITE, expect, load, read};
use crate::builder::{ChoiceRule, PointRule};
use crate::emitter::{Emitter, Falloff};
use crate::needs::Skip;
use crate::scene::Scene;
use sampling::{Vec3, vec3};
use std::path::Path;

/// Lines 1–3 camera, 4–6 material, 7–11 ball, then the emitter: `[[emitters]]` is line 12, its type line 13.
fn with(emitter: &str) -> String {
    format!("{CAMERA}{WHITE}{BALL}[[emitters]]\n{emitter}\n")
}

const SPOT: &str =
    "type = \"spot\"\nposition = [0, 2, 0]\ntarget = [0, 0, 0]\nintensity = [4, 2, 1]\ncutoff = 30\nbeam = 20";
const PARALLEL: &str = "type = \"directional\"\ndirection = [0, -2, 0]\nirradiance = 3";

fn in_folder(folder: &Path, emitter: &str) -> Result<Scene, String> {
    let origin = Origin { scene: "test", file: "test.toml", folder: Some(folder), attachments: &[] };
    let builder = read(&with(emitter), origin, None).map_err(|error| error.to_string())?;
    builder.build(Skip::default()).map_err(|error| error.to_string())
}

#[test]
fn every_emitter_is_read() {
    let scene = load(&with(SPOT)).unwrap();
    let Emitter::Spot(spot) = scene.emitters[0] else { panic!("not a spot") };
    assert_eq!((spot.axis, spot.falloff, spot.position), (-Vec3::Y, Falloff::Linear, vec3(0.0, 2.0, 0.0)));
    assert!((spot.cutoff.to_degrees() - 30.0).abs() < 1e-4 && (spot.beam.to_degrees() - 20.0).abs() < 1e-4);
    let smooth = load(&with(&format!("{SPOT}\nfalloff = \"smooth\""))).unwrap();
    assert!(matches!(smooth.emitters[0], Emitter::Spot(spot) if spot.falloff == Falloff::Smooth));
    let scene = load(&with(PARALLEL)).unwrap();
    assert!(matches!(scene.emitters[0], Emitter::Directional(parallel) if parallel.direction == -Vec3::Y));
    assert_ne!(load(&with(SPOT)).unwrap().hash, smooth.hash);
}

#[test]
fn a_choice_among_emitters_can_be_asked_for() {
    for rule in ChoiceRule::ALL {
        let scene = load(&format!("emitter_choice = \"{}\"\n{}", rule.name(), with(SPOT))).unwrap();
        assert_eq!(scene.choice_rule, rule);
    }
    let text = format!("emitter_choice = \"trees\"\n{}", with(SPOT));
    expect(&text, "1: `emitter_choice` is `\"trees\"`; did you mean `tree`?");
}

#[test]
fn a_rule_for_points_on_emitters_can_be_asked_for() {
    let of = |rule: PointRule| load(&format!("emitter_points = \"{}\"\n{}", rule.name(), with(SPOT))).unwrap();
    for rule in PointRule::ALL {
        assert_eq!(of(rule).point_rule, rule);
    }
    assert_ne!(of(PointRule::Area).hash, of(PointRule::SolidAngle).hash);
    let text = format!("emitter_points = \"solid angle\"\n{}", with(SPOT));
    expect(&text, "1: `emitter_points` is `\"solid angle\"`; did you mean `solid_angle`?");
}

#[test]
fn bad_emitters_are_told_with_their_line() {
    let spot = |from: &str, to: &str| with(&SPOT.replace(from, to));
    expect(&spot("cutoff = 30", "cutof = 30"), "17: unknown key `cutof` in `emitters[0]`; did you mean `cutoff`?");
    expect(&spot("beam = 20", ""), "12: `emitters[0]` lacks `beam`; add for example `beam = 20`");
    expect(
        &spot("beam = 20", "beam = 31"),
        "18: `emitters[0].beam` is `31`; the angle within which a spot has all its",
    );
    expect(&spot("beam = 20", "beam = -1"), "18: `emitters[0].beam` is `-1`; ");
    expect(&spot("cutoff = 30", "cutoff = 0"), "17: `emitters[0].cutoff` is `0`; the angle from the axis beyond which");
    expect(&spot("[0, 0, 0]", "[0, 2, 0]"), "15: `emitters[0].target` is `[0, 2, 0]`; it must differ from the spot's");
    expect(&spot("[4, 2, 1]", "0"), "16: `emitters[0].intensity` is `0`; an emitter must emit");
    let text = with(&format!("{SPOT}\nfalloff = \"smoth\""));
    expect(&text, "19: `emitters[0].falloff` is `\"smoth\"`; did you mean `smooth`?");
    let parallel = |from: &str, to: &str| with(&PARALLEL.replace(from, to));
    expect(&parallel("[0, -2, 0]", "[0, 0, 0]"), "14: `emitters[0].direction` is `[0, 0, 0]`; it must not be zero");
    expect(&parallel("irradiance = 3", "irradiance = -3"), "15: `emitters[0].irradiance` is `-3`; light cannot be");
    expect(
        &parallel("irradiance = 3", "radiance = 3"),
        "15: unknown key `radiance` in `emitters[0]`; did you mean `irradiance`?",
    );
}

#[test]
fn images_of_environments_are_read_and_judged() {
    let folder = tempfile::tempdir().unwrap();
    let save = |name: &str, image: image::Rgb32FImage| {
        let texel = |x: usize, y: usize| image.get_pixel(x as u32, y as u32).0.into();
        let (width, height) = (image.width() as usize, image.height() as usize);
        exr::prelude::write_rgb_file(folder.path().join(name), width, height, texel).unwrap();
    };
    save("sky.exr", image::Rgb32FImage::from_fn(4, 2, |x, y| image::Rgb([x as f32, y as f32, 1.0])));
    save("square.exr", image::Rgb32FImage::from_pixel(3, 3, image::Rgb([0.5, 0.5, 0.5])));
    save("black.exr", image::Rgb32FImage::from_pixel(4, 2, image::Rgb([0.0, 0.0, 0.0])));
    let texel = |value: f32| {
        image::Rgb32FImage::from_fn(4, 2, move |x, y| {
            image::Rgb([1.0, if (x, y) == (2, 1) { value } else { 1.0 }, 1.0])
        })
    };
    save("negative.exr", texel(-0.5));
    save("infinite.exr", texel(f32::INFINITY));
    image::GrayImage::from_pixel(2, 1, image::Luma([128])).save(folder.path().join("grey.png")).unwrap();
    std::fs::write(folder.path().join("half.exr"), &std::fs::read(folder.path().join("sky.exr")).unwrap()[..200])
        .unwrap();
    let of = |rest: &str| in_folder(folder.path(), &format!("type = \"environment\"\n{rest}"));
    let seen = |rest: &str, d: Vec3| of(rest).unwrap().environment_le(d).to_array();
    // The centre of the image is between columns 1 and 2, and between both rows.
    assert_eq!(seen("image = \"sky.exr\"", Vec3::Z), [1.5, 0.5, 1.0]);
    assert_eq!(seen("image = \"sky.exr\"\nscale = [2, 4, 0.5]", Vec3::Z), [3.0, 2.0, 0.5]);
    let turned = "image = \"sky.exr\"\ntransform = [{ rotate = { axis = [0, 1, 0], angle = 90 } }]";
    assert!((seen(turned, Vec3::X)[0] - 1.5).abs() < 1e-5, "what was at z has been turned to x");
    let grey = seen("image = \"grey.png\"", Vec3::X)[0];
    assert!((grey - 0.215_861).abs() < 1e-5, "bytes are sRGB: {grey}");
    assert_eq!(seen("image = \"square.exr\"\nmapping = \"equal_area\"", Vec3::Y), [0.5; 3]);

    let fails = |rest: &str, expected: &str| {
        let message = of(rest).err().unwrap_or_default();
        assert!(message.contains(expected), "{rest}: {message:?} instead of {expected:?}");
    };
    fails("image = \"skye.exr\"", "test.toml:14: `emitters[0].image` is `\"skye.exr\"`; cannot read");
    fails("image = \"half.exr\"", "it cannot be read as an image");
    fails("image = \"negative.exr\"", "the texel in column 2, row 1 is [1.0, -0.5, 1.0]; mend the image");
    fails("image = \"infinite.exr\"", "its texel in column 2, row 1 is not finite; mend the image");
    fails("image = \"black.exr\"", "the image is black; an emitter must emit");
    fails(
        "image = \"sky.exr\"\nmapping = \"equal_area\"",
        "the image has 4x2 texels, but `equal_area` covers a square",
    );
    fails("image = \"sky.exr\"\nmapping = \"equal-area\"", "did you mean `equal_area`?");
    fails("image = \"sky.exr\"\nscale = 0", "test.toml:15: `emitters[0].scale` is `0`; an emitter must emit");
    fails("image = \"sky.exr\"\nscale = 1e30", "keep it below 1e30");
    fails("image = \"sky.exr\"\ntransform = [{ scale = 2 }]", "test.toml:15: `emitters[0].transform` is");
    fails("image = \"sky.exr\"\nencoding = \"srgb\"", "unknown key `encoding`");
    let both = "image = \"sky.exr\"\n[[emitters]]\ntype = \"constant\"\nradiance = 1";
    fails(both, "test.toml:15: there are an emitter of type `constant` and one of type `environment`; keep one");
    let two = "image = \"sky.exr\"\n[[emitters]]\ntype = \"environment\"\nimage = \"sky.exr\"";
    fails(two, "there are two emitters of type `environment`; keep one: add up their radiances");
}
