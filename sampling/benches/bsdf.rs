//! Nanoseconds of one sample with its value and density, for every model of the list: `cargo bench -p sampling`.
//!
//! Directions of incidence and random numbers run through tables that stay in the first-level cache; what reading them takes is
//! measured too, as `nothing`.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use sampling::bsdf::{Arguments, Bsdf, ModelEntry, Preset, TransportMode};
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

/// The model as it is when nothing is said; its first example where something must be.
fn usual(entry: &ModelEntry) -> Bsdf {
    let required = entry.parameters.iter().any(|parameter| matches!(parameter.preset, Preset::Required(_)));
    let preset = || (entry.from_arguments)(&Arguments::presets(entry.parameters)).ok();
    (!required).then(preset).flatten().unwrap_or_else(|| (entry.examples)()[0])
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
    for entry in Bsdf::MODELS {
        let bsdf = black_box(usual(entry));
        group.bench_with_input(BenchmarkId::from_parameter(entry.name), &bsdf, |bencher, bsdf| {
            bencher.iter(|| sample_and_evaluate(black_box(bsdf), draws[next()]));
        });
    }
    group.finish();
}

criterion_group!(benches, models);
criterion_main!(benches);
