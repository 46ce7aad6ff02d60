//! Scenes that others made render the light that their home renderers' images hold. They are found through `NEUMANN_SCENES`.
//!
//! What is compared is the mean over the image, which no size of it changes, with that of the reference, whose own noise is far
//! below ours. False-alarm rate: 0.1 % for each test (Šidák over the scenes). A test without its scenes says so and passes.

use crate::support::{Budget, Entry, Estimate, Family, agree, measure, method};
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

/// How a scene up to an order, or without end, compares over some rows with the mean of its reference's channels.
struct Known {
    name: &'static str,
    size: (u32, u32),
    /// Samples, as [`Budget::samples`] counts them.
    samples: u32,
    /// The last order that the reference holds; it is without end if None.
    last: Option<usize>,
    rows: std::ops::Range<u32>,
    reference: f64,
}

/// Renders scenes and compares them; scenes that are missing are left out.
fn compare(title: &str, all: &[Known]) {
    let mut family = Family::new(title);
    let mut found = false;
    for known in all {
        let Some(scene) = open(known.name, known.size) else { continue };
        found = true;
        let budget = Budget::samples(known.samples).up_to(known.last.unwrap_or(4));
        let budget = Budget { tail: known.last.is_none(), ..budget };
        let rendered = measure(&scene, method("path").as_ref(), known.name, budget);
        let width = known.size.0 as usize;
        let pixels: Vec<usize> = (known.rows.start as usize * width..known.rows.end as usize * width).collect();
        let label = format!("{} up to {:?}, rows {:?}", known.name, known.last, known.rows);
        family.image(label, rendered.total(&pixels), Estimate::exact(known.reference));
    }
    if found {
        family.finish(0.0);
    }
}

/// Images of Mitsuba 2.2.1 with 4096 samples a pixel. Of the scene `env` there is one too, which holds 0.45 of the light: next to
/// (⅔)², as if a bilinear texel were weighted by its own hat twice; Mitsuba 3.9 renders what we do.
#[test]
fn ignis() {
    let scene =
        |name, last, reference| Known { name, size: (32, 32), samples: 8, last: Some(last), rows: 0..32, reference };
    compare(
        "scenes of Ignis",
        &[
            scene("ignis-eval/mitsuba/emissive-plane.xml", 3, 0.2543041),
            scene("ignis-eval/mitsuba/emissive-plane-scale.xml", 3, 0.0307651),
            scene("ignis-eval/mitsuba/multilight.xml", 3, 0.2772529),
            scene("ignis-eval/mitsuba/plane.xml", 5, 0.9623030),
            scene("ignis-eval/mitsuba/point.xml", 3, 0.0102349),
            scene("ignis-eval/mitsuba/room.xml", 3, 0.6809729),
            scene("ignis-eval/mitsuba/sphere-light.xml", 3, 0.0716424),
            // What is seen of the emitters alone has an image too.
            scene("ignis-eval/mitsuba/plane.xml", 0, 0.8491960),
        ],
    );
}

/// One scene of two programs, by the image of a third, Tungsten.
#[test]
fn cornell_box() {
    let scene = |name| Known { name, size: (32, 32), samples: 12, last: None, rows: 0..32, reference: 0.1199609 };
    compare(
        "Cornell box of two formats",
        &[scene("cornell-box/mitsuba/scene_v3.xml"), scene("cornell-box/pbrt/scene-v4.pbrt")],
    );
}

/// Tungsten's image of Veach's plates holds direct light alone, though the file asks for one order more: on the wall above the
/// lamps, and from the second plate on downwards. The lamps themselves are small and bright, and would decide nothing.
#[test]
fn veachs_plates() {
    let scene = |rows, reference| Known {
        name: "veach-mis/mitsuba/scene_v3.xml",
        size: (64, 36),
        samples: 12,
        last: Some(1),
        rows,
        reference,
    };
    compare("Veach's plates", &[scene(0..5, 0.2887144), scene(20..36, 0.1718933)]);
}

/// An environment's row r stands at the angle πr/(h − 1) from the pole: by the irradiance of its one bright texel, whose hat spans
/// a row to either side, on a plane of albedo ρ.
#[test]
fn a_bright_texel() {
    let Some(scene) = open("ignis-eval/mitsuba/env.xml", (32, 32)) else { return };
    let rendered = measure(&scene, method("path").as_ref(), "env", Budget::samples(32).up_to(1));
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

/// What has no reference here has methods that must agree: glass, metal and plastic of scenes that others made, and the light of an
/// environment. Light tracing is left out where connections to the camera meet narrow lobes: its tail is not
/// seen.
#[test]
fn methods_agree() {
    let entry = |name, samples| Entry::new(name, samples).without_roulette().by_night(8);
    for (name, last, narrow) in [
        ("cornell-obj/CornellBox-Glossy.obj", 3, false),
        ("cornell-obj/CornellBox-Glass.obj", 1, false),
        ("coffee/pbrt/scene-v4.pbrt", 2, true),
        ("ignis-eval/mitsuba/env.xml", 3, false),
        ("ignis-eval/mitsuba/room.xml", 3, false),
    ] {
        let Some(scene) = open(name, (12, 12)) else { continue };
        let mut entries = vec![entry("path", 24), entry("bdpt", 8)];
        entries.extend((!narrow).then(|| entry("light", 24).of_infinite_variance()));
        agree(name, &scene, last, &entries, 0.0);
    }
}
