use super::*;
use crate::lpe::loses;
use crate::measurement::Measurement;
use crate::render::{Render, RenderSettings};
use crate::request::Orders;
use sampling::sampler::{Role, SamplerKind};
use scenes::{LoadOptions, Skip};

fn composite(runs: Value) -> Result<Box<dyn Integrator>, String> {
    Methods::standard().build(NAME, &json!({ "runs": runs })).map_err(|e| e.to_string())
}

fn scene(name: &str) -> Scene {
    scenes::load(name, &LoadOptions { size: Some((20, 18)), skip: Skip::Unneeded }).unwrap()
}

fn measured(scene: &Scene, method: &dyn Integrator, samples: u32, replicates: u32) -> Measurement {
    let settings = RenderSettings {
        orders: Orders::up_to(3),
        tail: false,
        samples_per_replicate: samples,
        seed: 3,
        sampler: SamplerKind::Independent,
        instance: method.name().to_owned(),
        role: Role::Estimate,
    };
    let mut render = Render::new(scene, method, settings).unwrap();
    (0..replicates).for_each(|_| render.run_replicate(&|_| {}));
    render.finish()
}

/// |t| < 4.5 for each of the four orders: one false alarm in 37 000, for the seed is fixed.
#[test]
fn every_order_has_the_mean_of_its_own_method() {
    let scene = scene("cornell_box");
    let runs = json!([
        {"method": "light", "orders": "0,3", "share": 3.0},
        {"method": "bdpt", "orders": "2", "share": 0.5},
        {"method": "path", "orders": "1", "share": 1.5, "settings": {"strategy": "emitter"}},
    ]);
    let composite = composite(runs).unwrap();
    let path = Methods::standard().build("path", &Value::Null).unwrap();
    let (a, b) = (measured(&scene, &*composite, 10, 64), measured(&scene, &*path, 10, 64));
    for order in 0..=3 {
        let of = |m: &Measurement| {
            let means: Vec<f64> = m.replicate_means.iter().map(|means| means[order].iter().sum::<f64>()).collect();
            let mean = means.iter().sum::<f64>() / means.len() as f64;
            (mean, means.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (means.len() * (means.len() - 1)) as f64)
        };
        let ((x, u), (y, v)) = (of(&a), of(&b));
        assert!((x - y).abs() < 4.5 * (u + v).sqrt() && x > 0.0, "order {order}: {x} and {y}");
    }
}

#[test]
fn each_run_takes_its_share_of_the_samples_and_at_least_one() {
    let scene = scene("cornell_box");
    let runs = json!([
        {"method": "emission", "orders": "0", "share": 0.001},
        {"method": "path", "orders": "1", "share": 1.0},
        {"method": "light", "orders": "2-3", "share": 3.0},
    ]);
    let m = measured(&scene, &*composite(runs).unwrap(), 32, 2);
    let pixels = 2 * 20 * 18;
    assert_eq!((m.counters.camera_paths, m.counters.light_paths), (pixels * (1 + 8), pixels * 24));
}

/// |t| < 4.5 for each of four orders in each of four cells: one false alarm in 9 000, for the seed is fixed. The scale of a cell forgotten is
/// a factor of two or more.
#[test]
fn regions_have_samples_of_their_own_and_the_same_mean() {
    let scene = scene("cornell_box");
    let runs = json!([
        {"method": "light", "orders": "0,2-3", "share": 1.0},
        {"method": "path", "orders": "1", "share": 1.0, "settings": {"strategy": "emitter"}, "regions": [[1, 0], [3, 0]]},
        {"method": "path", "orders": "1", "share": 0.5, "regions": [[0, 6], [0, 1]]},
    ]);
    let composite = composite(runs).unwrap();
    let path = Methods::standard().build("path", &Value::Null).unwrap();
    let (a, b) = (measured(&scene, &*composite, 20, 96), measured(&scene, &*path, 10, 96));
    for (cell, window) in windows((2, 2), 20, 18).enumerate() {
        for order in 0..=3 {
            let of = |m: &Measurement| {
                let (mut mean, mut variance) = (0.0, 0.0);
                for pixel in window.pixels().map(|(x, y)| (y * 20 + x) as usize) {
                    for at in (pixel * m.layers.len() + order) * 3..(pixel * m.layers.len() + order) * 3 + 3 {
                        mean += m.mean[at];
                        variance += m.m2[at] / (f64::from(m.replicates) * f64::from(m.replicates - 1));
                    }
                }
                (mean, variance)
            };
            let ((x, u), (y, v)) = (of(&a), of(&b));
            // Channels go together: the standard deviation of their sum is at most the sum of theirs, √3 times that of independent ones.
            assert!(
                (x - y).abs() <= 4.5 * (3.0 * (u + v)).sqrt() && (x > 0.0 || order == 0),
                "cell {cell}, order {order}: {x} and {y}"
            );
        }
    }
}

