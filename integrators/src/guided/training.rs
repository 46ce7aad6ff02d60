//! How a guide is learned: by walks of its own, in iterations of twice as many each, every one led by what the ones before found.

use super::quadtree::to_square;
use super::tree::{Record, Tree};
use super::{Guided, Led};
use crate::contribution::{Contribution, Sink, Wants};
use crate::integrator::{Pixel, Replicate};
use crate::measurement::Counters;
use crate::request::Request;
use crate::scratch::Scratch;
use crate::vertex::{PathVertex, Site};
use rayon::prelude::*;
use sampling::bsdf::TransportMode;
use sampling::rng::{Stream, mix2};
use sampling::sampler::{Purpose, Sampler};
use sampling::{Vec3, vec3};
use scenes::Scene;
use std::ops::Range;

/// Parts of space are divided from so many records of light on, times the root of the samples per pixel of the iteration. That is the
/// rule of Müller et al. 2017, §5.1, who count dark records too, and give 12 000 for images of a million pixels, in 2019 4000 (§10.3);
/// here next-event estimation leaves most walks dark.
const RECORDS_OF_A_PART: f64 = 100.0;
/// Walks whose records are kept at once, about.
const WALKS_AT_ONCE: u32 = 1 << 16;

/// The samples per pixel of each iteration, of so many in all.
fn iterations(samples: u32) -> Vec<Range<u32>> {
    let (mut ranges, mut first, mut count) = (Vec::new(), 0, 1);
    while first < samples {
        // What is left goes to the last.
        let rest = samples - first;
        let taken = if rest < 3 * count { rest } else { count };
        ranges.push(first..first + taken);
        (first, count) = (first + taken, 2 * count);
    }
    ranges
}

/// Learns a guide from so many samples per pixel.
pub fn train(
    settings: &Guided,
    scene: &Scene,
    request: &Request,
    replicate: &Replicate,
    samples: u32,
) -> (Tree, Counters) {
    let (width, height) = (scene.camera.width(), scene.camera.height());
    // A little wider than the scene, so that no point lies on the cube's sides.
    let radius = 1.001 * scene.bounds.radius;
    let mut tree = Tree::new(scene.bounds.center - Vec3::splat(radius), 2.0 * radius);
    let (key, band) = (replicate.key.of_pilot(), (WALKS_AT_ONCE / width).max(1) as usize);
    let mut rows: Vec<Row> = (0..height).map(|_| Row::default()).collect();
    let mut records = Vec::new();
    for taken in iterations(samples) {
        for sample in taken.clone() {
            for (number, rows) in rows.chunks_mut(band).enumerate() {
                rows.par_iter_mut().enumerate().for_each(|(i, row)| {
                    let y = (number * band + i) as u32;
                    let mut sampler = Sampler::new(replicate.sampler, key, samples, (width, height));
                    row.trace(settings, (scene, request), &tree, y, sample, &mut sampler);
                });
                records.clear();
                rows.iter().for_each(|row| records.extend_from_slice(&row.witness.records));
                // In the first half of an iteration there is little to be judged.
                tree.learn(&mut records, sample - taken.start >= (taken.end - taken.start).div_ceil(2));
            }
        }
        tree.conclude(RECORDS_OF_A_PART * f64::from(taken.end - taken.start).sqrt());
    }
    let mut counters = Counters::default();
    rows.iter().for_each(|row| counters += row.scratch.counters);
    (tree, counters)
}

/// What a thread needs for the walks of a row of pixels.
#[derive(Default)]
struct Row {
    witness: Witness,
    scratch: Scratch,
}

impl Row {
    fn trace(
        &mut self,
        settings: &Guided,
        (scene, request): (&Scene, &Request),
        tree: &Tree,
        y: u32,
        sample: u32,
        sampler: &mut Sampler,
    ) {
        let (width, path) = (scene.camera.width(), settings.path());
        let mut dice = Stream::new(mix2(u64::from(sample), 0x6775_6964), u64::from(y));
        self.witness.records.clear();
        for x in 0..width {
            sampler.start_sample(u64::from(y) * u64::from(width) + u64::from(x), sample);
            let place = Pixel::sample(x, y, scene.camera.filter(), sampler.get_2d(Purpose::Film)).0;
            path.trace(Led(tree), (scene, request), place, sampler, &mut self.scratch, &mut self.witness);
            self.witness.follow(&self.scratch.camera);
            self.witness.finish(tree, &mut dice);
        }
    }
}

