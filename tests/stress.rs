//! Numerical stress: what a scene's size, place, proportions, lamps, materials and shapes may be without its physics changing.
//!
//! Scale invariance and thermal equilibrium give exact expectations at every point of a sweep:
//!
//! - A scene that is 2ᵏ times as large, or as bright, is the same scene to the bit: floating point knows no units, and neither
//!   may a constant in the program.
//! - Any other size or place rounds differently. Under the same random numbers nearly all paths stay the same, so that the mean
//!   difference has a standard error far below that of the means.
//! - In a closed enclosure that shines alike everywhere, of any geometry, order k is ρᵏ e; whatever stands in it and absorbs nothing is
//!   as bright as all the rest, e/(1 − ρ) over all orders, and n² times that inside glass.
//!
//! False-alarm rate: 0.1 % for each statistical test (Šidák over its methods, orders and blocks). The others may never fail.

mod lamps;
mod materials;
mod methods;
mod places;
mod shapes;

use crate::support::{ALL, Budget, Estimate, Family, Rendered, camera, lambert, measure, method_with, plain, shining};
use glam::{DVec3, dvec3};
use integrators::Integrator;
use sampling::bsdf::Bsdf;
use sampling::sampler::SamplerKind;
use sampling::{Vec2, vec2};
use scenes::{MaterialId, Scene, SceneBuilder, ShapeId};
use serde_json::json;

/// Albedo and emission of the enclosures.
const ALBEDO: f32 = 0.5;
const EMITTED: f32 = 0.7;

/// What all orders together are in an enclosure.
const EQUILIBRIUM: f64 = EMITTED as f64 / (1.0 - ALBEDO as f64);

/// Six quads around a box of ±1, fronts inside, of which each shines.
fn enclosure(builder: &mut SceneBuilder, wall: MaterialId, emitted: f32) -> Vec<ShapeId> {
    let (x, y, z) = (DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z * 2.0);
    let (low, high) = (DVec3::splat(-1.0), DVec3::splat(1.0));
    let sides = [(low, z, x), (low, x, y), (low, y, z), (high, -x, -z), (high, -y, -x), (high, -z, -y)];
    let quads = sides.map(|(corner, u, v)| {
        let quad = builder.quad(corner, u, v, wall);
        builder.emit(quad, shining(emitted));
        quad
    });
    quads.to_vec()
}

/// An enclosure of the usual material with a camera in it that looks at its back.
fn furnace(name: &str, size: u32) -> SceneBuilder {
    let mut builder = SceneBuilder::new(name);
    let wall = builder.material(lambert(ALBEDO));
    enclosure(&mut builder, wall, EMITTED);
    builder.camera(camera(dvec3(0.1, 0.2, 0.85), dvec3(0.0, 0.0, -1.0), 70.0, size));
    builder
}

/// Compares the image means of all orders of a uniform enclosure, whatever else it is, with ρᵏ e. Order 0 of what traces from the camera alone
/// is certain; what remains may be so precise that little is known of its distribution.
fn is_a_furnace(
    family: &mut Family,
    scene: &Scene,
    label: &str,
    names: &[&str],
    samples: u32,
    (albedo, emitted): (f32, f32),
) {
    for name in names {
        let samples = if *name == "light" { 4 * samples } else { samples };
        // Every sampler in turn, told by the label.
        let turn = label.bytes().map(usize::from).sum::<usize>() + name.len();
        let sampler = SamplerKind::ALL[turn % SamplerKind::ALL.len()];
        let budget = Budget { sampler, ..Budget::samples(samples).up_to(4) };
        let rendered = measure(scene, plain(name).as_ref(), &format!("{label} {name}"), budget);
        for layer in 0..rendered.measurement.layers.len() {
            let exact = f64::from(emitted) * f64::from(albedo).powi(layer as i32);
            let certain = layer == 0 && ["direct", "path", "guided"].contains(name);
            let add = if certain { Family::image } else { Family::block };
            add(family, format!("{label}, {name}, order {layer}"), rendered.image(layer), Estimate::exact(exact));
        }
    }
}

/// The share of pixels whose middle shows something else than Lambertian walls.
fn share_of_others(scene: &Scene) -> f64 {
    let (width, height) = (scene.camera.width(), scene.camera.height());
    let shows = |i: u32| {
        let middle = vec2((i % width) as f32 + 0.5, (i / width) as f32 + 0.5);
        let hit = scene.intersect(&scene.camera.sample_we(middle, Vec2::ZERO).ray);
        hit.is_some_and(|hit| !matches!(hit.bsdf, Bsdf::Lambert(_)))
    };
    (0..width * height).filter(|&i| shows(i)).count() as f64 / f64::from(width * height)
}

/// Compares what all orders add up to with what it is in equilibrium, where what absorbs nothing is in the picture: without it all would look
/// the same. The tail ends by roulette alone.
fn is_in_equilibrium(family: &mut Family, scene: &Scene, label: &str, samples: u32, exact: f64) {
    let share = share_of_others(scene);
    assert!(share > 0.05, "{label}: {share} of the picture shows anything but the enclosure");
    for name in ["path", "bdpt"] {
        let budget = Budget { tail: true, ..Budget::samples(samples).up_to(6) };
        let rendered = measure(scene, method_with(name, json!({})).as_ref(), &format!("{label} {name}"), budget);
        family.image(format!("{label}, {name}, all orders"), rendered.total(&rendered.all()), Estimate::exact(exact));
    }
}

/// Compares images that should be the same, `other` being `factor` times as bright, by the differences of replicates which
/// were rendered from the same random numbers.
fn is_the_same(family: &mut Family, label: &str, base: &Rendered, other: &Rendered, factor: f64) {
    let pixels = base.all();
    for layer in 0..base.measurement.layers.len() {
        let (base, other) = (base.replicates_over(layer, &pixels), other.replicates_over(layer, &pixels));
        let differences: Vec<f64> = base.iter().zip(&other).map(|(a, b)| b / factor - a).collect();
        let mean = base.iter().sum::<f64>() / base.len() as f64;
        let difference = Estimate::of(&differences);
        let moved = Estimate { mean: mean + difference.mean, ..difference };
        family.image(format!("{label}, order {layer}"), moved, Estimate::exact(mean));
    }
}

/// A method without roulette and its name, each of the list in turn.
fn methods() -> impl Iterator<Item = (&'static str, Box<dyn Integrator>)> {
    ALL.into_iter().map(|name| (name, plain(name)))
}
