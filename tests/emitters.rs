//! Emitters of every kind, alone and together: all methods agree, order by order.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over pairs, orders and blocks).

use crate::support::{ALL, Budget, COLUMNS, Entry, Family, agree, camera, lambert, measure, method, room, shining};
use glam::{DVec3, dvec3};
use sampling::bsdf::{Bsdf, RoughConductor, RoughDielectric, RoughPlastic};
use sampling::math::Spectrum;
use scenes::{ChoiceRule, Emission, Falloff, MeshData, Scene, SceneBuilder, Skip, Spot, Texture};
use serde_json::json;

/// All methods, with samples in the ratio of what they cost.
fn entries(samples: u32) -> [Entry; 4] {
    [
        Entry::new("direct", samples),
        Entry::new("path", samples).without_roulette(),
        Entry::new("light", samples).without_roulette(),
        Entry::new("bdpt", samples / 4).without_roulette(),
    ]
    .map(|entry| entry.by_night(4))
}

/// A lamp under the ceiling that shines downwards.
fn ceiling_lamp(builder: &mut SceneBuilder, width: f64, emission: Emission) {
    let black = builder.material(lambert(0.0));
    let half = width / 2.0;
    let lamp = builder.quad(dvec3(-half, 0.98, -half), DVec3::X * width, DVec3::Z * width, black);
    builder.emit(lamp, emission);
}

#[test]
fn point_emitter_in_a_room() {
    let mut builder = room("point emitter in a room");
    builder.point_emitter(dvec3(0.2, 0.4, 0.1), Spectrum::new(2.0, 1.0, 0.5));
    let scene = builder.build(Skip::Unneeded).unwrap();
    agree("point emitter in a room", &scene, 5, &entries(24), 0.9);
}

/// It hangs upright in the middle, lights both halves of the room, and its surface scatters too.
#[test]
fn two_sided_emitter() {
    let mut builder = room("two-sided emitter");
    let grey = builder.material(lambert(0.5));
    let lamp = builder.quad(dvec3(-0.1, -0.5, -0.4), dvec3(0.2, 0.0, 0.5), dvec3(0.0, 0.6, 0.1), grey);
    builder.emit(lamp, Emission { radiance: Texture::Constant(Spectrum::splat(3.0)), two_sided: true });
    let scene = builder.build(Skip::Unneeded).unwrap();
    agree("two-sided emitter", &scene, 5, &entries(24), 0.9);
}

