//! What an image is taken apart into adds up to it, and is the same whichever method takes it apart: strategies, light groups,
//! path classes.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over images and blocks).

use crate::support::{Estimate, Family, builtin, furnished, grey, method_with, seed};
use integrators::lpe::Expression;
use integrators::render::request;
use integrators::{
    Measurement, Orders, Part, PartSettings, PathClass, Quantity, Render, RenderError, RenderSettings, Window,
};
use sampling::sampler::{Role, SamplerKind};
use scenes::Scene;
use serde_json::{Value, json};

const MAX_ORDER: usize = 4;
/// Relative to the largest pixel: what `f32` sums of values and `f64` sums of sums leave.
const ROUNDING: f64 = 1e-5;

fn settings(samples: u32, instance: &str) -> RenderSettings {
    RenderSettings {
        orders: Orders::up_to(MAX_ORDER),
        tail: false,
        samples_per_replicate: samples,
        seed: seed(),
        sampler: SamplerKind::Independent,
        instance: instance.to_owned(),
        role: Role::Estimate,
    }
}

fn render(
    scene: &Scene,
    (name, with): (&str, Value),
    parts: &PartSettings,
    (samples, replicates): (u32, u32),
) -> Result<Measurement, RenderError> {
    let method = method_with(name, with);
    let settings = settings(samples, name);
    let request = request(scene, method.as_ref(), &settings, parts)?;
    let window = Window::whole(scene.camera.width(), scene.camera.height());
    let mut render = Render::of_request(scene, method.as_ref(), settings, window, request)?;
    (0..replicates).for_each(|_| render.run_replicate(&|_| {}));
    Ok(render.finish())
}

/// Image mean of a layer over replicates.
fn image(m: &Measurement, layer: usize) -> Estimate {
    Estimate::of(&m.replicate_means.iter().map(|means| grey(means[layer])).collect::<Vec<_>>())
}

/// Fails unless the parts that `add` says of an order, or with `None` of the image, add up to it in every pixel.
fn adds_up(m: &Measurement, title: &str, order: Option<usize>, add: impl Fn(&Part) -> bool) {
    let whole = |pixel| match order {
        Some(order) => m.mean(m.layer_of_order(order).unwrap(), pixel),
        None => m.total(pixel),
    };
    let brightest = (0..m.pixels()).map(|pixel| grey(whole(pixel))).fold(0.0, f64::max);
    for pixel in 0..m.pixels() {
        let mut sum = [0.0; 3];
        for (layer, _) in m.parts().filter(|(_, part)| add(part)) {
            let value = m.mean(layer, pixel);
            (0..3).for_each(|c| sum[c] += value[c]);
        }
        let off = (0..3).map(|c| (sum[c] - whole(pixel)[c]).abs()).fold(0.0, f64::max);
        assert!(off <= ROUNDING * brightest, "{title}, order {order:?}, pixel {pixel}: off by {off} of {brightest}");
    }
}

fn class(name: &str, expression: &str) -> PathClass {
    PathClass { name: name.to_owned(), expression: Expression::parse(expression).unwrap() }
}

