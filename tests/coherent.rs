//! Path tracing and bidirectional path tracing with common random numbers: what neighbours take off of one another's errors moves no mean, and is
//! worth its while.
//!
//! False-alarm rate: 0.1 % for each scene (Šidák over orders and blocks), as for every pair of methods.

use crate::cli::{folder_with, refused, succeed};
use crate::support::{Budget, Entry, Family, agree, builtin, measure, method_with, seed};
use integrators::{Orders, Part, PartSettings, Quantity, Render, RenderSettings, Window, render};
use sampling::filter::Filter;
use sampling::sampler::{Role, SamplerKind};
use scenes::{LoadOptions, Scene, load};
use serde_json::json;
use std::ops::RangeInclusive;

const SIZE: u32 = 24;

const METHODS: [&str; 2] = ["coherent", "coherent_bdpt"];

/// With neighbours near and further away.
fn coherent(samples: u32) -> Vec<Entry> {
    let at = |radius: u32| json!({"roulette": "none", "radius": radius});
    [
        ("coherent", "coherent", at(2)),
        ("coherent_bdpt", "coherent_bdpt", at(3)),
        ("coherent_bdpt", "coherent_bdpt, far", at(6)),
    ]
    .map(|(name, label, settings)| Entry::new(name, samples).with(label, settings))
    .into()
}

#[test]
fn diffuse_rooms() {
    let path = json!({"roulette": "none", "radius": 3, "own_samples": "path"});
    for (name, filter) in [("cornell_box", Filter::Triangle), ("indirect_lamp", Filter::Box)] {
        let mut scene = builtin(name, SIZE);
        scene.camera.set_filter(filter);
        let mut entries = coherent(20);
        entries.push(Entry::new("coherent_bdpt", 20).with("coherent_bdpt and path", path.clone()));
        let runs = json!({"runs": "bdpt(roulette=none):0:0.25;coherent(roulette=none):1-4:0.75"});
        entries.push(Entry::new("composite", 20).with("coherent in a composite", runs));
        entries.push(Entry::new("bdpt", 12).without_roulette());
        agree(&format!("coherent on {name}"), &scene, 4, &entries, 0.3);
    }
}

/// Places are common, too, whatever gives the numbers.
#[test]
fn every_sampler() {
    let mut scene = builtin("cornell_box", 16);
    scene.camera.set_filter(Filter::Triangle);
    let budget = |sampler| Budget { samples: 8, replicates: 64, sampler, ..Budget::samples(1).up_to(2) };
    let path = measure(&scene, method_with("path", json!({})).as_ref(), "path", budget(SamplerKind::Independent));
    let mut family = Family::new("coherent by samplers");
    for &sampler in &SamplerKind::ALL[1..] {
        let own = json!({"own_samples": "path"});
        for (name, settings) in [("coherent", json!({})), ("coherent_bdpt", own)] {
            let label = format!("{name} {sampler}");
            let other = measure(&scene, method_with(name, settings).as_ref(), &label, budget(sampler));
            for order in 0..=2 {
                family.layer(&format!("{label}, order {order}"), order, 4, &other, &path);
            }
        }
    }
    family.finish(0.3);
}

/// A bright and a dark half of a wall, whose edge is three tenths into the ninth of 16 columns of pixels, before a point that lights it less from
/// column to column.
const HALVES: &str = r#"
[camera]
position = [0, 0, 2]
target = [0, 0, 0]
fov = 40
width = 16
height = 16
[materials.bright]
type = "lambert"
albedo = 0.9
[materials.dark]
type = "lambert"
albedo = 0.1
[[shapes]]
type = "quad"
origin = [-9, -9, 0]
edge_u = [9.0273, 0, 0]
edge_v = [0, 18, 0]
material = "bright"
[[shapes]]
type = "quad"
origin = [0.0273, -9, 0]
edge_u = [9, 0, 0]
edge_v = [0, 18, 0]
material = "dark"
[[emitters]]
type = "point"
position = [-0.5, 0, 0.5]
intensity = 1
"#;

