//! Leaving out what a scene doesn't need changes no result: skips that only remove work leave the same bits.

use crate::support::{self, ALL, Budget, Family, builtin, builtin_with, camera, lambert, method, shining};
use glam::DVec3;
use integrators::{Counters, Measurement, Orders, Render, RenderSettings};
use sampling::bsdf::{Bsdf, Mirror};
use sampling::math::Spectrum;
use sampling::sampler::{Role, SamplerKind};
use scenes::{Scene, SceneBuilder, Skip, Work};

fn measure(scene: &Scene, name: &str, orders: Orders) -> Measurement {
    let method = method(name);
    let settings = RenderSettings {
        orders,
        tail: false,
        samples_per_replicate: 8,
        seed: 3,
        sampler: SamplerKind::Independent,
        instance: name.to_owned(),
        role: Role::Estimate,
    };
    let mut render = Render::new(scene, method.as_ref(), settings).unwrap();
    render.run_replicate(&|_| {});
    render.finish()
}

fn image(scene: &Scene, name: &str, orders: Orders) -> Vec<Vec<[f64; 3]>> {
    let m = measure(scene, name, orders);
    (0..m.layers.len()).map(|layer| (0..m.pixels()).map(|p| m.mean(layer, p)).collect()).collect()
}

/// Pixels of all layers that differ between two scenes.
fn differing(a: &Scene, b: &Scene, name: &str) -> usize {
    let [a, b] = [a, b].map(|scene| image(scene, name, Orders::up_to(5)));
    a.iter().flatten().zip(b.iter().flatten()).filter(|(a, b)| a != b).count()
}

/// A box of one material with a ball in it, lit by a ball or by a point, which no ray meets.
fn lit_box(material: Bsdf, lamp: bool) -> SceneBuilder {
    let mut builder = SceneBuilder::new("box");
    let material = builder.material(material);
    let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| axis * 2.0);
    for (u, v, across) in [(x, y, z), (y, z, x), (z, x, y)] {
        builder.quad(DVec3::NEG_ONE, u, v, material);
        builder.quad(DVec3::NEG_ONE + across, v, u, material);
    }
    builder.sphere(DVec3::new(-0.3, -0.6, -0.2), 0.4, material);
    let above = DVec3::new(0.1, 0.7, 0.2);
    if lamp {
        let ball = builder.sphere(above, 0.15, material);
        builder.emit(ball, shining(4.0));
    } else {
        builder.point_emitter(above, Spectrum::ONE);
    }
    builder.camera(camera(DVec3::new(0.3, 0.1, 0.9), DVec3::ZERO, 60.0, 16));
    builder
}

/// The scenes of the program, and two that need less in other ways: no emitter to be met, and nothing to be connected.
fn builders() -> Vec<SceneBuilder> {
    let own = scenes::builtin_names().iter().map(|name| scenes::load::open(name, Some((16, 16))).unwrap());
    let mirror = Mirror { reflectance: Spectrum::splat(0.7) };
    own.chain([lit_box(lambert(0.6), false), lit_box(mirror.into(), true)]).collect()
}

#[test]
fn skips_change_no_bit() {
    for &scene in scenes::builtin_names() {
        let [lean, full] = [Skip::Unneeded, Skip::Nothing].map(|skip| builtin_with(scene, 24, skip));
        assert!(full.needs.skipped().is_empty(), "{scene}: {:?}", full.needs.skipped());
        for name in ALL {
            assert_eq!(differing(&lean, &full, name), 0, "{scene}, {name}: pixels that differ");
        }
    }
}

#[test]
fn no_skip_by_itself_changes_a_bit() {
    let mut tried = Vec::new();
    for builder in builders() {
        let lean = builder.clone().build(Skip::Unneeded).unwrap();
        for work in Work::ALL.into_iter().filter(|&work| lean.needs.skips(work)) {
            let full = builder.clone().build(Skip::AllBut(work)).unwrap();
            let others = lean.needs.skipped().into_iter().filter(|name| *name != work.name());
            assert_eq!(full.needs.skipped(), others.collect::<Vec<_>>(), "{}", lean.name);
            for name in ALL {
                let differing = differing(&lean, &full, name);
                assert_eq!(differing, 0, "{}, {name}, {}: pixels that differ", lean.name, work.name());
            }
            tried.push(work);
        }
    }
    assert!(Work::ALL.iter().all(|work| tried.contains(work)), "{tried:?}");
}

