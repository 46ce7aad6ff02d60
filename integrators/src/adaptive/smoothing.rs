//! Averages over neighbouring pixels.

use rayon::prelude::*;
use std::ops::Range;

/// Pixels in a row, and rows.
pub type Size = (usize, usize);

/// A Gaussian filter, cut off at two standard deviations.
pub struct Smoothing {
    /// The weight of what is so many pixels away.
    weights: Vec<f64>,
}

impl Smoothing {
    /// Of a standard deviation \[pixels\].
    pub fn new(deviation: f64) -> Self {
        let weight = |d: usize| (-0.5 * (d as f64 / deviation).powi(2)).exp();
        Self { weights: (0..=(2.0 * deviation).ceil() as usize).map(weight).collect() }
    }

    /// The pixels that are in a pixel's average along a row or column of so many.
    fn reach(&self, at: usize, length: usize) -> Range<usize> {
        let reach = self.weights.len();
        (at + 1).saturating_sub(reach)..(at + reach).min(length)
    }

    /// The weights of all those.
    fn total(&self, at: usize, length: usize) -> f64 {
        self.reach(at, length).map(|other| self.weights[at.abs_diff(other)]).sum()
    }

    /// Averages over the neighbours of every pixel, and itself.
    pub fn smoothed<const N: usize>(&self, image: &[[f64; N]], (width, height): Size) -> Vec<[f64; N]> {
        self.along(&self.along(image, width, 1), height, width)
    }

    /// The same in one direction, in which an image has so many pixels, `step` apart.
    fn along<const N: usize>(&self, image: &[[f64; N]], length: usize, step: usize) -> Vec<[f64; N]> {
        let average = |pixel: usize| {
            let at = pixel / step % length;
            let mut sum = [0.0; N];
            for other in self.reach(at, length) {
                let weight = self.weights[at.abs_diff(other)];
                let value = &image[pixel + other * step - at * step];
                sum.iter_mut().zip(value).for_each(|(sum, x)| *sum += weight * x);
            }
            let total = self.total(at, length);
            sum.map(|sum| sum / total)
        };
        (0..image.len()).into_par_iter().map(average).collect()
    }

    /// Averages over the neighbours of every pixel without itself.
    pub fn of_others(&self, image: &[[f64; 1]], smoothed: &[[f64; 1]], (width, height): Size) -> Vec<[f64; 1]> {
        let other = |pixel: usize| {
            let own = 1.0 / (self.total(pixel % width, width) * self.total(pixel / width, height));
            // Of one pixel alone nothing is left.
            [((smoothed[pixel][0] - own * image[pixel][0]) / (1.0 - own)).max(0.0)]
        };
        (0..image.len()).into_par_iter().map(other).collect()
    }
}
