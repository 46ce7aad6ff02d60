//! Covariances between orders, with intervals, streamed replicate by replicate.
//!
//! Every replicate but the first adds `(r − 1)/r · (x_r − x̄_{r−1})(y_r − ȳ_{r−1})` for each pair of layers, image and channel mean: *recursive
//! products*, whose mean is exactly the sample covariance `[Welford62]`, as that of recursive squares is the variance. The variance of the
//! layers' sum is the sum of all entries of the matrix.

use super::means::{SKEWED_VALID_FROM, student_quantile, studentised, wider};
use super::positive::recursion;
use super::{Estimate, Interval};
use integrators::stored;
use rayon::prelude::*;
use sampling::moments::Moments;

/// Pixels that are looked at in one piece; pieces are added up in order.
const PIECE: usize = 1024;

/// Recursive products of all pairs of layers, one replicate at a time.
#[derive(Clone, Debug)]
pub struct Covariances {
    pixels: usize,
    layers: usize,
    count: usize,
    /// Mean image so far, `[pixel][layer]`.
    mean: Vec<[f64; 3]>,
    /// By pair, `i (i + 1) / 2 + j` for j ≤ i: one a replicate, from the second on.
    products: Vec<Vec<f64>>,
}

stored!(Covariances { pixels, layers, count, mean, products });

impl Covariances {
    /// No replicates yet of images with so many pixels and layers.
    pub fn new(pixels: usize, layers: usize) -> Self {
        let products = vec![Vec::new(); layers * (layers + 1) / 2];
        Self { pixels, layers, count: 0, mean: vec![[0.0; 3]; pixels * layers], products }
    }

    /// Adds a replicate's image, given by layer and pixel.
    pub fn push(&mut self, image: impl Fn(usize, usize) -> [f64; 3] + Sync) {
        self.count += 1;
        let (share, layers, pairs) = (1.0 / self.count as f64, self.layers, self.products.len());
        let pieces: Vec<Vec<f64>> = self
            .mean
            .par_chunks_mut(PIECE * layers)
            .enumerate()
            .map(|(piece, means)| {
                let (mut sums, mut deviations) = (vec![0.0; pairs], vec![[0.0; 3]; layers]);
                for (i, means) in means.chunks_mut(layers).enumerate() {
                    for (layer, (mean, deviation)) in means.iter_mut().zip(&mut deviations).enumerate() {
                        let value = image(layer, piece * PIECE + i);
                        for c in 0..3 {
                            deviation[c] = value[c] - mean[c];
                            mean[c] += deviation[c] * share;
                        }
                    }
                    add_products(&mut sums, &deviations);
                }
                sums
            })
            .collect();
        if self.count < 2 {
            return;
        }
        let scale = (1.0 - share) / (3 * self.pixels) as f64;
        let sum = |pair: usize| pieces.iter().map(|piece| piece[pair]).sum::<f64>();
        self.products.iter_mut().enumerate().for_each(|(pair, products)| products.push(sum(pair) * scale));
    }

    /// How many layers there are.
    pub fn layers(&self) -> usize {
        self.layers
    }

    /// What each replicate but the first adds to a layer's variance, see [`super::positive`].
    pub fn squares(&self, layer: usize) -> &[f64] {
        &self.products[layer * (layer + 1) / 2 + layer]
    }

    /// The same for the layers' sum: all entries of the matrix.
    pub fn squares_of_sum(&self) -> Vec<f64> {
        let mut sum = vec![0.0; self.count.saturating_sub(1)];
        let pairs = (0..self.layers).flat_map(|i| (0..=i).map(move |j| (i, j)));
        for ((i, j), products) in pairs.zip(&self.products) {
            let times = if i == j { 1.0 } else { 2.0 };
            sum.iter_mut().zip(products).for_each(|(sum, x)| *sum += times * x);
        }
        sum
    }

    /// The covariance of one replicate's pixels between two layers, image and channel mean, without its interval.
    pub fn value(&self, i: usize, j: usize) -> f64 {
        let (i, j) = (i.max(j), i.min(j));
        self.products[i * (i + 1) / 2 + j].iter().copied().collect::<Moments>().mean
    }

    /// The covariance of one replicate's pixels between two layers, image and channel mean.
    pub fn covariance(&self, i: usize, j: usize, salt: u64) -> Estimate {
        let (i, j) = (i.max(j), i.min(j));
        covariance(&self.products[i * (i + 1) / 2 + j], salt)
    }
}

/// Adds the products of one pixel's deviations.
#[inline]
fn add_products(sums: &mut [f64], deviations: &[[f64; 3]]) {
    let mut rest = sums;
    for (i, a) in deviations.iter().enumerate() {
        let (row, after) = rest.split_at_mut(i + 1);
        for (sum, b) in row.iter_mut().zip(deviations) {
            *sum += a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
        }
        rest = after;
    }
}

/// A covariance from recursive products, which may have either sign: to either side the wider of Student's interval and the studentised
/// bootstrap's, its standard error multiplied by [`recursion`].
pub fn covariance(products: &[f64], salt: u64) -> Estimate {
    let moments: Moments = products.iter().copied().collect();
    Estimate::new(moments.mean, interval(products, &moments, salt), products.len() + 1, SKEWED_VALID_FROM)
}

fn interval(products: &[f64], moments: &Moments, salt: u64) -> Option<Interval> {
    if moments.n < 2 {
        return None;
    }
    let error = recursion(products.len()) * moments.variance_of_mean().sqrt();
    let t = student_quantile(moments.n as f64 - 1.0);
    let (low, high) = studentised(products, moments.mean, salt);
    Some((moments.mean - error * wider(t, high), moments.mean + error * wider(t, -low)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::moments::CovarianceMoments;

    #[test]
    fn covariances_are_those_of_the_replicates() {
        let value = |r: usize, layer: usize, pixel: usize| ((r * 7 + layer * 3 + pixel * 5) as f64 * 12.9898).sin();
        let mut covariances = Covariances::new(4, 3);
        let mut expected = vec![CovarianceMoments::new(3); 4];
        for r in 0..9 {
            covariances.push(|layer, pixel| [value(r, layer, pixel); 3]);
            expected.iter_mut().enumerate().for_each(|(p, m)| m.push(&[0, 1, 2].map(|layer| value(r, layer, p))));
        }
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let expected = expected.iter().map(|m| m.covariance(i, j)).sum::<f64>() / 4.0;
            let found = covariances.covariance(i, j, 0);
            assert!((found.value - expected).abs() < 1e-12, "({i}, {j}): {found:?} {expected}");
            let (low, high) = found.interval.unwrap();
            assert!(low < expected && expected < high);
        }
        let total = covariances.squares_of_sum().iter().sum::<f64>() / 8.0;
        let all: f64 = (0..9).map(|n| covariances.covariance(n / 3, n % 3, 0).value).sum();
        assert!((total - all).abs() < 1e-12 && covariances.squares(2).len() == 8);
        assert_eq!(covariance(&[1.0; 5], 0).interval, None);
        assert_eq!(covariance(&[0.0; 9], 0).interval, Some((0.0, 0.0)));
    }
}
