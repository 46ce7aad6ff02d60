//! Covariances between orders, with intervals, streamed replicate by replicate.
//!
//! Every replicate but the first adds `(r − 1)/r · (x_r − x̄_{r−1})(y_r − ȳ_{r−1})` for each pair of layers, image and channel mean: *recursive
//! products*, whose mean is exactly the sample covariance `[Welford62]`, as that of recursive squares is the variance. The variance of the
//! layers' sum is the sum of all entries of the matrix.
//!
//! After the first [`ONE_BY_ONE`] replicates whole groups may be added, each by the sum of what its replicates add, which follows from moments: their
//! own products, and those of the distance between their mean and the mean of all before. What intervals rest on are groups then, of all
//! replicates ([`super::groups`]).

use super::groups;
use super::means::{SKEWED_VALID_FROM, student_quantile, studentised, wider};
use super::positive::recursion;
use super::{Estimate, Interval};
use crate::observations::ONE_BY_ONE;
use integrators::state::Stored;
use integrators::statistics::PIECE;
use rayon::prelude::*;
use sampling::moments::Moments;
use std::borrow::Cow;
use std::io::{self, Read, Write};
use std::ops::Range;

/// Pixels whose means lie together. Allocators give memory of a megabyte or so back to the system when it is freed; that of one piece they keep, and
/// what has freed a whole image they take for a program that will want as much again.
const PART: usize = 4 * PIECE;

/// Recursive products of all pairs of layers, one replicate at a time.
#[derive(Clone, Debug)]
pub struct Covariances {
    pixels: usize,
    layers: usize,
    count: usize,
    /// Mean image so far, `[pixel][layer]`, in parts of [`PART`] pixels; none once there are groups.
    mean: Vec<Vec<[f64; 3]>>,
    /// By pair, `i (i + 1) / 2 + j` for j ≤ i: one a replicate, from the second on, and then perhaps one a group.
    products: Vec<Vec<f64>>,
}

impl Stored for Covariances {
    fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        [self.pixels, self.layers, self.count].iter().try_for_each(|number| number.write(to))?;
        self.mean.iter().map(Vec::len).sum::<usize>().write(to)?;
        self.mean.iter().flatten().try_for_each(|mean| mean.write(to))?;
        self.products.write(to)
    }

    fn read(from: &mut dyn Read) -> io::Result<Self> {
        let [pixels, layers, count, mut left] = <[usize; 4]>::read(from)?;
        let mut mean = Vec::new();
        while left > 0 {
            let part = left.min(PART * layers.max(1));
            mean.push((0..part).map(|_| <[f64; 3]>::read(from)).collect::<io::Result<_>>()?);
            left -= part;
        }
        Ok(Self { pixels, layers, count, mean, products: Vec::read(from)? })
    }
}

impl Covariances {
    /// No replicates yet of images with so many pixels and layers.
    pub fn new(pixels: usize, layers: usize) -> Self {
        let products = vec![Vec::new(); layers * (layers + 1) / 2];
        let parts = (0..pixels).step_by(PART).map(|first| PART.min(pixels - first));
        let mean = parts.map(|pixels| vec![[0.0; 3]; pixels * layers]).collect();
        Self { pixels, layers, count: 0, mean, products }
    }

    /// Adds a replicate's image, given by layer and pixel.
    pub fn push(&mut self, image: impl Fn(usize, usize) -> [f64; 3] + Sync) {
        let added = self.push_pixels(0..self.pixels, 1, |_, layer, pixel| image(layer, pixel));
        self.count_in(1, &added);
    }

    /// Adds some pixels of the images of so many replicates, given by replicate, layer and pixel. They follow those that were added before, and
    /// are a multiple of [`PIECE`], except at the end; no group has been added yet. Returns what [`Self::count_in`] is to be told, by piece, replicate and pair.
    pub fn push_pixels(
        &mut self,
        pixels: Range<usize>,
        replicates: usize,
        image: impl Fn(usize, usize, usize) -> [f64; 3] + Sync,
    ) -> Vec<Vec<Vec<f64>>> {
        assert!(!self.in_groups(), "single replicates come before groups");
        let (count, layers, pairs) = (self.count, self.layers, self.products.len());
        let piece = |(piece, means): (usize, &mut [[f64; 3]])| {
            let first = pixels.start + piece * PIECE;
            let of_replicate = |replicate: usize| {
                let share = 1.0 / (count + replicate + 1) as f64;
                let (mut sums, mut deviations) = (vec![0.0; pairs], vec![[0.0; 3]; layers]);
                for (i, means) in means.chunks_mut(layers).enumerate() {
                    for (layer, (mean, deviation)) in means.iter_mut().zip(&mut deviations).enumerate() {
                        let value = image(replicate, layer, first + i);
                        for c in 0..3 {
                            deviation[c] = value[c] - mean[c];
                            mean[c] += deviation[c] * share;
                        }
                    }
                    add_products(&mut sums, &deviations);
                }
                sums
            };
            (0..replicates).map(of_replicate).collect()
        };
        let pieces = self.mean.iter_mut().flat_map(|part| part.chunks_mut(PIECE * layers));
        let pieces: Vec<_> = pieces.skip(pixels.start / PIECE).take(pixels.len().div_ceil(PIECE)).collect();
        pieces.into_par_iter().enumerate().map(piece).collect()
    }