/// A tetrahedron just above the floor, which is sampled by the solid angles of those of its faces that a point sees.
#[test]
fn few_triangles_beside_the_floor() {
    let mut builder = room("few triangles");
    let grey = builder.material(lambert(0.5));
    let positions =
        vec![dvec3(-0.3, -0.9, -0.2), dvec3(0.3, -0.95, -0.3), dvec3(0.1, -0.9, 0.4), dvec3(0.05, -0.4, 0.0)];
    let outwards = vec![[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
    let lamp = builder.mesh(MeshData { positions, triangles: outwards, ..MeshData::default() }, grey);
    builder.emit(lamp, shining(2.0));
    let scene = builder.build(Skip::Unneeded).unwrap();
    agree("few triangles beside the floor", &scene, 4, &entries(24), 0.9);
}

/// An area emitter, a ball, a point and the environment, of powers that differ a hundredfold.
#[test]
fn every_kind_at_once() {
    let mut builder = room("every kind at once");
    ceiling_lamp(&mut builder, 0.4, shining(8.0));
    let grey = builder.material(lambert(0.5));
    let ball = builder.sphere(dvec3(0.5, -0.7, 0.2), 0.15, grey);
    builder.emit(ball, shining(0.6));
    builder.point_emitter(dvec3(-0.6, -0.5, 0.3), Spectrum::new(0.01, 0.02, 0.01));
    builder.environment(Spectrum::splat(0.05));
    let scene = builder.build(Skip::Unneeded).unwrap();
    agree("every kind at once", &scene, 4, &entries(32), 0.9);
}

/// A lamp of fifty times the power, shut away in a box that lets nothing out, changes nothing but how rarely the other is
/// chosen.
#[test]
fn a_strong_emitter_that_lights_nothing() {
    let scene = |hidden: bool| -> Scene {
        let mut builder = room("hidden emitter");
        ceiling_lamp(&mut builder, 0.5, shining(4.0));
        let black = builder.material(lambert(0.0));
        builder.sphere(dvec3(0.4, -0.6, 0.1), 0.3, black);
        if hidden {
            let lamp = builder.sphere(dvec3(0.4, -0.6, 0.1), 0.2, black);
            builder.emit(lamp, shining(100.0));
        }
        builder.build(Skip::Unneeded).unwrap()
    };
    let mut family = Family::new("hidden emitter");
    let alone = measure(&scene(false), method("path").as_ref(), "alone", Budget::samples(32).up_to(3));
    for name in ALL {
        let method = method(name);
        let samples = if name == "bdpt" { 32 } else { 128 };
        let rendered = measure(&scene(true), method.as_ref(), name, Budget::samples(samples).up_to(3));
        for order in method.orders(3) {
            let label = format!("{name} order {order}");
            family.image(&label, rendered.image(order), alone.image(order));
            for (i, block) in rendered.blocks(COLUMNS).iter().enumerate() {
                family.block(format!("{label} block {i}"), rendered.over(order, block), alone.over(order, block));
            }
        }
    }
    family.finish(0.8);
}

/// Balls of metal, of glass and of coated plastic, all rough, amid one emitter of each kind.
fn gloss() -> Scene {
    let mut builder = room("gloss");
    ceiling_lamp(&mut builder, 0.4, shining(6.0));
    let metal = builder.material(Bsdf::from(RoughConductor::from_reflectance(Spectrum::splat(0.8), 0.2, 0.1)));
    let glass = builder.material(Bsdf::from(RoughDielectric::new(1.5, 0.3, 0.3)));
    let coated = builder.material(Bsdf::from(RoughPlastic::new(Spectrum::new(0.2, 0.5, 0.6), 1.5, 0.2)));
    for (x, material) in [(-0.6, metal), (0.0, glass), (0.6, coated)] {
        builder.sphere(dvec3(x, -0.65, 0.1), 0.3, material);
    }
    let black = builder.material(lambert(0.0));
    let ball = builder.sphere(dvec3(-0.3, 0.0, -0.4), 0.1, black);
    builder.emit(ball, shining(5.0));
    builder.point_emitter(dvec3(0.5, 0.3, 0.4), Spectrum::new(0.2, 0.3, 0.1));
    let (position, target) = (dvec3(-0.8, 0.8, 0.8), dvec3(-0.2, -0.7, 0.0));
    let intensity = Spectrum::splat(0.5);
    builder.spot(Spot { position, target, intensity, cutoff: 0.6, beam: 0.3, falloff: Falloff::Linear });
    builder.directional_emitter(dvec3(-0.2, -0.5, -1.0), Spectrum::splat(0.2));
    builder.environment(Spectrum::splat(0.1));
    builder.emitter_choice(ChoiceRule::Gloss);
    builder.build(Skip::Unneeded).unwrap()
}

#[test]
fn gloss_among_every_kind() {
    let direct =
        ["emitter", "mis"].map(|strategy| Entry::new("direct", 64).with(strategy, json!({ "strategy": strategy })));
    let mut entries = Vec::from(direct);
    entries.extend(["path", "adaptive"].map(|name| Entry::new(name, 64).without_roulette()));
    entries.push(Entry::new("path", 32).with("candidates", json!({"roulette": "none", "next_event_candidates": 3})));
    entries.extend(["coherent", "guided"].map(|name| Entry::new(name, 32).without_roulette()));
    entries.push(Entry::new("bdpt", 24).without_roulette());
    agree("gloss among emitters of every kind", &gloss(), 2, &entries, 0.5);
}

/// Where four lamps are mirrored in rough plates, surfaces know which of them they mirror.
#[test]
fn surfaces_that_are_asked_leave_less_to_chance() {
    let error = |rule: ChoiceRule| {
        let mut builder = SceneBuilder::new("plate");
        let metal = builder.material(Bsdf::from(RoughConductor::from_reflectance(Spectrum::splat(0.6), 0.05, 0.05)));
        builder.quad(dvec3(-4.0, 0.0, 4.0), DVec3::X * 8.0, DVec3::Z * -8.0, metal);
        let black = builder.material(lambert(0.0));
        for (x, radius, radiance) in [(-3.0, 0.6, 1.0), (-1.0, 0.2, 9.0), (1.0, 0.06, 100.0), (3.0, 0.02, 900.0)] {
            let ball = builder.sphere(dvec3(x, 1.2, -2.0), radius, black);
            builder.emit(ball, shining(radiance));
        }
        builder.camera(camera(dvec3(0.0, 2.5, 6.0), DVec3::ZERO, 50.0, 48));
        builder.emitter_choice(rule);
        let scene = builder.build(Skip::Unneeded).unwrap();
        let budget = Budget { samples: 16, replicates: 16, ..Budget::samples(1) }.up_to(1);
        let m = measure(&scene, method("path").as_ref(), rule.name(), budget).measurement;
        (0..m.pixels()).map(|pixel| m.variance(1, pixel).unwrap()[1]).sum::<f64>()
    };
    let ratio = error(ChoiceRule::Gloss) / error(ChoiceRule::Power);
    println!("variance with gloss over that by power: {ratio:.3}");
    assert!(ratio < 0.6, "{ratio}");
}
