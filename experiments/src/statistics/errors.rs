//! Errors against a reference that is noisy itself, streamed replicate by replicate.
//!
//! Let `x_r` be a pixel of replicate r of R, with mean μ + b (b is the method's bias) and variance σ²; let `ref` be the
//! reference's pixel, of mean μ and variance v, independent of all replicates, and `v̂` an unbiased estimate of v. Bars and ⟨ ⟩ are
//! means over replicates, and over pixels and channels.
//!
//! - **MSE** of one replicate: `⟨(x_r − ref)² − v̂⟩`, averaged over r. Its expectation is `⟨σ² + b²⟩`: unbiased.
//! - **bias²**: `⟨(x̄ − ref)² − s²/R − v̂⟩`. The first two terms are the mean of `(x_r − ref)(x_s − ref)` over all pairs r ≠ s, whose
//!   expectation is `b² + v`: unbiased, and negative about half of the time where there is no bias. It is never clamped.
//! - **relMSE**: `⟨((x_r − ref)² − v̂) / (h² + 0.01)⟩`, with h the pixel of an independent half of the reference. Given h it is unbiased
//!   for the MSE with these weights. That the weights themselves are noisy is left: where `μ² ≫ 0.01` they are too
//!   large by a part of about `3 Var(h)/μ²`. Were h part of `ref`, the covariance of both would be a bias of the first order.
//! - **SMAPE**: `⟨|x_r − ref| / (|x_r| + |h|)⟩`, 0 where both terms vanish, and 1 (its largest value, were h the reference) where the
//!   denominator alone does. Absolute values cannot be debiased: the reference's noise raises it, by a part of about `v/(2σ²)`
//!   while v ≪ σ². It is what it is for this reference, and its interval is that of its mean over replicates.
//!
//! What is kept are the mean image and a few numbers per replicate and layer: memory does not grow with samples.
//!
//! # Intervals
//!
//! Those of MSE, relMSE and SMAPE are the intervals of skewed means over replicates ([`super::means`]). To the first two is added, in
//! quadrature, what the reference's noise contributes, which all replicates share:
//! `Var ⟨(ref − μ − b)² − v⟩ = ⟨2 v² + 4 b² v⟩ / N` for N independent normal pixels with fully correlated channels, with `(x̄ − ref)²`
//! for b², which is too large rather than too small.
//!
//! That of bias² comes from `c_r = ⟨(x_r − ref)(x̄_{r−1} − ref)⟩`, whose weighted mean `Σ w_r c_r`, `w_r = 2 (r − 1)/(R (R − 1))`, is the mean
//! over all pairs. Let `S = Σ w_r² (c_r − c̄)²`. Where there is no bias, the `(r − 1) c_r` are martingale differences, and S estimates the
//! variance. Where bias dominates, `c_r − c̄ ≈ ⟨b (δ_r + δ̄_{r−1})⟩` is correlated over r and S is a third of the variance
//! `4 Var⟨b x_r⟩/R`, which itself grows with b². So the interval holds all values θ of bias² with `(c̄ − θ)² ≤ t² V(θ)` [as Wilson 1927
//! does for proportions], where V(θ) lies between S (or 3 S, above the estimate) and what S says of the worst case, a bias along the noise's
//! largest principal component: `S + √8 θ √S`. Student's t is that of R/2 − 1 degrees of freedom, since late c_r weigh most. The
//! interval is too wide rather than too narrow, by a factor of up to 3 above and 1.3 below where there is no bias.

use super::means::{self, NORMAL_QUANTILE, skewed_mean, skewed_reach, student_quantile};
use super::{Estimate, Interval, positive};
use crate::metrics::RELATIVE_FLOOR;

/// Replicates from which on the interval of bias² is valid.
pub const BIAS_VALID_FROM: usize = 8;

/// What is judged against: images of all layers, `[pixel][layer]` with the layers' sum last.
#[derive(Clone, Copy, Debug)]
pub struct Reference<'a> {
    /// Means over the reference's replicates.
    pub mean: &'a [[f64; 3]],
    /// The same over replicates that are not among those of `mean`, for denominators.
    pub half: &'a [[f64; 3]],
    /// Unbiased estimates of the variance of `mean`; zeros if the reference is exact.
    pub variance: &'a [[f64; 3]],
}

