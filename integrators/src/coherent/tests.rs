use super::*;
use crate::block::Window;
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

/// The pixels in an average and their weights, in all of the image.
fn average(neighbours: &Neighbours, at: (u32, u32), part: usize) -> Vec<((u32, u32), f64)> {
    let mut average = Vec::new();
    neighbours.weights(at, part, &Window::whole(SIZE, SIZE), |of, weight| average.push((of, weight)));
    average
}

#[test]
fn averages_are_of_what_sees_the_same_surface_and_add_up_to_one() {
    for (name, least) in [("cornell_box", 0.7), ("veach_mis", 0.5)] {
        let scene = scene(name);
        for radius in [1, 2, 7] {
            let neighbours = Neighbours::find(&scene, radius);
            let whole: Vec<_> = pixels().filter(|&at| neighbours.parts(at) == 1).collect();
            assert!(whole.len() as f64 > least * f64::from(SIZE * SIZE), "{name}: {} see one surface", whole.len());
            let mut short = 0;
            for at in whole {
                let (normal, emits) = seen(&scene, at).unwrap();
                assert!(!emits, "{name}: {at:?}");
                let average = average(&neighbours, at, 0);
                for &(of, weight) in &average {
                    assert!(weight > 0.0 && neighbours.parts(of) == 1, "{name}: {at:?} {of:?}");
                    assert!(at.0.abs_diff(of.0).max(at.1.abs_diff(of.1)) <= radius, "{name}: {at:?} {of:?}");
                    assert!(seen(&scene, of).unwrap().0.dot(normal) > 0.9, "{name}: {at:?} {of:?}");
                }
                // Where a neighbour is left alone itself, one may be left with less than it needs.
                let sum: f64 = average.iter().map(|(_, weight)| weight).sum();
                assert!((0.5..1.0 + 1e-6).contains(&sum), "{name}: {at:?} {sum}");
                short += u32::from(sum < 1.0 - 1e-6);
            }
            assert!(short < 10, "{name}: {short} averages are short of one");
        }
    }
}

/// Of each part of a pixel at an edge, the average is of pixels that see what a ray to that part meets, and of the pixel itself.
#[test]
fn parts_at_edges_share_with_their_own_sides() {
    let scene = scene("cornell_box");
    let neighbours = Neighbours::find(&scene, 3);
    let edges: Vec<_> = pixels().filter(|&at| neighbours.parts(at) > 1).collect();
    assert!(edges.len() > 200, "{} see edges", edges.len());
    let (mut sides, mut full) = (0, 0);
    for at in edges {
        let parts = neighbours.parts(at);
        assert_eq!(average(&neighbours, at, parts - 1), [(at, 0.5)], "past what shares");
        let mut met = [false; 16];
        for (i, j) in (0..8).flat_map(|j| (0..8).map(move |i| (i, j))) {
            let place = sampling::vec2(i as f32 + 0.5, j as f32 + 0.5) / 8.0;
            let part = neighbours.part(&scene, at, place);
            if part == parts - 1 {
                continue;
            }
            met[part] = true;
            let raster = sampling::vec2(at.0 as f32, at.1 as f32) + place;
            let ray = scene.camera.sample_we(raster, sampling::vec2(0.5, 0.5)).ray;
            let normal = scene.intersect(&ray).unwrap().ns();
            let average = average(&neighbours, at, part);
            let sum: f64 = average.iter().map(|(_, weight)| weight).sum();
            assert!((0.5..1.0 + 1e-6).contains(&sum), "{at:?} {part}: {sum}");
            full += u32::from(sum > 1.0 - 1e-6);
            for (of, _) in average {
                assert!(of == at || seen(&scene, of).unwrap().0.dot(normal) > 0.9, "{at:?} {part} {of:?}");
            }
        }
        sides += met.iter().filter(|&&met| met).count();
    }
    assert!(sides > 400 && full > 10_000, "{sides} parts, and {full} places that have neighbours");
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
    assert!(plates.len() > 200 && plates.iter().all(|&at| neighbours.parts(at) == 0), "{}", plates.len());
    let alone = Neighbours::none(&scene("cornell_box"));
    assert!(pixels().all(|at| alone.parts(at) == 0) && alone.work == Counters::default());
}
