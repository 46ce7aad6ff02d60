//! The film of a method whose pixels share random numbers.

use super::{BlockFilm, Counts, PixelSink, Place, Raster, Window};
use crate::contribution::{Contribution, Sink, Wants};
use crate::integrator::Pixel;
use crate::measurement::Counters;
use crate::request::Request;
use sampling::{Spectrum, fault};
use std::ops::Range;

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

    /// How many parts a pixel has that share numbers: none if it does not, and several where it sees an edge.
    fn parts(&self, pixel: (u32, u32)) -> usize;

    /// The pixels of a window that share numbers and are in the average at a part of a pixel, and their weights there; those of all pixels add up to one
    /// at most, and to one where the part has neighbours.
    fn weights(&self, at: (u32, u32), part: usize, within: &Window, take: impl FnMut((u32, u32), f64));
}

/// A pixel that sees an edge.
struct Edge {
    pixel: (u32, u32),
    /// Of each part, which residuals of the tile its average is of, and their weights.
    averages: Vec<Vec<(Range<usize>, f64)>>,
    /// The averages of residuals so far, `[layer][channel]`.
    sums: Vec<f64>,
}

/// A block's film for samples of every [`Source`]: it has the image `C + F (O − C)` once [`finish`](Self::finish) is called, with C from the common samples,
/// O from the own ones and F an [`Average`].
pub struct ResidualFilm<'f, 'r, A> {
    film: &'f mut BlockFilm<'r>,
    average: &'f A,
    tile: Window,
    /// Samples per pixel of the replicate.
    samples: u32,
    source: Source,
    /// Numbers of a pixel: layers times channels.
    stride: usize,
    /// O − C of the samples since the last [`step`](Self::step), `[pixel][layer][channel]`.
    latest: Vec<f64>,
    /// That of all before.
    residuals: Vec<f64>,
    /// The pixels at edges that residuals of the tile reach.
    edges: Vec<Edge>,
}

impl<'f, 'r, A: Average> ResidualFilm<'f, 'r, A> {
    /// For samples in pixels of a tile, of a replicate of so many samples of each.
    pub fn new(film: &'f mut BlockFilm<'r>, tile: Window, samples: u32, average: &'f A) -> Self {
        let pixels = tile.width() as usize * tile.height() as usize;
        let stride = film.request.film_layers() * 3;
        let (residuals, latest, edges) = (vec![0.0; pixels * stride], vec![0.0; pixels * stride], Vec::new());
        let mut film = Self { film, average, tile, samples, source: Source::All, stride, latest, residuals, edges };
        let edges = film.reached().filter(|&pixel| average.parts(pixel) > 1).map(|pixel| film.edge(pixel));
        film.edges = edges.filter(|edge| edge.averages.iter().any(|average| !average.is_empty())).collect();
        film
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
        let counts = self.source.counts(c, self.samples);
        self.film.counts = Counts { own: counts, splats: counts };
        let done = does(self.film);
        self.film.counts = Counts::ONCE;
        done
    }

    /// The pixels that residuals of the tile reach.
    fn reached(&self) -> impl Iterator<Item = (u32, u32)> + use<A> {
        let reach = self.average.reach();
        let grown = |range: &Range<u32>, size: u32| range.start.saturating_sub(reach)..(range.end + reach).min(size);
        let Raster { width, height, .. } = self.film.raster;
        Window { x: grown(&self.tile.x, width), y: grown(&self.tile.y, height) }.pixels()
    }

    /// A pixel that sees an edge.
    fn edge(&self, pixel: (u32, u32)) -> Edge {
        let average = |part| {
            let mut average = Vec::new();
            self.average.weights(pixel, part, &self.tile, |of, weight| average.push((self.of(of), weight)));
            average
        };
        let averages = (0..self.average.parts(pixel)).map(average).collect();
        Edge { pixel, averages, sums: vec![0.0; self.stride] }
    }

    /// The residuals of a pixel of the tile.
    fn of(&self, (x, y): (u32, u32)) -> Range<usize> {
        let pixel = (y - self.tile.y.start) as usize * self.tile.x.len() + (x - self.tile.x.start) as usize;
        pixel * self.stride..(pixel + 1) * self.stride
    }

    /// Ends one sample of every pixel with own numbers, one with common numbers, or both, which lie at the same place in all pixels: in this part of one that
    /// sees an edge.
    pub fn step(&mut self, mut part: impl FnMut((u32, u32)) -> usize) {
        for Edge { pixel, averages, sums } in &mut self.edges {
            for (of, weight) in &averages[part(*pixel)] {
                sums.iter_mut().zip(&self.latest[of.clone()]).for_each(|(sum, x)| *sum += weight * x);
            }
        }
        self.residuals.iter_mut().zip(&self.latest).for_each(|(sum, x)| *sum += x);
        self.latest.fill(0.0);
    }

    /// Adds the averages of residuals to all pixels that these reach, and ends the block.
    pub fn finish(mut self) {
        let mut sums = vec![0.0; self.stride];
        for pixel in self.reached().filter(|&pixel| self.average.parts(pixel) == 1) {
            sums.fill(0.0);
            self.average.weights(pixel, 0, &self.tile, |of, weight| {
                sums.iter_mut().zip(&self.residuals[self.of(of)]).for_each(|(sum, x)| *sum += weight * x);
            });
            self.add(pixel, &sums);
        }
        for Edge { pixel, sums, .. } in std::mem::take(&mut self.edges) {
            self.add(pixel, &sums);
        }
    }

    /// Adds to all layers of a pixel.
    fn add(&mut self, pixel: (u32, u32), sums: &[f64]) {
        for (layer, sum) in sums.chunks_exact(3).enumerate() {
            let sum = Spectrum::new(sum[0] as f32, sum[1] as f32, sum[2] as f32);
            if !sum.is_zero() {
                self.film.add_to(pixel, layer, [sum]);
            }
        }
    }
}

impl<A: Average> Place for ResidualFilm<'_, '_, A> {
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
        let residuals = self.latest[first..first + 3 * N].chunks_exact_mut(3);
        for (residual, value) in residuals.zip(values) {
            residual.iter_mut().zip(value.to_array()).for_each(|(sum, x)| *sum += sign * f64::from(x));
        }
    }

    fn place_alike(&mut self, _: &Contribution, layer: usize, value: Spectrum) {
        self.film.add_to(self.film.pixel, layer, [value * self.film.weight]);
    }
}

impl<A: Average> Sink for ResidualFilm<'_, '_, A> {
    const WANTS: Wants = Wants::NOTHING;

    #[inline]
    fn add(&mut self, contribution: Contribution) {
        if let Some((layer, value)) = self.counted(&contribution) {
            self.place(&contribution, layer, [value]);
        }
    }
}

impl<A: Average> PixelSink for ResidualFilm<'_, '_, A> {
    #[inline]
    fn start_sample(&mut self, pixel: Pixel, number: u32, weight: f32) {
        self.film.start_sample(pixel, number, weight);
    }

    #[inline]
    fn start_point(&mut self, pixel: Pixel, weight: f32, share: f32) {
        self.film.start_point(pixel, weight, share);
    }

    fn set_counts(&mut self, counts: Counts) {
        self.film.set_counts(counts);
    }
}
