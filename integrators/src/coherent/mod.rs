//! Path tracing with the same random numbers in many pixels, whose common error is taken from their neighbours' own: `coherent`; and bidirectional
//! path tracing, `coherent_bdpt`.
//!
//! Of the samples of a pixel that sees a diffuse surface, half take the pixel's *own* random numbers and half the *common* ones, the same in all such
//! pixels \[Sadeghi09\]. With C for the image of the common samples and O for that of the own ones, the estimate is
//!
//! ```text
//! I = C + F (O − C)
//! ```
//!
//! F averages over the neighbours of a pixel that see much the same. O and C have the same mean and F depends on the scene alone, so the mean
//! of I is the truth whatever F is: F (O − C) is a control variate in image space \[Rousselle16\]. What neighbouring pixels err by with common numbers
//! is much the same, so that (1 − F) C errs by little, and F O by what the average over all neighbours errs by. The walks that \[Kettunen15\] traces for
//! gradients are the common ones of neighbouring pixels here, so that none is traced twice.
//!
//! A pixel at an edge between diffuse surfaces takes off what those err by that the sample at work sees: half of its samples see either side, and what they err
//! by is not half of what all do. Own and common samples lie at the same places in all pixels, where O and C have the same mean, so that F may depend on the
//! place as well. (Under a filter with negative lobes that would leave the common weights of places in the image: there own samples have places of their own,
//! and pixels at edges own samples alone.)
//!
//! A pixel that sees mirrors, gloss, lamps or the sky takes all of its samples with numbers of its own, as `path` does; so does what it has no
//! neighbours like. Order 0 is the mean of all samples in any pixel.
//!
//! Bidirectionally, light vertices are connected to camera subpaths and not to the camera, so that what a sample brings lands in its own pixel. With
//! common numbers all pixels share one light subpath, a row of virtual lamps \[Keller97\], which is traced once for pixels in a row that share it; what these lamps light
//! changes little from pixel to pixel, even where no walk from the camera would find what shines.
//!
//! Own samples need not be made as common ones are, if only they have the same mean: where walks find the light that there is, path tracing makes more of the
//! time that they take.
//!
//! The common error of all pixels is not in the image, but the mean of an image is that of the own samples: half as many, for twice the variance. Where
//! neighbours' errors are not alike, as in caustics, nothing is gained.

mod neighbours;
mod settings;

use crate::bias::Bias;
use crate::contribution::{Contribution, Technique};
use crate::film::{Average, Block, BlockFilm, PartsFilm, PixelSink, ResidualFilm, Source};
use crate::integrator::{Estimator, Integrator, Pass, Pixel, Replicate};
use crate::measurement::Counters;
use crate::parts::Part;
use crate::path::Path;
use crate::request::Request;
use crate::sampled::{Witness, unsupported_by};
use crate::scratch::Scratch;
use neighbours::Neighbours;
use sampling::sampler::{Purpose, Sampler};
use sampling::{Vec2, fault};
use scenes::{Needs, Scene};
use serde_json::Value;
use settings::Settings;
pub use settings::{Coherent, CoherentBdpt, OwnSamples, Reach};
use std::ops::RangeInclusive;

/// Such a method, under a name.
pub(crate) struct Sharing<S> {
    pub name: &'static str,
    pub settings: S,
}

impl<S: Settings> Integrator for Sharing<S> {
    fn name(&self) -> &str {
        self.name
    }

    fn settings(&self) -> Value {
        serde_json::to_value(&self.settings).unwrap_or(Value::Null)
    }

    fn orders(&self, max_order: usize) -> RangeInclusive<usize> {
        self.settings.walks().orders(max_order)
    }

    fn carries_subsurface(&self) -> bool {
        S::Walks::SUBSURFACE
    }

    fn expression(&self) -> &'static str {
        self.settings.walks().expression()
    }

    fn classifies(&self) -> bool {
        S::Walks::CLASSIFIES
    }

    fn makes(&self, technique: Technique) -> bool {
        self.settings.walks().makes(technique)
    }

    fn bias(&self) -> Bias {
        self.settings.walks().bias()
    }

    fn unsupported(&self, scene: &Scene) -> Option<String> {
        unsupported_by(&self.settings.walks(), scene).or_else(|| self.losing(scene))
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        if self.settings.own().is_some() && request.parts().list().iter().any(Part::is_strategy) {
            return Some("its samples have other strategies by turns; set own_samples=bdpt to tell them apart".into());
        }
        self.settings.walks().unsupported_request(request)
    }

    /// Those with common numbers tell what neighbours differ by, and not the mean.
    fn counts(&self) -> f64 {
        2.0
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        self.settings.walks().missing_light(needs)
    }

    fn bytes(&self, pixels: u64, _: &Request) -> u64 {
        pixels * Neighbours::BYTES
    }

    fn begin<'a>(&'a self, scene: &'a Scene, request: &'a Request, replicate: Replicate) -> Box<dyn Pass + 'a> {
        // A single sample has no common numbers.
        let neighbours = match replicate.samples {
            1 => Neighbours::none(scene),
            _ => Neighbours::find(scene, self.settings.radius().into()),
        };
        let (walks, own) = (self.settings.walks(), self.settings.own());
        Box::new(SharingPass { walks, own, scene, request, replicate, neighbours })
    }
}

