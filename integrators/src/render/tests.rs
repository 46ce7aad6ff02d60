use super::*;
use crate::method::Methods;
use crate::statistics::side_by_side::Pixels;
use scenes::{LoadOptions, Skip};
use std::io::Read;

fn scene() -> Scene {
    scene_of((6, 5))
}

fn scene_of(size: (u32, u32)) -> Scene {
    scenes::load("cornell_box", &LoadOptions { size: Some(size), skip: Skip::Unneeded }).unwrap()
}

fn render<'a>(scene: &'a Scene, method: &'a dyn Integrator, max_order: usize) -> Render<'a> {
    let settings = RenderSettings {
        orders: Orders::up_to(max_order),
        tail: true,
        samples_per_replicate: 2,
        seed: 3,
        sampler: SamplerKind::Sobol,
        instance: "saved".to_owned(),
        role: Role::Estimate,
    };
    Render::new(scene, method, settings).unwrap()
}

/// The same up to order 2, with its largest contributions.
fn with_fireflies<'a>(scene: &'a Scene, method: &'a dyn Integrator) -> Render<'a> {
    let bare = render(scene, method, 2);
    let request = bare.request.clone().with_fireflies();
    Render::of_request(scene, method, bare.settings.clone(), bare.window.clone(), request).unwrap()
}

/// All of a measurement but its times; what is printed of a number tells it from every other one.
fn told(render: Render) -> String {
    format!("{:?}", Measurement { replicate_seconds: Vec::new(), ..render.finish() })
}

fn saved(render: &Render) -> Vec<u8> {
    let mut bytes = Vec::new();
    render.save(&mut bytes).unwrap();
    bytes
}

#[test]
fn a_render_that_goes_on_later_has_the_bits_of_one_that_never_stopped() {
    const ALL: u32 = 21;
    let scene = scene();
    let method = Methods::standard().build("bdpt", &serde_json::json!({})).unwrap();
    let mut long = render(&scene, &*method, 3);
    let states: Vec<Vec<u8>> = (0..ALL)
        .map(|_| {
            let state = saved(&long);
            long.run_replicate(&|_| {});
            state
        })
        .collect();
    let expected = told(long);
    for (replicates, state) in states.iter().enumerate() {
        let mut later = render(&scene, &*method, 3);
        later.resume(&mut state.as_slice()).unwrap();
        assert_eq!(later.replicates() as usize, replicates);
        assert_eq!(saved(&later), *state);
        (later.replicates()..ALL).for_each(|_| later.run_replicate(&|_| {}));
        assert!(told(later) == expected, "after {replicates} replicates");
    }
}

#[test]
fn a_damaged_state_or_one_of_another_image_changes_nothing() {
    let scene = scene();
    let method = Methods::standard().build("path", &serde_json::json!({})).unwrap();
    let [mut render, mut other] = [2, 3].map(|max_order| render(&scene, &*method, max_order));
    (0..9).for_each(|_| render.run_replicate(&|_| {}));
    other.run_replicate(&|_| {});
    let state = saved(&render);
    for damaged in [&state[..state.len() - 1], &state[1..], &saved(&other)] {
        assert!(render.resume(&mut &damaged[..]).is_err());
        assert!(saved(&render) == state);
    }
}

#[test]
fn replicates_rendered_apart_add_up_to_the_bits_of_one_render() {
    const ALL: u32 = 19;
    let scene = scene();
    for name in ["path", "bdpt", "vcm"] {
        let method = Methods::standard().build(name, &serde_json::json!({})).unwrap();
        let new = || with_fireflies(&scene, &*method);
        let mut whole = new();
        (0..ALL).for_each(|_| whole.run_replicate(&|_| {}));
        // Groups in another order, the second one by two that share it.
        let mut apart: Vec<Vec<u8>> = vec![Vec::new(); ALL as usize];
        for range in [16..ALL, 8..11, 0..8, 11..16] {
            let mut part = new();
            if range.start % GROUP > 0 {
                part.read_replicate(&mut apart[range.start as usize - 1].as_slice()).unwrap();
            }
            for number in range {
                let seconds = part.run_apart(number, &|_| {});
                part.write_replicate(seconds, &mut apart[number as usize]).unwrap();
            }
        }
        let mut merged = new();
        apart.iter().for_each(|bytes| merged.take_replicate(&mut bytes.as_slice()).unwrap());
        assert!(told(merged) == told(whole), "{name}");
        let mut other = render(&scene, &*method, 3);
        assert!(other.take_replicate(&mut apart[0].as_slice()).is_err());
        assert!(new().take_replicate(&mut &apart[0][..apart[0].len() - 1]).is_err());
    }
}

