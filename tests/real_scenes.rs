//! Scenes that others made render the light that their home renderers' images hold. They are found through `NEUMANN_SCENES`.
//!
//! What is compared is the mean over the image, which no size of it changes, with that of the reference, whose own noise is far
//! below ours. False-alarm rate: 0.1 % for each test (Šidák over the scenes). A test without its scenes says so and passes.

use crate::support::{Budget, Estimate, Family, measure, plain};
use sampling::filter::Filter;
use scenes::{LoadOptions, Scene, Skip};
use std::path::PathBuf;

/// A scene at this size, with the box filter, which looks at nothing beyond the image; `None`, and why, where it is not there.
fn open(name: &str, size: (u32, u32)) -> Option<Scene> {
    let folder = std::env::var("NEUMANN_SCENES").unwrap_or_else(|_| "../shared/scenes".to_owned());
    let path = PathBuf::from(folder).join(name);
    if !path.exists() {
        println!("skipped: no {}; set NEUMANN_SCENES to the folder of scenes", path.display());
        return None;
    }
    let options = LoadOptions { size: Some(size), skip: Skip::Unneeded };
    let mut scene = scenes::load(path.to_str().unwrap(), &options).unwrap();
    scene.camera.set_filter(Filter::Box);
    Some(scene)
}

/// How the whole of a scene up to an order, or without end, compares with the mean of its reference's channels.
fn compare(family: &mut Family, name: &str, size: (u32, u32), samples: u32, last: Option<usize>, reference: f64) {
    let Some(scene) = open(name, size) else { return };
    let budget = Budget { tail: last.is_none(), ..Budget::samples(samples).up_to(last.unwrap_or(4)) };
    let rendered = measure(&scene, plain("path").as_ref(), name, budget);
    let all: Vec<usize> = (0..rendered.measurement.pixels()).collect();
    family.image(name, rendered.total(&all), Estimate::exact(reference));
}

/// Images of Mitsuba 2.2.1 with 4096 samples a pixel. Of the scene `env` there is one too, which holds 0.45 of the light: next to
/// (⅔)², as if a bilinear texel were weighted by its own hat twice; Mitsuba 3.9 renders what we do.
#[test]
fn ignis() {
    let mut family = Family::new("scenes of Ignis");
    for (name, last, reference) in [
        ("emissive-plane", 3, 0.2543041),
        ("emissive-plane-scale", 3, 0.0307651),
        ("multilight", 3, 0.2772529),
        ("plane", 5, 0.9623030),
        ("point", 3, 0.0102349),
        ("room", 3, 0.6809729),
        ("sphere-light", 3, 0.0716424),
    ] {
        compare(&mut family, &format!("ignis-eval/mitsuba/{name}.xml"), (32, 32), 4, Some(last), reference);
    }
    // The first order alone has an image too.
    compare(&mut family, "ignis-eval/mitsuba/plane.xml", (32, 32), 4, Some(0), 0.8491960);
    family.finish(0.0);
}

/// One scene of two programs, by the image of a third, Tungsten.
#[test]
fn cornell_box() {
    let mut family = Family::new("Cornell box of two formats");
    for name in ["cornell-box/mitsuba/scene_v3.xml", "cornell-box/pbrt/scene-v4.pbrt"] {
        compare(&mut family, name, (32, 32), 4, None, 0.1199609);
    }
    family.finish(0.0);
}

/// Tungsten's image of Veach's plates holds direct light alone, though the file asks for one order more.
#[test]
fn veachs_plates() {
    let mut family = Family::new("Veach's plates");
    compare(&mut family, "veach-mis/mitsuba/scene_v3.xml", (64, 36), 32, Some(1), 0.6254106);
    family.finish(0.0);
}

/// An environment's row r stands at the angle πr/(h − 1) from the pole: by the irradiance of its one bright texel, whose hat spans
/// a row to either side, on a plane of albedo ρ.
#[test]
fn a_bright_texel() {
    let Some(scene) = open("ignis-eval/mitsuba/env.xml", (32, 32)) else { return };
    let rendered = measure(&scene, plain("path").as_ref(), "env", Budget::samples(4).up_to(1));
    // The floor, away from its edges: 100 times the texel in row 13 of 50, one column of 100.
    let pixels: Vec<usize> = (26..29).flat_map(|row| (8..24).map(move |column| row * 32 + column)).collect();
    let step = std::f64::consts::PI / 49.0;
    let hat = |t: f64| (1.0 - t.abs()) * (step * (13.0 + t)).sin() * (step * (13.0 + t)).cos();
    let n = 2000;
    let sum: f64 =
        (0..n).map(|i| hat(2.0 * (f64::from(i) + 0.5) / f64::from(n) - 1.0)).sum::<f64>() * 2.0 / f64::from(n);
    let irradiance = 100.0 * std::f64::consts::TAU / 100.0 * step * sum;
    let albedo = (0.885809 + 0.698859 + 0.666422) / 3.0;
    let mut family = Family::new("a bright texel");
    let exact = Estimate::exact(albedo * irradiance / std::f64::consts::PI);
    family.image("order 1", rendered.over(1, &pixels), exact);
    family.finish(0.0);
}