/// Errors of a method's replicates, one replicate at a time.
#[derive(Clone, Debug)]
pub struct Errors<'a> {
    reference: Reference<'a>,
    pixels: usize,
    /// Layers, without their sum.
    layers: usize,
    count: usize,
    /// Mean image so far, `[pixel][layer]`, sums last.
    mean: Vec<[f64; 3]>,
    /// By layer, the sum last.
    rows: Vec<Replicates>,
}

/// Image and channel means of a layer, one a replicate.
#[derive(Clone, Debug, Default)]
struct Replicates {
    mean: Vec<f64>,
    square: Vec<f64>,
    relative: Vec<f64>,
    symmetric: Vec<f64>,
    /// `c_r`, from the second replicate on.
    cross: Vec<f64>,
    /// Recursive squares, from the second replicate on.
    recursive: Vec<f64>,
}

/// What one replicate adds to the sums over a layer's pixels.
#[derive(Clone, Copy, Default)]
struct Sums {
    mean: f64,
    square: f64,
    relative: f64,
    symmetric: f64,
    cross: f64,
    recursive: f64,
}

/// The errors of one layer, or of the layers' sum.
#[derive(Clone, Copy, Debug)]
pub struct LayerErrors {
    /// Image mean.
    pub mean: Estimate,
    /// Variance of one replicate.
    pub variance: Estimate,
    /// Mean squared error of one replicate.
    pub mse: Estimate,
    /// The part of it that does not fall with more samples.
    pub bias2: Estimate,
    /// Relative mean squared error of one replicate.
    pub relmse: Estimate,
    /// Symmetric mean absolute percentage error of one replicate, between 0 and about 1.
    pub smape: Estimate,
}

impl<'a> Errors<'a> {
    /// No replicates yet of images with so many pixels and layers.
    pub fn new(pixels: usize, layers: usize, reference: Reference<'a>) -> Self {
        let size = pixels * (layers + 1);
        let images = [reference.mean, reference.half, reference.variance];
        assert!(images.iter().all(|image| image.len() == size), "a reference of all layers and their sum");
        Self {
            reference,
            pixels,
            layers,
            count: 0,
            mean: vec![[0.0; 3]; size],
            rows: vec![Replicates::default(); layers + 1],
        }
    }

    /// Adds a replicate's image, given by layer and pixel.
    pub fn push(&mut self, image: impl Fn(usize, usize) -> [f64; 3]) {
        self.count += 1;
        let mut sums = vec![Sums::default(); self.layers + 1];
        for pixel in 0..self.pixels {
            let mut total = [0.0; 3];
            for (layer, sum) in sums.iter_mut().enumerate() {
                let value = if layer < self.layers { image(layer, pixel) } else { total };
                (0..3).for_each(|c| total[c] += value[c]);
                self.add(pixel * (self.layers + 1) + layer, value, sum);
            }
        }
        let n = (3 * self.pixels) as f64;
        let first = self.count == 1;
        for (row, sum) in self.rows.iter_mut().zip(sums) {
            row.mean.push(sum.mean / n);
            row.square.push(sum.square / n);
            row.relative.push(sum.relative / n);
            row.symmetric.push(sum.symmetric / n);
            if !first {
                row.cross.push(sum.cross / n);
                row.recursive.push(sum.recursive / n);
            }
        }
    }

    fn add(&mut self, at: usize, value: [f64; 3], sum: &mut Sums) {
        let r = self.count as f64;
        let mean = &mut self.mean[at];
        for c in 0..3 {
            let (reference, half) = (self.reference.mean[at][c], self.reference.half[at][c]);
            let noise = self.reference.variance[at][c];
            let error = value[c] - reference;
            let square = error * error - noise;
            sum.mean += value[c];
            sum.square += square;
            sum.relative += square / (half * half + RELATIVE_FLOOR);
            sum.symmetric += symmetric(error, value[c], half);
            sum.cross += error * (mean[c] - reference) - noise;
            let deviation = value[c] - mean[c];
            sum.recursive += deviation * deviation * (r - 1.0) / r;
            mean[c] += deviation / r;
        }
    }

    /// What each replicate but the first adds to a layer's variance, see [`super::positive`]; the layers' sum is the last layer.
    pub fn recursive_squares(&self, layer: usize) -> &[f64] {
        &self.rows[layer].recursive
    }

