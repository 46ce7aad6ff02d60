//! The film of a method whose pixels share random numbers.

use super::{BlockFilm, PixelSink, Place, Window};
use crate::contribution::{Contribution, Sink, Wants};
use crate::integrator::Pixel;
use crate::measurement::Counters;
use crate::request::Request;
use sampling::{Spectrum, fault};

/// Which samples of a pixel are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// All, in a pixel that shares no numbers.
    All,
    /// Those with numbers of the pixel's own, in one that shares numbers besides.
    Own,
    /// Those with the common numbers.
    Common,
}

impl Source {
    /// The three, in this order.
    pub const EVERY: [Self; 3] = [Self::All, Self::Own, Self::Common];

    /// How many of so many samples.
    pub fn samples(self, of: u32) -> u32 {
        match self {
            Self::All => of,
            Self::Own => of.div_ceil(2),
            Self::Common => of / 2,
        }
    }

    /// Whether a contribution goes to its own pixel and nowhere else. What the camera sees shine does: a lamp at an edge is known better by the
    /// mean of all samples.
    fn is_plain(self, c: &Contribution) -> bool {
        self == Self::All || c.technique.order() == 0
    }

    /// How often a contribution counts, of so many samples of a pixel.
    pub(crate) fn counts(self, c: &Contribution, samples: u32) -> f32 {
        if self.is_plain(c) {
            return 1.0;
        }
        samples as f32 / fault!("samples_of_a_source_taken_for_all", self.samples(samples), samples) as f32
    }
}

/// What pixels that share random numbers make of one another's residuals.
pub trait Average {
    /// How far the furthest neighbour is, along a row or a column \[pixels\].
    fn reach(&self) -> u32;

    /// Whether a pixel shares numbers.
    fn shares(&self, pixel: (u32, u32)) -> bool;

    /// The weight of one pixel in the average at another within reach, both of which share numbers. Those in any average add up to one.
    fn weight(&self, at: (u32, u32), of: (u32, u32)) -> f64;
}

/// A block's film for samples of every [`Source`]: it has the image `C + F (O − C)` once [`spread`](Self::spread) is called, with C from the common samples,
/// O from the own ones and F an [`Average`].
pub struct ResidualFilm<'f, 'r> {
    film: &'f mut BlockFilm<'r>,
    tile: Window,
    /// Samples per pixel of the replicate.
    samples: u32,
    source: Source,
    /// O − C of the block, `[pixel][layer][channel]`.
    residuals: Vec<f64>,
}

impl<'f, 'r> ResidualFilm<'f, 'r> {
    /// For samples in pixels of a tile, of a replicate of so many samples of each.
    pub fn new(film: &'f mut BlockFilm<'r>, tile: Window, samples: u32) -> Self {
        let pixels = tile.width() as usize * tile.height() as usize;
        let residuals = vec![0.0; pixels * film.request.film_layers() * 3];
        Self { film, tile, samples, source: Source::All, residuals }
    }

    /// Says where the samples from here on are from.
    pub fn set_source(&mut self, source: Source) {
        self.source = source;
    }

    /// The work of the block.
    pub fn counters(&mut self) -> &mut Counters {
        &mut self.film.counters
    }

    /// What a film does that takes a contribution for as large as it counts.
    fn as_often_as<T>(&mut self, c: &Contribution, does: impl FnOnce(&mut BlockFilm<'r>) -> T) -> T {
        let scale = self.film.scale;
        self.film.scale = scale * self.source.counts(c, self.samples);
        let done = does(self.film);
        self.film.scale = scale;
        done
    }

    /// The residuals of a pixel of the tile.
    fn of(&self, (x, y): (u32, u32)) -> std::ops::Range<usize> {
        let pixel = (y - self.tile.y.start) as usize * self.tile.x.len() + (x - self.tile.x.start) as usize;
        let stride = self.film.request.film_layers() * 3;
        pixel * stride..(pixel + 1) * stride
    }

    /// Adds the averages of residuals to all pixels that these reach, and ends the block.
    pub fn spread(self, average: &impl Average) {
        let reach = average.reach();
        let grown =
            |range: &std::ops::Range<u32>, size: u32| range.start.saturating_sub(reach)..(range.end + reach).min(size);
        let (width, height) = (self.film.raster.width, self.film.raster.height);
        let (columns, rows) = (grown(&self.tile.x, width), grown(&self.tile.y, height));
        let mut sums = vec![0.0; self.film.request.film_layers() * 3];
        for at in rows.flat_map(|y| columns.clone().map(move |x| (x, y))).filter(|&at| average.shares(at)) {
            let near = Window { x: grown(&(at.0..at.0 + 1), width), y: grown(&(at.1..at.1 + 1), height) };
            let near = near.within(&self.tile);
            sums.fill(0.0);
            for of in near.y.flat_map(|y| near.x.clone().map(move |x| (x, y))).filter(|&of| average.shares(of)) {
                let weight = average.weight(at, of);
                if weight > 0.0 {
                    sums.iter_mut().zip(&self.residuals[self.of(of)]).for_each(|(sum, x)| *sum += weight * x);
                }
            }
            for (layer, sum) in sums.chunks_exact(3).enumerate() {
                let sum = Spectrum::new(sum[0] as f32, sum[1] as f32, sum[2] as f32);
                if !sum.is_zero() {
                    self.film.add_to(at, layer, [sum]);
                }
            }
        }
    }
}

impl Place for ResidualFilm<'_, '_> {
    fn request(&self) -> &Request {
        self.film.request
    }

    #[inline]
    fn counted(&mut self, c: &Contribution) -> Option<(usize, Spectrum)> {
        self.as_often_as(c, |film| film.counted(c))
    }

    fn count_unweighted(&mut self, layer: usize, c: &Contribution) {
        self.as_often_as(c, |film| film.count_unweighted(layer, c));
    }

    #[inline]
    fn place<const N: usize>(&mut self, c: &Contribution, layer: usize, values: [Spectrum; N]) {
        let weight = self.film.weight * self.source.counts(c, self.samples);
        let values = values.map(|value| value * weight);
        if self.source.is_plain(c) {
            return self.film.add_to(self.film.pixel, layer, values);
        }
        let mut sign = 1.0;
        if self.source == Source::Common {
            self.film.add_to(self.film.pixel, layer, values);
            sign = -1.0;
        }
        let first = self.of(self.film.pixel).start + layer * 3;
        let residuals = self.residuals[first..first + 3 * N].chunks_exact_mut(3);
        for (residual, value) in residuals.zip(values) {
            residual.iter_mut().zip(value.to_array()).for_each(|(sum, x)| *sum += sign * f64::from(x));
        }
    }

    fn place_alike(&mut self, _: &Contribution, layer: usize, value: Spectrum) {
        self.film.add_to(self.film.pixel, layer, [value * self.film.weight]);
    }
}

impl Sink for ResidualFilm<'_, '_> {
    const WANTS: Wants = Wants::NOTHING;

    #[inline]
    fn add(&mut self, contribution: Contribution) {
        if let Some((layer, value)) = self.counted(&contribution) {
            self.place(&contribution, layer, [value]);
        }
    }
}

impl PixelSink for ResidualFilm<'_, '_> {
    #[inline]
    fn start_sample(&mut self, pixel: Pixel, number: u32, weight: f32) {
        self.film.start_sample(pixel, number, weight);
    }

    #[inline]
    fn start_point(&mut self, pixel: Pixel, weight: f32, share: f32) {
        self.film.start_point(pixel, weight, share);
    }
}