/// A scattering of a walk, and the light it led to.
struct Scattering {
    p: Vec3,
    wi: Vec3,
    /// Densities of `wi` [1/sr]: by which it was sampled, and of the BSDF alone.
    pdf: f32,
    pdf_bsdf: f32,
    /// Luminance of the walk's weight before and after.
    before: f32,
    after: f32,
    /// Luminance that the walk brought home from there.
    light: f64,
}

/// Sees what walks find.
#[derive(Default)]
struct Witness {
    /// Scatterings of the walk at work; `None` where nothing is to be learned.
    walk: Vec<Option<Scattering>>,
    records: Vec<Record>,
}

impl Sink for Witness {
    const WANTS: Wants = Wants { vertices: true, ..Wants::NOTHING };

    fn add(&mut self, contribution: Contribution) {
        self.follow(contribution.path.camera);
        let light = f64::from(contribution.value.luminance()) * contribution.weight;
        if light.is_finite() {
            self.walk.iter_mut().flatten().for_each(|scattering| scattering.light += light);
        }
    }
}

impl Witness {
    /// Goes as far as a walk has come.
    fn follow(&mut self, vertices: &[PathVertex]) {
        // The first is the camera; a scattering is known by the vertex after it.
        for i in self.walk.len()..vertices.len().saturating_sub(2) {
            self.walk.push(scattering(&vertices[i + 1], &vertices[i + 2]));
        }
    }

    /// Makes records of a walk that has ended. Each goes to the part of a point near its own, as far as the part is wide, so that
    /// neighbours learn of one another [Müller 2019, §10.3].
    fn finish(&mut self, tree: &Tree, dice: &mut Stream) {
        for Scattering { p, wi, pdf, pdf_bsdf, before, after, light } in self.walk.drain(..).flatten() {
            let (of_radiance, of_scattered) = (light as f32 / (after * pdf), light as f32 / before);
            if !of_radiance.is_finite() || !of_scattered.is_finite() {
                continue;
            }
            let (_, size) = tree.find(p);
            let near = p + size * (vec3(dice.next_f32(), dice.next_f32(), dice.next_f32()) - Vec3::splat(0.5));
            let (part, _) = tree.find(near);
            self.records.push(Record {
                part,
                place: to_square(wi),
                light: of_radiance,
                scattered: of_scattered,
                pdf_bsdf,
            });
        }
    }
}

/// What happened at `from`, from which the walk went to `to`; `None` where a guide has no say.
fn scattering(from: &PathVertex, to: &PathVertex) -> Option<Scattering> {
    let Site::Surface(hit) = &from.site else { return None };
    if from.delta || !hit.is_connectable() {
        return None;
    }
    // Back from a density per area.
    let (wi, pdf) = if to.is_infinite() {
        (-to.wo, to.pdf_fwd)
    } else {
        let d = to.at.p - from.at.p;
        let cos = to.at.ng.dot(to.wo).abs();
        (-to.wo, to.pdf_fwd * f64::from(d.length_squared()) / f64::from(cos))
    };
    Some(Scattering {
        p: from.at.p,
        wi,
        pdf: pdf as f32,
        pdf_bsdf: hit.pdf(from.wo, wi, TransportMode::Radiance),
        before: from.beta.luminance(),
        after: to.beta.luminance(),
        light: 0.0,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn iterations_double_and_take_all() {
        let counts = |samples| iterations(samples).iter().map(ExactSizeIterator::len).collect::<Vec<_>>();
        assert_eq!(counts(1), [1]);
        assert_eq!(counts(2), [2]);
        assert_eq!(counts(7), [1, 2, 4]);
        assert_eq!(counts(12), [1, 2, 9]);
        assert_eq!(counts(15), [1, 2, 4, 8]);
        for samples in 1..100 {
            let ranges = iterations(samples);
            assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert_eq!((ranges[0].start, ranges.last().unwrap().end), (0, samples));
        }
    }
}
