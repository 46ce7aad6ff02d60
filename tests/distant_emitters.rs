//! Spots, directional emitters, environments with images, and crowds of emitters: all methods agree, order by order.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over pairs, orders and blocks).

use crate::support::{
    Budget, COLUMNS, Entry, Family, Rendered, agree, lambert, measure, method, method_with, room, shining, sky,
};
use glam::{DVec3, dvec3};
use integrators::Integrator;
use sampling::bsdf::{Bsdf, Dielectric, Mirror};
use sampling::math::Spectrum;
use scenes::texture::Image;
use scenes::{ChoiceRule, EnvironmentImage, Falloff, Mapping, Scene, SceneBuilder, Skip, Spot};
use serde_json::json;
use std::ops::RangeInclusive;
use std::sync::Arc;

/// What stands in the room.
#[derive(Clone, Copy, PartialEq)]
enum Balls {
    Matte,
    Glass,
    GlassAndMirror,
}

/// The open room with balls in it, lit by what `add` adds.
fn lit(name: &str, balls: Balls, add: impl FnOnce(&mut SceneBuilder)) -> Scene {
    let mut builder = room(name);
    let grey = builder.material(lambert(0.5));
    let glass = builder.material(Bsdf::from(Dielectric { eta: 1.5 }));
    let mirror = builder.material(Bsdf::from(Mirror { reflectance: Spectrum::splat(0.9) }));
    let (left, right) = match balls {
        Balls::Matte => (grey, grey),
        Balls::Glass => (glass, grey),
        Balls::GlassAndMirror => (glass, mirror),
    };
    builder.sphere(dvec3(-0.4, -0.6, 0.2), 0.35, left);
    builder.sphere(dvec3(0.5, -0.7, -0.1), 0.28, right);
    add(&mut builder);
    builder.build(Skip::Unneeded).unwrap()
}

fn add_spot(builder: &mut SceneBuilder, falloff: Falloff) {
    let (cutoff, beam) = (f64::to_radians(35.0), f64::to_radians(20.0));
    let intensity = Spectrum::new(4.0, 3.0, 2.0);
    let (position, target) = (dvec3(0.3, 0.9, 0.5), dvec3(-0.3, -0.7, 0.0));
    builder.spot(Spot { position, target, intensity, cutoff, beam, falloff });
}

fn add_directional(builder: &mut SceneBuilder) {
    builder.directional_emitter(dvec3(-0.2, -0.5, -1.0), Spectrum::new(2.0, 1.5, 1.0));
}

/// All methods, with samples in the ratio of what they cost.
fn entries(samples: u32) -> [Entry; 4] {
    [
        Entry::new("direct", samples),
        Entry::new("path", samples).without_roulette(),
        Entry::new("light", samples).without_roulette(),
        Entry::new("bdpt", samples / 4).without_roulette(),
    ]
    .map(|entry| entry.by_night(3))
}

/// The methods that carry what glass makes of light which no ray meets.
fn from_the_light(samples: u32) -> [Entry; 2] {
    [Entry::new("light", samples).without_roulette(), Entry::new("bdpt", samples / 4).without_roulette()]
        .map(|entry| entry.by_night(3))
}

/// Compares these orders with a reference, over the image and over blocks of it.
fn compare(family: &mut Family, label: &str, orders: RangeInclusive<usize>, rendered: &Rendered, reference: &Rendered) {
    for order in orders {
        let label = format!("{label} order {order}");
        family.image(&label, rendered.image(order), reference.image(order));
        for (i, block) in rendered.blocks(COLUMNS).iter().enumerate() {
            family.block(format!("{label} block {i}"), rendered.over(order, block), reference.over(order, block));
        }
    }
}

#[test]
fn spot_in_a_room() {
    for falloff in Falloff::ALL {
        let scene = lit("spot", Balls::Matte, |builder| add_spot(builder, falloff));
        agree(&format!("{falloff:?} spot in a room"), &scene, 4, &entries(16), 0.9);
    }
}

#[test]
fn spot_through_glass() {
    let scene = lit("spot through glass", Balls::Glass, |builder| add_spot(builder, Falloff::Linear));
    agree("spot through glass", &scene, 4, &from_the_light(32), 0.5);
}

#[test]
fn parallel_light_in_a_room() {
    let scene = lit("parallel light", Balls::Matte, add_directional);
    agree("parallel light in a room", &scene, 4, &entries(24), 0.9);
}

#[test]
fn parallel_light_through_glass() {
    let scene = lit("parallel light through glass", Balls::Glass, add_directional);
    agree("parallel light through glass", &scene, 4, &from_the_light(48), 0.5);
}

