//! Replicates of one method in one scene.

use crate::film::{Block, BlockFilm, BlockStore, Film, Window};
use crate::integrator::{Integrator, Replicate};
use crate::measurement::{Layer, Measurement};
use crate::parts::{PartSettings, Parts};
use crate::request::{Orders, Request};
use crate::statistics::{BlockGrid, GROUP, MAX_COVARIANCE_LAYERS};
use crate::tally::Tally;
use rayon::prelude::*;
use sampling::fault;
use sampling::sampler::{Role, SamplerKind, StreamKey};
use scenes::Scene;
use std::time::Instant;

mod apart;
mod resume;

/// Blocks in flight at once, at most; bits do not depend on it.
const WAVE: usize = 128;
/// Bytes that the blocks in flight may take.
const WAVE_BYTES: usize = 64 << 20;

/// What a render is asked for.
#[derive(Clone, Debug)]
pub struct RenderSettings {
    /// The orders asked for.
    pub orders: Orders,
    /// Whether all that lies beyond the last order is estimated too.
    pub tail: bool,
    /// Samples per pixel of each replicate.
    pub samples_per_replicate: u32,
    /// The experiment's seed.
    pub seed: u64,
    /// Where random numbers come from.
    pub sampler: SamplerKind,
    /// Which method instance this is; instances of different names draw independent numbers.
    pub instance: String,
    /// What the samples are for; roles draw independent numbers.
    pub role: Role,
}

/// Why a render cannot start.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RenderError {
    /// A replicate needs at least one sample.
    #[error("0 samples per replicate; ask for at least 1")]
    NoSamples,
    /// No pixel, or one that the image does not have.
    #[error("the crop has columns {x:?} and rows {y:?} of an image of {width}x{height}; choose some of its pixels", x = .window.x, y = .window.y)]
    NoSuchPixels {
        /// What was asked for.
        window: Window,
        /// Pixels in a row of the image.
        width: u32,
        /// Its rows.
        height: u32,
    },
    /// The image cannot be taken apart as asked for.
    #[error("the image cannot be taken apart: {reason}")]
    Parts {
        /// What stands in the way, and what would do instead.
        reason: String,
    },
    /// The method cannot work in this scene.
    #[error("{method} cannot render this scene: {reason}")]
    Unsupported {
        /// The method.
        method: String,
        /// What stands in the way, and what would do instead.
        reason: String,
    },
}

/// Whether the image has the pixels of a window.
///
/// # Errors
/// If the window has none, or such as the image does not have.
pub fn check_window(scene: &Scene, window: &Window) -> Result<(), RenderError> {
    let (width, height) = (scene.camera.width(), scene.camera.height());
    if window.x.is_empty() || window.y.is_empty() || window.x.end > width || window.y.end > height {
        return Err(RenderError::NoSuchPixels { window: window.clone(), width, height });
    }
    Ok(())
}

/// What a method is asked for in a scene. Orders that it cannot carry are left out, unless no other was asked for.
///
/// # Errors
/// If the method does not support the scene, what is asked for, or taking the image apart as asked for.
pub fn request(
    scene: &Scene,
    method: &dyn Integrator,
    settings: &RenderSettings,
    parts: &PartSettings,
) -> Result<Request, RenderError> {
    let orders = settings.orders.clone().within(method.orders(settings.orders.max_order()));
    let request = Request::new(orders, settings.tail);
    let unsupported = |reason| RenderError::Unsupported { method: method.name().to_owned(), reason };
    let nothing = "it carries none of the orders asked for; ask for lower ones".to_owned();
    let reason = method.unsupported(scene).or_else(|| request.layers().is_empty().then_some(nothing));
    let unclassified = "it does not tell light groups and path classes apart; leave them out".to_owned();
    let asked = parts.groups || !parts.classes.is_empty();
    let reason = reason.or_else(|| (asked && !method.classifies()).then_some(unclassified));
    if let Some(reason) = reason {
        return Err(unsupported(reason));
    }
    let parts = Parts::new(parts, scene, request.layers(), |technique| method.makes(technique));
    let request = request.with_parts(parts.map_err(|reason| RenderError::Parts { reason })?);
    if let Some(reason) = method.unsupported_request(&request).or_else(|| method.seedless(scene, &request)) {
        return Err(unsupported(reason));
    }
    let runs = method.runs(&request);
    Ok(request.with_runs(runs))
}

