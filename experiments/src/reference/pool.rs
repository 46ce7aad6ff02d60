//! Several methods' images made one: the weights, and the weighted means.

use super::plan::{Carrier, layers};
use super::{Images, Pooled, Truth};
use crate::config::Experiment;
use crate::job::Job;
use integrators::{Layer, Measurement};
use std::sync::Arc;

/// Samples of a pilot's replicate, and its replicates.
pub const PILOT: (u32, u32) = (4, 8);

/// The weights of all carriers, `[carrier][layer]`, from their pilots, one a carrier; none are needed where every layer has but one.
pub fn weights(experiment: &Experiment, carriers: &[Carrier], pilots: &[Measurement]) -> Vec<Vec<f64>> {
    let mut weights = vec![Vec::new(); carriers.len()];
    for (i, layer) in layers(experiment).into_iter().enumerate() {
        let takes_part: Vec<bool> = carriers.iter().map(|c| c.takes_part[i]).collect();
        let seen = |carrier: usize| pilots.get(carrier).map_or((0.0, 0.0), |m| mean_and_variance(m, layer));
        let seen: Vec<(f64, f64)> = (0..carriers.len()).map(seen).collect();
        let of_layer = of_layer(&takes_part, &seen);
        weights.iter_mut().zip(of_layer).for_each(|(all, weight)| all.push(weight));
    }
    weights
}

/// Weights that add up to one, proportional to the inverse of variances. What has none is exact and shares the layer with its like alone,
/// but for what has found no light at all, which takes part only where nobody has.
fn of_layer(takes_part: &[bool], seen: &[(f64, f64)]) -> Vec<f64> {
    let share = |of: &dyn Fn(usize) -> f64| {
        let raw: Vec<f64> = (0..seen.len()).map(|i| if takes_part[i] { of(i) } else { 0.0 }).collect();
        let sum: f64 = raw.iter().sum();
        (sum > 0.0).then(|| raw.iter().map(|w| w / sum).collect::<Vec<f64>>())
    };
    let is_exact = |i: usize| f64::from(seen[i].0 != 0.0 && seen[i].1 == 0.0);
    let precision = |i: usize| if seen[i].1 > 0.0 { seen[i].1.recip() } else { 0.0 };
    share(&is_exact).or_else(|| share(&precision)).or_else(|| share(&|_| 1.0)).unwrap_or_default()
}

/// Image and channel means of a layer's mean, and of the variance of one replicate.
fn mean_and_variance(m: &Measurement, layer: Layer) -> (f64, f64) {
    let Some(at) = m.layers.iter().position(|l| *l == layer) else { return (0.0, 0.0) };
    let average = |v: [f64; 3]| v.iter().sum::<f64>() / 3.0;
    (average(m.image_mean(at)), m.image_variance(at).map_or(0.0, average))
}

/// The weights of a carrier's own layers, in their order.
pub fn own_weights(carrier: &Carrier, weights: &[f64], experiment: &Experiment) -> Vec<f64> {
    let layers = layers(experiment);
    let place = |layer: &Layer| layers.iter().position(|l| l == layer);
    carrier.request.layers().iter().map(|layer| place(layer).map_or(0.0, |i| weights[i])).collect()
}

/// One half: weighted means and the variances of these, `[pixel][layer]`, sums last.
pub struct Half {
    mean: Vec<[f64; 3]>,
    variance: Vec<[f64; 3]>,
}

impl Half {
    /// That of finished jobs, one a carrier, in order.
    pub fn new(experiment: &Experiment, pixels: usize, jobs: Vec<Job>, weights: &[Vec<f64>]) -> Self {
        let layers = layers(experiment);
        let stride = layers.len() + 1;
        let mut half = Self { mean: vec![[0.0; 3]; pixels * stride], variance: vec![[0.0; 3]; pixels * stride] };
        for (job, weights) in jobs.into_iter().zip(weights) {
            let (m, noted) = job.finish();
            let add = |to: &mut [f64; 3], x: [f64; 3], weight: f64| (0..3).for_each(|c| to[c] += weight * x[c]);
            for (i, layer) in layers.iter().enumerate().filter(|(i, _)| weights[*i] > 0.0) {
                let Some(own) = m.layers.iter().position(|l| l == layer) else { continue };
                let per_replicate = weights[i] * weights[i] / f64::from(m.replicates);
                for pixel in 0..pixels {
                    let (mean, at) = (m.mean(own, pixel), pixel * stride + i);
                    add(&mut half.mean[at], mean, weights[i]);
                    add(&mut half.mean[pixel * stride + stride - 1], mean, weights[i]);
                    add(&mut half.variance[at], m.variance(own, pixel).unwrap_or_default(), per_replicate);
                }
            }
            for pixel in (0..pixels).filter(|_| noted.share.is_some()) {
                let of_sum = noted.share.as_ref().map_or([0.0; 3], |share| share.variance_of_mean(pixel));
                add(&mut half.variance[pixel * stride + stride - 1], of_sum, 1.0);
            }
        }
        half
    }
}

impl Truth {
    /// Two halves put together. The variance of the first is its own: it goes with the first half's noise, which it is to take out, and not
    /// with the second's, which weighs.
    pub fn of_halves(
        experiment: &Experiment,
        size: [usize; 2],
        hash: String,
        [first, second]: [Half; 2],
        pooled: Vec<Pooled>,
    ) -> Self {
        let images = Images { first: first.mean, second: second.mean, variance: first.variance };
        Self { hash, layers: layers(experiment), size, pooled, images: Arc::new(images) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_inverse_variances_of_those_that_take_part() {
        let near = |found: Vec<f64>, expected: [f64; 3]| {
            assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?} {expected:?}");
        };
        let seen = [(1.0, 0.5), (1.0, 1.5), (1.0, 0.1)];
        near(of_layer(&[true, true, false], &seen), [0.75, 0.25, 0.0]);
        // Who knows the layer exactly needs nobody's help, and who saw nothing gives none.
        near(of_layer(&[true; 3], &[(1.0, 0.5), (1.0, 0.0), (0.0, 0.0)]), [0.0, 1.0, 0.0]);
        near(of_layer(&[true; 3], &[(1.0, 0.5), (0.0, 0.0), (1.0, 0.5)]), [0.5, 0.0, 0.5]);
        near(of_layer(&[true, false, true], &[(0.0, 0.0); 3]), [0.5, 0.0, 0.5]);
    }
}
