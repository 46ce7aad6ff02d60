//! Nanoseconds of one sample with its value and density, for every model of the list: `cargo bench -p sampling`.
//!
//! `bsdf` takes a sample, which has a weight and a density, and evaluates both again for its direction, as multiple importance
//! sampling does; `sample` takes the sample alone; `from_arguments` makes the model, as textures do at every hit.
//! Directions of incidence and random numbers run through a table: longer than branch predictors remember, and short enough to
//! stay in the second-level cache. What reading it takes is measured too, as `nothing`.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use sampling::bsdf::{Argument, Arguments, Bsdf, Domain, ModelEntry, Preset, TransportMode};
use sampling::sampler::{Purpose, Role, Sampler, SamplerKind, StreamKey};
use sampling::{Vec2, Vec3, warp};
use std::hint::black_box;

const COUNT: usize = 4096;

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

/// A model as it is measured.
struct Usual {
    name: String,
    bsdf: Bsdf,
    /// `None` of an example.
    made_from: Option<(&'static ModelEntry, Arguments)>,
}

/// The model as it is when nothing is said, and with every other word of its choices; its first example where something must be
/// said.
fn usual(entry: &'static ModelEntry) -> Vec<Usual> {
    if entry.parameters.iter().any(|parameter| matches!(parameter.preset, Preset::Required(_))) {
        return vec![Usual { name: entry.name.to_owned(), bsdf: (entry.examples)()[0], made_from: None }];
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
    let made = |(name, arguments): (String, Arguments)| {
        let bsdf = (entry.from_arguments)(&arguments).ok()?;
        Some(Usual { name, bsdf, made_from: Some((entry, arguments)) })
    };
    all.into_iter().filter_map(made).collect()
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
    let all: Vec<Usual> = Bsdf::MODELS.iter().flat_map(usual).collect();
    let mut i = 0;
    let mut next = || {
        i = (i + 1) % COUNT;
        draws[i]
    };
    let mut group = criterion.benchmark_group("bsdf");
    group.bench_function("nothing", |bencher| bencher.iter(|| black_box(next())));
    for Usual { name, bsdf, .. } in &all {
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter(|| sample_and_evaluate(black_box(bsdf), next()));
        });
    }
    group.finish();
    let mut group = criterion.benchmark_group("sample");
    for Usual { name, bsdf, .. } in &all {
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter(|| {
                let (wo, uc, u) = next();
                black_box(bsdf).sample(wo, uc, u, TransportMode::Radiance)
            });
        });
    }
    group.finish();
    let mut group = criterion.benchmark_group("from_arguments");
    for Usual { name, made_from, .. } in &all {
        let Some((entry, arguments)) = made_from else { continue };
        group.bench_function(BenchmarkId::from_parameter(name), |bencher| {
            bencher.iter(|| (black_box(entry).from_arguments)(black_box(arguments)));
        });
    }
    group.finish();
}

criterion_group!(benches, models);
criterion_main!(benches);