/// A method at work in a scene, replicate by replicate.
pub struct Render<'a> {
    scene: &'a Scene,
    method: &'a dyn Integrator,
    settings: RenderSettings,
    request: Request,
    window: Window,
    film: Film,
    grid: BlockGrid,
    /// The replicates of the group at work.
    group: Tally,
    /// Those of all groups before.
    whole: Tally,
    /// Replicates of the group that ended last, and what it has added to the products of deviations.
    last_group: (u32, Vec<[f64; 3]>),
    /// Seconds in which blocks were put together.
    merging: f64,
    /// Of how many samples a replicate is whose blocks have as many as this one's.
    cut_as: u32,
}

impl<'a> Render<'a> {
    /// Gets ready; no ray is traced yet.
    ///
    /// # Errors
    /// If no sample is asked for, or the method does not support the scene or the request. Orders that it cannot carry are
    /// left out, unless no other was asked for.
    pub fn new(scene: &'a Scene, method: &'a dyn Integrator, settings: RenderSettings) -> Result<Self, RenderError> {
        let window = Window::whole(scene.camera.width(), scene.camera.height());
        Self::cropped(scene, method, settings, window)
    }

    /// The same for the pixels of a window of the image alone, which get the bits that they have in the whole.
    ///
    /// A method that splats takes the samples of all pixels for that, since each may land in any.
    ///
    /// # Errors
    /// Those of [`Render::new`], and if the window has no pixels, or such as the image does not have.
    pub fn cropped(
        scene: &'a Scene,
        method: &'a dyn Integrator,
        settings: RenderSettings,
        window: Window,
    ) -> Result<Self, RenderError> {
        let request = request(scene, method, &settings, &PartSettings::default())?;
        Self::of_request(scene, method, settings, window, request)
    }

    /// The same for a request made by [`request`], which may take the image apart.
    ///
    /// # Errors
    /// Those of [`Render::cropped`].
    pub fn of_request(
        scene: &'a Scene,
        method: &'a dyn Integrator,
        settings: RenderSettings,
        window: Window,
        request: Request,
    ) -> Result<Self, RenderError> {
        check_window(scene, &window)?;
        if settings.samples_per_replicate == 0 {
            return Err(RenderError::NoSamples);
        }
        let (width, height, layers) = (window.width(), window.height(), request.film_layers());
        let series = request.layers().len();
        let pixels = width as usize * height as usize;
        let grid = BlockGrid::new(width, height);
        Ok(Self {
            scene,
            method,
            cut_as: settings.samples_per_replicate,
            settings,
            // A render that takes groups from elsewhere needs neither film nor group.
            film: Film::unexposed(width, height, layers),
            group: Tally::new(0, &grid, layers, series),
            whole: Tally::new(pixels, &grid, layers, series),
            last_group: (0, Vec::new()),
            grid,
            request,
            window,
            merging: 0.0,
        })
    }

    /// Cuts its replicates in blocks as long as those of a replicate of so many samples: one of few takes as much time for each of them then.
    pub fn cut_as(self, samples: u32) -> Self {
        Self { cut_as: samples, ..self }
    }

    /// Bytes of film and statistics for an image of so many pixels and layers, the working set of threads apart.
    pub fn bytes(pixels: u64, layers: u64) -> u64 {
        120 * pixels * layers
    }

    /// The same where replicates are taken side by side: of the whole alone.
    pub fn bytes_of_whole(pixels: u64, layers: u64) -> u64 {
        48 * pixels * layers
    }