#[test]
fn image_over_a_room_with_glass_and_mirror() {
    for mapping in [Mapping::Equirectangular, Mapping::EqualArea] {
        let sky = sky(mapping, 3.0);
        let scene = lit("sky", Balls::GlassAndMirror, |builder| builder.environment_image(sky));
        agree(&format!("{mapping:?} sky over a room"), &scene, 4, &entries(16), 0.8);
    }
}

/// A texel of a hundred thousand times the sky's radiance.
#[test]
fn small_sun() {
    let sky = sky(Mapping::Equirectangular, 1e5);
    let scene = lit("sun", Balls::Matte, |builder| builder.environment_image(sky));
    let mut family = Family::new("small sun over a room");
    let reference = measure(&scene, method("path").as_ref(), "reference", Budget::samples(96).up_to(4));
    // Light walks nearly all start in the sun, so that they seldom show the sky itself: they are compared from order 1 on.
    for (name, samples, orders) in
        [("direct", 48, 0..=1), ("path", 48, 0..=4), ("light", 48, 1..=4), ("bdpt", 12, 0..=4)]
    {
        let rendered = measure(&scene, method(name).as_ref(), name, Budget::samples(samples).up_to(4));
        compare(&mut family, name, orders, &rendered, &reference);
    }
    family.finish(0.8);
}

#[test]
fn all_at_once() {
    let scene = lit("all at once", Balls::Matte, |builder| {
        add_spot(builder, Falloff::Smooth);
        builder.directional_emitter(dvec3(-0.2, -0.5, -1.0), Spectrum::splat(0.3));
        builder.point_emitter(dvec3(-0.6, -0.2, 0.3), Spectrum::splat(0.1));
        builder.environment_image(sky(Mapping::EqualArea, 5.0));
    });
    agree("all distant emitters at once", &scene, 4, &entries(64), 0.8);
}

/// An image of one colour is a constant environment.
#[test]
fn one_colour_is_constant() {
    let colour = Spectrum::new(1.2, 0.8, 0.5);
    let constant = lit("constant", Balls::GlassAndMirror, |builder| builder.environment(colour));
    let reference =
        measure(&constant, method_with("path", json!({})).as_ref(), "constant", Budget::samples(48).up_to(4));
    let mut family = Family::new("image of one colour");
    for mapping in [Mapping::Equirectangular, Mapping::EqualArea] {
        let image = Arc::new(Image::from_linear(4, 4, vec![[0.6, 0.4, 0.25, 1.0]; 16]).unwrap());
        let rotation = sky(mapping, 1.0).rotation;
        let image = EnvironmentImage { image, mapping, scale: Spectrum::splat(2.0), rotation };
        let scene = lit("one colour", Balls::GlassAndMirror, |builder| builder.environment_image(image));
        for (name, samples) in [("path", 48), ("bdpt", 12)] {
            let method: Box<dyn Integrator> = method_with(name, json!({}));
            let label = format!("{mapping:?} {name}");
            let rendered = measure(&scene, method.as_ref(), &label, Budget::samples(samples).up_to(4));
            compare(&mut family, &label, 0..=4, &rendered, &reference);
        }
    }
    family.finish(0.8);
}

/// A hundred little lamps all over the walls, some turned away, and a spot; every choice among them has the same means.
#[test]
fn a_crowd_whatever_the_choice() {
    let scene = |rule: ChoiceRule| {
        lit("crowd", Balls::Matte, |builder| {
            let black = builder.material(lambert(0.0));
            for i in 0..100 {
                let (column, row) = ((i % 10) as f64, (i / 10) as f64);
                let corner = dvec3(-0.9 + 0.18 * column, -0.8 + 0.17 * row, -0.95 + 0.07 * ((i * 37) % 11) as f64);
                let (u, v) = (DVec3::X * 0.1, DVec3::Y * 0.1 + DVec3::Z * (0.02 * (i % 5) as f64));
                let lamp =
                    if i % 6 == 0 { builder.quad(corner, v, u, black) } else { builder.quad(corner, u, v, black) };
                builder.emit(lamp, shining(if i % 9 == 0 { 6.0 } else { 1.0 }));
            }
            add_spot(builder, Falloff::Linear);
            builder.emitter_choice(rule);
        })
    };
    let budget = |samples: u32| Budget::samples(samples).up_to(2);
    let reference = measure(&scene(ChoiceRule::Power), method("path").as_ref(), "reference", budget(96));
    let mut family = Family::new("a crowd of emitters");
    for rule in ChoiceRule::FOR_ANY_NUMBER {
        let scene = scene(rule);
        for (name, samples) in [("direct", 32), ("path", 32), ("bdpt", 12)] {
            let label = format!("{} {name}", rule.name());
            let method = method(name);
            let rendered = measure(&scene, method.as_ref(), &label, budget(samples));
            compare(&mut family, &label, method.orders(2), &rendered, &reference);
        }
    }
    family.finish(0.8);
}