fn methods() -> [(&'static str, Value); 4] {
    ["direct", "path", "light", "bdpt"].map(|name| match name {
        "direct" => (name, json!({})),
        _ => (name, json!({"roulette": "none"})),
    })
}

#[test]
fn weighted_strategies_add_up_to_every_order() {
    let parts = PartSettings { strategies: true, ..PartSettings::default() };
    let merging = ["vcm", "ppm"].map(|name| (name, json!({"radius": 0.1})));
    let guided = ("guided", json!({"roulette": "none"}));
    let coherent = ["coherent", "coherent_bdpt"].map(|name| (name, json!({"roulette": "none"})));
    for (name, with) in methods().into_iter().chain(merging).chain([guided]).chain(coherent) {
        let m = render(&furnished([true, true]), (name, with), &parts, (4, 2)).unwrap();
        assert!(m.parts.iter().any(Part::is_strategy));
        for order in (0..=MAX_ORDER).filter(|&order| m.layer_of_order(order).is_some()) {
            let of_order = |part: &Part| match *part {
                Part::Strategy { s, t, quantity: Quantity::Weighted } => s + t - 2 == order,
                Part::Merged { order: merged } => merged == order,
                _ => false,
            };
            adds_up(&m, name, Some(order), of_order);
        }
    }
}

/// In a sphere no geometry term is unbounded, so that every strategy has a variance.
#[test]
fn every_strategy_alone_estimates_its_order() {
    let scene = builtin("integrating_sphere", 4);
    let parts = PartSettings { strategies: true, ..PartSettings::default() };
    let m = render(&scene, ("bdpt", json!({"roulette": "none"})), &parts, (96, 64)).unwrap();
    let truth = render(&scene, ("path", json!({"roulette": "none"})), &PartSettings::default(), (512, 64)).unwrap();
    let mut family = Family::new("strategies alone");
    let mut seen = 0;
    for (layer, part) in m.parts() {
        let &Part::Strategy { s, t, quantity: Quantity::Raw } = part else { continue };
        family.image(format!("({s}, {t})"), image(&m, layer), image(&truth, s + t - 2));
        // The weights are those of what lands: between none and all.
        let [weights, number, _] = m.image_mean(layer + 1);
        assert!(number > 0.0 && weights > 0.0 && weights <= number * (1.0 + 1e-6), "({s}, {t}): {weights} {number}");
        seen += 1;
    }
    assert_eq!(seen, (2..=MAX_ORDER + 2).sum::<usize>());
    family.finish(0.9);
}

/// Near an edge the geometry term between the two surfaces has no second moment, and there is no edge in a sphere. A false alarm in the
/// sphere has a probability of at most 0.1 % for each strategy, 2 % in all; the seed is fixed.
#[test]
fn strategies_that_have_no_variance_alone_are_told() {
    let unbounded = |name, samples| {
        let scene = builtin(name, 16);
        let method = method_with("bdpt", json!({"roulette": "none"}));
        let parts = PartSettings { strategies: true, ..PartSettings::default() };
        let request = request(&scene, method.as_ref(), &settings(samples, name), &parts).unwrap().with_fireflies();
        let mut render =
            Render::of_request(&scene, method.as_ref(), settings(samples, name), Window::whole(16, 16), request)
                .unwrap();
        (0..2).for_each(|_| render.run_replicate(&|_| {}));
        render.finish().unbounded_strategies()
    };
    let in_corners = unbounded("cornell_box", 512);
    assert!(!in_corners.is_empty() && in_corners.iter().all(|&(s, t)| s >= 2 && t >= 2), "{in_corners:?}");
    assert_eq!(unbounded("integrating_sphere", 128), []);
}

#[test]
fn light_groups_add_up_and_each_is_the_image_of_its_lamps_alone() {
    let parts = PartSettings { groups: true, ..PartSettings::default() };
    let both = furnished([true, true]);
    let mut family = Family::new("light groups");
    for (name, with) in methods() {
        let budget = (if name == "bdpt" { 32 } else { 64 }, 64);
        let m = render(&both, (name, with.clone()), &parts, budget).unwrap();
        adds_up(&m, name, None, |part| matches!(part, Part::Group { layer: None, .. }));
        for &layer in &m.layers {
            adds_up(&m, name, layer.order(), |part| matches!(part, Part::Group { layer: Some(l), .. } if *l == layer));
        }
        for (group, lamps) in [("key", [true, false]), ("fill", [false, true])] {
            let alone = render(&furnished(lamps), (name, with.clone()), &PartSettings::default(), budget).unwrap();
            for (i, &layer) in m.layers.iter().enumerate() {
                let of_group = Part::Group { name: group.to_owned(), layer: Some(layer) };
                let (place, _) = m.parts().find(|(_, part)| **part == of_group).unwrap();
                family.image(format!("{name} {group} {layer:?}"), image(&m, place), image(&alone, i));
            }
        }
    }
    family.finish(0.9);
}

/// By the first scattering, by a label, and as they are taught; the first two sets are disjoint and complete.
fn classes() -> Vec<PathClass> {
    vec![
        class("emission", "CL"),
        class("diffuse", "CD.*L"),
        class("glossy", "CG.*L"),
        class("specular", "CS.*L"),
        class("floor", "C'floor'.*L"),
        class("elsewhere", "C[^'floor'].*L"),
        class("caustics", "C[DG]S+L"),
        class("transmitted", "C.*<TS>.*L'key'"),
        class("whitted", "LD?S*E"),
    ]
}

#[test]
fn path_classes_add_up_and_are_the_same_for_all_methods() {
    let parts = PartSettings { classes: classes(), ..PartSettings::default() };
    let scene = furnished([true, true]);
    let mut measured = Vec::new();
    for (name, with) in methods() {
        let m = render(&scene, (name, with), &parts, (if name == "bdpt" { 128 } else { 512 }, 64)).unwrap();
        let named = |names: &'static [&str]| move |part: &Part| matches!(part, Part::Class { name } if names.contains(&name.as_str()));
        adds_up(&m, name, None, named(&["emission", "diffuse", "glossy", "specular"]));
        adds_up(&m, name, None, named(&["emission", "floor", "elsewhere"]));
        measured.push((name, m));
    }
    let mut family = Family::new("path classes");
    let (_, path) = &measured[1];
    for (name, m) in &measured[2..] {
        for (layer, part) in m.parts() {
            let Part::Class { name: class } = part else { panic!("{part:?}") };
            // Connections to the camera lose what mirrors and glass send it, and paths light on everything that has both.
            if *name == "light" && matches!(class.as_str(), "specular" | "elsewhere" | "transmitted" | "whitted") {
                continue;
            }
            let (a, b) = (image(path, layer), image(m, layer));
            assert!(a.mean > 0.0, "{class} is empty");
            family.image(format!("{name} {class}"), a, b);
        }
    }
    family.finish(0.8);
}

#[test]
fn taking_an_image_apart_changes_no_bit_of_it() {
    let scene = furnished([true, true]);
    let all = PartSettings { strategies: true, groups: true, classes: classes() };
    for (name, with) in methods() {
        let [plain, apart] =
            [&PartSettings::default(), &all].map(|parts| render(&scene, (name, with.clone()), parts, (4, 3)).unwrap());
        assert_eq!((plain.parts.len(), plain.layers.len()), (0, apart.layers.len()));
        for (layer, pixel) in (0..plain.layers.len()).flat_map(|l| (0..plain.pixels()).map(move |p| (l, p))) {
            assert_eq!(plain.mean(layer, pixel), apart.mean(layer, pixel), "{name} {layer} {pixel}");
            assert_eq!(plain.variance(layer, pixel), apart.variance(layer, pixel), "{name} {layer} {pixel}");
        }
        assert_eq!((plain.covariance, plain.total_variance), (apart.covariance, apart.total_variance));
    }
}

#[test]
fn what_cannot_be_taken_apart_is_said() {
    let scene = furnished([true, true]);
    let parts = PartSettings { classes: vec![class("typo", "C.*L'keyy'")], ..PartSettings::default() };
    let message = render(&scene, ("path", json!({})), &parts, (1, 1)).err().unwrap().to_string();
    assert!(message.contains("'keyy'") && message.contains("did you mean 'key'"), "{message}");
}
