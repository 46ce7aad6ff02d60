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
//! That of bias² is told in [`super::bias`].

use super::bias::{bias2, no_bias};
use super::means::{self, NORMAL_QUANTILE, skewed_mean, skewed_reach};
use super::{Estimate, positive};
use crate::metrics::RELATIVE_FLOOR;
use integrators::stored;
use rayon::prelude::*;
use sampling::fault;

/// Pixels that are looked at in one piece; pieces are added up in order, so that sums have the same bits for any number of threads.
const PIECE: usize = 1024;

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

/// Errors of a method's replicates, one replicate at a time, all against the same reference.
#[derive(Clone, Debug)]
pub struct Errors {
    pixels: usize,
    /// Layers, without their sum.
    layers: usize,
    count: usize,
    /// Mean image so far, `[pixel][layer]`, sums last.
    mean: Vec<[f64; 3]>,
    /// By layer, the sum last.
    rows: Vec<Replicates>,
}

stored!(Errors { pixels, layers, count, mean, rows });

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
    /// Both with the weights of the relative error.
    relative_cross: Vec<f64>,
    relative_recursive: Vec<f64>,
}

stored!(Replicates { mean, square, relative, symmetric, cross, recursive, relative_cross, relative_recursive });

/// What one replicate adds to the sums over a layer's pixels.
#[derive(Clone, Copy, Default)]
struct Sums {
    mean: f64,
    square: f64,
    relative: f64,
    symmetric: f64,
    cross: f64,
    recursive: f64,
    relative_cross: f64,
    relative_recursive: f64,
}

impl Sums {
    /// Adds a channel of a pixel, of which the mean so far is moved on by `share`, one over the replicates.
    #[inline]
    fn add(&mut self, share: f64, value: f64, mean: &mut f64, [reference, half, noise]: [f64; 3]) {
        let weight = 1.0 / (fault!("relative_error_over_the_mean", half * half, half) + RELATIVE_FLOOR);
        let error = value - reference;
        let noise = fault!("noise_of_the_reference_ignored", noise, 0.0);
        let (square, cross) = (error * error - noise, error * (*mean - reference) - noise);
        let deviation = value - *mean;
        let recursive = deviation * deviation * (1.0 - share);
        self.mean += value;
        self.square += square;
        self.relative += square * weight;
        self.symmetric += symmetric(error, value, half);
        self.cross += cross;
        self.recursive += recursive;
        self.relative_cross += cross * weight;
        self.relative_recursive += recursive * weight;
        *mean += deviation * share;
    }

    fn merge(&mut self, other: &Self) {
        self.mean += other.mean;
        self.square += other.square;
        self.relative += other.relative;
        self.symmetric += other.symmetric;
        self.cross += other.cross;
        self.recursive += other.recursive;
        self.relative_cross += other.relative_cross;
        self.relative_recursive += other.relative_recursive;
    }
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
    /// The p-value of the test that there is none; `None` for too few replicates.
    pub no_bias: Option<f64>,
    /// Relative mean squared error of one replicate.
    pub relmse: Estimate,
    /// The part of it that does not fall with more samples.
    pub relbias2: Estimate,
    /// Symmetric mean absolute percentage error of one replicate, between 0 and about 1.
    pub smape: Estimate,
}

impl Errors {
    /// No replicates yet of images with so many pixels and layers.
    pub fn new(pixels: usize, layers: usize) -> Self {
        let mean = vec![[0.0; 3]; pixels * (layers + 1)];
        Self { pixels, layers, count: 0, mean, rows: vec![Replicates::default(); layers + 1] }
    }

    /// Adds a replicate's image, given by layer and pixel.
    pub fn push(&mut self, reference: Reference, image: impl Fn(usize, usize) -> [f64; 3] + Sync) {
        let images = [reference.mean, reference.half, reference.variance];
        assert!(images.iter().all(|image| image.len() == self.mean.len()), "a reference of all layers and their sum");
        self.count += 1;
        let (share, layers, stride) = (1.0 / self.count as f64, self.layers, self.layers + 1);
        let pieces: Vec<Vec<Sums>> = self
            .mean
            .par_chunks_mut(PIECE * stride)
            .enumerate()
            .map(|(piece, means)| {
                let mut sums = vec![Sums::default(); stride];
                for (i, mean) in means.chunks_mut(stride).enumerate() {
                    let (pixel, mut total) = (piece * PIECE + i, [0.0; 3]);
                    let [first, second, noise] = images.map(|image| &image[pixel * stride..][..stride]);
                    for (layer, (mean, sum)) in mean.iter_mut().zip(&mut sums).enumerate() {
                        let value = if layer < layers { image(layer, pixel) } else { total };
                        for c in 0..3 {
                            total[c] += value[c];
                            let reference = [first[layer][c], second[layer][c], noise[layer][c]];
                            sum.add(share, value[c], &mut mean[c], reference);
                        }
                    }
                }
                sums
            })
            .collect();
        let mut sums = vec![Sums::default(); layers + 1];
        pieces.iter().for_each(|piece| sums.iter_mut().zip(piece).for_each(|(sum, part)| sum.merge(part)));
        self.note(&sums);
    }

