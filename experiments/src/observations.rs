//! What is noted of every replicate while its image is at hand, and the intervals that follow from it.

use crate::convergence::Deviations;
use crate::reference::Judge;
use crate::statistics::covariances::Covariances;
use crate::statistics::errors::{Errors, LayerErrors};
use crate::statistics::flip::{self, PIXELS_PER_DEGREE};
use crate::statistics::time::{TimeToError, time_to_error};
use crate::statistics::{Estimate, means, positive};
use integrators::statistics::side_by_side::Pixels;
use integrators::statistics::{GROUP, MAX_COVARIANCE_LAYERS};
use integrators::{Render, stored};
use rayon::prelude::*;

/// So many replicates are noted one by one. Of images that are judged by nothing the groups after them are noted as wholes: there are then so many
/// groups that intervals rest on these, and their moments are all that has to be known of them.
pub const ONE_BY_ONE: u32 = 32 * GROUP;

/// What is noted, as far as it is asked for.
#[derive(Default)]
pub struct Observations {
    /// Squared deviations, at the checkpoints of convergence.
    pub deviations: Option<Deviations>,
    /// Products of deviations, of images.
    pub covariances: Option<Covariances>,
    /// Errors against a reference.
    pub errors: Option<Errors>,
    /// FLIP, `[layer][replicate]`, the layers' sum last.
    pub flips: Vec<Vec<f64>>,
    /// The part that a method has in a reference's sum of layers.
    pub share: Option<Share>,
}

stored!(Observations { deviations, covariances, errors, flips, share });

impl Observations {
    /// Those of images of so many pixels and layers, judged or not.
    pub fn of_images(pixels: usize, layers: usize, judge: Option<&Judge>) -> Self {
        Self {
            covariances: (layers <= MAX_COVARIANCE_LAYERS).then(|| Covariances::new(pixels, layers)),
            errors: judge.map(|_| Errors::new(pixels, layers)),
            flips: judge.map_or(Vec::new(), |judge| vec![Vec::new(); judge.flip_references().len()]),
            ..Self::default()
        }
    }

    /// Looks at the replicate rendered last.
    pub fn observe(&mut self, render: &Render, judge: Option<&Judge>) {
        let image = |layer: usize, pixel: usize| render.last_replicate(layer, pixel);
        if let Some(deviations) = &mut self.deviations {
            deviations.push(image);
        }
        if let Some(covariances) = &mut self.covariances {
            covariances.push(image);
        }
        if let Some(share) = &mut self.share {
            share.push(image);
        }
        let Some(judge) = judge else { return };
        if let Some(errors) = &mut self.errors {
            errors.push(judge.reference(), image);
        }
        for (layer, values) in self.flips.iter_mut().enumerate() {
            let layers = if layer + 1 < judge.flip_references().len() { layer..layer + 1 } else { 0..layer };
            let face = |pixel: usize| {
                let sum = |c: usize| layers.clone().map(|layer| image(layer, pixel)[c]).sum::<f64>() as f32;
                [sum(0), sum(1), sum(2)]
            };
            let reference = &judge.flip_references()[layer];
            let test: Vec<[f32; 3]> = (0..reference.len()).map(face).collect();
            values.push(flip::mean(&flip::hdr(judge.width(), reference, &test, PIXELS_PER_DEGREE)));
        }
    }

    /// Looks at some pixels of the replicates of a group, those that follow, of images that are noted in groups later on. Returns what
    /// [`Self::count_in`] is to be told.
    pub fn observe_pixels(&mut self, pixels: &Pixels) -> Vec<Vec<Vec<f64>>> {
        let Some(covariances) = &mut self.covariances else { return Vec::new() };
        covariances.push_pixels(pixels.range(), pixels.replicates(), |r, layer, pixel| pixels.value(r, layer, pixel))
    }

    /// Ends with so many replicates of which it has looked at all pixels.
    pub fn count_in(&mut self, replicates: usize, added: &[Vec<Vec<f64>>]) {
        if let Some(covariances) = &mut self.covariances {
            covariances.count_in(replicates, added);
        }
    }

    /// Looks at the group that ended last.
    pub fn observe_group(&mut self, render: &Render) {
        let (replicates, products) = render.last_group();
        if let Some(covariances) = &mut self.covariances {
            covariances.push_group(replicates as usize, products);
        }
    }

    /// Whether fewer replicates than these have been noted.
    pub fn lack(&self, replicates: u32) -> bool {
        self.covariances.as_ref().is_some_and(|covariances| covariances.replicates() < replicates as usize)
    }

