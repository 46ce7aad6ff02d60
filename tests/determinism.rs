//! The same seed gives the same bits, whatever the number of threads and however the replicates are run.

use crate::support::{builtin, method, method_with, with_pilot};
use integrators::{Measurement, Orders, Render, RenderSettings};
use sampling::sampler::{Role, SamplerKind};
use serde_json::json;

fn settings(samples: u32, sampler: SamplerKind, instance: &str) -> RenderSettings {
    RenderSettings {
        orders: Orders::up_to(4),
        tail: false,
        samples_per_replicate: samples,
        seed: 7,
        sampler,
        instance: instance.to_owned(),
        role: Role::Estimate,
    }
}

/// All numbers of a measurement but the times, as bits.
fn bits(m: &Measurement) -> Vec<u64> {
    let mut bits = Vec::new();
    for layer in 0..m.layers.len() {
        for pixel in 0..m.pixels() {
            bits.extend(m.mean(layer, pixel).map(f64::to_bits));
            bits.extend(m.variance(layer, pixel).unwrap().map(f64::to_bits));
        }
        for block in 0..m.grid.count() {
            bits.extend(m.block_mean(layer, block).map(f64::to_bits));
        }
    }
    bits.extend(m.covariance.iter().flatten().map(|x| x.to_bits()));
    bits.extend(m.replicate_means.iter().flatten().flatten().map(|x| x.to_bits()));
    bits.extend([m.counters.closest, m.counters.shadow, m.counters.connections]);
    bits
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let [room, plates] = ["cornell_box", "veach_mis"].map(|name| builtin(name, 24));
    let by_default =
        ["direct", "path", "adaptive", "guided", "coherent", "adaptive_bdpt", "coherent_bdpt", "light", "bdpt"];
    let by_default = by_default.map(|name| (name, json!({})));
    let piloted = [
        ("bdpt", json!({"mis": "variance_aware"})),
        ("bdpt", json!({"mis": "optimal"})),
        ("path", json!({"roulette": "efficiency", "roulette_start": 1})),
    ];
    let merging = ["vcm", "ppm"].map(|name| (name, json!({"radius": 0.05})));
    let chains = ["pssmlt", "mmlt"].map(|name| (name, json!({})));
    let meshes = [("radiosity", json!({"elements": 100}))];
    for (name, settings_of) in by_default.into_iter().chain(piloted).chain(merging).chain(chains).chain(meshes) {
        // Where pixels take different numbers of samples.
        let scene = if name.starts_with("adaptive") { &plates } else { &room };
        // Where numbers come from is no concern of merging, and chains have numbers of their own.
        let samplers = if ["vcm", "ppm", "pssmlt", "mmlt", "radiosity"].contains(&name) {
            &SamplerKind::ALL[..1]
        } else {
            SamplerKind::ALL
        };
        for &sampler in samplers {
            let with_threads = |threads: usize| {
                // A method of its own, which keeps nothing that another number of threads has made.
                let method = method_with(name, settings_of.clone());
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let mut render =
                        Render::new(scene, method.as_ref(), settings(with_pilot(name, 6), sampler, name)).unwrap();
                    (0..3).for_each(|_| render.run_replicate(&|_| {}));
                    bits(&render.finish())
                })
            };
            let one = with_threads(1);
            for threads in [3, 8] {
                assert!(one == with_threads(threads), "{name} with {threads} threads and the {sampler} sampler");
            }
        }
    }
}

#[test]
fn seeds_instances_roles_and_replicates_draw_different_numbers() {
    let scene = builtin("cornell_box", 8);
    let method = method("path");
    let image = |settings: RenderSettings| {
        let mut render = Render::new(&scene, method.as_ref(), settings).unwrap();
        (0..2).for_each(|_| render.run_replicate(&|_| {}));
        render.finish().replicate_means
    };
    let base = settings(1, SamplerKind::Independent, "path");
    let mut images = vec![image(base.clone())];
    images.push(image(RenderSettings { seed: 8, ..base.clone() }));
    images.push(image(RenderSettings { instance: "path_2".into(), ..base.clone() }));
    images.push(image(RenderSettings { role: Role::Pilot, ..base.clone() }));
    images.push(image(RenderSettings { role: Role::Reference, ..base }));
    let replicates: Vec<_> = images.into_iter().flatten().collect();
    for (i, a) in replicates.iter().enumerate() {
        replicates[..i].iter().for_each(|b| assert_ne!(a[1], b[1]));
    }
}
