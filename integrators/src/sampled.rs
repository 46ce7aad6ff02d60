//! Estimators as integrators: sample after sample of every pixel of a block.

use crate::adaptive::{Allocation, MOST_COUNTS};
use crate::bias::Bias;
use crate::contribution::{Contribution, Sink, Technique, Wants};
use crate::film::{Block, BlockFilm, Counts, PartsFilm, PixelSink};
use crate::integrator::{Estimator, Integrator, Pass, Pixel, Replicate};
use crate::measurement::Counters;
use crate::method::{MethodEntry, Methods};
use crate::request::Request;
use crate::scratch::Scratch;
use sampling::sampler::{Purpose, Sampler};
use scenes::{Needs, Scene};
use serde_json::Value;
use std::ops::RangeInclusive;

/// An estimator under a name.
pub(crate) struct Sampled<E> {
    pub name: &'static str,
    pub estimator: E,
    /// Whether a pilot tells how many samples each pixel takes; all take the same number else.
    pub adapts: bool,
}

impl<E: Estimator> Integrator for Sampled<E> {
    fn name(&self) -> &str {
        self.name
    }

    fn settings(&self) -> Value {
        serde_json::to_value(&self.estimator).unwrap_or(Value::Null)
    }

    fn orders(&self, max_order: usize) -> RangeInclusive<usize> {
        self.estimator.orders(max_order)
    }

    fn carries_subsurface(&self) -> bool {
        E::SUBSURFACE
    }

    fn classifies(&self) -> bool {
        E::CLASSIFIES
    }

    fn expression(&self) -> &'static str {
        self.estimator.expression()
    }

    fn bias(&self) -> Bias {
        self.estimator.bias()
    }

    fn makes(&self, technique: Technique) -> bool {
        self.estimator.makes(technique)
    }

    fn unsupported(&self, scene: &Scene) -> Option<String> {
        unsupported_by(&self.estimator, scene)
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        self.estimator.unsupported_request(request)
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        self.estimator.missing_light(needs)
    }

    fn splats(&self) -> bool {
        self.estimator.splats()
    }

    fn divides(&self) -> bool {
        // A pilot spreads samples over the whole image.
        !self.adapts && !self.splats()
    }

    fn iterates(&self) -> bool {
        E::ITERATES
    }

    fn counts(&self) -> f64 {
        if self.adapts { MOST_COUNTS } else { 1.0 }
    }

    fn bytes(&self, pixels: u64, request: &Request) -> u64 {
        self.estimator.bytes(pixels, request) + if self.adapts { Allocation::BYTES * pixels } else { 0 }
    }

    fn most_samples(&self, _: &Scene, _: &Request, replicate: Replicate) -> u32 {
        if self.adapts { Allocation::most(replicate.samples) } else { replicate.samples }
    }

    fn begin<'a>(&'a self, scene: &'a Scene, request: &'a Request, replicate: Replicate) -> Box<dyn Pass + 'a> {
        let prepared = self.estimator.prepare(scene, request, &replicate);
        let estimator = prepared.as_ref().unwrap_or(&self.estimator);
        let allocation = self.adapts.then(|| Allocation::find(estimator, scene, request, &replicate)).flatten();
        Box::new(Samples { estimator: &self.estimator, prepared, allocation, scene, request, replicate })
    }
}

/// Shows what a sample contributes.
pub(crate) struct Witness<'s>(pub &'s mut dyn FnMut(&Contribution));

impl Sink for Witness<'_> {
    const WANTS: Wants = Wants { vertices: true, ..Wants::NOTHING };

    fn add(&mut self, contribution: Contribution) {
        (self.0)(&contribution);
    }
}

impl PixelSink for Witness<'_> {
    fn start_sample(&mut self, _: Pixel, _: u32, _: f32) {}

    fn start_point(&mut self, _: Pixel, _: f32, _: f32) {}

    fn set_counts(&mut self, _: Counts) {}
}

/// Why an estimator cannot take samples of a scene, if so.
pub(crate) fn unsupported_by<E: Estimator>(estimator: &E, scene: &Scene) -> Option<String> {
    let bodies = (!E::SUBSURFACE).then(|| bodies_in(scene)).flatten();
    bodies.or_else(|| estimator.unsupported(scene))
}