    /// Intervals of variances, covariances and efficiencies, given each replicate's seconds.
    pub fn intervals(&self, seconds: &[f64]) -> Option<Intervals> {
        let covariances = self.covariances.as_ref()?;
        let layers = covariances.layers();
        let mut squares: Vec<Vec<f64>> = (0..layers).map(|layer| covariances.squares(layer).into_owned()).collect();
        squares.push(covariances.squares_of_sum());
        let seconds = covariances.beside(seconds.get(1..)?);
        let variance: Vec<Estimate> =
            squares.iter().enumerate().map(|(i, q)| positive::variance(q, i as u64)).collect();
        let pairs = (0..layers).flat_map(|i| (0..=i).map(move |j| (i, j)));
        // With itself an order has its variance, of which there is but one interval.
        let covariance = |(i, j): (usize, usize)| match i == j {
            true => variance[i],
            false => covariances.covariance(i, j, (i << 16 | j) as u64),
        };
        Some(Intervals {
            covariance: pairs.map(covariance).collect(),
            variance,
            efficiency: squares.iter().enumerate().map(|(i, q)| positive::efficiency(q, &seconds, i as u64)).collect(),
            squares,
            seconds,
        })
    }

    /// What the errors are, and the times to these relative mean squared errors, given each replicate's seconds.
    pub fn judged(&self, judge: &Judge, seconds: &[f64], targets: &[f64]) -> Option<Judged> {
        let errors = self.errors.as_ref().filter(|errors| errors.replicates() > 0)?;
        let layers = errors.finish(judge.reference(), 0);
        let later = seconds.get(1..)?;
        let times = |(layer, found): (usize, &LayerErrors)| {
            let squares = errors.relative_squares(layer);
            let time = |&target| time_to_error(squares, later, &found.relbias2, target, layer as u64);
            targets.iter().map(time).collect()
        };
        Some(Judged {
            times: layers.iter().enumerate().map(times).collect(),
            flip: self.flips.iter().enumerate().map(|(i, values)| means::skewed_mean(values, i as u64)).collect(),
            layers,
        })
    }
}

/// How sure the second moments of a method's images are, layer by layer, their sum last.
#[derive(Clone, Debug)]
pub struct Intervals {
    /// Of one replicate.
    pub variance: Vec<Estimate>,
    /// `1 / (variance · seconds)` of a replicate.
    pub efficiency: Vec<Estimate>,
    /// Between layers i and j ≤ i, at `i (i + 1)/2 + j`.
    pub covariance: Vec<Estimate>,
    /// What each replicate but the first adds to the variance, or each group of them where these were noted as wholes.
    pub squares: Vec<Vec<f64>>,
    /// The seconds of these.
    pub seconds: Vec<f64>,
}

/// How far a method's images are from their reference, layer by layer, the distance of their sum from that of all orders last.
#[derive(Clone, Debug)]
pub struct Judged {
    /// Errors.
    pub layers: Vec<LayerErrors>,
    /// FLIP; empty where it was not asked for.
    pub flip: Vec<Estimate>,
    /// The times to all errors asked for.
    pub times: Vec<Vec<TimeToError>>,
}

/// A weighted sum of a method's layers, pixel by pixel: its mean and squared deviations over replicates.
pub struct Share {
    weights: Vec<f64>,
    count: u32,
    mean: Vec<[f64; 3]>,
    m2: Vec<[f64; 3]>,
}

stored!(Share { weights, count, mean, m2 });

impl Share {
    /// No replicates yet of images with so many pixels, whose layers have these weights.
    pub fn new(pixels: usize, weights: Vec<f64>) -> Self {
        Self { weights, count: 0, mean: vec![[0.0; 3]; pixels], m2: vec![[0.0; 3]; pixels] }
    }

    /// Adds a replicate's image \[Welford62\].
    fn push(&mut self, image: impl Fn(usize, usize) -> [f64; 3] + Sync) {
        self.count += 1;
        let (n, weights) = (f64::from(self.count), &self.weights);
        self.mean.par_iter_mut().zip(&mut self.m2).enumerate().for_each(|(pixel, (mean, m2))| {
            let mut sum = [0.0; 3];
            for (layer, weight) in weights.iter().enumerate() {
                let value = image(layer, pixel);
                (0..3).for_each(|c| sum[c] += weight * value[c]);
            }
            for c in 0..3 {
                let before = sum[c] - mean[c];
                mean[c] += before / n;
                m2[c] += before * (sum[c] - mean[c]);
            }
        });
    }

    /// The variance of the mean over replicates.
    pub fn variance_of_mean(&self, pixel: usize) -> [f64; 3] {
        let n = f64::from(self.count);
        self.m2[pixel].map(|m2| m2 / (n * (n - 1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_variance_of_a_weighted_sum_is_that_of_two_passes() {
        let value = |r: usize, layer: usize, pixel: usize| ((r * 7 + layer * 3 + pixel * 5) as f64 * 12.9898).sin();
        let mut share = Share::new(3, vec![0.25, 0.75]);
        (0..6).for_each(|r| share.push(|layer, pixel| [value(r, layer, pixel); 3]));
        for pixel in 0..3 {
            let sums: Vec<f64> = (0..6).map(|r| 0.25 * value(r, 0, pixel) + 0.75 * value(r, 1, pixel)).collect();
            let mean = sums.iter().sum::<f64>() / 6.0;
            let expected = sums.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / 30.0;
            assert!((share.variance_of_mean(pixel)[1] - expected).abs() < 1e-12);
        }
    }
}
