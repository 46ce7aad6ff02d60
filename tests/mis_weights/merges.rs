//! The weights of merges beside those of connections.

use super::*;
use integrators::connect::{EmitterEnd, Strategies};

/// Weights of all that could have made a path, by connecting or by merging at each of its vertices.
fn with_merges(whole: &Whole, merging: f64) -> (f64, usize) {
    let strategies = Strategies { merging, ..whole.strategies };
    let next_event = {
        let end = EmitterEnd { emitter: whole.emitter, endpoint: whole.endpoint };
        end.next_event_density(whole.scene, &whole.vertices[1].at)
    };
    // Each vertex as the last of both of its subpaths, which know what they would of each other's strategies.
    let subpaths = |s: usize, shared: usize| {
        let (mut light, mut camera) = (whole.divide(s).0, whole.divide(s - shared).1);
        strategies.sum_light(&mut light, next_event);
        strategies.sum_camera(&mut camera);
        (light, camera)
    };
    let connected: f64 = (0..whole.len())
        .filter(|&s| whole.weight(s).is_some())
        .map(|s| {
            let (light, camera) = subpaths(s, 0);
            let end = EmitterEnd { emitter: whole.emitter, endpoint: whole.endpoint };
            match s {
                0 => strategies.weight_emission(whole.scene, &camera, &end),
                _ => strategies.weight_connected(whole.scene, &light, &camera, next_event),
            }
        })
        .sum();
    let merges: Vec<usize> = (1..whole.len() - 1).filter(|&i| !whole.vertices[i].delta).collect();
    let merged = merges.iter().map(|&i| {
        let (light, camera) = subpaths(i + 1, 1);
        strategies.weight_merged(&strategies.light_end(&light, i, next_event), light[i].wo, &camera)
    });
    (connected + merged.sum::<f64>(), merges.len())
}

#[test]
fn weights_sum_to_one_where_vertices_are_merged() {
    let mut scenes = rooms();
    scenes.extend(["cornell_box", "glass_caustic"].map(|name| builtin(name, 8)));
    for scene in &scenes {
        let mut merges = 0;
        for mis in [Heuristic::Balance, Heuristic::POWER, Heuristic::Maximum] {
            for emitter_to_camera in [false, true] {
                let settings = Bdpt { mis: mis.into(), emitter_to_camera, ..Bdpt::default() };
                for path in paths(scene, &settings, 2) {
                    let whole = Whole::new(scene, &path, &settings);
                    // From where they hardly count to where nothing else does.
                    for merging in [1e-4, 1e-2, 1.0, 1e4] {
                        let (sum, count) = with_merges(&whole, merging);
                        merges += count;
                        let label = format!("{}, {:?}, η {merging}, {settings:?}", scene.name, path.technique);
                        assert!((sum - 1.0).abs() < TOLERANCE, "{label}: sum {sum}");
                    }
                }
            }
        }
        assert!(merges > 1000, "{}: {merges}", scene.name);
    }
}
