//! What a render leaves behind: means, variances and covariances of every order, and what they cost.

use crate::fireflies::Fireflies;
use crate::parts::{Part, Quantity};
use crate::statistics::BlockGrid;
use crate::stored;
use sampling::fault;
use sampling::tail::Variance;
use serde::Serialize;

/// One image of a measurement: an order of the Neumann series, or all orders beyond the last one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub enum Layer {
    /// Light scattered exactly this many times.
    Order(usize),
    /// Light scattered more often than `max_order`.
    Tail,
}

impl Layer {
    /// The order that it holds, if it is one.
    pub fn order(self) -> Option<usize> {
        match self {
            Layer::Order(k) => Some(k),
            Layer::Tail => None,
        }
    }

    /// The layer's name in image files: `order02` (three digits where `max_order` exceeds 99), `tail`.
    pub fn name(self, max_order: usize) -> String {
        match self {
            Layer::Order(k) if max_order > 99 => format!("order{k:03}"),
            Layer::Order(k) => format!("order{k:02}"),
            Layer::Tail => "tail".to_owned(),
        }
    }

    /// The order as records write it: `2`, `tail`.
    pub fn label(self) -> String {
        match self {
            Layer::Order(k) => k.to_string(),
            Layer::Tail => "tail".to_owned(),
        }
    }
}

/// Work done, in events.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Counters {
    /// Closest-hit rays.
    pub closest: u64,
    /// Any-hit (shadow) rays.
    pub shadow: u64,
    /// Camera subpaths started.
    pub camera_paths: u64,
    /// Light subpaths started.
    pub light_paths: u64,
    /// Connections evaluated, whether or not a ray was traced for them.
    pub connections: u64,
    /// Directions sampled from a BSDF.
    pub bsdf_samples: u64,
}

stored!(Counters { closest, shadow, camera_paths, light_paths, connections, bsdf_samples });

impl std::ops::AddAssign for Counters {
    fn add_assign(&mut self, other: Self) {
        self.closest += other.closest;
        self.shadow += other.shadow;
        self.camera_paths += other.camera_paths;
        self.light_paths += other.light_paths;
        self.connections += other.connections;
        self.bsdf_samples += other.bsdf_samples;
    }
}

/// The outcome of a render of `replicates` independent images.
///
/// Pixels are numbered `y · width + x`, row 0 at the top; channels are linear red, green and blue.
#[derive(Clone, Debug)]
pub struct Measurement {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Column and row of the first pixel in the image that these pixels are cut from; `(0, 0)` for a whole one.
    pub origin: (u32, u32),
    /// Width and height of that image.
    pub image_size: (u32, u32),
    /// The highest order of the truncated series.
    pub max_order: usize,
    /// What the layers hold that make up the image, in rising order.
    pub layers: Vec<Layer>,
    /// What the layers behind them hold, which the image is taken apart into.
    pub parts: Vec<Part>,
    /// Number of independent images.
    pub replicates: u32,
    /// Samples per pixel of each of them.
    pub samples_per_replicate: u32,
    /// Means over replicates, `[pixel][layer][channel]`.
    pub(crate) mean: Vec<f64>,
    /// Sums of squared deviations over replicates, `[pixel][layer][channel]`.
    pub(crate) m2: Vec<f64>,
    /// How the image is divided into blocks.
    pub grid: BlockGrid,
    /// Means over replicates of block means, `[block][layer][channel]`.
    pub(crate) block_mean: Vec<f64>,
    /// Their sums of squared deviations.
    pub(crate) block_m2: Vec<f64>,
    /// `[i · layers + j]`: image mean of the covariance over replicates between layers `i` and `j` of one replicate's pixel.
    /// Empty for fewer than two replicates or more than [`crate::statistics::MAX_COVARIANCE_LAYERS`] layers.
    pub covariance: Vec<[f64; 3]>,
    /// Image mean of the variance over replicates of one replicate's pixel, all layers added; `None` for one replicate.
    pub total_variance: Option<[f64; 3]>,
    /// Image means, `[replicate][layer]`.
    pub replicate_means: Vec<Vec<[f64; 3]>>,
    /// Seconds of transport (wall time), per replicate.
    pub replicate_seconds: Vec<f64>,
    /// Non-finite contributions, per layer. They are left out of every sum.
    pub invalid: Vec<u64>,
    /// Work done.
    pub counters: Counters,
    /// The largest contributions of every layer, where they were asked for.
    pub fireflies: Fireflies,
}

impl Measurement {
    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Samples per pixel over all replicates.
    pub fn samples(&self) -> u64 {
        self.replicates as u64 * self.samples_per_replicate as u64
    }

    /// Seconds of transport (wall time) over all replicates.
    pub fn seconds(&self) -> f64 {
        self.replicate_seconds.iter().sum()
    }

    /// Index of an order's layer, if it was asked for.
    pub fn layer_of_order(&self, order: usize) -> Option<usize> {
        self.layers.iter().position(|&l| l == Layer::Order(order))
    }

