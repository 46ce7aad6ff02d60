//! Splats: pixels at the border of the film are as bright as the others, and brightness does not depend on how the
//! samples are divided.
//!
//! False-alarm rate: 0.1 % for each test.

use crate::support::{Budget, Estimate, Family, builtin, exact, grey, measure, method};

/// Inside a uniform enclosure every pixel has the same value, those in corners and at borders too, at any shape of film.
#[test]
fn border_pixels_get_their_share() {
    let mut family = Family::new("border pixels");
    for (width, height) in [(5, 3), (16, 9), (17, 16)] {
        let mut scene = builtin("furnace", 8);
        scene.camera.set_size(width, height);
        for name in ["light", "bdpt"] {
            let m = measure(&scene, method(name).as_ref(), &format!("{name} {width}x{height}"), Budget {
                max_order: 2,
                ..Budget::samples(32)
            });
            let ray = scene.camera.sample_we(sampling::vec2(0.5, 0.5), sampling::Vec2::ZERO).ray;
            let hit = scene.intersect(&ray).unwrap();
            for layer in 0..m.layers.len() {
                let truth = grey(exact(&scene, layer, hit.point.p, ray.d));
                for block in 0..m.grid.count() {
                    let label = format!("{name} {width}x{height} order {layer} block {block}");
                    family.against_truth(label, Estimate::of_block(&m, layer, block), truth);
                }
            }
        }
    }
    family.finish();
}

#[test]
fn brightness_does_not_depend_on_the_number_of_samples() {
    let scene = builtin("cornell_box", 8);
    let mut family = Family::new("sample counts");
    for name in ["path", "light", "bdpt"] {
        let measured = [(1, 128), (5, 64), (64, 16)].map(|(samples, replicates)| {
            let budget = Budget { samples, replicates, max_order: 3, tail: false };
            measure(&scene, method(name).as_ref(), &format!("{name} {samples}"), budget)
        });
        for other in &measured[1..] {
            for layer in 0..other.layers.len() {
                let pair = [&measured[0], other].map(|m| Estimate::of_image(m, layer));
                family.pair(format!("{name} order {layer}"), pair[0], pair[1]);
            }
        }
    }
    family.finish();
}
