//! The film of an image that is taken apart.

use super::place::Place;
use super::{Counts, PixelSink};
use crate::contribution::{Contribution, Sink, Wants};
use crate::integrator::Pixel;
use crate::trail::ClassShare;
use sampling::Spectrum;

/// A block's film that takes the image apart.
pub struct PartsFilm<'f, P>(pub &'f mut P);

impl<P: Place> Sink for PartsFilm<'_, P> {
    const WANTS: Wants = Wants { vertices: false, classes: true };

    fn add(&mut self, c: Contribution) {
        let Self(film) = self;
        let Some((layer, value)) = film.counted(&c) else { return };
        film.place(&c, layer, [value]);
        if let Some(strategy) = film.request().parts().strategy(c.technique) {
            film.count_unweighted(strategy + 1, &c);
            let weight = c.weight as f32;
            film.place(&c, strategy, [value, c.value]);
            film.place_alike(&c, strategy + 2, Spectrum::new(weight, 1.0, weight + 1.0));
        }
        if let Some(merged) = film.request().parts().merged(c.technique) {
            film.place(&c, merged, [value]);
        }
        if let Some(group) = film.request().parts().group(c.emitter) {
            film.place(&c, group, [value]);
            film.place(&c, group + 1 + layer, [value]);
        }
        for &ClassShare { classes, share } in c.classes {
            let mut rest = classes;
            while rest != 0 {
                let class = film.request().parts().class(rest.trailing_zeros());
                film.place(&c, class, [value * share]);
                rest &= rest - 1;
            }
        }
    }
}

impl<P: Place + PixelSink> PixelSink for PartsFilm<'_, P> {
    #[inline]
    fn start_sample(&mut self, pixel: Pixel, number: u32, weight: f32) {
        self.0.start_sample(pixel, number, weight);
    }

    #[inline]
    fn start_point(&mut self, pixel: Pixel, weight: f32, share: f32) {
        self.0.start_point(pixel, weight, share);
    }

    fn set_counts(&mut self, counts: Counts) {
        self.0.set_counts(counts);
    }
}
