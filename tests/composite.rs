//! A composite is unbiased, order by order, whatever its runs and their shares; and a choice by pilots is a composite that is worth it.
//!
//! False-alarm rate: 0.1 % for each scene (Šidák over orders and blocks), as for every pair of methods.

use crate::support::{Entry, agree, builtin, camera, divided, is_night, lambert, left_to_the_night};
use glam::{DVec3, dvec3};
use integrators::{Methods, Orders, RenderSettings};
use neumann::choice::Choice;
use neumann::stop::Stop;
use sampling::sampler::{Role, SamplerKind};
use scenes::{SceneBuilder, Skip};
use serde_json::{Value, json};

const SIZE: u32 = 16;

/// Runs without roulette, as [`Entry::without_roulette`]: method, orders, share.
fn composite(runs: &[(&str, &str, f64)], samples: u32) -> Entry {
    let run = |(method, orders, share): &(&str, &str, f64)| json!({"method": method, "orders": orders, "share": share, "settings": {"roulette": "none"}});
    let runs: Vec<Value> = runs.iter().map(run).collect();
    Entry::new("composite", samples).with("composite", json!({ "runs": runs }))
}

/// Every method has orders on both sides of another's, and shares differ by a factor of 8.
#[test]
fn any_runs_have_the_means_of_one_method() {
    let runs = [("light", "0,3-4,7-8", 4.0), ("path", "1,6", 1.0), ("bdpt", "2,5", 0.5)];
    for name in ["cornell_box", "integrating_sphere"] {
        let entries = [composite(&runs, 48), Entry::new("bdpt", 24).without_roulette()];
        agree(&format!("composite on {name}"), &builtin(name, SIZE), 8, &entries, 0.4);
    }
}

/// Where `light` loses what mirrors and glass show, it gets order 0 alone. Above order 4 both are too noisy to say anything, as they are for
/// the law of agreement.
#[test]
fn light_that_only_some_methods_carry_is_all_there() {
    if left_to_the_night() {
        return;
    }
    let runs = [("light", "0", 1.0), ("bdpt", "2-8", 3.0), ("path", "1", 1.0)];
    let entries = [composite(&runs, 224).up_to(4), Entry::new("bdpt", 96).without_roulette()];
    agree("composite on glass_caustic", &builtin("glass_caustic", SIZE), 8, &entries, 0.3);
}

/// In every built-in scene (every day in three), by methods and regions that no pilot would choose. What is noisy for the law of agreement is noisy
/// here: camera paths seldom meet the smallest ball of `veach_mis`, and caustics in mirrors are met by chance, in `mirror_caustic` by every method alike.
#[test]
fn runs_in_regions_have_the_means_of_one_method_in_every_built_in_scene() {
    let scenes = [
        ("cornell_box", 64, 0.4),
        ("furnace", 16, 0.9),
        ("glass_caustic", 128, 0.3),
        ("integrating_sphere", 16, 0.9),
        ("indirect_lamp", 64, 0.3),
        ("mirror_caustic", 96, 0.3),
        ("veach_mis", 96, 0.5),
    ];
    let wanted = if is_night() { scenes.len() } else { 3 };
    for (name, samples, conclusive) in scenes.into_iter().take(wanted) {
        let last = if name.ends_with("caustic") { 4 } else { 8 };
        let composite = Entry::new("composite", 2 * samples).with("composite", divided("2-8")).up_to(last);
        let bdpt = Entry::new("bdpt", samples).without_roulette();
        // What two methods have to agree on decisively where a composite's samples are too few for that.
        let other = |name, samples| Entry::new(name, samples).without_roulette();
        let entries = match name {
            "mirror_caustic" => vec![composite.of_infinite_variance(), bdpt.up_to(4), other("light", 96)],
            "veach_mis" => vec![composite.of_infinite_variance(), bdpt, other("path", 256)],
            _ => vec![composite, bdpt],
        };
        agree(&format!("regions on {name}"), &builtin(name, SIZE), 8, &entries, conclusive);
    }
}

fn settings() -> RenderSettings {
    RenderSettings {
        orders: Orders::up_to(6),
        tail: true,
        samples_per_replicate: 1,
        seed: 1,
        sampler: SamplerKind::Independent,
        instance: String::new(),
        role: Role::Estimate,
    }
}

/// In every built-in scene: all orders have runs whose methods carry them there; and no choice is taken to be worse than the best method
/// by itself.
#[test]
fn pilots_choose_runs_that_carry_every_order_of_every_built_in_scene() {
    let methods = Methods::standard();
    for name in scenes::builtin::NAMES {
        let mut scene = builtin(name, SIZE);
        let choice = Choice::new(&mut scene, &methods, &settings(), &|_| 1.0, &Stop::never()).unwrap();
        assert!(choice.gain.is_none_or(|gain| gain >= 1.0) && choice.pilot_seconds > 0.0, "{name}: {choice:?}");
        let mut layers: Vec<&String> = choice.runs.iter().flat_map(|run| &run.layers).collect();
        layers.sort();
        // Several runs share an order in regions of their own alone, which the composite checks.
        layers.dedup();
        assert_eq!(layers, ["0", "1", "2", "3", "4", "5", "6", "tail"], "{name}");
        let time: f64 = choice.runs.iter().map(|run| run.time).sum();
        let samples: f64 = choice.runs.iter().map(|run| run.run.share).sum();
        assert!((time - 1.0).abs() < 1e-9 && (samples - 1.0).abs() < 1e-9, "{name}: {choice:?}");
        let method = choice.composite(&methods).unwrap();
        assert!(method.unsupported(&scene).is_none() && method.missing_light(&scene.facts).is_empty(), "{name}");
        assert_eq!((scene.camera.width(), scene.camera.height()), (SIZE, SIZE));
    }
}

/// Without an emitter all is black: nothing varies, nothing is to be gained, and that is soon found.
#[test]
fn in_the_dark_there_is_nothing_to_choose_by() {
    let mut builder = SceneBuilder::new("dark");
    let material = builder.material(lambert(0.5));
    builder.quad(dvec3(-1.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 2.0, material);
    builder.camera(camera(dvec3(0.0, 0.0, 3.0), DVec3::ZERO, 40.0, SIZE));
    let mut dark = builder.build(Skip::Unneeded).unwrap();
    let choice = Choice::new(&mut dark, &Methods::standard(), &settings(), &|_| 1.0, &Stop::never()).unwrap();
    assert_eq!((choice.gain, choice.gain_interval), (None, None));
    assert!(choice.pilot_seconds < 60.0 && choice.composite(&Methods::standard()).is_ok());
}