    /// The errors of every layer, and of their sum last.
    pub fn finish(&self, salt: u64) -> Vec<LayerErrors> {
        let layer = |(layer, row): (usize, &Replicates)| {
            let (shared, shared_relative) = self.shared_errors(layer);
            let salt = salt << 16 | layer as u64;
            LayerErrors {
                mean: means::mean(&row.mean),
                variance: positive::variance(&row.recursive, salt),
                mse: widened(&row.square, shared, salt),
                bias2: bias2(&row.cross, shared),
                relmse: widened(&row.relative, shared_relative, salt),
                smape: skewed_mean(&row.symmetric, salt),
            }
        };
        self.rows.iter().enumerate().map(layer).collect()
    }

    /// Standard error that the reference gives to MSE, and to relMSE.
    fn shared_errors(&self, layer: usize) -> (f64, f64) {
        let (mut plain, mut relative) = (0.0, 0.0);
        for at in (layer..self.mean.len()).step_by(self.layers + 1) {
            let (mut noise, mut cross) = ([0.0; 2], [0.0; 2]);
            for c in 0..3 {
                let half = self.reference.half[at][c];
                let weights = [1.0, 1.0 / (half * half + RELATIVE_FLOOR)];
                let v = self.reference.variance[at][c].max(0.0);
                let bias = (self.mean[at][c] - self.reference.mean[at][c]).abs();
                for (i, weight) in weights.into_iter().enumerate() {
                    noise[i] += weight * v;
                    cross[i] += weight * bias * v.sqrt();
                }
            }
            plain += 2.0 * noise[0] * noise[0] + 4.0 * cross[0] * cross[0];
            relative += 2.0 * noise[1] * noise[1] + 4.0 * cross[1] * cross[1];
        }
        let n = (3 * self.pixels) as f64;
        (plain.sqrt() / n, relative.sqrt() / n)
    }
}

/// `|x − ref| / (|x| + |h|)`.
fn symmetric(error: f64, value: f64, half: f64) -> f64 {
    let denominator = value.abs() + half.abs();
    match (error == 0.0, denominator == 0.0) {
        (true, _) => 0.0,
        (false, true) => 1.0,
        (false, false) => error.abs() / denominator,
    }
}

/// The mean of skewed values with another, normal error that all of them share.
fn widened(values: &[f64], shared: f64, salt: u64) -> Estimate {
    let plain = skewed_mean(values, salt);
    let (below, above) = skewed_reach(values, salt);
    let shared = NORMAL_QUANTILE * shared;
    let interval =
        (values.len() >= 2).then_some((plain.value - below.hypot(shared), plain.value + above.hypot(shared)));
    Estimate::new(plain.value, interval, values.len(), plain.valid_from)
}

/// bias² from `c_r` of the second replicate and those after it, and the standard error that the reference gives to it.
pub fn bias2(cross: &[f64], shared: f64) -> Estimate {
    let replicates = cross.len() + 1;
    let all = (replicates * cross.len()) as f64;
    let weights = (1..replicates).map(|r| 2.0 * r as f64 / all);
    let value: f64 = weights.clone().zip(cross).map(|(w, c)| w * c).sum();
    let spread: f64 = weights.zip(cross).map(|(w, c)| (w * (c - value)).powi(2)).sum();
    let interval = (replicates >= 6).then(|| bias2_interval(value, spread, shared, replicates));
    Estimate::new(value, interval, replicates, BIAS_VALID_FROM)
}

