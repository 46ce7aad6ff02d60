//! A sample traced again gives the same contributions, to the bit, with the vertices of their paths.

use crate::support::{builtin, method_with, room, sky, with_pilot};
use integrators::integrator::Replicate;
use integrators::vertex::Site;
use integrators::{
    Contribution, Integrator, Measurement, Orders, PartSettings, Render, RenderSettings, Request, Technique, Window,
    render,
};
use sampling::sampler::{Role, SamplerKind, StreamKey};
use scenes::{Mapping, Scene, Skip};
use serde_json::{Value, json};

/// Every method, and what of `bdpt` draws numbers of its own.
fn methods() -> Vec<Box<dyn Integrator>> {
    let settings: [(&str, Value); 23] = [
        ("direct", json!({})),
        ("path", json!({})),
        ("light", json!({})),
        ("bdpt", json!({})),
        ("bdpt", json!({"connections": "resampled", "light_paths": 2, "next_event_candidates": 3})),
        ("bdpt", json!({"connections": "roulette", "roulette": "throughput"})),
        ("bdpt", json!({"mis": "variance_aware"})),
        ("bdpt", json!({"mis": "optimal"})),
        ("path", json!({"strategy": "bsdf"})),
        ("path", json!({"strategy": "emitter"})),
        ("path", json!({"next_event_candidates": 3})),
        ("path", json!({"roulette": "efficiency", "roulette_start": 1})),
        ("guided", json!({})),
        ("adaptive", json!({})),
        ("adaptive_bdpt", json!({})),
        ("composite", json!({"runs": "path:1:0.3;adaptive_bdpt:0,2-4:0.7"})),
        ("coherent", json!({})),
        ("coherent_bdpt", json!({})),
        ("coherent_bdpt", json!({"own_samples": "path"})),
        ("local", json!({})),
        ("whitted", json!({})),
        ("vcm", json!({"radius": 0.1})),
        ("ppm", json!({"radius": 0.1})),
    ];
    settings.into_iter().map(|(name, settings)| method_with(name, settings)).collect()
}

fn under_a_sky() -> Scene {
    let mut builder = room("glossy");
    builder.environment_image(sky(Mapping::Equirectangular, 50.0));
    builder.build(Skip::Unneeded).unwrap()
}

fn settings(name: &str, sampler: SamplerKind) -> RenderSettings {
    RenderSettings {
        orders: Orders::up_to(4),
        tail: false,
        // Enough for the pilot of a run that has two thirds of them.
        samples_per_replicate: if name == "composite" { 32 } else { with_pilot(name, 4) },
        seed: 3,
        sampler,
        instance: "replay".to_owned(),
        role: Role::Estimate,
    }
}

fn request(scene: &Scene, method: &dyn Integrator, settings: &RenderSettings) -> Request {
    render::request(scene, method, settings, &PartSettings::default()).unwrap()
}

/// Two replicates, with or without the largest contributions.
fn measure(scene: &Scene, method: &dyn Integrator, settings: RenderSettings, fireflies: bool) -> Measurement {
    let request = request(scene, method, &settings);
    let request = if fireflies { request.with_fireflies() } else { request };
    let window = Window::whole(scene.camera.width(), scene.camera.height());
    let mut render = Render::of_request(scene, method, settings, window, request).unwrap();
    (0..2).for_each(|_| render.run_replicate(&|_| {}));
    render.finish()
}

/// Checks that a path is one: as many vertices as its technique says, and what the camera's walk alone made is its last vertex'
/// throughput times what that emits.
fn check_path(scene: &Scene, c: &Contribution) {
    let (Technique::Connect { s, t } | Technique::Merge { s, t }) = c.technique else { panic!() };
    assert_eq!((c.path.light.len(), c.path.camera.len()), (usize::from(s), usize::from(t)));
    let last = &c.path.camera[usize::from(t) - 1];
    if let Technique::Merge { .. } = c.technique {
        // Within the radius of one another.
        let met = c.path.light[usize::from(s) - 1].at.p;
        assert!(met.distance(last.at.p) <= 0.1 * scene.bounds.radius);
    }
    if s == 0 {
        let le = match &last.site {
            Site::Surface(hit) => scene.le(hit, last.wo),
            _ => scene.environment_le(-last.wo),
        };
        let expected = (last.beta * le).to_array();
        for (value, expected) in c.value.to_array().into_iter().zip(expected) {
            assert!((value - expected).abs() <= 1e-5 * expected, "{value} {expected}");
        }
    }
}

#[test]
fn the_largest_contributions_are_traced_again_to_the_bit() {
    let scenes = [builtin("glass_caustic", 16), builtin("veach_mis", 16), under_a_sky()];
    for scene in &scenes {
        for method in methods() {
            for sampler in [SamplerKind::Independent, SamplerKind::Sobol] {
                let settings = settings(method.name(), sampler);
                let measured = measure(scene, &*method, settings.clone(), true);
                let request = request(scene, &*method, &settings);
                let mut count = 0;
                for firefly in measured.fireflies.layers().iter().flatten() {
                    let key = StreamKey::new(settings.seed, &settings.instance, settings.role, firefly.replicate);
                    let replicate =
                        Replicate { number: firefly.replicate, key, sampler, samples: settings.samples_per_replicate };
                    let mut found = false;
                    let mut show = |c: &Contribution| {
                        if request.wants(c.technique.order()) {
                            check_path(scene, c);
                            let same = (c.raster, c.value, c.weight) == (firefly.raster, firefly.value, firefly.weight);
                            found |= c.technique == firefly.technique && same;
                        }
                    };
                    assert!(method.begin(scene, &request, replicate).replay(firefly.pixel, firefly.sample, &mut show));
                    assert!(found, "{} in {}: {firefly:?}", method.name(), scene.name);
                    count += 1;
                }
                assert!(count >= 8, "{} in {}: {count}", method.name(), scene.name);
            }
        }
    }
}

#[test]
fn looking_for_the_largest_changes_no_bit_and_finds_the_same_with_any_threads() {
    let scene = builtin("glass_caustic", 40);
    for method in methods() {
        let with_threads = |threads: usize, fireflies| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| measure(&scene, &*method, settings(method.name(), SamplerKind::Independent), fireflies))
        };
        let (plain, one, many) = (with_threads(2, false), with_threads(1, true), with_threads(5, true));
        assert_eq!(plain.replicate_means, one.replicate_means);
        assert!(plain.fireflies.layers().iter().all(Vec::is_empty));
        assert_eq!(one.fireflies, many.fireflies);
    }
}