#[test]
fn replicates_side_by_side_add_up_to_the_bits_of_one_render() {
    const ALL: u32 = 19;
    // More pixels than are taken at once, and rows that end anywhere in them.
    let scene = scene_of((70, 47));
    let method = Methods::standard().build("bdpt", &serde_json::json!({})).unwrap();
    let new = || with_fireflies(&scene, &*method);
    let (mut whole, mut part, mut merged) = (new(), new(), new());
    (0..ALL).for_each(|_| whole.run_replicate(&|_| {}));
    let mut of_replicate = |number| {
        let (seconds, mut bytes) = (part.run_apart(number, &|_| {}), Vec::new());
        part.write_replicate(seconds, &mut bytes).unwrap();
        bytes
    };
    let apart: Vec<Vec<u8>> = (0..ALL).map(&mut of_replicate).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    for group in apart.chunks(GROUP as usize) {
        let mut last = new();
        last.read_replicate(&mut group[group.len() - 1].as_slice()).unwrap();
        let mut from: Vec<&[u8]> = group.iter().map(Vec::as_slice).collect();
        let mut seen = 0;
        let mut look = |pixels: &Pixels| {
            assert_eq!((pixels.range().start, pixels.replicates()), (seen, group.len()));
            for (pixel, layer) in pixels.range().flat_map(|pixel| (0..3).map(move |layer| (pixel, layer))) {
                assert_eq!(pixels.value(group.len() - 1, layer, pixel), last.last_replicate(layer, pixel));
            }
            seen = pixels.range().end;
        };
        pool.install(|| merged.take_replicates(&mut from, &mut look)).unwrap();
        assert!(seen == 70 * 47 && from.iter().all(|left| left.is_empty()));
    }
    assert_eq!(merged.replicates(), ALL);
    assert!(new().take_replicates(&mut [&apart[0][..apart[0].len() - 1]], &mut |_| {}).is_err());
    assert!(told(merged) == told(whole));
}

#[test]
fn groups_gathered_apart_add_up_to_the_bits_of_one_render() {
    const ALL: u32 = 27;
    let scene = scene();
    for name in ["path", "bdpt", "vcm"] {
        let method = Methods::standard().build(name, &serde_json::json!({})).unwrap();
        let new = || with_fireflies(&scene, &*method);
        let mut whole = new();
        let mut added = Vec::new();
        for replicate in 0..ALL {
            whole.run_replicate(&|_| {});
            if (replicate + 1).is_multiple_of(GROUP) {
                added.push(whole.last_group().1.to_vec());
            }
        }
        // The first group replicate by replicate, the third before the second, which is divided, and the last one not full.
        let mut part = new();
        let mut bytes = vec![Vec::new(); 4];
        let films: Vec<Vec<u8>> = (0..GROUP)
            .map(|number| {
                let (seconds, mut bytes) = (part.run_apart(number, &|_| {}), Vec::new());
                part.write_replicate(seconds, &mut bytes).unwrap();
                bytes
            })
            .collect();
        for group in [2, 1, 3] {
            let mut film = Vec::new();
            for number in group * GROUP..ALL.min((group + 1) * GROUP) {
                if number == 11 {
                    // Another process goes on, from the films that it finds.
                    part = new();
                    for bytes in &film {
                        let bytes: &Vec<u8> = bytes;
                        let seconds = part.read_replicate(&mut bytes.as_slice()).unwrap();
                        part.gather_replicate(seconds);
                    }
                }
                let (seconds, mut bytes) = (part.run_apart(number, &|_| {}), Vec::new());
                part.write_replicate(seconds, &mut bytes).unwrap();
                film.push(bytes);
                part.gather_replicate(seconds);
            }
            part.write_group(&mut bytes[group as usize]).unwrap();
        }
        let mut merged = new();
        let take = |render: &mut Render, bytes: &[u8]| render.take_group(&mut bytes.take(bytes.len() as u64));
        assert!(take(&mut merged, &films[0]).is_err());
        films.iter().for_each(|bytes| merged.take_replicate(&mut bytes.as_slice()).unwrap());
        for (group, bytes) in bytes.iter().enumerate().skip(1) {
            assert!(take(&mut merged, &bytes[..bytes.len() - 8]).is_err());
            take(&mut merged, bytes).unwrap();
            if let Some(added) = added.get(group) {
                assert_eq!(merged.last_group(), (GROUP, added.as_slice()));
            }
        }
        assert!(take(&mut render(&scene, &*method, 3), &bytes[1]).is_err());
        assert!(told(merged) == told(whole), "{name}");
    }
}
