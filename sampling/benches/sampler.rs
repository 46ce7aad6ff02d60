//! Nanoseconds of a number and of a point, for every sampler: `cargo bench -p sampling --bench sampler`.
//!
//! `independent` is PCG itself, started at every address. Each round turns to a new sample, at most every fourth draw.

use criterion::{Criterion, criterion_group, criterion_main};
use sampling::sampler::{Purpose, Role, Sampler, SamplerKind, StreamKey, Subpath};
use std::hint::black_box;

fn samplers(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("sampler");
    for &kind in SamplerKind::ALL {
        let key = StreamKey::new(0, "bench", Role::Estimate, 0);
        let mut sampler = Sampler::new(kind, black_box(key), black_box(64), (256, 256));
        let mut sample = 0;
        // What a vertex of a path takes: a lobe, a direction, an emitter, a point on it.
        group.bench_function(format!("{kind}, a vertex"), |bencher| {
            bencher.iter(|| {
                sample = (sample + 1) % 64;
                sampler.start_sample(black_box(777), sample);
                sampler.start_vertex(Subpath::Camera, black_box(1));
                let numbers = sampler.get_1d(Purpose::Lobe) + sampler.get_1d(Purpose::NextEmitter);
                (numbers, sampler.get_2d(Purpose::Direction), sampler.get_2d(Purpose::NextPosition))
            });
        });
    }
    group.finish();
}

criterion_group!(benches, samplers);
criterion_main!(benches);