    /// The parts, each with its place among all layers.
    pub fn parts(&self) -> impl Iterator<Item = (usize, &Part)> {
        self.parts.iter().enumerate().map(|(i, part)| (self.layers.len() + i, part))
    }

    /// The strategies `(s, t)` of which the variance looks infinite where they stand alone, unweighted. Known where fireflies are kept.
    pub fn unbounded_strategies(&self) -> Vec<(usize, usize)> {
        let unbounded =
            |layer: usize| self.fireflies.tails().get(layer).is_some_and(|t| t.variance() == Variance::Infinite);
        let raw = self.parts().filter_map(|(layer, part)| match *part {
            Part::Strategy { s, t, quantity: Quantity::Raw } => Some((layer, (s, t))),
            _ => None,
        });
        raw.filter(|&(layer, _)| unbounded(layer)).map(|(_, strategy)| strategy).collect()
    }

    #[inline]
    fn at(&self, layer: usize, pixel: usize) -> usize {
        (pixel * (self.layers.len() + self.parts.len()) + layer) * 3
    }

    /// Mean of a pixel of a layer.
    #[inline]
    pub fn mean(&self, layer: usize, pixel: usize) -> [f64; 3] {
        let i = self.at(layer, pixel);
        [self.mean[i], self.mean[i + 1], self.mean[i + 2]]
    }

    /// Variance over replicates of one replicate's pixel; `None` for fewer than two replicates.
    /// Divide by `replicates` for the variance of [`Measurement::mean`], multiply by `samples_per_replicate` for that of one sample.
    #[inline]
    pub fn variance(&self, layer: usize, pixel: usize) -> Option<[f64; 3]> {
        if self.replicates < 2 {
            return None;
        }
        let n = fault!("variance_with_n_for_n_minus_1", self.replicates - 1, self.replicates) as f64;
        let i = self.at(layer, pixel);
        Some([self.m2[i] / n, self.m2[i + 1] / n, self.m2[i + 2] / n])
    }

    /// Mean of a block of pixels of a layer.
    pub fn block_mean(&self, layer: usize, block: usize) -> [f64; 3] {
        let i = self.at(layer, block);
        [self.block_mean[i], self.block_mean[i + 1], self.block_mean[i + 2]]
    }

    /// Variance over replicates of one replicate's block mean, whatever the correlation of its pixels; `None` for fewer
    /// than two replicates.
    pub fn block_variance(&self, layer: usize, block: usize) -> Option<[f64; 3]> {
        if self.replicates < 2 {
            return None;
        }
        let (i, n) = (self.at(layer, block), (self.replicates - 1) as f64);
        Some([self.block_m2[i] / n, self.block_m2[i + 1] / n, self.block_m2[i + 2] / n])
    }

    /// Sum of all layers of a pixel.
    pub fn total(&self, pixel: usize) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for layer in 0..self.layers.len() {
            let x = self.mean(layer, pixel);
            (0..3).for_each(|c| sum[c] += x[c]);
        }
        sum
    }

    /// Image mean of a layer.
    pub fn image_mean(&self, layer: usize) -> [f64; 3] {
        self.average(|p| self.mean(layer, p))
    }

    /// Image mean of the sum of all layers.
    pub fn total_image_mean(&self) -> [f64; 3] {
        self.average(|p| self.total(p))
    }

    /// Image mean of [`Measurement::variance`].
    pub fn image_variance(&self, layer: usize) -> Option<[f64; 3]> {
        (self.replicates >= 2).then(|| self.average(|p| self.variance(layer, p).unwrap_or_default()))
    }

    /// Standard error of [`Measurement::image_mean`] across replicates; `None` for fewer than two.
    pub fn image_mean_error(&self, layer: usize) -> Option<[f64; 3]> {
        self.error_of(|means| means[layer])
    }

    /// Standard error of [`Measurement::total_image_mean`] across replicates; `None` for fewer than two.
    pub fn total_image_mean_error(&self) -> Option<[f64; 3]> {
        self.error_of(|means| {
            let mut sum = [0.0; 3];
            means.iter().take(self.layers.len()).for_each(|m| (0..3).for_each(|c| sum[c] += m[c]));
            sum
        })
    }

    fn average(&self, value: impl Fn(usize) -> [f64; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for pixel in 0..self.pixels() {
            let x = value(pixel);
            (0..3).for_each(|c| sum[c] += x[c]);
        }
        sum.map(|s| s / self.pixels() as f64)
    }

    fn error_of(&self, value: impl Fn(&[[f64; 3]]) -> [f64; 3]) -> Option<[f64; 3]> {
        if self.replicates < 2 {
            return None;
        }
        let mut error = [0.0; 3];
        for (c, e) in error.iter_mut().enumerate() {
            let mut moments = sampling::moments::Moments::default();
            self.replicate_means.iter().for_each(|m| moments.push(value(m)[c]));
            *e = moments.variance_of_mean().sqrt();
        }
        Some(error)
    }
}
