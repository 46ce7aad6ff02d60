//! References: images by which others are judged, and which are never taken for the truth.
//!
//! A reference is pooled from the methods that carry all light of an order: [`mod@plan`] finds out which these are before any ray is traced,
//! [`pool`] weighs them, [`mod@file`] keeps the result as an image. It consists of two independent halves. The first is what errors are
//! taken against; the second stands in the denominators of relative errors, which must not share its noise.
//!
//! Every method has one weight for an order and the whole image, the inverse of the variance that a pilot found. Weights per pixel, or from
//! the samples that they weigh, would go with the values, and so be a bias. Pilot, halves and what is judged draw numbers of their own
//! ([`sampling::sampler::Role`]). Where the scene has a closed form, that is the reference, with no variance but that of
//! a pixel's extent.
//!
//! What is judged has the reference's hash in its state's key, so that an error is never the sum of errors against two references.

pub mod file;
pub mod plan;
pub mod pool;

use crate::config::Metric;
use crate::statistics::errors::Reference;
use integrators::Layer;
use std::sync::Arc;

/// A scene's reference.
#[derive(Clone, Debug)]
pub struct Truth {
    /// What it follows from: other samples or another scene have another hash.
    pub hash: String,
    /// Its layers, in rising order: all that are asked for.
    pub layers: Vec<Layer>,
    /// Pixels in a row, and rows.
    pub size: [usize; 2],
    /// What it was pooled from; empty for one that was read.
    pub pooled: Vec<Pooled>,
    images: Arc<Images>,
}

/// A method in a reference.
#[derive(Clone, Debug, PartialEq)]
pub struct Pooled {
    /// Its label.
    pub label: String,
    /// Its weight in every layer of the reference.
    pub weights: Vec<f64>,
    /// Samples per pixel in each half.
    pub samples: u64,
}

/// Red, green and blue of every pixel.
type Pixels = Vec<[f64; 3]>;

/// `[pixel][layer]`, the layers' sum last.
#[derive(Clone, Debug, Default)]
struct Images {
    /// The first half's means.
    first: Vec<[f64; 3]>,
    /// The second's.
    second: Vec<[f64; 3]>,
    /// The variance of the first half's mean, from that half.
    variance: Vec<[f64; 3]>,
}

impl Images {
    /// Those of some layers, of so many; the sum stays that of all.
    fn of(&self, chosen: &[usize], layers: usize) -> Self {
        let of = |image: &[[f64; 3]]| -> Vec<[f64; 3]> {
            image.chunks(layers + 1).flat_map(|pixel| chosen.iter().chain([&layers]).map(|&i| pixel[i])).collect()
        };
        Self { first: of(&self.first), second: of(&self.second), variance: of(&self.variance) }
    }
}

impl Truth {
    /// Mean over both halves of a layer; of the layers' sum for `None`.
    fn mean(&self, layer: Option<usize>) -> impl Iterator<Item = [f64; 3]> {
        let (at, stride) = (layer.unwrap_or(self.layers.len()), self.layers.len() + 1);
        let pairs = self.images.first.iter().zip(&self.images.second).skip(at).step_by(stride);
        pairs.map(|(a, b)| [0, 1, 2].map(|c| 0.5 * (a[c] + b[c])))
    }

    /// Its variance: half as much as that of one half.
    fn variance(&self, layer: Option<usize>) -> impl Iterator<Item = [f64; 3]> {
        let (at, stride) = (layer.unwrap_or(self.layers.len()), self.layers.len() + 1);
        self.images.variance.iter().skip(at).step_by(stride).map(|v| v.map(|v| 0.5 * v))
    }

    /// Mean and its variance of a layer's pixels; of the layers' sum for `None`. `None` where the reference lacks it.
    pub fn image(&self, layer: Option<Layer>) -> Option<(Pixels, Pixels)> {
        let place = match layer {
            None => None,
            Some(layer) => Some(self.layers.iter().position(|&mine| mine == layer)?),
        };
        Some((self.mean(place).collect(), self.variance(place).collect()))
    }

    /// Root of the mean variance over the mean: how noisy a layer is, of the layers' sum for `None`. Not a number where it is black.
    pub fn noise(&self, layer: Option<usize>) -> f64 {
        let sum = |values: &mut dyn Iterator<Item = [f64; 3]>| values.map(|v| v.iter().sum::<f64>()).sum::<f64>();
        let pixels = 3.0 * (self.size[0] * self.size[1]) as f64;
        let (mean, variance) = (sum(&mut self.mean(layer)) / pixels, sum(&mut self.variance(layer)) / pixels);
        variance.sqrt() / mean
    }

    /// What judges images of some of the layers.
    pub fn judge(&self, layers: &[Layer], metrics: &[Metric]) -> Judge {
        let chosen: Vec<usize> = layers.iter().filter_map(|l| self.layers.iter().position(|mine| mine == l)).collect();
        let all = chosen.len() == self.layers.len();
        let images = if all { Arc::clone(&self.images) } else { Arc::new(self.images.of(&chosen, self.layers.len())) };
        let flip_reference = |layer: Option<usize>| self.mean(layer).map(|v| v.map(|v| v as f32)).collect();
        let flip_references = match metrics.contains(&Metric::Flip) {
            true => chosen.iter().map(|&i| Some(i)).chain([None]).map(flip_reference).collect(),
            false => Vec::new(),
        };
        Judge { images, flip_references, width: self.size[0] }
    }
}

/// A reference of the layers of a method.
#[derive(Clone)]
pub struct Judge {
    images: Arc<Images>,
    flip_references: Vec<Vec<[f32; 3]>>,
    width: usize,
}

impl Judge {
    /// What errors are taken against.
    pub fn reference(&self) -> Reference<'_> {
        let Images { first, second, variance } = &*self.images;
        Reference { mean: first, half: second, variance }
    }

    /// What the eye compares with, layer by layer, the sum last; nothing where that is not asked for.
    pub fn flip_references(&self) -> &[Vec<[f32; 3]>] {
        &self.flip_references
    }

    /// Pixels in a row.
    pub fn width(&self) -> usize {
        self.width
    }
}