/// Columns of pixels beside the edge of a wall's halves. Samples that lay elsewhere in their pixels than those they are compared with would see
/// another light.
#[test]
fn edges_have_the_means_of_their_sides() {
    let folder = folder_with(&[("halves.toml", HALVES)]);
    let file = folder.path().join("halves.toml");
    let mut family = Family::new("coherent at an edge");
    for filter in [Filter::Box, Filter::Triangle, Filter::Mitchell] {
        let mut scene = load(file.to_str().unwrap(), &LoadOptions::default()).unwrap();
        scene.camera.set_filter(filter);
        let budget = Budget { samples: 16, replicates: 320, ..Budget::samples(1) }.up_to(1);
        let render = |name| measure(&scene, method_with(name, json!({})).as_ref(), name, budget);
        let path = render("path");
        for name in METHODS {
            let other = render(name);
            for column in 6..11 {
                let pixels: Vec<usize> = (4..12).map(|row| row * 16 + column).collect();
                let label = format!("{name}, {filter:?}, column {column}");
                family.image(label, other.over(1, &pixels), path.over(1, &pixels));
            }
        }
    }
    family.finish(1.0);
}

/// A floor that shares numbers, and plates that do not.
#[test]
fn gloss_beside_diffuse_surfaces() {
    let mut entries = Vec::from(METHODS.map(|name| Entry::new(name, 48).without_roulette()));
    entries.push(Entry::new("path", 32).without_roulette());
    agree("coherent on veach_mis", &builtin("veach_mis", SIZE), 2, &entries, 0.3);
}

/// Replicates of a number of samples that cannot be halved, or not at all.
#[test]
fn odd_numbers_of_samples() {
    let scene = builtin("cornell_box", SIZE);
    let budget = |samples: u32| Budget { samples, replicates: 512 / samples, ..Budget::samples(16) }.up_to(2);
    let path = measure(&scene, method_with("path", json!({})).as_ref(), "path", budget(4));
    let mut family = Family::new("coherent by few samples");
    for (name, samples) in METHODS.into_iter().flat_map(|name| [1, 2, 3, 7].map(|samples| (name, samples))) {
        let coherent = method_with(name, json!({}));
        let rendered = measure(&scene, coherent.as_ref(), &format!("{name} {samples}"), budget(samples));
        for order in 0..=2 {
            family.layer(&format!("{name}, {samples} samples, order {order}"), order, 4, &rendered, &path);
        }
    }
    family.finish(0.3);
}

/// With 16 independent samples of each of 128x128 pixels, orders have less than half the variance of those by `path`, and what a wall sends on of a
/// lamp that nothing else sees less than half that of those by `bdpt` with all of its strategies: without the twentieth of the pixels that vary
/// most, of which chance has some in each image that outweigh all others.
#[test]
fn neighbours_take_off_half_the_variance() {
    for (scene, first, coherent, other) in [
        ("cornell_box", 1, "coherent", "path"),
        ("cornell_box", 1, "coherent_bdpt", "path"),
        ("indirect_lamp", 2, "coherent_bdpt", "bdpt"),
    ] {
        takes_off_half(&builtin(scene, 128), first..=3, coherent, other);
    }
}

fn takes_off_half(scene: &Scene, orders: RangeInclusive<usize>, coherent: &str, other: &str) {
    let variance = |name: &str| {
        let budget = Budget { samples: 16, replicates: 8, ..Budget::samples(16) }.up_to(3);
        let rendered = measure(scene, method_with(name, json!({})).as_ref(), name, budget);
        let m = &rendered.measurement;
        let of_order = |order| {
            let mut variances: Vec<f64> = (0..m.pixels()).map(|pixel| m.variance(order, pixel).unwrap()[1]).collect();
            variances.sort_by(f64::total_cmp);
            variances[..variances.len() * 19 / 20].iter().sum::<f64>()
        };
        orders.clone().map(of_order).collect::<Vec<_>>()
    };
    let ratios: Vec<f64> = variance(coherent).iter().zip(variance(other)).map(|(a, b)| a / b).collect();
    println!("{}: variance of orders {orders:?} by {coherent} over that by {other}: {ratios:.3?}", scene.name);
    assert!(ratios.iter().all(|&ratio| ratio < 0.5), "{}: {coherent}, {other}: {ratios:?}", scene.name);
}

