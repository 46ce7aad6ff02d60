//! Samplers: whichever gives the random numbers, every method has the same mean at every order, and where a smooth integrand
//! profits, the variance falls.
//!
//! False-alarm rate: 0.1 % (Šidák over samplers, methods, orders and blocks).

use crate::support::{ALL, Budget, COLUMNS, Family, builtin, is_night, measure, plain};
use sampling::sampler::SamplerKind;

/// Replicates of 16 samples, so that strata and nets are whole, and of 5, so that they are not.
#[test]
fn every_sampler_has_the_mean_of_independent_numbers() {
    let scene = builtin("cornell_box", 12);
    let mut family = Family::new("samplers");
    for (turn, name) in ALL.into_iter().enumerate() {
        let method = plain(name);
        let render = |sampler: SamplerKind, samples: u32| {
            let budget = Budget { samples, replicates: 128, sampler, ..Budget::samples(1).up_to(4) };
            measure(&scene, method.as_ref(), &format!("{name} {sampler} {samples}"), budget)
        };
        let independent = render(SamplerKind::Independent, 32);
        for (place, &sampler) in SamplerKind::ALL[1..].iter().enumerate() {
            // Every day one of the two, in turn.
            let counts = if is_night() { vec![5, 16] } else { vec![[5, 16][(turn + place) % 2]] };
            for samples in counts {
                let other = render(sampler, samples);
                for order in 0..independent.measurement.layers.len() {
                    let label = format!("{name} {sampler} {samples} order {order}");
                    family.layer(&label, order, COLUMNS, &independent, &other);
                }
            }
        }
    }
    family.finish(0.9);
}

/// The variance of image means of direct light at 64 samples of 16 pixels, in 512 replicates: about 8 times lower for `path` and
/// 4.3 times for `light`. A ratio of two such variances has a relative standard error of 9 %, so that 2 is 4 errors away.
#[test]
fn sequences_are_far_better_than_chance_at_smooth_light() {
    let mut scene = builtin("cornell_box", 4);
    scene.camera.set_size(4, 4);
    let variance = |name: &str, sampler| {
        let budget = Budget { samples: 64, replicates: 512, sampler, ..Budget::samples(1).up_to(1) };
        measure(&scene, plain(name).as_ref(), &format!("{name} {sampler}"), budget).image(1).error.powi(2)
    };
    for name in ["path", "light"] {
        let independent = variance(name, SamplerKind::Independent);
        for sampler in [SamplerKind::Sobol, SamplerKind::Zsobol] {
            let ratio = independent / variance(name, sampler);
            println!("{name}, {sampler}: {ratio}");
            assert!(ratio > 2.0, "{name}: {sampler} has a variance only {ratio} times lower than independent numbers");
        }
    }
}
