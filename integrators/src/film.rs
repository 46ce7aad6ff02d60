//! The film: where contributions are added up, in an order that does not depend on threads.
//!
//! What a camera walk brings belongs to the pixel whose sample it is; what a light walk splats belongs to every pixel whose filter
//! reaches where it lands.
//!
//! A block adds what lands in its own tile to its own sums, and lists what lands elsewhere as splats. Blocks are reduced into the
//! film in block order, band of rows by band of rows, so the sums have the same bits for any number of threads, any number of
//! blocks in flight, and any part of the image that the film has.

mod parts;
mod place;
mod residual;
mod store;
mod sums;

pub use crate::block::{Block, Blocks, TILE, Window};
use crate::contribution::{Contribution, Sink, Wants};
use crate::fireflies::{Fireflies, brought};
use crate::integrator::Pixel;
use crate::measurement::Counters;
use crate::request::Request;
use crate::splats::{Splat, Splats};
pub use parts::PartsFilm;
pub use place::Place;
pub use residual::{Average, ResidualFilm, Source};
use sampling::filter::Filter;
use sampling::{Spectrum, Vec2, fault};
use scenes::camera::{Edges, Raster};
pub use store::BlockStore;
pub use sums::Film;

/// How often a sample counts.
#[derive(Clone, Copy, Debug)]
pub struct Counts {
    /// By what it brings to its own pixel.
    pub own: f32,
    /// By what it splats.
    pub splats: f32,
}

impl Counts {
    /// As often as all others.
    pub const ONCE: Self = Self { own: 1.0, splats: 1.0 };

    /// By a contribution.
    #[inline]
    pub fn of(self, c: &Contribution) -> f32 {
        if c.technique.splats() { self.splats } else { self.own }
    }
}

/// What one block adds to the film.
#[derive(Clone, Debug)]
pub struct BlockFilm<'r> {
    request: &'r Request,
    raster: Raster,
    /// The pixels that the film has.
    window: Window,
    tile: Window,
    /// The pixel whose sample is taken, the sample's number and its weight.
    pixel: (u32, u32),
    sample: u32,
    weight: f32,
    /// How often it counts: once where samples are independent.
    share: f32,
    /// How often all of a run of a composite counts.
    scale: f32,
    /// How often samples count besides.
    counts: Counts,
    /// What the run of a composite that is at work is asked for.
    run: Option<&'r Request>,
    sums: Vec<f64>,
    splats: Splats,
    /// Non-finite contributions, per layer.
    pub invalid: Vec<u64>,
    /// The largest contributions, where they are asked for.
    pub fireflies: Option<Fireflies>,
    /// Work done by the block.
    pub counters: Counters,
}

impl<'r> BlockFilm<'r> {
    /// Empty, in this memory, for blocks of an image of these pixels, and a film of those in a window.
    pub fn new(store: BlockStore, request: &'r Request, raster: Raster, window: Window) -> Self {
        let BlockStore { mut sums, mut splats } = store;
        let layers = request.film_layers();
        let pixels = TILE.min(raster.width) as usize * TILE.min(raster.height) as usize;
        sums.resize(pixels * layers * 3, 0.0);
        splats.set_bands(window.height().div_ceil(TILE) as usize);
        Self {
            request,
            raster,
            tile: Window { x: 0..0, y: 0..0 },
            pixel: (0, 0),
            sample: 0,
            weight: 1.0,
            share: 1.0,
            scale: 1.0,
            counts: Counts::ONCE,
            run: None,
            sums,
            splats,
            window,
            invalid: vec![0; request.layers().len()],
            fireflies: request.keeps_fireflies().then(|| Fireflies::new(request.layers().len(), layers)),
            counters: Counters::default(),
        }
    }

    /// Its memory, for another one.
    pub fn into_store(self) -> BlockStore {
        BlockStore { sums: self.sums, splats: self.splats }
    }

    /// Bytes of sums that one such film holds.
    pub fn bytes(request: &Request, width: u32, height: u32) -> usize {
        TILE.min(width) as usize * TILE.min(height) as usize * request.film_layers() * 24
    }

    /// Makes it ready for another block.
    ///
    /// Until [`start_sample`](Self::start_sample) is called, camera walks are taken for the first pixel's.
    pub fn start(&mut self, tile: Window) {
        self.pixel = (tile.x.start, tile.y.start);
        self.weight = 1.0;
        (self.scale, self.share, self.run) = (1.0, 1.0, None);
        self.counts = Counts::ONCE;
        self.tile = tile;
        self.sums.fill(0.0);
        self.splats.clear();
        self.invalid.fill(0);
        self.fireflies.iter_mut().for_each(Fireflies::start);
        self.counters = Counters::default();
    }

