//! Samples where the image needs them: how many a pixel takes moves no mean, and is worth its while.
//!
//! False-alarm rate: 0.1 % for each scene (Šidák over orders and blocks), as for every pair of methods.

use crate::cli::folder_with;
use crate::support::{Budget, Entry, Family, agree, measure, method_with, seed};
use integrators::{Orders, PartSettings, Render, RenderSettings, Window, render};
use sampling::filter::Filter;
use sampling::sampler::{Role, SamplerKind};
use scenes::{LoadOptions, Scene, load};
use serde_json::json;

/// A ball and a lamp's panel above a floor, before a sky that shows without noise in half of the pixels.
const OPEN: &str = r#"
[camera]
position = [0, 1, 4]
target = [0, 0.9, 0]
fov = 45
width = 16
height = 16
[materials.white]
type = "lambert"
albedo = 0.7
[[shapes]]
type = "quad"
origin = [-50, 0, -50]
edge_u = [0, 0, 100]
edge_v = [100, 0, 0]
material = "white"
[[shapes]]
type = "sphere"
center = [-0.6, 0.4, 0.5]
radius = 0.4
material = "white"
[[shapes]]
type = "quad"
origin = [0.3, 1, -0.3]
edge_u = [0.5, 0, 0]
edge_v = [0, 0, 0.5]
material = "white"
emission = 5
[[emitters]]
type = "constant"
radiance = 0.3
"#;

/// With so many pixels in a row and in a column.
fn open(filter: Filter, side: u32) -> Scene {
    let folder = folder_with(&[("open.toml", &OPEN.replace("= 16\n", &format!("= {side}\n")))]);
    let mut scene = load(folder.path().join("open.toml").to_str().unwrap(), &LoadOptions::default()).unwrap();
    scene.camera.set_filter(filter);
    scene
}

/// Replicates of 16 and 17 samples, of which the first are the fewest that a pilot looks ahead for: by either method, and by a composite of one of them.
#[test]
fn samples_are_many_where_they_are_wanted_and_few_elsewhere() {
    let runs = json!({"runs": "adaptive_bdpt(roulette=none):0,2-3:0.5;path(roulette=none):1:0.5"});
    for filter in [Filter::Box, Filter::Mitchell] {
        let adaptive = [("adaptive", 68), ("adaptive_bdpt", 64)];
        let mut entries = Vec::from(adaptive.map(|(name, samples)| Entry::new(name, samples).without_roulette()));
        entries.push(Entry::new("composite", 128).with("adaptive_bdpt in a composite", runs.clone()));
        entries.push(Entry::new("bdpt", 48).without_roulette());
        agree(&format!("adaptive in the open, {filter}"), &open(filter, 16), 3, &entries, 0.3);
    }
}

#[test]
fn every_sampler() {
    let scene = open(Filter::Triangle, 16);
    let budget = |sampler| Budget { samples: 16, replicates: 48, sampler, ..Budget::samples(1) }.up_to(1);
    let path = measure(&scene, method_with("path", json!({})).as_ref(), "path", budget(SamplerKind::Independent));
    let mut family = Family::new("adaptive by samplers");
    for &sampler in SamplerKind::ALL {
        for name in ["adaptive", "adaptive_bdpt"] {
            let label = format!("{name} {sampler}");
            let other = measure(&scene, method_with(name, json!({})).as_ref(), &label, budget(sampler));
            for order in 0..=1 {
                family.layer(&format!("{label}, order {order}"), order, 4, &other, &path);
            }
        }
    }
    family.finish(0.3);
}

/// What is taken apart has the same image.
#[test]
fn parts_have_the_bits_of_the_whole() {
    let scene = open(Filter::Box, 16);
    for name in ["adaptive", "adaptive_bdpt"] {
        let image = |strategies: bool| {
            let settings = RenderSettings {
                orders: Orders::up_to(2),
                tail: false,
                samples_per_replicate: 64,
                seed: seed(),
                sampler: SamplerKind::Sobol,
                instance: name.to_owned(),
                role: Role::Estimate,
            };
            let (method, window) = (method_with(name, json!({})), Window::whole(16, 16));
            let parts = PartSettings { strategies, ..PartSettings::default() };
            let request = render::request(&scene, method.as_ref(), &settings, &parts).unwrap();
            let mut render = Render::of_request(&scene, method.as_ref(), settings, window, request).unwrap();
            render.run_replicate(&|_| {});
            let m = render.finish();
            (0..m.pixels()).map(|pixel| m.total(pixel)).collect::<Vec<_>>()
        };
        assert_eq!(image(false), image(true), "{name}");
    }
}

/// With 64 independent samples of each of 96x96 pixels, those of the sky, which err by nothing, leave theirs to others.
#[test]
fn errors_are_less_for_the_same_number_of_samples() {
    let scene = open(Filter::Box, 96);
    let ratio = error(&scene, "adaptive") / error(&scene, "path");
    println!("error by adaptive over that by path: {ratio:.3}");
    assert!(ratio < 0.8, "{ratio}");
}

/// The sum over pixels of the variance of orders 0 to 3, relative to the mean squared.
fn error(scene: &Scene, name: &str) -> f64 {
    let budget = Budget { samples: 64, replicates: 8, ..Budget::samples(1) }.up_to(3);
    let m = measure(scene, method_with(name, json!({})).as_ref(), name, budget).measurement;
    let of_pixel = |pixel: usize| {
        let variance: f64 = (0..m.layers.len()).map(|layer| m.variance(layer, pixel).unwrap()[1]).sum();
        variance / (m.total(pixel)[1].powi(2) + 0.01)
    };
    (0..m.pixels()).map(of_pixel).sum()
}
