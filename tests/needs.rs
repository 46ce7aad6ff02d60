//! Leaving out what a scene doesn't need changes no result: skips that only remove work leave the same bits.

use crate::support::{builtin_with, method};
use integrators::{Orders, Render, RenderSettings};
use sampling::sampler::{Role, SamplerKind};
use scenes::{Scene, Skip};

fn image(scene: &Scene, name: &str, orders: Orders) -> Vec<Vec<[f64; 3]>> {
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
    let m = render.finish();
    (0..m.layers.len()).map(|layer| (0..m.pixels()).map(|p| m.mean(layer, p)).collect()).collect()
}

#[test]
fn skips_change_no_bit() {
    for &scene in scenes::builtin_names() {
        let [lean, full] = [Skip::Unneeded, Skip::Nothing].map(|skip| builtin_with(scene, 24, skip));
        assert!(full.needs.skipped().is_empty(), "{scene}: {:?}", full.needs.skipped());
        for name in ["direct", "path", "light", "bdpt"] {
            let [a, b] = [&lean, &full].map(|s| image(s, name, Orders::up_to(5)));
            let differing = a.iter().flatten().zip(b.iter().flatten()).filter(|(a, b)| a != b).count();
            assert_eq!(differing, 0, "{scene}, {name}: pixels that differ, of {}", a.len() * a[0].len());
        }
    }
}

#[test]
fn orders_not_asked_for_change_no_bit_of_the_others() {
    for scene in ["cornell_box", "glass_caustic"] {
        let scene = builtin_with(scene, 24, Skip::Unneeded);
        for name in ["path", "light", "bdpt"] {
            let all = image(&scene, name, Orders::up_to(5));
            let some = image(&scene, name, Orders::parse("1,3-4", 5).unwrap());
            assert!(some == [all[1].clone(), all[3].clone(), all[4].clone()], "{}, {name}", scene.name);
        }
    }
}