/// Where there is a choice among emitters, a black one moves the numbers by which the others are chosen, and no mean.
#[test]
fn a_black_environment_changes_nothing() {
    let mut family = Family::new("black environment");
    for builder in builders() {
        let lean = builder.clone().build(Skip::Unneeded).unwrap();
        if lean.environment.is_some() {
            continue;
        }
        let mut builder = builder;
        builder.environment(Spectrum::ZERO);
        let full = builder.build(Skip::Unneeded).unwrap();
        if !lean.needs.emitter_choice {
            for name in ALL {
                assert_eq!(differing(&lean, &full, name), 0, "{}, {name}: pixels that differ", lean.name);
            }
            continue;
        }
        for name in ["path", "bdpt"] {
            let [a, b] = [(&lean, "lean"), (&full, "full")].map(|(scene, instance)| {
                support::measure(scene, method(name).as_ref(), instance, Budget::samples(8).up_to(3))
            });
            for k in 0..=3 {
                let label = format!("{}, {name}, order {k}", lean.name);
                // The lamps of the other scene with a choice are too small for so few samples to decide.
                match lean.name == "furnace" {
                    true => family.image(label, a.image(k), b.image(k)),
                    false => family.spare(label, a.image(k), b.image(k)),
                }
            }
        }
    }
    family.finish(0.0);
}

#[test]
fn orders_not_asked_for_change_no_bit_of_the_others() {
    for scene in ["cornell_box", "glass_caustic", "veach_mis"] {
        let scene = builtin(scene, 24);
        for name in ["path", "light", "bdpt"] {
            let all = image(&scene, name, Orders::up_to(5));
            let some = image(&scene, name, Orders::parse("1,3-4", 5).unwrap());
            assert!(some == [all[1].clone(), all[3].clone(), all[4].clone()], "{}, {name}", scene.name);
        }
    }
}

fn counted(scene: &Scene, name: &str, orders: &str) -> Counters {
    measure(scene, name, Orders::parse(orders, 5).unwrap()).counters
}

#[test]
fn orders_not_asked_for_are_not_traced() {
    let scene = builtin("cornell_box", 24);
    // Order 1: a camera ray, a segment to an emitter, and a ray that may meet one; no second bounce.
    for name in ["direct", "path"] {
        let Counters { closest, shadow, camera_paths, bsdf_samples, .. } = counted(&scene, name, "1");
        assert!(closest <= 2 * camera_paths && shadow <= camera_paths && bsdf_samples <= camera_paths, "{name}");
    }
    let Counters { closest, light_paths, bsdf_samples, .. } = counted(&scene, "light", "1");
    assert!(closest <= light_paths && bsdf_samples == 0);
    // Order 0 has no light subpaths.
    let Counters { closest, light_paths, camera_paths, .. } = counted(&scene, "bdpt", "0");
    assert_eq!((closest, light_paths), (camera_paths, 0));
    // No connection is looked at but those of the orders asked for: those of a part and of the rest are those of all.
    for name in ["path", "light", "bdpt"] {
        let [low, high, all] =
            ["0-2", "3-5", "0-5"].map(|orders| counted(&scene, name, orders)).map(|c| (c.connections, c.shadow));
        assert!(low.0 > 0 && high.0 > 0, "{name}");
        assert_eq!((low.0 + high.0, low.1 + high.1), all, "{name}");
    }
}

#[test]
fn orders_that_a_method_has_no_strategy_for_are_no_layers() {
    let scene = builtin("cornell_box", 24);
    assert_eq!(measure(&scene, "direct", Orders::up_to(5)).layers.len(), 2);
}

#[test]
fn rays_that_could_meet_emitters_alone_are_not_traced_where_there_are_none() {
    let [lean, full] =
        [Skip::Unneeded, Skip::AllBut(Work::EmitterHits)].map(|skip| lit_box(lambert(0.6), false).build(skip).unwrap());
    for (name, order) in [("direct", "1"), ("path", "3"), ("bdpt", "3")] {
        let [a, b] = [&lean, &full].map(|scene| counted(scene, name, &format!("0-{order}")));
        assert!(a.closest + a.camera_paths / 8 < b.closest, "{name}: {} against {}", a.closest, b.closest);
        assert_eq!((a.shadow, a.connections), (b.shadow, b.connections), "{name}");
    }
    // What a camera ray meets serves nothing else.
    assert_eq!(counted(&lean, "path", "0").closest, 0);
}
