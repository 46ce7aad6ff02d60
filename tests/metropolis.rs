//! Chains carry what independent samples do: closed forms, `bdpt` order by order, and every part of an image, from replicates short and
//! long.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over methods, orders and blocks). Replicates are independent, so that their scatter
//! has the error of the normalisation in it; that chains have none of the start is what the short ones would show.

use crate::support::{
    Budget, Entry, Estimate, Family, Truth, agree, builtin, camera, exact, furnished, grey, lambert, left_to_the_night,
    measure, method, method_with, room, seed, shining,
};
use glam::{DVec3, dvec3};
use integrators::render::request;
use integrators::{
    Bias, Measurement, Orders, Part, PartSettings, Quantity, Render, RenderError, RenderSettings, Request,
};
use sampling::bsdf::{Bsdf, Mirror};
use sampling::filter::Filter;
use sampling::math::Spectrum;
use sampling::sampler::{Role, SamplerKind};
use scenes::{Scene, SceneBuilder, Skip};
use serde_json::{Value, json};

/// Both methods; without roulette, as everything that high orders are compared with.
fn methods() -> [(&'static str, Value); 2] {
    [("pssmlt", json!({"roulette": "none"})), ("mmlt", json!({}))]
}

fn settings(samples: u32, instance: &str) -> RenderSettings {
    RenderSettings {
        orders: Orders::up_to(4),
        tail: false,
        samples_per_replicate: samples,
        seed: seed(),
        sampler: SamplerKind::Independent,
        instance: instance.to_owned(),
        role: Role::Estimate,
    }
}

/// One sample per pixel is a chain of 64 mutations that begins at one of 8 points.
#[test]
fn in_a_sphere_of_known_light_replicates_short_and_long_have_the_truth() {
    let scene = builtin("integrating_sphere", 8);
    let truth = Truth::new(&scene, |hit, ray| (0..=3).map(|k| grey(exact(&scene, k, hit.point.p, ray.d))).collect());
    let mut family = Family::new("integrating sphere");
    for (name, with) in methods() {
        let method = method_with(name, with);
        for (samples, replicates) in [(1, 1024), (64, 64)] {
            let budget = Budget { samples, replicates, ..Budget::samples(1) };
            truth.compare(&mut family, &format!("{name} {samples}"), method.as_ref(), budget, 2);
        }
    }
    family.finish(0.6);
}

fn agree_on(name: &str, entries: &[Entry], conclusive: f64) {
    agree(name, &builtin(name, 16), 5, entries, conclusive);
}

fn entries(samples: [u32; 3]) -> [Entry; 3] {
    let [pssmlt, mmlt, bdpt] = samples;
    [
        Entry::new("pssmlt", pssmlt).without_roulette(),
        Entry::new("mmlt", mmlt),
        Entry::new("bdpt", bdpt).without_roulette(),
    ]
}

#[test]
fn cornell_box() {
    agree_on("cornell_box", &entries([192, 192, 32]), 0.4);
}

#[test]
fn indirect_lamp() {
    agree_on("indirect_lamp", &entries([192, 96, 16]), 0.25);
}

/// What a mirror shows of the lamp by way of the glass is rare and bright: chains are held to their error, and decide nothing.
#[test]
fn glass_caustic() {
    let [pssmlt, mmlt, bdpt] = entries([96, 64, 32]);
    let light = Entry::new("light", 96).without_roulette();
    agree_on("glass_caustic", &[pssmlt.of_infinite_variance(), mmlt.of_infinite_variance(), bdpt, light], 0.4);
}

#[test]
fn furnace() {
    agree_on("furnace", &entries([16, 48, 4]), 0.8);
}

/// Every order of the image mean: of 2048 replicates of 256 mutations, of 64 of 8 thousand, and of `path`. And the brightness of all
/// orders together, which is what is normalised.
#[test]
fn few_long_replicates_are_as_many_short_ones() {
    if left_to_the_night() {
        return;
    }
    let scene = builtin("furnace", 16);
    let path = measure(&scene, method("path").as_ref(), "path", Budget::samples(32).up_to(3));
    let mut family = Family::new("short and long");
    for (name, with) in methods() {
        let method = method_with(name, with);
        let of = |samples: u32, replicates: u32| {
            let budget = Budget { samples, replicates, ..Budget::samples(1).up_to(3) };
            measure(&scene, method.as_ref(), &format!("{name} {samples}"), budget)
        };
        let (short, long) = (of(1, 2048), of(32, 64));
        for order in 0..=3 {
            family.image(format!("{name} short order {order}"), short.image(order), path.image(order));
            family.image(format!("{name} long order {order}"), long.image(order), path.image(order));
        }
        for (label, rendered) in [("short", &short), ("long", &long)] {
            family.image(format!("{name} {label}, all"), rendered.total(&rendered.all()), path.total(&path.all()));
        }
    }
    family.finish(1.0);
}

/// A wide filter, a lens and an environment, and the tail where there is one.
#[test]
fn filters_lenses_environments_and_tails() {
    let mut builder = room("bright");
    builder.environment(Spectrum::new(0.2, 0.5, 1.0));
    let black = builder.material(lambert(0.0));
    let lamp = builder.quad(dvec3(-0.3, 0.95, -0.3), DVec3::X * 0.6, DVec3::Z * 0.6, black);
    builder.emit(lamp, shining(2.0));
    builder.camera(scenes::CameraSettings {
        projection: scenes::Projection::ThinLens { fov: 39.3, lens_radius: 0.05, focus_distance: Some(3.0) },
        ..camera(dvec3(0.0, 0.0, 3.9), DVec3::ZERO, 39.3, 16)
    });
    let mut scene = builder.build(Skip::Unneeded).unwrap();
    scene.camera.set_filter(Filter::Mitchell);
    let mut family = Family::new("filters, lenses, environments, tails");
    for (name, tail) in [("pssmlt", true), ("mmlt", false)] {
        let budget = |samples| Budget { tail, ..Budget::samples(samples).up_to(2) };
        let of = measure(&scene, method(name).as_ref(), name, budget(64));
        let path = measure(&scene, method("path").as_ref(), &format!("path {tail}"), budget(64));
        for layer in 0..of.measurement.layers.len() {
            family.image(format!("{name} layer {layer}"), of.image(layer), path.image(layer));
            for (i, block) in of.blocks(2).iter().enumerate() {
                family.block(format!("{name} layer {layer} block {i}"), of.over(layer, block), path.over(layer, block));
            }
        }
    }
    family.finish(0.9);
}

fn render(scene: &Scene, (name, with): (&str, Value), parts: &PartSettings, replicates: u32) -> Measurement {
    let method = method_with(name, with);
    let settings = settings(if name == "bdpt" { 64 } else { 96 }, name);
    let request = request(scene, method.as_ref(), &settings, parts).unwrap();
    let window = integrators::Window::whole(scene.camera.width(), scene.camera.height());
    let mut render = Render::of_request(scene, method.as_ref(), settings, window, request).unwrap();
    (0..replicates).for_each(|_| render.run_replicate(&|_| {}));
    render.finish()
}

fn image(m: &Measurement, layer: usize) -> Estimate {
    Estimate::of(&m.replicate_means.iter().map(|means| grey(means[layer])).collect::<Vec<_>>())
}

/// What strategies of chains are weighted by and would give alone is what those of `bdpt` are and would; light groups too.
#[test]
fn parts_are_those_of_independent_samples() {
    let parts = PartSettings { strategies: true, groups: true, ..PartSettings::default() };
    let scene = furnished([true, true]);
    let bdpt = render(&scene, ("bdpt", json!({"roulette": "none"})), &parts, 64);
    let mmlt = render(&scene, ("mmlt", json!({})), &parts, 64);
    assert_eq!(bdpt.parts, mmlt.parts);
    let mut family = Family::new("parts");
    for (layer, part) in bdpt.parts() {
        match part {
            // Contributions that weigh nothing are no light that a chain could look for.
            Part::Strategy { s, t, quantity: Quantity::Weighted } if s + t <= 4 => {}
            Part::Group { .. } => {}
            _ => continue,
        }
        family.spare(format!("{part:?}"), image(&bdpt, layer), image(&mmlt, layer));
    }
    let scene = builtin("integrating_sphere", 4);
    let bdpt = render(&scene, ("bdpt", json!({"roulette": "none"})), &parts, 128);
    let mmlt = render(&scene, ("mmlt", json!({})), &parts, 512);
    for (layer, part) in bdpt.parts() {
        if let Part::Strategy { s, t, .. } = part
            && s + t <= 5
        {
            family.spare(format!("sphere {part:?}"), image(&bdpt, layer), image(&mmlt, layer));
        }
    }
    for order in 0..=1 {
        family.image(format!("sphere order {order}"), image(&bdpt, order), image(&mmlt, order));
    }
    family.finish(1.0);
}

#[test]
fn methods_say_what_they_carry() {
    for (name, base) in [("pssmlt", "path"), ("mmlt", "bdpt")] {
        let (chains, base) = (method(name), method(base));
        assert_eq!((chains.expression(), chains.bias()), (base.expression(), Bias::None));
        assert_eq!(chains.carries_subsurface(), base.carries_subsurface());
        let mut builder = room("point");
        let mirror = builder.material(Bsdf::from(Mirror { reflectance: Spectrum::splat(0.9) }));
        builder.sphere(dvec3(0.3, 0.0, 0.0), 0.2, mirror);
        builder.point_emitter(DVec3::ZERO, Spectrum::ONE);
        let needs = builder.build(Skip::Unneeded).unwrap().facts;
        assert_eq!(base.missing_light(&needs).len(), 1);
        assert_eq!(chains.missing_light(&needs), base.missing_light(&needs));
    }
}

/// A lamp in a closed box of black walls, and a camera outside.
fn dark() -> SceneBuilder {
    let mut builder = room("dark");
    let black = builder.material(lambert(0.0));
    crate::support::block(&mut builder, dvec3(-0.2, -0.2, -0.2), dvec3(0.2, 0.2, 0.2), black);
    let lamp = builder.sphere(DVec3::ZERO, 0.05, black);
    builder.emit(lamp, shining(1.0));
    builder
}

#[test]
fn a_chain_without_seeds_is_one_error_and_a_room_without_lamps_is_black() {
    let scene = dark().build(Skip::Unneeded).unwrap();
    for (name, instead) in [("pssmlt", "light or bdpt"), ("mmlt", "light or vcm")] {
        let method = method(name);
        let error = Render::new(&scene, method.as_ref(), settings(1, name)).err().expect("no seeds");
        assert!(matches!(error, RenderError::Unsupported { .. }));
        let message = error.to_string();
        for word in [name, "no path to begin with", "65536", "up to order 8", instead] {
            assert!(message.contains(word), "`{word}` in {message}");
        }
        let black = room("without lamps").build(Skip::Unneeded).unwrap();
        let mut render = Render::new(&black, method.as_ref(), settings(1, name)).unwrap();
        render.run_replicate(&|_| {});
        let measured = render.finish();
        assert_eq!(measured.total_image_mean(), [0.0; 3]);
    }
}

#[test]
fn what_cannot_be_is_refused_with_the_mend() {
    let refused = |name: &str, settings: Value| {
        integrators::Methods::standard().build(name, &settings).err().expect("refused").to_string()
    };
    for name in ["pssmlt", "mmlt"] {
        for (key, value, mend) in [
            ("large_steps", json!(0.0), "such as 0.3"),
            ("large_steps", json!(1.5), "such as 0.3"),
            ("small_step", json!(0.7), "such as 0.015625"),
            ("small_step", json!(0.0), "such as 0.015625"),
            ("bootstrap", json!(0.0), "such as 0.125"),
        ] {
            let message = refused(name, json!({ key: value }));
            assert!(message.contains(&format!("setting `{key}`")) && message.contains(mend), "{message}");
        }
    }
    let scene = builtin("cornell_box", 8);
    let with_tail = RenderSettings { tail: true, ..settings(1, "tail") };
    let message = Render::new(&scene, method("mmlt").as_ref(), with_tail.clone()).err().unwrap().to_string();
    assert!(message.contains("leave out the tail, or use pssmlt"), "{message}");
    assert!(Render::new(&scene, method("pssmlt").as_ref(), with_tail.clone()).is_ok());
    let endless = method_with("pssmlt", json!({"roulette": "none"}));
    let message = Render::new(&scene, endless.as_ref(), with_tail).err().unwrap().to_string();
    assert!(message.contains("roulette=throughput"), "{message}");
    // No sample of a chain stands alone.
    let replicate = integrators::integrator::Replicate {
        number: 0,
        key: sampling::sampler::StreamKey::new(0, "mmlt", Role::Estimate, 0),
        sampler: SamplerKind::Independent,
        samples: 1,
    };
    let request = Request::new(Orders::up_to(2), false);
    assert!(!method("mmlt").begin(&scene, &request, replicate).replay((0, 0), 0, &mut |_| {}));
}