/// What a method that does not follow light through bodies says of a scene with some: which materials, and what to do.
fn bodies_in(scene: &Scene) -> Option<String> {
    let names: Vec<String> = scene.bodies().map(|body| format!("`{}`", body.name)).collect();
    let (material, lets) = match names.len() {
        0 => return None,
        1 => ("material", "lets"),
        _ => ("materials", "let"),
    };
    let methods = Methods::standard();
    let made =
        |entry: &&MethodEntry| (entry.factory)(&Value::Null, &methods).is_ok_and(|method| method.carries_subsurface());
    let able: Vec<&str> = methods.entries().iter().filter(made).map(|entry| entry.name).collect();
    Some(format!(
        "the {material} {} {lets} light through beneath the surface (subsurface), which it cannot follow; use a method that can \
         ({}), or give the surface a BSDF alone, such as plastic",
        names.join(", "),
        able.join(", ")
    ))
}

/// A replicate of an estimator.
struct Samples<'a, E> {
    estimator: &'a E,
    prepared: Option<E>,
    /// How many samples each pixel takes, where they differ.
    allocation: Option<Allocation>,
    scene: &'a Scene,
    request: &'a Request,
    replicate: Replicate,
}

impl<E: Estimator> Pass for Samples<'_, E> {
    fn pilot(&self) -> Counters {
        let mut work = self.prepared.as_ref().map_or(Counters::default(), E::pilot);
        work += self.allocation.as_ref().map_or(Counters::default(), |allocation| allocation.work);
        work
    }

    fn begin_iteration(&mut self, number: u32) -> Counters {
        let Self { prepared, scene, request, replicate, .. } = self;
        prepared.as_mut().map_or(Counters::default(), |method| method.iterate(scene, request, replicate, number))
    }

    fn run(&self, block: Block, out: &mut BlockFilm) {
        let counters = match self.request.parts().list() {
            [] => self.take(block, out),
            _ => self.take(block, &mut PartsFilm(out)),
        };
        out.counters += counters;
    }

    fn replay(&mut self, pixel: (u32, u32), sample: u32, show: &mut dyn FnMut(&Contribution)) -> bool {
        if E::ITERATES {
            self.begin_iteration(sample);
        }
        let (mut samplers, mut scratch) = (self.samplers(), Scratch::default());
        let Some(allocation) = &self.allocation else {
            self.sample(pixel, sample, &mut samplers[0], &mut scratch, &mut Witness(show));
            return true;
        };
        if sample < allocation.samples(pixel) {
            let counts = allocation.counts(pixel);
            let mut scaled = |c: &Contribution| {
                show(&Contribution { weight: c.weight * f64::from(counts.of(c)), ..*c });
            };
            let sampler = &mut samplers[allocation.of(pixel)];
            self.sample(pixel, sample, sampler, &mut scratch, &mut Witness(&mut scaled));
        }
        true
    }
}

impl<E: Estimator> Samples<'_, E> {
    /// Takes the samples of a block.
    fn take<S: PixelSink>(&self, block: Block, out: &mut S) -> Counters {
        let (mut samplers, mut scratch) = (self.samplers(), Scratch::default());
        for pixel in block.tile.pixels() {
            let (of, samples) = match &self.allocation {
                None => (0, block.samples.clone()),
                Some(allocation) => {
                    out.set_counts(allocation.counts(pixel));
                    (allocation.of(pixel), allocation.within(pixel, &block.samples))
                }
            };
            for sample in samples {
                self.sample(pixel, sample, &mut samplers[of], &mut scratch, out);
            }
        }
        scratch.counters
    }

    /// What gives samples their numbers: one for each number of samples that pixels take.
    fn samplers(&self) -> Vec<Sampler> {
        let Replicate { sampler, key, samples, .. } = self.replicate;
        let size = (self.scene.camera.width(), self.scene.camera.height());
        match &self.allocation {
            None => vec![Sampler::new(sampler, key, samples, size)],
            Some(allocation) => {
                let of = |(key, samples)| Sampler::new(sampler, key, samples, size);
                allocation.numbers_of_samples(key).map(of).collect()
            }
        }
    }

    /// Takes one sample.
    #[inline]
    fn sample<S: PixelSink>(
        &self,
        (x, y): (u32, u32),
        sample: u32,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        let width = u64::from(self.scene.camera.width());
        sampler.start_sample(u64::from(y) * width + u64::from(x), sample);
        let (pixel, weight) = Pixel::sample(x, y, self.scene.camera.filter(), sampler.get_2d(Purpose::Film));
        out.start_sample(pixel, sample, weight);
        let estimator = self.prepared.as_ref().unwrap_or(self.estimator);
        estimator.estimate(self.scene, self.request, pixel, sampler, scratch, out);
    }
}
