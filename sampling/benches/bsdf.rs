//! Nanoseconds of one sample with its value and density, for every model of the list: `cargo bench -p sampling`.
//!
//! Directions of incidence and random numbers run through tables that stay in the first-level cache; what reading them takes is
//! measured too, as `nothing`.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use sampling::bsdf::{Argument, Arguments, Bsdf, Domain, ModelEntry, Preset, TransportMode};
use sampling::sampler::{Purpose, Role, Sampler, SamplerKind, StreamKey};
use sampling::{Vec2, Vec3, warp};
use std::hint::black_box;

const COUNT: usize = 256;

/// A direction of incidence, the choice of lobe, and the point of the unit square.
type Draw = (Vec3, f32, Vec2);

fn draws() -> Vec<Draw> {
    let mut sampler =
        Sampler::new(SamplerKind::Independent, StreamKey::new(0, "bench", Role::Estimate, 0), COUNT as u32, (1, 1));
    let mut draw = |i| {
        sampler.start_sample(0, i);
        let wo = warp::cosine_hemisphere(sampler.get_2d(Purpose::EmitterDirection));
        (wo, sampler.get_1d(Purpose::Lobe), sampler.get_2d(Purpose::Direction))
    };
    (0..COUNT as u32).map(&mut draw).collect()
}

/// The model as it is when nothing is said, and with every other word of its choices; its first example where something must be
/// said.
fn usual(entry: &ModelEntry) -> Vec<(String, Bsdf)> {
    if entry.parameters.iter().any(|parameter| matches!(parameter.preset, Preset::Required(_))) {
        return vec![(entry.name.to_owned(), (entry.examples)()[0])];
    }
    let presets = Arguments::presets(entry.parameters);
    let mut all = vec![(entry.name.to_owned(), presets)];
    for (place, parameter) in entry.parameters.iter().enumerate() {
        // Names of metals and the like say nothing of time.
        let (Domain::Choice(words), Preset::Choice(_)) = (parameter.domain, parameter.preset) else { continue };
        for (choice, word) in words.iter().enumerate().skip(1) {
            let mut arguments = presets;
            arguments.set(place, Argument::Choice(choice));
            all.push((format!("{}, {} {word}", entry.name, parameter.name), arguments));
        }
    }
    all.into_iter().filter_map(|(name, arguments)| Some((name, (entry.from_arguments)(&arguments).ok()?))).collect()
}

/// One sample, and the value and density of a direction, which is the one sampled if there is one.
fn sample_and_evaluate(bsdf: &Bsdf, (wo, uc, u): Draw) -> f32 {
    let sample = bsdf.sample(wo, uc, u, TransportMode::Radiance);
    let wi = sample.map_or(wo, |sample| sample.wi);
    let (f, pdf) = bsdf.eval_pdf(wo, wi, TransportMode::Radiance);
    f.max_component() + pdf + sample.map_or(0.0, |sample| sample.weight.max_component())
}

fn models(criterion: &mut Criterion) {
    let draws = draws();
    let mut group = criterion.benchmark_group("bsdf");
    let mut i = 0;
    let mut next = move || {
        i = (i + 1) % COUNT;
        i
    };
    group.bench_function("nothing", |bencher| bencher.iter(|| black_box(draws[next()])));
    for (name, bsdf) in Bsdf::MODELS.iter().flat_map(usual) {
        group.bench_with_input(BenchmarkId::from_parameter(name), &bsdf, |bencher, bsdf| {
            bencher.iter(|| sample_and_evaluate(black_box(bsdf), draws[next()]));
        });
    }
    group.finish();
}

criterion_group!(benches, models);
criterion_main!(benches);
