//! A small measurement for tests.

use integrators::{Measurement, Methods, Orders, Render, RenderSettings};
use sampling::sampler::{Role, SamplerKind};
use scenes::{LoadOptions, Skip};

/// Orders 0 to 2 of the Cornell box at 11 × 9 pixels and two samples a replicate, by a method with its default settings.
pub fn measurement(method: &str, replicates: u32, tail: bool) -> Measurement {
    let scene = scenes::load("cornell_box", &LoadOptions { size: Some((11, 9)), skip: Skip::Unneeded }).unwrap();
    let method = Methods::standard().build(method, &serde_json::json!({})).unwrap();
    let settings = RenderSettings {
        orders: Orders::up_to(2),
        tail,
        samples_per_replicate: 2,
        seed: 1,
        sampler: SamplerKind::Independent,
        instance: method.name().to_owned(),
        role: Role::Estimate,
    };
    let mut render = Render::new(&scene, &*method, settings).unwrap();
    (0..replicates).for_each(|_| render.run_replicate(&|_| {}));
    render.finish()
}