/// Of 5 samples these shares have 1.5 and 3.5; with weights of 1 and 3, 1.5 are 0.75 and 2.25, of which one and two are taken.
#[test]
fn whole_samples_are_taken_for_parts() {
    let run = |orders: &str, share: f64| json!({"method": "path", "orders": orders, "share": share});
    let mut by_regions = run("0-1", 3.0);
    by_regions["regions"] = json!([[1, 3]]);
    let request = Request::new(Orders::up_to(3), false);
    let rounding = |first: Value| {
        let method = Composite::new(&json!({ "runs": [first, run("2-3", 7.0)] }), &Methods::standard()).unwrap();
        method.rounding(&request, 5, (8, 8))
    };
    let close = |found: Vec<f64>, expected: [f64; 2]| {
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    };
    close(rounding(run("0-1", 3.0)), [2.0 / 1.5, 4.0 / 3.5]);
    close(rounding(by_regions), [1.0, 4.0 / 3.5]);
}

/// Of 20 samples, 8 are those of each run with a share of 0.4: an average of 4 and 12 here, 8 there.
/// `direct` adds what the camera sees of order 0 whether or not it is asked for.
#[test]
fn what_a_run_is_not_asked_for_does_not_count() {
    let scene = scene("furnace");
    let path = json!({"method": "path", "orders": "0,2-3", "share": 1.0});
    let alone = composite(json!([{"method": "path", "orders": "0-3", "share": 1.0}])).unwrap();
    let with = composite(json!([path, {"method": "direct", "orders": "1", "share": 1.0}])).unwrap();
    let (a, b) = (measured(&scene, &*alone, 4, 1), measured(&scene, &*with, 4, 1));
    (0..20 * 18).for_each(|pixel| assert!((a.mean(0, pixel)[0] - b.mean(0, pixel)[0]).abs() < 1e-6));
}

#[test]
fn weights_of_regions_are_kept() {
    let scene = scene("cornell_box");
    let runs = json!([
        {"method": "path", "orders": "1", "share": 2.0, "regions": [[1, 3]]},
        {"method": "path", "orders": "0,2", "share": 2.0, "regions": [[1, 0]]},
        {"method": "light", "orders": "3", "share": 1.0},
        {"method": "path", "orders": "0,2", "share": 0.0001, "regions": [[0, 1]]},
    ]);
    let m = measured(&scene, &*composite(runs).unwrap(), 20, 1);
    let half = 10 * 18;
    assert_eq!((m.counters.camera_paths, m.counters.light_paths), (half * (4 + 12 + 16 + 1), 2 * half * 4));
}

#[test]
fn one_run_of_all_orders_has_the_efficiency_of_its_method_and_its_fireflies() {
    let scene = scene("cornell_box");
    let method = composite(json!([{"method": "path", "orders": "0-3", "share": 1.0}])).unwrap();
    let request = crate::render::request(
        &scene,
        &*method,
        &RenderSettings {
            orders: Orders::up_to(3),
            tail: false,
            samples_per_replicate: 4,
            seed: 1,
            sampler: SamplerKind::Independent,
            instance: String::new(),
            role: Role::Estimate,
        },
        &crate::PartSettings::default(),
    )
    .unwrap();
    let replicate = Replicate {
        number: 0,
        key: sampling::sampler::StreamKey::new(1, "", Role::Estimate, 0),
        sampler: SamplerKind::Independent,
        samples: 4,
    };
    let mut shown = 0;
    assert!(method.begin(&scene, &request, replicate).replay((3, 4), 2, &mut |c| shown += c.technique.order()));
    assert!(shown > 0);
    assert_eq!(method.most_samples(&scene, &request, replicate), 4);
    // A region of three times the other's weight has 6 of an average of 4.
    let divided = json!([{"method": "path", "orders": "0-3", "share": 1.0, "regions": [[1, 3]]}]);
    assert_eq!(composite(divided).unwrap().most_samples(&scene, &request, replicate), 6);
}

