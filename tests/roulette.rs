//! Roulette moves no mean, and the tail that it makes possible joins on to the truncated series.
//!
//! False-alarm rate: 0.1 % for each test.

use crate::support::{Budget, Entry, Estimate, Family, agree, builtin, exact, grey, measure, method_with};
use serde_json::json;

/// The last order whose comparisons must decide something.
const DECIDED: usize = 4;

#[test]
fn roulette_moves_no_mean() {
    let mut family = Family::new("roulette");
    for (scene, samples) in [("cornell_box", 64)] {
        let scene = builtin(scene, 8);
        let pairs = [
            ("path", json!({"roulette": "none"}), json!({"roulette": "throughput", "roulette_start": 1})),
            ("light", json!({"roulette": "none"}), json!({"roulette": "throughput", "roulette_start": 1})),
            ("bdpt", json!({"roulette": "none"}), json!({"roulette": "local"})),
        ];
        for (name, off, on) in pairs {
            let budget = Budget::samples(samples);
            let off = measure(&scene, method_with(name, off).as_ref(), &format!("{name}_off"), budget);
            let on = measure(&scene, method_with(name, on).as_ref(), &format!("{name}_on"), budget);
            for order in 0..=8 {
                let label = format!("{} {name} order {order}", scene.name);
                // Roulette makes high orders rare: they must not differ, but need not decide.
                if order > DECIDED {
                    family.spare(label, off.image(order), on.image(order));
                    continue;
                }
                family.layer(&label, order, 4, &off, &on);
            }
        }
    }
    family.finish(0.5);
}

/// Whatever a pilot has learned.
#[test]
fn roulette_by_efficiency_moves_no_mean() {
    let settings = json!({"roulette": "efficiency", "roulette_start": 1});
    let entries =
        [Entry::new("path", 64).with("roulette by efficiency", settings), Entry::new("path", 64).without_roulette()];
    agree("roulette by efficiency in cornell_box", &builtin("cornell_box", 16), 5, &entries, 0.25);
}

/// The tail beyond order 2 must be the orders 3 to 20 and what little follows them, in a scene with a closed form.
#[test]
fn the_tail_is_the_rest_of_the_series() {
    let scene = builtin("furnace", 4);
    let emitted = |k: usize| {
        let ray = scene.camera.sample_we(sampling::vec2(2.0, 2.0), sampling::Vec2::ZERO).ray;
        let hit = scene.intersect(&ray).unwrap();
        exact(&scene, k, hit.point.p, ray.d)
    };
    let mut family = Family::new("tail");
    let by_efficiency = json!({"roulette": "efficiency", "roulette_start": 1});
    for (name, settings) in
        [("path", json!({})), ("path", by_efficiency), ("light", json!({})), ("bdpt", json!({"roulette": "local"}))]
    {
        let budget = Budget { max_order: 2, tail: true, ..Budget::samples(128) };
        let m = measure(&scene, method_with(name, settings).as_ref(), name, budget);
        let truth: f64 = (3..200).map(|k| grey(emitted(k))).sum();
        family.image(format!("{name} tail"), m.image(3), Estimate::exact(truth));
    }
    family.finish(0.0);
}