    /// Turns to a run of a composite: samples from here on count so many times, and only where the run is asked for their orders.
    pub fn set_run(&mut self, run: usize, scale: f32) {
        self.scale = scale;
        self.share = scale;
        self.counts = Counts::ONCE;
        self.run = Some(&self.request.runs()[run]);
    }

    /// Ends the block.
    pub fn finish(&mut self) {
        self.fireflies.iter_mut().for_each(Fireflies::end_sample);
    }

    /// Adds this block's share of one band of [`TILE`] rows of the film to it.
    fn reduce_band(&self, band: usize, rows: &mut [f64]) {
        let stride = self.request.film_layers() * 3;
        let width = self.window.width() as usize;
        let first_row = self.window.y.start + band as u32 * TILE;
        let last_row = (first_row + TILE).min(self.window.y.end);
        let shared = self.tile.within(&Window { y: first_row..last_row, ..self.window.clone() });
        for y in shared.y.clone().filter(|_| !shared.x.is_empty()) {
            // Where the row begins in the tile's sums, and in the band.
            let local =
                (y - self.tile.y.start) as usize * self.tile.x.len() + (shared.x.start - self.tile.x.start) as usize;
            let place = (y - first_row) as usize * width + (shared.x.start - self.window.x.start) as usize;
            let length = shared.x.len() * stride;
            let sums = &self.sums[local * stride..][..length];
            rows[place * stride..][..length].iter_mut().zip(sums).for_each(|(a, b)| *a += b);
        }
        let first_pixel = band * TILE as usize * width;
        for splat in self.splats.band(band) {
            let i = (splat.pixel as usize - first_pixel) * stride + splat.layer as usize * 3;
            (0..3).for_each(|c| rows[i + c] = added(rows[i + c], splat.value[c]));
        }
    }
}

impl BlockFilm<'_> {
    /// Adds to successive layers of a pixel of the film.
    #[inline]
    fn add_to<const N: usize>(&mut self, (x, y): (u32, u32), layer: usize, values: [Spectrum; N]) {
        if self.tile.contains((x, y)) {
            let pixel = (y - self.tile.y.start) as usize * self.tile.x.len() + (x - self.tile.x.start) as usize;
            let i = (pixel * self.request.film_layers() + layer) * 3;
            for (sums, value) in self.sums[i..i + 3 * N].chunks_exact_mut(3).zip(values) {
                let value = value.to_array();
                (0..3).for_each(|c| sums[c] = added(sums[c], value[c]));
            }
            return;
        }
        if self.window.contains((x, y)) {
            let (column, row) = (x - self.window.x.start, y - self.window.y.start);
            let pixel = row * self.window.width() + column;
            for (i, value) in values.into_iter().enumerate() {
                let splat = Splat { pixel, layer: (layer + i) as u32, value: value.to_array() };
                self.splats.push((row / TILE) as usize, splat);
            }
        }
    }

    /// Adds what lands anywhere to the pixel it lands in.
    #[inline]
    fn splat<const N: usize>(&mut self, raster: Vec2, layer: usize, values: [Spectrum; N]) {
        // The comparison, made before the conversion, also leaves out what lies off the film.
        let Vec2 { x: width, y: height } = self.raster.size();
        if !(raster.x >= 0.0 && raster.y >= 0.0 && raster.x < width && raster.y < height) {
            return;
        }
        let x = fault!("last_column_left_out", raster.x as u32, (raster.x as u32).min(self.raster.width.max(2) - 2));
        self.add_to((x, raster.y as u32), layer, values);
    }

    /// Adds what lands anywhere, off the film too, to every pixel whose filter reaches there: around a sphere from all sides.
    fn splat_filtered<const N: usize>(&mut self, raster: Vec2, layer: usize, values: [Spectrum; N]) {
        match self.raster.edges {
            Edges::Border => self.spread(raster, layer, values),
            Edges::Sphere => self.raster.images(raster).for_each(|image| self.spread(image, layer, values)),
        }
    }

    /// Adds what lands at one place to every pixel whose filter reaches there.
    fn spread<const N: usize>(&mut self, raster: Vec2, layer: usize, values: [Spectrum; N]) {
        // As in `splat`, the comparison also leaves out what is not a number.
        let (filter, Vec2 { x: width, y: height }) = (self.raster.filter, self.raster.size());
        let radius = filter.radius();
        let within = |x: f32, size: f32| x > -radius && x < size + radius;
        if !(within(raster.x, width) && within(raster.y, height)) {
            return;
        }
        let reach = |at: f32, size: u32| {
            let first = (at - 0.5 - radius).ceil().max(0.0) as u32;
            let last = (at - 0.5 + radius).floor();
            first..if last < 0.0 { 0 } else { (last as u32 + 1).min(size) }
        };
        let (columns, rows) = (reach(raster.x, self.raster.width), reach(raster.y, self.raster.height));
        for y in rows {
            let weight_y = filter.eval_1d(raster.y - (y as f32 + 0.5));
            for x in columns.clone() {
                let weight = weight_y * filter.eval_1d(raster.x - (x as f32 + 0.5));
                self.add_to((x, y), layer, values.map(|value| value * weight));
            }
        }
    }
}

