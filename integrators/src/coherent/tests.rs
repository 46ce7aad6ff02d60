use super::*;
use scenes::{LoadOptions, load};

const SIZE: u32 = 64;

fn scene(name: &str) -> Scene {
    load(name, &LoadOptions { size: Some((SIZE, SIZE)), ..LoadOptions::default() }).unwrap()
}

fn pixels() -> impl Iterator<Item = (u32, u32)> {
    (0..SIZE).flat_map(|y| (0..SIZE).map(move |x| (x, y)))
}

/// What a ray through the middle of a pixel meets: the surface's normal, and whether it emits.
fn seen(scene: &Scene, (x, y): (u32, u32)) -> Option<(sampling::Vec3, bool)> {
    let middle = sampling::vec2(x as f32 + 0.5, y as f32 + 0.5);
    let ray = scene.camera.sample_we(middle, sampling::vec2(0.5, 0.5)).ray;
    scene.intersect(&ray).map(|hit| (hit.ns(), hit.emitter.is_some()))
}

#[test]
fn averages_are_of_what_sees_the_same_surface_and_add_up_to_one() {
    for (name, least) in [("cornell_box", 0.7), ("veach_mis", 0.5)] {
        let scene = scene(name);
        for radius in [1, 2, 7] {
            let neighbours = Neighbours::find(&scene, radius);
            let shared = pixels().filter(|&at| neighbours.shares(at)).count();
            assert!(shared as f64 > least * f64::from(SIZE * SIZE), "{name}: {shared} pixels share numbers");
            for at in pixels().filter(|&at| neighbours.shares(at)) {
                let (normal, emits) = seen(&scene, at).unwrap();
                assert!(!emits, "{name}: {at:?}");
                let mut sum = 0.0;
                for of in pixels().filter(|of| of.0.abs_diff(at.0) <= radius && of.1.abs_diff(at.1) <= radius) {
                    let weight = neighbours.weight(at, of);
                    assert!(weight >= 0.0 && (weight == 0.0 || neighbours.shares(of)), "{name}: {at:?} {of:?}");
                    sum += weight;
                    if weight > 0.0 {
                        assert!(seen(&scene, of).unwrap().0.dot(normal) > 0.9, "{name}: {at:?} {of:?}");
                    }
                }
                assert!((sum - 1.0).abs() < 1e-6, "{name}: {at:?} {sum}");
            }
        }
    }
}

#[test]
fn nothing_is_shared_where_there_is_one_sample_or_no_diffuse_surface() {
    let glossy = scene("veach_mis");
    let neighbours = Neighbours::find(&glossy, 2);
    let plates = pixels().filter(|&at| {
        let middle = sampling::vec2(at.0 as f32 + 0.5, at.1 as f32 + 0.5);
        let ray = glossy.camera.sample_we(middle, sampling::vec2(0.5, 0.5)).ray;
        let met = glossy.intersect(&ray);
        met.is_some_and(|hit| !sampling::bsdf::Lobes::DIFFUSE.contains(hit.bsdf.lobes()))
    });
    let plates: Vec<_> = plates.collect();
    assert!(plates.len() > 200 && plates.iter().all(|&at| !neighbours.shares(at)), "{}", plates.len());
    let alone = Neighbours::none(&scene("cornell_box"));
    assert!(pixels().all(|at| !alone.shares(at)) && alone.work == Counters::default());
}