    /// Ends the addition of so many replicates, whose pixels have all been added.
    pub fn count_in(&mut self, replicates: usize, added: &[Vec<Vec<f64>>]) {
        for replicate in 0..replicates {
            self.count += 1;
            if self.count < 2 {
                continue;
            }
            let scale = (1.0 - 1.0 / self.count as f64) / (3 * self.pixels) as f64;
            let sum = |pair: usize| added.iter().map(|piece| piece[replicate][pair]).sum::<f64>();
            self.products.iter_mut().enumerate().for_each(|(pair, products)| products.push(sum(pair) * scale));
        }
    }

    /// Adds a group of so many replicates after the first [`ONE_BY_ONE`], by what it adds to the sums over pixels of products, as
    /// [`Render::last_group`](integrators::Render::last_group) tells it.
    pub fn push_group(&mut self, replicates: usize, sums: &[[f64; 3]]) {
        assert!(self.count >= ONE_BY_ONE as usize, "groups come after single replicates");
        self.count += replicates;
        // No single replicate comes after a group.
        self.mean = Vec::new();
        let (n, layers) = ((3 * self.pixels) as f64, self.layers);
        let pairs = (0..layers).flat_map(|i| (0..=i).map(move |j| i * layers + j));
        pairs.zip(&mut self.products).for_each(|(at, products)| products.push(sums[at].iter().sum::<f64>() / n));
    }

    /// How many layers there are.
    pub fn layers(&self) -> usize {
        self.layers
    }

    /// Replicates seen.
    pub fn replicates(&self) -> usize {
        self.count
    }

    /// Whether the last of them were added in groups.
    fn in_groups(&self) -> bool {
        self.products.first().is_some_and(|products| products.len() + 1 < self.count)
    }

    /// What intervals rest on, of one value for every replicate but the first and, perhaps, for every group then.
    fn of_equal_standing<'a>(&self, values: &'a [f64]) -> Cow<'a, [f64]> {
        if !self.in_groups() {
            return Cow::Borrowed(values);
        }
        let (single, whole) = values.split_at(ONE_BY_ONE as usize - 1);
        Cow::Owned(groups::of_equal_standing(groups::sums(single).chain(whole.iter().copied()), self.count))
    }

    /// Values of every replicate but the first, such as their seconds, in the form in which [`Self::squares`] are.
    pub fn beside(&self, values: &[f64]) -> Vec<f64> {
        match self.in_groups() {
            true => groups::of_equal_standing(groups::sums(values), self.count),
            false => values.to_vec(),
        }
    }

    /// What each replicate but the first, or each group, adds to a layer's variance, see [`super::positive`].
    pub fn squares(&self, layer: usize) -> Cow<'_, [f64]> {
        self.of_equal_standing(&self.products[layer * (layer + 1) / 2 + layer])
    }

    /// The same for the layers' sum: all entries of the matrix.
    pub fn squares_of_sum(&self) -> Vec<f64> {
        self.squares_over(&(0..self.layers).collect::<Vec<_>>())
    }

    /// The same for the sum of some layers, which rise.
    pub fn squares_over(&self, layers: &[usize]) -> Vec<f64> {
        let mut sum = vec![0.0; self.products.first().map_or(0, Vec::len)];
        for (place, i) in layers.iter().enumerate() {
            for j in &layers[..=place] {
                let times = if i == j { 1.0 } else { 2.0 };
                let products = &self.products[i * (i + 1) / 2 + j];
                sum.iter_mut().zip(products).for_each(|(sum, x)| *sum += times * x);
            }
        }
        self.of_equal_standing(&sum).into_owned()
    }

    /// The covariance of one replicate's pixels between two layers, image and channel mean, without its interval.
    pub fn value(&self, i: usize, j: usize) -> f64 {
        self.of_pair(i, j).iter().copied().collect::<Moments>().mean
    }

    /// The covariance of one replicate's pixels between two layers, image and channel mean.
    pub fn covariance(&self, i: usize, j: usize, salt: u64) -> Estimate {
        covariance(&self.of_pair(i, j), salt)
    }

    fn of_pair(&self, i: usize, j: usize) -> Cow<'_, [f64]> {
        let (i, j) = (i.max(j), i.min(j));
        self.of_equal_standing(&self.products[i * (i + 1) / 2 + j])
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
    fn replicates_side_by_side_have_the_products_of_one_after_the_other() {
        const PIXELS: usize = PART + PIECE + 5;
        let value = |r: usize, layer: usize, pixel: usize| [((r * 7 + layer * 3 + pixel * 5) as f64).sin(); 3];
        let [mut in_turn, mut at_once] = [0, 1].map(|_| Covariances::new(PIXELS, 2));
        (0..5).for_each(|r| in_turn.push(|layer, pixel| value(r, layer, pixel)));
        for replicates in [0..3, 3..5] {
            let image = |r: usize, layer: usize, pixel: usize| value(replicates.start + r, layer, pixel);
            let mut added = at_once.push_pixels(0..PART - PIECE, replicates.len(), image);
            added.extend(at_once.push_pixels(PART - PIECE..PIXELS, replicates.len(), image));
            at_once.count_in(replicates.len(), &added);
        }
        assert_eq!((in_turn.products, in_turn.mean), (at_once.products, at_once.mean));
    }

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
        let two = covariances.squares_over(&[0, 2]).iter().sum::<f64>() / 8.0;
        let [own, other, both] = [(0, 0), (2, 2), (0, 2)].map(|(i, j)| covariances.value(i, j));
        assert!((two - (own + other + 2.0 * both)).abs() < 1e-12);
        assert_eq!(covariance(&[1.0; 5], 0).interval, None);
        assert_eq!(covariance(&[0.0; 9], 0).interval, Some((0.0, 0.0)));
    }
}