    /// Replicates finished.
    pub fn replicates(&self) -> u32 {
        self.whole.count() + self.group.count()
    }

    /// Seconds of transport (wall time) so far.
    pub fn seconds(&self) -> f64 {
        self.whole.seconds.iter().chain(&self.group.seconds).sum()
    }

    /// Those of them, since this render was made, in which blocks were put together: the part that threads share least well.
    pub fn merging_seconds(&self) -> f64 {
        self.merging
    }

    /// What was asked for.
    pub fn settings(&self) -> &RenderSettings {
        &self.settings
    }

    /// The pixels that it renders.
    pub fn window(&self) -> &Window {
        &self.window
    }

    /// The layers that make up its image.
    pub fn layers(&self) -> &[Layer] {
        self.request.layers()
    }

    /// A pixel of a layer, as the mean of the replicates so far; 0 before the first.
    pub fn mean(&self, layer: usize, pixel: usize) -> [f64; 3] {
        let at = (pixel * self.request.film_layers() + layer) * 3;
        let whole = &self.whole.pixels.mean[at..at + 3];
        // Before its first replicate the group has no pixels.
        let group = self.group.pixels.mean.get(at..at + 3).unwrap_or(whole);
        // As groups are merged, so that it has the bits of the measurement.
        let share = f64::from(self.group.count()) / f64::from(self.replicates().max(1));
        [0, 1, 2].map(|c| whole[c] + (group[c] - whole[c]) * share)
    }

    /// Image means of the layers, replicate by replicate.
    pub fn replicate_means(&self) -> impl Iterator<Item = &[[f64; 3]]> {
        self.whole.means.iter().chain(&self.group.means).map(Vec::as_slice)
    }

    /// Renders the next replicate in the current thread pool. `progress` is told the fraction done, from any thread.
    pub fn run_replicate(&mut self, progress: &(dyn Fn(f64) + Sync)) {
        let seconds = self.trace(self.replicates(), progress);
        self.add_replicate(seconds);
    }

    /// Adds what is on the film to the group at work.
    fn add_replicate(&mut self, seconds: f64) {
        self.group.push(&self.film, &self.grid, self.settings.samples_per_replicate, seconds);
        if self.group.count() == GROUP {
            self.end_group();
        }
    }

    /// Fills the film with a replicate of this number, and counts for the group at work; gives the seconds that it took.
    fn trace(&mut self, number: u32, progress: &(dyn Fn(f64) + Sync)) -> f64 {
        let start = Instant::now();
        let settings = &self.settings;
        let key = StreamKey::new(settings.seed, &settings.instance, settings.role, number);
        let replicate = Replicate { number, key, sampler: settings.sampler, samples: settings.samples_per_replicate };
        let (width, height) = (self.scene.camera.width(), self.scene.camera.height());
        let image = Window::whole(width, height);
        let anywhere = fault!("light_paths_of_a_crop_alone", self.method.splats(), false);
        let taken = if anywhere { image.clone() } else { self.window.clone() };
        let blocks =
            self.method.blocks(image, &self.request, self.cut_as).of_samples(replicate.samples).of_pixels(taken);
        let iterates = self.method.iterates();
        // The blocks between two of which the method may want to be told: those of an iteration, or all.
        let together = if iterates { blocks.tiles() } else { blocks.count() };
        let mut pass = self.method.begin(self.scene, &self.request, replicate);
        self.group.counters += pass.pilot();
        let wave = (WAVE_BYTES / BlockFilm::bytes(&self.request, width, height).max(1)).clamp(1, WAVE);
        let film = |store| BlockFilm::new(store, &self.request, *self.scene.camera.raster(), self.window.clone());
        let mut films: Vec<_> = BlockStore::take(wave.min(together as usize)).into_iter().map(film).collect();
        self.film.clear();
        let mut first = 0;
        while first < blocks.count() {
            if iterates && first.is_multiple_of(together) {
                self.group.counters += pass.begin_iteration((first / together) as u32);
            }
            let count = films.len().min((together - first % together) as usize);
            // One by one: a thread that has ended its own takes any that no other has begun.
            films[..count].par_iter_mut().enumerate().with_max_len(1).for_each(|(i, film)| {
                let block: Block = blocks.block(first + i as u64);
                film.start(block.tile.clone());
                pass.run(block, film);
                film.finish();
            });
            let merge = Instant::now();
            self.film.reduce(&films[..count]);
            self.merging += merge.elapsed().as_secs_f64();
            for film in &films[..count] {
                self.group.counters += film.counters;
                self.group.invalid.iter_mut().zip(&film.invalid).for_each(|(sum, n)| *sum += n);
                film.fireflies.iter().for_each(|found| self.group.fireflies.add_block(found, number));
            }
            first += count as u64;
            progress(first as f64 / blocks.count() as f64);
        }
        drop(pass);
        // Which blocks a film has had depends on the image alone, not on threads.
        let found = films.iter().filter_map(|film| film.fireflies.as_ref());
        found.for_each(|found| self.group.fireflies.add_tails(found));
        BlockStore::give_back(films.into_iter().map(BlockFilm::into_store));
        start.elapsed().as_secs_f64()
    }

