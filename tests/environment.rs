//! A furnace lit by its environment alone: where nothing absorbs, every ray brings back the environment's radiance.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over methods, orders and blocks).

use crate::support::{
    Budget, COLUMNS, Entry, Estimate, Family, agree, camera, lambert, measure, method_with, pixels_without_delta,
};
use glam::{DVec3, dvec3};
use sampling::bsdf::{Bsdf, Dielectric, Mirror};
use sampling::math::Spectrum;
use scenes::{Scene, SceneBuilder, Skip};
use serde_json::json;

const RADIANCE: f32 = 1.3;

/// What lies in the white cup.
#[derive(Clone, Copy, PartialEq)]
enum Contents {
    White,
    GlassAndMirror,
}

/// A white cup, open above, with two balls in it, under a uniform sky.
fn cup(contents: Contents) -> Scene {
    let mut builder = SceneBuilder::new("cup");
    let white = builder.material(lambert(1.0));
    let (glass, mirror) = match contents {
        Contents::White => (white, white),
        Contents::GlassAndMirror => (
            builder.material(Bsdf::from(Dielectric { eta: 1.5 })),
            builder.material(Bsdf::from(Mirror { reflectance: Spectrum::ONE })),
        ),
    };
    let (low, x, y, z) = (dvec3(-1.0, 0.0, -1.0), DVec3::X * 2.0, DVec3::Y * 0.5, DVec3::Z * 2.0);
    builder.quad(low, z, x, white);
    builder.quad(low, x, y, white);
    builder.quad(low, y, z, white);
    builder.quad(low + x + z, -x, y, white);
    builder.quad(low + x + z, y, -z, white);
    builder.sphere(dvec3(0.45, 0.5, 0.2), 0.35, glass);
    builder.sphere(dvec3(-0.45, 0.45, -0.2), 0.3, mirror);
    builder.environment(Spectrum::splat(RADIANCE));
    builder.camera(camera(dvec3(0.4, 2.2, 2.4), dvec3(0.0, 0.2, 0.0), 42.0, 16));
    builder.build(Skip::Unneeded).unwrap()
}

/// The orders up to 8 and the tail, together.
#[test]
fn what_absorbs_nothing_is_as_bright_as_its_environment() {
    let mut family = Family::new("white furnace");
    for (contents, name) in [(Contents::White, "white cup"), (Contents::GlassAndMirror, "cup with glass and mirror")] {
        let scene = cup(contents);
        let methods = [("path", json!({}), 64), ("light", json!({}), 256), ("bdpt", json!({"roulette": "local"}), 16)];
        for (method, settings, samples) in methods {
            let budget = Budget { tail: true, ..Budget::samples(samples) };
            let instance = format!("{name} {method}");
            let rendered = measure(&scene, method_with(method, settings).as_ref(), &instance, budget);
            let carried = match method {
                "light" => pixels_without_delta(&scene),
                _ => (0..rendered.measurement.pixels()).collect(),
            };
            let truth = Estimate::exact(RADIANCE as f64);
            family.image(format!("{name} {method}"), rendered.total(&carried), truth);
            for (i, block) in rendered.blocks(COLUMNS).into_iter().enumerate() {
                let pixels: Vec<usize> = block.into_iter().filter(|p| carried.contains(p)).collect();
                if !pixels.is_empty() {
                    family.block(format!("{name} {method} block {i}"), rendered.total(&pixels), truth);
                }
            }
        }
    }
    family.finish(0.9);
}

#[test]
fn methods_agree_under_a_sky() {
    for (contents, name) in [(Contents::White, "white cup"), (Contents::GlassAndMirror, "cup with glass and mirror")] {
        let entries = [
            Entry::new("direct", 32).by_night(2),
            Entry::new("path", 64).without_roulette().by_night(2),
            Entry::new("light", 256).without_roulette().by_night(2),
            Entry::new("bdpt", 16).without_roulette().by_night(2),
        ];
        agree(name, &cup(contents), 5, &entries, 0.9);
    }
}
