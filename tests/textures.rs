//! What varies over surfaces: images against a closed form, and surfaces that are not met everywhere.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over its methods, orders and blocks).

use crate::support::{
    ALL, Budget, COLUMNS, Entry, Family, Truth, agree, camera, lambert, method, plain, room, shining,
};
use glam::{DVec3, dvec3};
use sampling::bsdf::{Arguments, Bsdf};
use sampling::math::Spectrum;
use sampling::{Vec2, vec2};
use scenes::material::Varying;
use scenes::texture::{Channel, Image, ImageTexture, Noise, Texture, UvMap, Wrap};
use scenes::{Material, SceneBuilder, Skip};
use std::f64::consts::PI;
use std::sync::Arc;

/// A Lambertian surface of opacity below 1.
fn screen(albedo: Texture, opacity: Texture) -> Material {
    let model = Bsdf::model("lambert").unwrap();
    let mut varying = Varying::new(model, Arguments::presets(model.parameters), vec![(0, albedo)]);
    varying.opacity = Some(opacity);
    varying.into()
}

/// An image of one column whose two texels are these greys: linear between their centres.
fn gradient(top: f32, bottom: f32) -> Texture {
    let texels = [top, bottom].map(|grey| [grey, grey, grey, 1.0]).to_vec();
    let image = Arc::new(Image::from_linear(1, 2, texels).unwrap());
    let (map, channel) = (UvMap::default(), Channel::One(1));
    Texture::Image(ImageTexture { image, wrap: Wrap::Clamp, map, channel, scale: Spectrum::ONE })
}

/// A sphere that shines alike everywhere, whose albedo is an image over its latitude: L₀ = e, L_k = ρ(x) ρ̄^(k−1) e, and ρ̄ is the
/// albedo at the equator, because the image is odd about it.
#[test]
fn an_image_over_a_sphere() {
    let (radius, emitted, south, north) = (1.5, 0.8, 0.2, 0.9);
    let mut builder = SceneBuilder::new("image over a sphere");
    let wall = builder.material(Material::lambert(gradient(north, south)));
    let sphere = builder.sphere(DVec3::ZERO, radius, wall);
    builder.flip(sphere);
    builder.emit(sphere, shining(emitted));
    builder.camera(camera(dvec3(0.2, 0.1, 0.0), dvec3(-1.0, 0.3, 0.0), 50.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let truth = Truth::new(&scene, |hit, _| {
        let latitude = 1.0 - (hit.point.p.as_dvec3().z / radius).acos() / PI;
        assert!((0.25..=0.75).contains(&latitude), "the view stays where the image is linear");
        let albedo = f64::from(south) + f64::from(north - south) * (latitude - 0.25) / 0.5;
        let mean = f64::from(south + north) / 2.0;
        let emitted = f64::from(emitted);
        std::iter::once(emitted).chain((0..8).map(|k| albedo * mean.powi(k) * emitted)).collect()
    });
    let mut family = Family::new(truth.name());
    for name in ALL {
        let budget = Budget::samples(if name == "light" { 128 } else { 32 });
        truth.compare(&mut family, name, plain(name).as_ref(), budget, COLUMNS);
    }
    family.finish(0.9);
}

/// Two black screens between a floor and a point: what is met by neither, (1 − α)(1 − β) of all, arrives.
#[test]
fn what_screens_let_through() {
    let (albedo, intensity, position) = (0.7, 2.0, dvec3(0.2, 0.7, -0.1));
    let mut builder = SceneBuilder::new("screens over a floor");
    let grey = builder.material(lambert(albedo));
    builder.quad(dvec3(-2.0, 0.0, 2.0), dvec3(4.0, 0.0, 0.0), dvec3(0.0, 0.0, -4.0), grey);
    for (height, opacity) in [(0.6, 0.3), (0.65, 0.4)] {
        let black = builder.material(screen(Spectrum::ZERO.into(), opacity.into()));
        builder.quad(dvec3(-2.0, height, 2.0), dvec3(4.0, 0.0, 0.0), dvec3(0.0, 0.0, -4.0), black);
    }
    builder.camera(camera(dvec3(0.9, 0.5, 0.9), dvec3(0.35, 0.0, 0.35), 22.0, 8));
    builder.point_emitter(position, Spectrum::splat(intensity));
    let scene = builder.build(Skip::Unneeded).unwrap();
    assert!(scene.needs.masks);
    let truth = Truth::new(&scene, |hit, _| {
        let d = position - (hit.point.p.as_dvec3() + scene.origin);
        let irradiance = f64::from(intensity) * d.y / d.length().powi(3);
        vec![0.0, f64::from(albedo) / PI * irradiance * 0.7 * 0.6]
    });
    let mut family = Family::new(&scene.name);
    for name in ALL {
        let budget = Budget::samples(if name == "light" { 512 } else { 64 });
        truth.compare(&mut family, name, method(name).as_ref(), budget, COLUMNS);
    }
    family.finish(0.9);
}

/// Screens with holes and with veils in a room: every pair of methods agrees on what passes, what is scattered, and what is seen.
#[test]
fn screens_in_a_room() {
    let mut builder = room("screens in a room");
    let black = builder.material(lambert(0.0));
    let lamp = builder.quad(dvec3(-0.3, 0.95, -0.3), DVec3::X * 0.6, DVec3::Z * 0.6, black);
    builder.emit(lamp, shining(4.0));
    let low_high = [Spectrum::ZERO, Spectrum::ONE];
    let holes =
        Texture::Checkerboard { values: low_high, map: UvMap { scale: Vec2::splat(3.0), offset: vec2(0.1, 0.2) } };
    let veil = Texture::Noise(Noise {
        low: Spectrum::ZERO,
        high: Spectrum::ONE,
        size: 0.4,
        octaves: 2,
        seed: 3,
        origin: DVec3::ZERO,
    });
    let lattice = builder.material(screen(Spectrum::splat(0.8).into(), holes));
    let cloud = builder.material(screen(Spectrum::splat(0.6).into(), veil));
    builder.quad(dvec3(-0.7, 0.3, -0.7), DVec3::X * 1.4, DVec3::Z * 1.4, lattice);
    builder.quad(dvec3(-0.6, -0.6, 0.4), DVec3::X * 1.2, DVec3::Y * 1.0, cloud);
    let scene = builder.build(Skip::Unneeded).unwrap();
    let entries = [
        Entry::new("direct", 32).by_night(2),
        Entry::new("path", 64).without_roulette().by_night(2),
        Entry::new("light", 128).without_roulette().by_night(2),
        Entry::new("bdpt", 16).without_roulette().by_night(2),
    ];
    agree("screens in a room", &scene, 5, &entries, 0.9);
}
