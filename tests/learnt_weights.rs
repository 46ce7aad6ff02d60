//! Weights of which pilots learn something, aware of variances or optimal: whatever is found, means are the truth, and those of the balance heuristic;
//! and where the camera's samples have little variance, so has the image.
//!
//! False-alarm rate: 0.1 % for each test of means (Šidák over orders and blocks).

use crate::support::{Budget, COLUMNS, Entry, Family, Truth, agree, builtin, exact, grey, measure, method_with};
use integrators::{Orders, Render, RenderSettings};
use sampling::sampler::{Role, SamplerKind};
use serde_json::{Value, json};

/// Against closed forms, by replicates of few samples, whose pilots know little.
#[test]
fn enclosures_of_known_orders() {
    for name in ["furnace", "integrating_sphere"] {
        let scene = builtin(name, 8);
        let truth =
            Truth::new(&scene, |hit, ray| (0..=8).map(|k| grey(exact(&scene, k, hit.point.p, ray.d))).collect());
        for mis in ["variance_aware", "optimal"] {
            let mut family = Family::new(format!("weights by mis={mis} in {name}"));
            for light_paths in [1, 2] {
                let settings = json!({"mis": mis, "roulette": "none", "light_paths": light_paths});
                let label = format!("{light_paths} light paths");
                let method = method_with("bdpt", settings);
                truth.compare(&mut family, &label, method.as_ref(), Budget::samples(8), COLUMNS);
            }
            family.finish(0.9);
        }
    }
}

/// Against the balance heuristic; pilots of small images know little, and what they find is far from what it should be. Orders are left out whose
/// variance by the balance heuristic leaves everything open.
#[test]
fn built_in_scenes() {
    for (name, max_order) in [("cornell_box", 6), ("veach_mis", 6), ("glass_caustic", 1), ("indirect_lamp", 4)] {
        let samples = if name == "veach_mis" { 16 } else { 8 };
        let entry =
            |label, mis| Entry::new("bdpt", samples).with(label, json!({"mis": mis, "roulette": "none"})).by_night(16);
        let mut entries = vec![entry("by densities", "balance"), entry("by variances", "variance_aware")];
        // Elsewhere a few contributions decide, by all weights alike.
        if ["cornell_box", "indirect_lamp"].contains(&name) {
            entries.push(entry("optimal", "optimal"));
        }
        agree(&format!("learnt weights on {name}"), &builtin(name, 16), max_order, &entries, 0.4);
    }
}

/// Once scattered light of a large lamp is found by the camera's walks with less noise than by light walks, of which the balance heuristic does
/// not know that they are many.
#[test]
fn direct_light_in_the_cornell_box_has_much_less_variance() {
    let scene = builtin("cornell_box", 48);
    let budget = Budget { samples: 16, replicates: 16, ..Budget::samples(1) };
    let [balance, aware, optimal] = ["balance", "variance_aware", "optimal"].map(|mis| {
        let rendered = measure(&scene, method_with("bdpt", json!({"mis": mis})).as_ref(), mis, budget.up_to(1));
        let m = &rendered.measurement;
        (0..m.pixels()).flat_map(|pixel| m.variance(1, pixel).unwrap()).sum::<f64>()
    });
    println!("direct light: {:.2} and {:.2} times the variance", aware / balance, optimal / balance);
    assert!(aware < 0.5 * balance && optimal < 0.8 * balance, "{aware} and {optimal} against {balance}");
}

/// By roulette that follows the throughput, say, a path is chosen with a chance that depends on the strategy and is in no density, and control variates
/// would no longer cancel.
#[test]
fn optimal_weights_refuse_what_no_density_knows() {
    let scene = builtin("cornell_box", 8);
    let settings = RenderSettings {
        orders: Orders::up_to(2),
        tail: false,
        samples_per_replicate: 1,
        seed: 1,
        sampler: SamplerKind::Independent,
        instance: String::new(),
        role: Role::Estimate,
    };
    let refused = |key: &str, value: Value| {
        let method = method_with("bdpt", json!({"mis": "optimal", key: value}));
        Render::new(&scene, method.as_ref(), settings.clone()).err().map(|error| error.to_string())
    };
    for (key, value) in
        [("roulette", json!("throughput")), ("connections", json!("resampled")), ("next_event_candidates", json!(2))]
    {
        let message = refused(key, value).expect("it would be biased");
        assert!(message.contains(key) && message.contains("mis=balance"), "{message}");
    }
    assert_eq!(refused("connections", json!("roulette")), None);
    assert_eq!(refused("light_paths", json!(2)), None);
}
