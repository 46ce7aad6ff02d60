//! The film of an image that is taken apart.

use super::{BlockFilm, PixelSink};
use crate::contribution::{Contribution, Sink, Wants};
use crate::fireflies::brought;
use crate::integrator::Pixel;
use crate::trail::ClassShare;
use sampling::Spectrum;

/// A block's film that takes the image apart.
pub struct PartsFilm<'f, 'r>(pub &'f mut BlockFilm<'r>);

impl Sink for PartsFilm<'_, '_> {
    const WANTS: Wants = Wants { vertices: false, classes: true };

    fn add(&mut self, c: Contribution) {
        let Self(film) = self;
        let Some((layer, value)) = film.counted(&c) else { return };
        film.place(&c, layer, [value]);
        let parts = film.request.parts();
        if let Some(strategy) = parts.strategy(c.technique) {
            let scale = film.scale;
            film.fireflies.iter_mut().for_each(|found| found.count(strategy + 1, brought(c.value) * scale));
            let weight = c.weight as f32;
            film.place(&c, strategy, [value, c.value, Spectrum::new(weight, 1.0, weight + 1.0)]);
        }
        if let Some(merged) = parts.merged(c.technique) {
            film.place(&c, merged, [value]);
        }
        if let Some(group) = parts.group(c.emitter) {
            film.place(&c, group, [value]);
            film.place(&c, group + 1 + layer, [value]);
        }
        for &ClassShare { classes, share } in c.classes {
            let mut rest = classes;
            while rest != 0 {
                film.place(&c, parts.class(rest.trailing_zeros()), [value * share]);
                rest &= rest - 1;
            }
        }
    }
}

impl PixelSink for PartsFilm<'_, '_> {
    #[inline]
    fn start_sample(&mut self, pixel: Pixel, number: u32, weight: f32) {
        self.0.start_sample(pixel, number, weight);
    }

    #[inline]
    fn start_point(&mut self, pixel: Pixel, weight: f32, share: f32) {
        self.0.start_point(pixel, weight, share);
    }
}
