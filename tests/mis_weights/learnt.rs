//! Weights that have more of a strategy than its densities, whatever that is.

use super::*;
use integrators::Counters;
use integrators::bdpt::Weighting;
use sampling::rng::Stream;
use std::sync::Arc;

/// Scenes of every kind of path.
fn scenes() -> Vec<Scene> {
    let mut scenes = rooms();
    scenes.extend(["cornell_box", "veach_mis", "glass_caustic"].map(|name| builtin(name, 8)));
    scenes
}

/// With something learnt of strategies that is made up: other numbers in every cell of the image and for every order up to the fifth.
fn with_learnt(mis: Weighting, number: impl Fn(f32) -> f32) -> Bdpt {
    let mut learnt = PerStrategy::all(1.0, (8, 8), 3, 6);
    let mut numbers = Stream::new(5, 0);
    learnt.values.iter_mut().for_each(|value| *value = number(numbers.next_f32()));
    Bdpt { mis, learnt: Some(Arc::new((learnt, Counters::default()))), ..Bdpt::default() }
}

/// With factors from a hundredth to a hundred.
#[test]
fn weights_sum_to_one_with_any_factors() {
    let with_factors = with_learnt(Weighting::VarianceAware, |u| 10.0_f32.powf(4.0 * u - 2.0));
    for scene in scenes() {
        for emitter_to_camera in [false, true] {
            check(&scene, &Bdpt { emitter_to_camera, ..with_factors.clone() }, 6);
        }
        let light_paths = NonZeroU16::new(3).unwrap();
        check(&scene, &Bdpt { light_paths, ..with_factors.clone() }, 2);
        check(&scene, &Bdpt { camera_connections: false, ..with_factors.clone() }, 2);
    }
}

/// With α of the size of what paths bring, on either side of zero. Of a path that strategy s made, which contributes C there, strategy i would
/// contribute `C b_s / b_i`, with b its weights by the balance heuristic: so its weight is `b_i + b_i / b_s (α_i − ᾱ) / C`, and the sum of all is 1
/// if that of s is what it should be.
#[test]
fn weights_sum_to_one_with_any_controls() {
    let with_controls = with_learnt(Weighting::Optimal, |u| 2.0 * u - 1.0);
    for scene in scenes() {
        for (emitter_to_camera, light_paths) in [(false, 1), (true, 1), (true, 3)] {
            let light_paths = NonZeroU16::new(light_paths).unwrap();
            check_controls(&scene, &Bdpt { emitter_to_camera, light_paths, ..with_controls.clone() });
        }
    }
}

fn check_controls(scene: &Scene, settings: &Bdpt) {
    let mut moved = 0;
    for_every_path(scene, settings, 4, |path, whole, rounding| {
        let Technique::Connect { s, .. } = path.technique else { panic!("bdpt connects") };
        let s = usize::from(s);
        let shares: Vec<f64> =
            (0..whole.len()).map(|i| whole.weight_by(i, Heuristic::Balance).unwrap_or(0.0)).collect();
        let alpha: Vec<f64> = path.learnt.iter().copied().map(f64::from).collect();
        let mean: f64 = shares.iter().zip(&alpha).map(|(share, alpha)| share * alpha).sum();
        let expected = shares[s] + (alpha[s] - mean) / path.luminance;
        // What rounding leaves of shares is multiplied by α over what the path contributes.
        let tolerance = (TOLERANCE + rounding) * (1.0 + 1.0 / path.luminance);
        assert!(
            (path.weight - expected).abs() < tolerance,
            "{}, {:?}: {}, not {expected}: shares {shares:?}, α {alpha:?}",
            scene.name,
            path.technique,
            path.weight
        );
        moved += usize::from((path.weight - shares[s]).abs() > 10.0 * tolerance);
    });
    assert!(moved > 20, "{}: only {moved} weights are another's than the balance heuristic's", scene.name);
}
