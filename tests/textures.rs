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
use scenes::material::{Blend, Scattering, Varying};
use scenes::texture::{Channel, Image, ImageTexture, Noise, Texture, UvMap, Wrap};
use scenes::{Material, SceneBuilder, Skip};
use std::f64::consts::PI;
use std::sync::Arc;

/// A Lambertian surface of opacity below 1.
fn screen(albedo: Texture, opacity: Texture) -> Material {
    let model = Bsdf::model("lambert").unwrap();
    let scattering = Scattering::new(model, Arguments::presets(model.parameters), vec![(0, albedo)]).unwrap();
    let mut varying = Varying::of(scattering);
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

/// The albedos of an image over a sphere, at its poles.
const SOUTH: f32 = 0.2;
const NORTH: f32 = 0.9;

/// A sphere that shines alike everywhere, whose albedo is linear in its latitude: `slope` times what [`SOUTH`] and [`NORTH`] give,
/// and `base` more. L₀ = e, L_k = ρ(x) ρ̄^(k−1) e, and ρ̄ is the albedo at the equator, because the image is odd about it.
fn sphere_of(name: &str, wall: Material, base: f64, slope: f64) {
    let (radius, emitted) = (1.5, 0.8);
    let mut builder = SceneBuilder::new(name);
    let wall = builder.material(wall);
    let sphere = builder.sphere(DVec3::ZERO, radius, wall);
    builder.flip(sphere);
    builder.emit(sphere, shining(emitted));
    builder.camera(camera(dvec3(0.2, 0.1, 0.0), dvec3(-1.0, 0.3, 0.0), 50.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let truth = Truth::new(&scene, |hit, _| {
        let latitude = 1.0 - (hit.point.p.as_dvec3().z / radius).acos() / PI;
        assert!((0.25..=0.75).contains(&latitude), "the view stays where the image is linear");
        let (south, north) = (f64::from(SOUTH), f64::from(NORTH));
        let albedo = base + slope * (south + (north - south) * (latitude - 0.25) / 0.5);
        let mean = base + slope * (south + north) / 2.0;
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

#[test]
fn an_image_over_a_sphere() {
    sphere_of("image over a sphere", Material::lambert(gradient(NORTH, SOUTH)), 0.0, 1.0);
}

/// What is reflected is the sum of what the parts reflect, by their shares, which are a third each.
#[test]
fn a_mix_of_a_mix_of_parts_that_vary() {
    let model = Bsdf::model("lambert").unwrap();
    let image = vec![(0, gradient(NORTH, SOUTH))];
    let varying = Scattering::new(model, Arguments::presets(model.parameters), image).unwrap();
    let blend = |first: Scattering, albedo: f32, amount: f32| {
        let amount = Texture::Constant(Spectrum::splat(amount));
        Scattering::Blend(Box::new(Blend { parts: [first, Scattering::Same(lambert(albedo))], amount }))
    };
    let wall = Varying::of(blend(blend(varying, 0.8, 0.5), 0.7, 1.0 / 3.0)).into();
    sphere_of("mix over a sphere", wall, f64::from(0.8f32 + 0.7) / 3.0, 1.0 / 3.0);
}

/// Gold leaf that is torn by noise, over dark paint.
#[test]
fn methods_agree_on_a_mix_of_parts_that_vary() {
    let noise = |low: f32, high: f32, size: f32| {
        let [low, high] = [low, high].map(Spectrum::splat);
        Texture::Noise(Noise { low, high, size, octaves: 2, seed: 4, origin: DVec3::ZERO })
    };
    let mut builder = room("gold leaf");
    let metal = Bsdf::model("rough_conductor").unwrap();
    let place = |name: &str| metal.parameters.iter().position(|parameter| parameter.name == name).unwrap();
    let textures = vec![(place("alpha"), noise(0.2, 0.6, 0.3))];
    let leaf = Scattering::new(metal, Arguments::presets(metal.parameters), textures).unwrap();
    let blend = Blend { parts: [leaf, Scattering::Same(lambert(0.2))], amount: noise(0.0, 1.0, 0.2) };
    let leaf = builder.material(Varying::of(Scattering::Blend(Box::new(blend))));
    builder.sphere(dvec3(0.2, -0.3, -0.2), 0.6, leaf);
    let black = builder.material(lambert(0.0));
    let lamp = builder.quad(dvec3(-0.5, 0.95, -0.5), DVec3::X, DVec3::Z, black);
    builder.emit(lamp, shining(2.0));
    let entries = [
        Entry::new("direct", 16).by_night(4),
        Entry::new("path", 32).without_roulette().by_night(4),
        Entry::new("light", 64).without_roulette().by_night(4),
        Entry::new("bdpt", 8).without_roulette().by_night(4),
    ];
    agree("gold leaf", &builder.build(Skip::Unneeded).unwrap(), 4, &entries, 0.9);
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
        Entry::new("direct", 16).by_night(4),
        Entry::new("path", 32).without_roulette().by_night(4),
        Entry::new("light", 64).without_roulette().by_night(4),
        Entry::new("bdpt", 8).without_roulette().by_night(4),
    ];
    agree("screens in a room", &scene, 5, &entries, 0.9);
}