#[test]
fn what_cannot_be_is_refused_with_the_mend() {
    let told = |runs: Value| composite(runs).err().unwrap();
    let run = |method: &str, orders: &str, share: f64| json!({"method": method, "orders": orders, "share": share});
    assert!(told(json!([run("path", "0-3", 1.0), run("light", "3", 1.0)])).contains("two runs estimate order 3"));
    assert!(told(json!([run("pth", "0", 1.0)])).contains("did you mean `path`"));
    assert!(told(json!([run("path", "x", 1.0)])).contains("neither an order nor a range"));
    assert!(told(json!([run("path", "0", 0.0)])).contains("positive"));
    assert!(told(json!([run("vcm", "0", 1.0)])).contains("vcm cannot be a part"));
    assert!(told(json!([run("mmlt", "0", 1.0)])).contains("chains"));
    assert!(told(json!([run("composite", "0", 1.0)])).contains("composites"));
    assert!(told(json!("path:0-8")).contains("METHOD:ORDERS:SHARE"));
    let regions =
        |method: &str, regions: Value| json!({"method": method, "orders": "0-2", "share": 1.0, "regions": regions});
    assert!(told(json!([regions("light", json!([[1]]))])).contains("light cannot be left to regions"));
    assert!(told(json!([regions("path", json!([[1, 2], [1]]))])).contains("row 1 of the regions has another length"));
    assert!(told(json!([regions("path", json!([[1, -2]]))])).contains("the weight -2.0 of a region"));
    assert!(told(json!([regions("path", json!([[0, 0]]))])).contains("no weight above 0"));
    assert!(told(json!([regions("path", json!([]))])).contains("give 1 to 64"));
    assert!(told(json!([regions("path", json!([[1, 0]])), regions("direct", json!([[1, 1]]))])).contains("order 0"));
    assert!(told(json!([regions("path", json!([[1, 0]])), regions("direct", json!([[0], [1]]))])).contains("order 0"));
    assert!(told(json!("path:0-8:1:1,x")).contains("`x` is no weight of a region"));
    assert!(told(json!("path(emitter):0-8:1")).contains("METHOD:ORDERS:SHARE"));
    assert!(told(json!("path:0-8:x")).contains("`x` is no share"));
    assert!(told(json!("path(mis=power:0-8:1")).contains("parenthesis"));
    assert!(told(json!(" ;")).contains("empty") && composite(json!("path:0-8:1;")).is_ok());
    assert!(told(json!("path:1:1e308;light:0,2-8:1e308")).contains("too large"));
    assert!(told(json!("path:0-8:1:1e308,1e308")).contains("too large"));
    assert!(told(json!([3])).contains("METHOD:ORDERS:SHARE"));
    let request = Request::new(Orders::up_to(2), true);
    let why = |runs: Value| composite(runs).unwrap().unsupported_request(&request);
    assert!(why(json!([])).unwrap().contains("no runs"));
    assert!(why(json!([run("path", "0,2", 1.0)])).unwrap().contains("no run estimates order 1"));
    assert!(why(json!([run("path", "0-2", 1.0)])).unwrap().contains("the tail"));
    let half = json!([run("path", "0", 1.0), {"method": "path", "orders": "1,2", "share": 1.0, "tail": true, "regions": [[1, 0]]}]);
    assert!(why(half).unwrap().contains("no run estimates order 1 in all of the image"));
    // `direct` carries no order above the first, whatever it is told to do.
    assert!(why(json!([run("direct", "0-2", 1.0)])).unwrap().contains("order 2"));
}

#[test]
fn light_that_a_run_loses_in_its_own_orders_is_named_and_no_other() {
    let scene = scene("glass_caustic");
    let run = |method: &str, orders: &str| json!({"method": method, "orders": orders, "share": 1.0});
    let missing = |runs: Value| composite(runs).unwrap().missing_light(&scene.facts);
    assert!(missing(json!([run("light", "0"), run("path", "1-3")])).is_empty());
    let of_light = missing(json!([run("light", "0,2,4-6"), run("path", "1,3")]));
    let [class] = of_light.as_slice() else { panic!("{of_light:?}") };
    assert!(class.ends_with(" (orders 2,4-6)"), "{class}");
    let lost: Vec<usize> = (0..9).filter(|&k| loses(class, Layer::Order(k))).collect();
    assert!(lost == [2, 4, 5, 6] && !loses(class, Layer::Tail), "{lost:?}");
}

#[test]
fn runs_are_written_in_brief_and_read_again() {
    let runs = json!([
        {"method": "light", "orders": "0,3", "share": 0.25},
        {"method": "path", "orders": "1-2", "tail": true, "share": 0.1},
        {"method": "bdpt", "orders": "4-9", "share": 0.65},
        {"method": "path", "settings": {"roulette_start": 5, "strategy": "emitter"}, "orders": "10", "share": 0.5, "regions": [[1.5, 0.0], [2.0, 1.0]]},
    ]);
    let list: Vec<Run> = serde_json::from_value(runs.clone()).unwrap();
    let brief = list.iter().map(Run::brief).collect::<Vec<_>>().join(";");
    assert_eq!(
        brief,
        "light:0,3:0.25;path:1-2+tail:0.1;bdpt:4-9:0.65;path(roulette_start=5,strategy=emitter):10:0.5:1.5,0/2,1"
    );
    assert_eq!(composite(json!(brief)).unwrap().settings(), composite(runs).unwrap().settings());
    assert!(composite(json!("path:+tail:1;bdpt:0-3:1")).is_ok());
}