impl Place for BlockFilm<'_> {
    fn request(&self) -> &Request {
        self.request
    }

    #[inline]
    fn counted(&mut self, c: &Contribution) -> Option<(usize, Spectrum)> {
        let layer = self.request.layer(c.technique.order())?;
        let foreign = |run: &Request| !run.wants(c.technique.order());
        if self.run.is_some_and(|run| fault!("orders_of_other_runs_counted", foreign(run), false)) {
            return None;
        }
        let value = c.value * c.weight as f32;
        let counts = self.counts.of(c);
        if let Some(fireflies) = &mut self.fireflies {
            let brought = brought(value) * counts * self.scale;
            if fireflies.takes(layer, brought.abs()) {
                // Multiplied one by one, as those do that show the sample again.
                let counted = Contribution { weight: c.weight * f64::from(counts), ..*c };
                fireflies.keep(layer, &counted, f64::from(self.scale), (self.pixel, self.sample));
            }
            if brought.is_finite() {
                fireflies.count(layer, brought);
            }
        }
        if !(value.is_finite() && c.raster.is_finite()) {
            self.invalid[layer] += fault!("invalid_not_counted", 1, 0);
            return None;
        }
        Some((layer, value))
    }

    fn count_unweighted(&mut self, layer: usize, c: &Contribution) {
        let scale = self.counts.of(c) * self.scale;
        self.fireflies.iter_mut().for_each(|found| found.count(layer, brought(c.value) * scale));
    }

    #[inline]
    fn place<const N: usize>(&mut self, c: &Contribution, layer: usize, values: [Spectrum; N]) {
        match (c.technique.splats(), fault!("splats_ignore_the_filter", self.raster.filter, Filter::Box)) {
            (true, Filter::Box) => {
                self.splat(c.raster, layer, values.map(|value| value * self.share));
            }
            (true, _) => {
                self.splat_filtered(c.raster, layer, values.map(|value| value * self.share));
            }
            (false, _) => self.add_to(self.pixel, layer, values.map(|value| value * self.weight)),
        }
    }
}

/// A sink that is told whose pixel's sample is being taken.
pub trait PixelSink: Sink {
    /// Turns to the sample of this number of a pixel of its tile, whose filter gives it this weight.
    fn start_sample(&mut self, pixel: Pixel, number: u32, weight: f32);

    /// Turns to a point that a chain has visited, with its camera walk in a pixel whose filter gives it this weight. It counts so
    /// many times, whatever it contributes and however.
    fn start_point(&mut self, pixel: Pixel, weight: f32, share: f32);

    /// Says how often samples from here on count, where pixels take different numbers of them.
    fn set_counts(&mut self, counts: Counts);
}

impl Sink for BlockFilm<'_> {
    const WANTS: Wants = Wants::NOTHING;

    #[inline]
    fn add(&mut self, contribution: Contribution) {
        if let Some((layer, value)) = self.counted(&contribution) {
            self.place(&contribution, layer, [value]);
        }
    }
}

impl PixelSink for BlockFilm<'_> {
    #[inline]
    fn start_sample(&mut self, pixel: Pixel, number: u32, weight: f32) {
        self.pixel = (pixel.x, pixel.y);
        self.sample = number;
        self.weight = weight * self.scale * self.counts.own;
        self.fireflies.iter_mut().for_each(Fireflies::start_sample);
    }

    #[inline]
    fn start_point(&mut self, pixel: Pixel, weight: f32, share: f32) {
        self.pixel = (pixel.x, pixel.y);
        self.weight = weight * share;
        self.share = share;
    }

    fn set_counts(&mut self, counts: Counts) {
        self.counts = counts;
        self.share = self.scale * counts.splats;
    }
}

/// A sum and what one sample adds to it.
#[inline]
fn added(sum: f64, value: f32) -> f64 {
    fault!("sums_in_single_precision", sum + value as f64, (sum as f32 + value) as f64)
}

#[cfg(test)]
mod tests;