    fn note(&mut self, sums: &[Sums]) {
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
                row.relative_cross.push(sum.relative_cross / n);
                row.relative_recursive.push(sum.relative_recursive / n);
            }
        }
    }

    /// Replicates seen.
    pub fn replicates(&self) -> usize {
        self.count
    }

    /// What each replicate but the first adds to a layer's variance, see [`super::positive`]; the layers' sum is the last layer.
    pub fn recursive_squares(&self, layer: usize) -> &[f64] {
        &self.rows[layer].recursive
    }

    /// The same with the weights of the relative error.
    pub fn relative_squares(&self, layer: usize) -> &[f64] {
        &self.rows[layer].relative_recursive
    }

    /// The errors of every layer, and of their sum last.
    pub fn finish(&self, reference: Reference, salt: u64) -> Vec<LayerErrors> {
        let layer = |(layer, row): (usize, &Replicates)| {
            let (shared, shared_relative) = self.shared_errors(reference, layer);
            let salt = salt << 16 | layer as u64;
            LayerErrors {
                mean: means::mean(&row.mean),
                variance: positive::variance(&row.recursive, salt),
                mse: widened(&row.square, shared, salt),
                bias2: bias2(&row.cross, shared),
                no_bias: no_bias(&row.cross, shared),
                relmse: widened(&row.relative, shared_relative, salt),
                relbias2: bias2(&row.relative_cross, shared_relative),
                smape: skewed_mean(&row.symmetric, salt),
            }
        };
        self.rows.iter().enumerate().map(layer).collect()
    }

    /// Standard error that the reference gives to MSE, and to relMSE.
    fn shared_errors(&self, reference: Reference, layer: usize) -> (f64, f64) {
        let (mut plain, mut relative) = (0.0, 0.0);
        for at in (layer..self.mean.len()).step_by(self.layers + 1) {
            let (mut noise, mut cross) = ([0.0; 2], [0.0; 2]);
            for c in 0..3 {
                let half = reference.half[at][c];
                let weights = [1.0, 1.0 / (half * half + RELATIVE_FLOOR)];
                let v = reference.variance[at][c].max(0.0);
                let bias = (self.mean[at][c] - reference.mean[at][c]).abs();
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
        (false, false) => fault!("signs_of_errors_kept", error.abs(), error) / denominator,
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
        let reference = Reference { mean: &mean, half: &half, variance: &variance };
        let mut errors = Errors::new(PIXELS, 2);
        let images: Vec<Vec<[f64; 3]>> = (0..9).map(|r| image(|layer, p, c| value(r, layer, p, c))).collect();
        images.iter().for_each(|x| errors.push(reference, |layer, pixel| x[pixel * 3 + layer]));
        for (layer, row) in errors.finish(reference, 0).into_iter().enumerate() {
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
                average(&|at, c| {
                    ((x_bar(at, c) - mean[at][c]).powi(2) - s2(at, c) / 9.0 - variance[at][c])
                        / (half[at][c].powi(2) + 0.01)
                }),
                over(&|x| average(&|at, c| (x[at][c] - mean[at][c]).abs() / (x[at][c] + half[at][c]))),
            ];
            let found = [row.mean, row.variance, row.mse, row.bias2, row.relmse, row.relbias2, row.smape];
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
        let squares = [1.0, 1.5, 0.7, 1.2, 0.9, 1.1, 1.3, 0.8];
        let ends = |shared: f64| widened(&squares, shared, 0).interval.unwrap();
        assert!(ends(0.3).0 < ends(0.0).0 && ends(0.3).1 > ends(0.0).1);
    }
}