    /// A pixel of a layer of the replicate rendered last.
    #[inline]
    pub fn last_replicate(&self, layer: usize, pixel: usize) -> [f64; 3] {
        let at = (pixel * self.request.film_layers() + layer) * 3;
        let scale = 1.0 / self.settings.samples_per_replicate as f64;
        [self.film.sums[at] * scale, self.film.sums[at + 1] * scale, self.film.sums[at + 2] * scale]
    }

    /// Ends the group at work, full or not. One that is not is the last.
    pub fn end_group(&mut self) {
        if self.group.count() > 0 {
            self.last_group = (self.group.count(), self.whole.merge(&self.group));
            self.group.clear();
        }
    }

    /// Replicates of the group that ended last, and what it has added to the sums over pixels of products of deviations, as
    /// [`ImageMoments::products`](crate::statistics::ImageMoments::products) lists them: as many degrees of freedom as it has replicates, or
    /// one less if it is the first.
    pub fn last_group(&self) -> (u32, &[[f64; 3]]) {
        (self.last_group.0, &self.last_group.1)
    }

    /// Ends the render and gives what was measured.
    pub fn finish(mut self) -> Measurement {
        self.end_group();
        let (tally, layers) = (self.whole, self.request.layers().to_vec());
        let whole = tally.pixels;
        let pixels = self.window.width() as f64 * self.window.height() as f64;
        let count = layers.len();
        let scale = 1.0 / (pixels * (whole.count as f64 - 1.0));
        let known = whole.count >= 2;
        let mut covariance = Vec::new();
        if known && count <= MAX_COVARIANCE_LAYERS {
            let entry = |i: usize, j: usize| whole.products[i.max(j) * count + i.min(j)].map(|x| x * scale);
            covariance = (0..count * count).map(|n| entry(n / count, n % count)).collect();
        }
        Measurement {
            width: self.window.width(),
            height: self.window.height(),
            origin: (self.window.x.start, self.window.y.start),
            image_size: (self.scene.camera.width(), self.scene.camera.height()),
            max_order: self.settings.orders.max_order(),
            layers,
            parts: self.request.parts().list().to_vec(),
            replicates: whole.count,
            samples_per_replicate: self.settings.samples_per_replicate,
            covariance,
            total_variance: known.then(|| whole.products[whole.products.len() - 1].map(|x| x * scale)),
            mean: whole.mean,
            m2: whole.m2,
            grid: self.grid,
            block_mean: tally.blocks.mean,
            block_m2: tally.blocks.m2,
            replicate_means: tally.means,
            replicate_seconds: tally.seconds,
            invalid: tally.invalid,
            counters: tally.counters,
            fireflies: tally.fireflies,
        }
    }
}

#[cfg(test)]
mod tests;
