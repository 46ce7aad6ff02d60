//! Splats: pixels at the border of the film are as bright as the others, and brightness does not depend on how the
//! samples are divided. Camera samples that a pixel filter places, and splats that it spreads, give the same pixels.
//!
//! False-alarm rate: 0.1 % for each test.

use crate::support::{Budget, Estimate, Family, builtin, exact, grey, measure, plain};
use sampling::filter::Filter;

/// Inside a uniform enclosure every pixel has the same value, those in corners and at borders too, at any shape of film.
#[test]
fn border_pixels_get_their_share() {
    let mut family = Family::new("border pixels");
    for (width, height) in [(5, 3), (16, 9), (17, 16)] {
        let mut scene = builtin("furnace", 8);
        scene.camera.set_size(width, height);
        for name in ["light", "bdpt"] {
            let m = measure(
                &scene,
                plain(name).as_ref(),
                &format!("{name} {width}x{height}"),
                Budget::samples(64).up_to(2),
            );
            let ray = scene.camera.sample_we(sampling::vec2(0.5, 0.5), sampling::Vec2::ZERO).ray;
            let hit = scene.intersect(&ray).unwrap();
            for layer in 0..=2 {
                let truth = Estimate::exact(grey(exact(&scene, layer, hit.point.p, ray.d)));
                let label = format!("{name} {width}x{height} order {layer}");
                for pixel in 0..m.measurement.pixels() {
                    family.block(format!("{label} pixel {pixel}"), m.over(layer, &[pixel]), truth);
                }
                family.image(label, m.image(layer), truth);
            }
        }
    }
    family.finish(0.8);
}

#[test]
fn brightness_does_not_depend_on_the_number_of_samples() {
    let scene = builtin("cornell_box", 8);
    let mut family = Family::new("sample counts");
    for name in ["path", "light", "bdpt"] {
        let measured = [(1, 1024), (5, 256), (64, 64)].map(|(samples, replicates)| {
            let budget = Budget { samples, replicates, ..Budget::samples(1).up_to(3) };
            measure(&scene, plain(name).as_ref(), &format!("{name} {samples}"), budget)
        });
        for other in &measured[1..] {
            for layer in 0..=3 {
                family.image(format!("{name} order {layer}"), measured[0].image(layer), other.image(layer));
            }
        }
    }
    family.finish(0.0);
}

/// Over a floor that is brightest at one border of the film: camera samples and splats see the same slope through every filter, in
/// the pixels at the border too, to which places off the film count.
#[test]
fn filters_weight_camera_samples_and_splats_alike() {
    let mut family = Family::new("filters");
    for &filter in Filter::ALL {
        let mut scene = builtin("cornell_box", 8);
        scene.camera.set_filter(filter);
        let [path, light, bdpt] = ["path", "light", "bdpt"].map(|name| {
            let budget = Budget::samples(if name == "bdpt" { 48 } else { 192 }).up_to(2);
            measure(&scene, plain(name).as_ref(), &format!("{name} {filter}"), budget)
        });
        for layer in 0..=2 {
            for (name, other) in [("light", &light), ("bdpt", &bdpt)] {
                let label = format!("path and {name}, {filter}, order {layer}");
                family.image(label.clone(), path.image(layer), other.image(layer));
                for pixel in 0..path.measurement.pixels() {
                    let pair = [&path, other].map(|rendered| rendered.over(layer, &[pixel]));
                    family.block(format!("{label}, pixel {pixel}"), pair[0], pair[1]);
                }
            }
        }
    }
    family.finish(0.7);
}

/// In a uniform enclosure a normalised filter changes nothing, at borders either.
#[test]
fn filters_are_normalised_up_to_the_border() {
    let mut family = Family::new("filters of a furnace");
    for &filter in Filter::ALL {
        let mut scene = builtin("furnace", 4);
        scene.camera.set_filter(filter);
        let ray = scene.camera.sample_we(sampling::vec2(0.5, 0.5), sampling::Vec2::ZERO).ray;
        let hit = scene.intersect(&ray).unwrap();
        for name in ["path", "light", "bdpt"] {
            let m = measure(&scene, plain(name).as_ref(), &format!("{name} {filter}"), Budget::samples(64).up_to(2));
            for layer in 0..=2 {
                let truth = Estimate::exact(grey(exact(&scene, layer, hit.point.p, ray.d)));
                let label = format!("{name} {filter} order {layer}");
                for pixel in 0..m.measurement.pixels() {
                    family.block(format!("{label} pixel {pixel}"), m.over(layer, &[pixel]), truth);
                }
                family.image(label, m.image(layer), truth);
            }
        }
    }
    family.finish(0.8);
}