/// All θ with `(value − θ)² ≤ t² V(θ)`: see this file's head.
fn bias2_interval(value: f64, spread: f64, shared: f64, replicates: usize) -> Interval {
    let t = student_quantile(replicates as f64 / 2.0 - 1.0);
    let worst = |theta: f64| spread + 8.0_f64.sqrt() * theta.max(0.0) * spread.sqrt();
    let above = |theta: f64| (3.0 * spread).max((3.0 * spread * theta / value.abs()).min(worst(theta)));
    let below = |theta: f64| (3.0 * spread).min(worst(theta));
    let reach = |variance: f64| (t * t * variance).sqrt().hypot(NORMAL_QUANTILE * shared);
    // Above, the noise grows with θ, but slower: the sequence rises to the end.
    let high = (0..100).fold(value, |high, _| value + reach(above(high)));
    // Below, it shrinks with θ, and the end lies where θ crosses what it reaches to.
    let (mut low, mut held) = (value - reach(3.0 * spread), value);
    for _ in 0..60 {
        let middle = 0.5 * (low + held);
        if middle < value - reach(below(middle)) { low = middle } else { held = middle }
    }
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PIXELS: usize = 5;

    fn value(r: usize, layer: usize, pixel: usize, c: usize) -> f64 {
        1.0 + 0.5 * ((r * 7 + layer * 3 + pixel * 5 + c) as f64 * 12.9898).sin()
    }

    /// `[pixel][layer]` of two layers and their sum.
    fn image(of: impl Fn(usize, usize, usize) -> f64) -> Vec<[f64; 3]> {
        let pixel = |p: usize| {
            let [a, b] = [0, 1].map(|layer| [0, 1, 2].map(|c| of(layer, p, c)));
            [a, b, [0, 1, 2].map(|c| a[c] + b[c])]
        };
        (0..PIXELS).flat_map(pixel).collect()
    }

    #[test]
    fn errors_are_those_of_two_passes() {
        let mean = image(|layer, p, c| 1.0 + 0.1 * value(90, layer, p, c));
        let half = image(|layer, p, c| 1.0 + 0.1 * value(91, layer, p, c));
        let variance = image(|_, _, _| 0.003);
        let mut errors = Errors::new(PIXELS, 2, Reference { mean: &mean, half: &half, variance: &variance });
        let images: Vec<Vec<[f64; 3]>> = (0..9).map(|r| image(|layer, p, c| value(r, layer, p, c))).collect();
        images.iter().for_each(|x| errors.push(|layer, pixel| x[pixel * 3 + layer]));
        for (layer, row) in errors.finish(0).into_iter().enumerate() {
            let average = |of: &dyn Fn(usize, usize) -> f64| {
                (0..PIXELS).map(|p| (0..3).map(|c| of(p * 3 + layer, c)).sum::<f64>()).sum::<f64>()
                    / (3 * PIXELS) as f64
            };
            let over = |of: &dyn Fn(&Vec<[f64; 3]>) -> f64| images.iter().map(of).sum::<f64>() / 9.0;
            let square = |x: &Vec<[f64; 3]>, at: usize, c: usize| (x[at][c] - mean[at][c]).powi(2) - variance[at][c];
            let x_bar = |at: usize, c: usize| over(&|x| x[at][c]);
            let s2 = |at: usize, c: usize| over(&|x| (x[at][c] - x_bar(at, c)).powi(2)) * 9.0 / 8.0;
            let expected = [
                average(&x_bar),
                average(&s2),
                over(&|x| average(&|at, c| square(x, at, c))),
                average(&|at, c| (x_bar(at, c) - mean[at][c]).powi(2) - s2(at, c) / 9.0 - variance[at][c]),
                over(&|x| average(&|at, c| square(x, at, c) / (half[at][c].powi(2) + 0.01))),
                over(&|x| average(&|at, c| (x[at][c] - mean[at][c]).abs() / (x[at][c] + half[at][c]))),
            ];
            let found = [row.mean, row.variance, row.mse, row.bias2, row.relmse, row.smape];
            for (found, expected) in found.iter().zip(expected) {
                assert!((found.value - expected).abs() < 1e-12, "layer {layer}: {found:?} {expected}");
                let (low, high) = found.interval.unwrap();
                assert!(low < found.value && found.value < high, "{found:?}");
            }
        }
    }

    #[test]
    fn black_pixels_have_no_relative_error() {
        assert_eq!(symmetric(0.0, 0.0, 0.0), 0.0);
        assert_eq!(symmetric(-1e-3, 0.0, 0.0), 1.0);
        assert_eq!(symmetric(1.0, 2.0, 2.0), 0.25);
    }

    #[test]
    fn a_noisy_reference_widens_what_it_judges() {
        let cross = [0.01, -0.02, 0.015, 0.0, -0.01, 0.02, 0.005];
        let width = |shared: f64| bias2(&cross, shared).interval.map(|(low, high)| high - low).unwrap();
        assert!(width(0.1) > width(0.0));
        let squares = [1.0, 1.5, 0.7, 1.2, 0.9, 1.1, 1.3, 0.8];
        let ends = |shared: f64| widened(&squares, shared, 0).interval.unwrap();
        assert!(ends(0.3).0 < ends(0.0).0 && ends(0.3).1 > ends(0.0).1);
        assert_eq!(bias2(&cross[..6], 0.0).interval, None);
    }
}
