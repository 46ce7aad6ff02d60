//! Refraction: radiance is compressed into denser matter, importance is not, and what they carry is the same.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over pairs, orders and blocks).

use crate::support::{Entry, agree, block, camera, lambert, room, shining};
use glam::{DVec3, dvec3};
use sampling::bsdf::{Bsdf, Dielectric, RoughDielectric};
use scenes::{SceneBuilder, Skip};

/// All methods, with samples in the ratio of what they cost.
fn entries(samples: u32) -> [Entry; 4] {
    [
        Entry::new("direct", samples / 2),
        Entry::new("path", samples).without_roulette(),
        Entry::new("light", samples).without_roulette(),
        Entry::new("bdpt", samples / 4).without_roulette(),
    ]
    .map(|entry| entry.by_night(2))
}

fn ceiling_lamp(builder: &mut SceneBuilder, width: f64) {
    let black = builder.material(lambert(0.0));
    let lamp = builder.quad(dvec3(-width / 2.0, 0.97, -width / 2.0), DVec3::X * width, DVec3::Z * width, black);
    builder.emit(lamp, shining(2.0));
}

/// The floor is seen through the slab and lit through it.
#[test]
fn slab_of_rough_glass() {
    let mut builder = room("slab of rough glass");
    let glass = builder.material(Bsdf::from(RoughDielectric::new(1.5, 0.4, 0.4)));
    block(&mut builder, dvec3(-0.8, -0.7, -0.7), dvec3(0.8, -0.3, 0.8), glass);
    ceiling_lamp(&mut builder, 1.2);
    builder.camera(camera(dvec3(0.0, 0.6, 3.6), dvec3(0.0, -0.6, 0.0), 30.0, 16));
    agree("slab of rough glass", &builder.build(Skip::Unneeded).unwrap(), 4, &entries(80), 0.9);
}

/// A lamp within a ball of rough glass.
#[test]
fn lamp_inside_rough_glass() {
    let mut builder = room("lamp inside rough glass");
    let glass = builder.material(Bsdf::from(RoughDielectric::new(1.5, 0.3, 0.3)));
    let black = builder.material(lambert(0.0));
    builder.sphere(dvec3(0.1, 0.1, 0.0), 0.4, glass);
    let lamp = builder.sphere(dvec3(0.1, 0.15, 0.0), 0.2, black);
    builder.emit(lamp, shining(3.0));
    agree("lamp inside rough glass", &builder.build(Skip::Unneeded).unwrap(), 4, &entries(64), 0.9);
}

/// A camera within a ball of rough glass that holds a white one too.
#[test]
fn camera_inside_rough_glass() {
    let mut builder = room("camera inside rough glass");
    let glass = builder.material(Bsdf::from(RoughDielectric::new(1.5, 0.5, 0.5)));
    let white = builder.material(lambert(0.7));
    builder.sphere(dvec3(0.0, -0.2, 0.3), 0.6, glass);
    builder.sphere(dvec3(0.1, -0.3, 0.0), 0.15, white);
    ceiling_lamp(&mut builder, 1.2);
    builder.camera(camera(dvec3(0.0, -0.2, 0.6), dvec3(0.0, -0.2, 0.0), 60.0, 16));
    agree("camera inside rough glass", &builder.build(Skip::Unneeded).unwrap(), 4, &entries(192), 0.6);
}

/// A shelf of smooth glass between a large lamp and the floor, which alone is seen: every path that crosses it from the lamp
/// ends there, so that light tracing loses none, and the lamp is large enough for path tracing to find it through the shelf.
#[test]
fn shelf_of_smooth_glass() {
    let mut builder = room("shelf of smooth glass");
    let glass = builder.material(Bsdf::from(Dielectric { eta: 1.5 }));
    block(&mut builder, dvec3(-0.9, 0.0, -0.9), dvec3(0.9, 0.2, 0.9), glass);
    ceiling_lamp(&mut builder, 1.6);
    builder.camera(camera(dvec3(0.0, -0.3, 1.6), dvec3(0.0, -1.0, 0.2), 40.0, 16));
    agree("shelf of smooth glass", &builder.build(Skip::Unneeded).unwrap(), 4, &entries(64), 0.9);
}