impl<S: Settings> Sharing<S> {
    /// The light that samples with numbers of their own lose and others do not, if any: their means have to be the same.
    fn losing(&self, scene: &Scene) -> Option<String> {
        let [lost, ..] = &self.settings.own()?.missing_light(&scene.needs)[..] else { return None };
        Some(format!("samples by path tracing lose what the others carry ({lost}); set own_samples=bdpt"))
    }
}

/// A replicate at work.
struct SharingPass<'a, E> {
    walks: E,
    /// What takes samples with numbers of their own, if not the same.
    own: Option<Path>,
    scene: &'a Scene,
    request: &'a Request,
    replicate: Replicate,
    neighbours: Neighbours,
}

impl<E: Estimator> Pass for SharingPass<'_, E> {
    fn pilot(&self) -> Counters {
        self.neighbours.work
    }

    fn run(&self, block: Block, out: &mut BlockFilm) {
        let mut film = ResidualFilm::new(out, block.tile.clone(), self.replicate.samples, &self.neighbours);
        let mut scratch = Scratch::default();
        let mut samplers = Source::EVERY.map(|source| self.sampler(source));
        for number in block.samples.clone() {
            let place = self.place(&mut samplers[Source::Common as usize], number);
            let mut before = Source::All;
            for pixel in block.tile.pixels() {
                let source = self.source(pixel, number);
                let sampler = &mut samplers[source as usize];
                film.set_source(source);
                // Samples with common numbers have the same light subpaths, too.
                scratch.keeps_light = (before, source) == (Source::Common, Source::Common);
                before = source;
                match self.request.parts().list() {
                    [] => self.sample(pixel, (source, number, place), sampler, &mut scratch, &mut film),
                    _ => self.sample(pixel, (source, number, place), sampler, &mut scratch, &mut PartsFilm(&mut film)),
                }
            }
            if number % 2 == 1 || number + 1 == block.samples.end {
                film.step(|pixel| {
                    scratch.counters.closest += 1;
                    self.neighbours.part(self.scene, pixel, place)
                });
            }
        }
        *film.counters() += scratch.counters;
        film.finish();
    }

    fn replay(&mut self, pixel: (u32, u32), sample: u32, show: &mut dyn FnMut(&Contribution)) -> bool {
        let source = self.source(pixel, sample);
        let (mut sampler, mut scratch) = (self.sampler(source), Scratch::default());
        let place = self.place(&mut self.sampler(Source::Common), sample);
        let samples = self.replicate.samples;
        let mut scaled = |c: &Contribution| {
            show(&Contribution { weight: c.weight * f64::from(source.counts(c, samples)), ..*c });
        };
        self.sample(pixel, (source, sample, place), &mut sampler, &mut scratch, &mut Witness(&mut scaled));
        true
    }
}

impl<E: Estimator> SharingPass<'_, E> {
    /// Where a sample of a pixel is from: of one that shares numbers, own and common ones by turns.
    fn source(&self, pixel: (u32, u32), number: u32) -> Source {
        match (self.neighbours.parts(pixel), number % 2) {
            (0, _) => Source::All,
            (_, 0) => Source::Own,
            (_, _) => Source::Common,
        }
    }

    /// What gives samples of a source their numbers.
    fn sampler(&self, source: Source) -> Sampler {
        let Replicate { sampler, key, samples, .. } = self.replicate;
        let size = (self.scene.camera.width(), self.scene.camera.height());
        Sampler::new(sampler, key.of_part(source as u32), source.samples(samples), size)
    }

    /// Where a sample with common numbers lies in its pixel, for the filter, and that with own numbers before it.
    fn place(&self, common: &mut Sampler, number: u32) -> Vec2 {
        common.start_sample(0, number / 2);
        common.get_2d(Purpose::Film)
    }

    /// Takes one sample.
    #[inline]
    fn sample<S: PixelSink>(
        &self,
        (x, y): (u32, u32),
        (source, number, place): (Source, u32, Vec2),
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        let own = u64::from(y) * u64::from(self.scene.camera.width()) + u64::from(x);
        match source {
            Source::All => sampler.start_sample(own, number),
            Source::Own => sampler.start_sample(own, number / 2),
            Source::Common => sampler.start_sample(0, number / 2),
        }
        let filter = self.scene.camera.filter();
        let place = match source {
            Source::All => sampler.get_2d(Purpose::Film),
            Source::Own if filter.has_negative_lobes() => sampler.get_2d(Purpose::Film),
            Source::Own => fault!("own_samples_at_places_of_their_own", place, sampler.get_2d(Purpose::Film)),
            Source::Common => place,
        };
        let (pixel, weight) = Pixel::sample(x, y, filter, place);
        out.start_sample(pixel, number, weight);
        match &self.own {
            Some(own) if source == Source::Own => own.estimate(self.scene, self.request, pixel, sampler, scratch, out),
            _ => self.walks.estimate(self.scene, self.request, pixel, sampler, scratch, out),
        }
    }
}

#[cfg(test)]
mod tests;