/// What an image is taken apart into adds up to it where pixels share numbers, and weights are between 0 and 1.
#[test]
fn parts_add_up() {
    let scene = builtin("cornell_box", SIZE);
    METHODS.into_iter().for_each(|name| parts_of_add_up(&scene, name));
}

fn parts_of_add_up(scene: &Scene, name: &str) {
    let settings = RenderSettings {
        orders: Orders::up_to(3),
        tail: false,
        samples_per_replicate: 5,
        seed: seed(),
        sampler: SamplerKind::Independent,
        instance: "parts".to_owned(),
        role: Role::Estimate,
    };
    let method = method_with(name, json!({}));
    let parts = PartSettings { strategies: true, ..PartSettings::default() };
    let request = render::request(scene, method.as_ref(), &settings, &parts).unwrap();
    let mut render = Render::of_request(scene, method.as_ref(), settings, Window::whole(SIZE, SIZE), request).unwrap();
    (0..3).for_each(|_| render.run_replicate(&|_| {}));
    let m = render.finish();
    for pixel in 0..m.pixels() {
        let mut sums = [[0.0; 3]; 4];
        for (layer, part) in m.parts() {
            let value = m.mean(layer, pixel);
            match *part {
                Part::Strategy { s, t, quantity: Quantity::Weighted } => {
                    sums[s + t - 2].iter_mut().zip(value).for_each(|(sum, x)| *sum += x);
                }
                Part::Strategy { quantity: Quantity::Weights, .. } => {
                    let [weights, number, _] = value;
                    assert!(weights >= 0.0 && weights <= number * (1.0 + 1e-6), "{pixel}: {weights} of {number}");
                }
                _ => {}
            }
        }
        for (order, sum) in sums.iter().enumerate() {
            for (sum, whole) in sum.iter().zip(m.mean(order, pixel)) {
                assert!((sum - whole).abs() <= 1e-5 * (1.0 + whole.abs()), "{pixel}, order {order}: {sum} {whole}");
            }
        }
    }
}

/// A point that a mirror throws on a wall: walks from the camera never find it, so that a path tracer's samples have another mean.
const POINT_AND_MIRROR: &str = r#"
[camera]
position = [0, 1, 3]
target = [0, 0, 0]
width = 8
height = 8
[materials.white]
type = "lambert"
albedo = 0.7
[materials.mirror]
type = "mirror"
[[shapes]]
type = "sphere"
center = [0, 0, 0]
radius = 0.5
material = "mirror"
[[shapes]]
type = "quad"
origin = [-2, -1, -2]
edge_u = [0, 0, 4]
edge_v = [4, 0, 0]
material = "white"
[[emitters]]
type = "point"
position = [0, 2, 0]
intensity = 1
"#;

#[test]
fn samples_of_other_means_or_strategies_are_refused() {
    let folder = folder_with(&[("point.toml", POINT_AND_MIRROR)]);
    let render = |scene, more: &[&'static str]| {
        let command = ["render", scene, "-i", "coherent_bdpt", "--size", "8x8", "--spp", "4", "--layers"];
        [&command[..], more].concat()
    };
    succeed(folder.path(), &render("point.toml", &["orders"]));
    let path = ["orders", "--set", "own_samples=path"];
    refused(folder.path(), &render("point.toml", &path), &["coherent_bdpt", "LS.*E", "set own_samples=bdpt"]);
    succeed(folder.path(), &render("cornell_box", &path));
    let strategies = ["strategies", "--set", "own_samples=path"];
    refused(folder.path(), &render("cornell_box", &strategies), &["other strategies", "set own_samples=bdpt"]);
}
