//! What a method has measured of one layer, as comparisons need it.

use crate::result::MethodResult;
use crate::statistics::welch::Sample;
use integrators::{Layer, exact};
use sampling::moments::Moments;

/// What a sample's skewness is multiplied by for what it has not seen.
const UNSEEN: f64 = 1.5;

/// A layer of a method's result.
pub(super) struct Measured<'a> {
    /// The whole.
    pub of: &'a MethodResult,
    /// The layer's number in it.
    at: usize,
    /// The image mean, mean of channels, of every replicate.
    pub image: Moments,
    /// Skewness of the mean of all replicates; 0 for the closed form, which has no distribution.
    pub lean: f64,
    /// The radiance of single paths that are met by chance alone.
    pub hit: [f64; 3],
}

impl<'a> Measured<'a> {
    /// `None` where the layer was not measured.
    pub fn of(of: &'a MethodResult, layer: Layer) -> Option<Self> {
        let measurement = &of.measurement;
        let at = measurement.layers.iter().position(|&l| l == layer)?;
        let mean = |means: &Vec<[f64; 3]>| means[at].iter().sum::<f64>() / 3.0;
        let image: Vec<f64> = measurement.replicate_means.iter().map(mean).collect();
        let samples = measurement.fireflies.tails().get(at).and_then(|tail| Some((tail.kurtosis()?, tail.count)));
        let lean = if of.method == exact::NAME { 0.0 } else { lean(&image, samples) };
        let hit = of.largest_hits.get(at).copied().unwrap_or_default();
        Some(Self { of, at, image: image.into_iter().collect(), lean, hit })
    }

    /// Whether it found no light, which may be chance; a closed form that is zero is none.
    pub fn is_dark(&self) -> bool {
        self.image.mean == 0.0 && self.of.method != exact::NAME
    }

    /// A channel of the mean of a block.
    pub fn block(&self, block: usize, channel: usize) -> Sample {
        let m = &self.of.measurement;
        let variance = m.block_variance(self.at, block).map_or(f64::NAN, |variance| variance[channel]);
        Sample { mean: m.block_mean(self.at, block)[channel], variance, n: m.replicates }
    }

    /// The number of blocks.
    pub fn blocks(&self) -> usize {
        self.of.measurement.grid.count()
    }

    /// What a hit brings, mean of channels.
    pub fn mean_hit(&self) -> f64 {
        self.hit.iter().sum::<f64>() / 3.0
    }

    /// Samples of the whole image.
    pub fn samples(&self) -> f64 {
        let m = &self.of.measurement;
        m.samples() as f64 * m.pixels() as f64
    }

    /// The variance that the image mean of a replicate has if blocks are independent and channels are not.
    pub fn variance_by_blocks(&self) -> f64 {
        let count = self.blocks();
        let by_channel = |c: usize| (0..count).map(|block| self.block(block, c).variance).sum::<f64>();
        (0..3).map(by_channel).sum::<f64>() / (3 * count * count) as f64
    }

    /// The probability, at most, of having met none of the paths that would make up for what the mean of so many blocks is too low
    /// by, in a channel: there are fewest of them if each brings as much as one can.
    pub fn chance_of_missing(&self, lower_by: f64, blocks: usize, hit: f64) -> f64 {
        let samples = self.samples() * blocks as f64 / self.blocks() as f64;
        if hit > 0.0 && lower_by > 0.0 { (-samples * lower_by / hit).exp() } else { 0.0 }
    }
}

/// Skewness of a mean of values ≥ 0: the least that a mean of rare contributions can have, its relative error, or what the kurtosis κ
/// of n single samples allows, if it is more: that of one sample is at most √(κ − 1) [Pearson 1916], that of their mean √n times
/// less. Infinite where nothing arrived; 0 where there is no variance.
pub(super) fn lean(means: &[f64], samples: Option<(f64, u64)>) -> f64 {
    let n = means.len() as f64;
    let mean = means.iter().sum::<f64>() / n;
    if mean == 0.0 {
        return f64::INFINITY;
    }
    let variance = means.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n;
    if variance == 0.0 {
        return 0.0;
    }
    let of_samples = samples.map_or(0.0, |(kurtosis, n)| ((kurtosis - 1.0).max(0.0) / n as f64).sqrt());
    UNSEEN * of_samples.max((variance / (n - 1.0)).sqrt() / mean.abs())
}
