//! Moments over replicates, held in groups.
//!
//! Replicates are added in order to the group at work; a full group is merged into the whole. Any division of replicates
//! into runs of whole groups therefore gives the same bits as one run. Per pixel, layer and channel there are five numbers
//! (the sum of the replicate at work, and mean and squared deviations of the group and of the whole): 120 bytes for three channels.

use crate::film::Film;
use crate::stored;
use rayon::prelude::*;
use sampling::fault;
use std::io::{self, Read};

mod block_grid;
pub mod side_by_side;

pub use block_grid::{BLOCK_GRID, BlockGrid};

/// Replicates in a group.
pub const GROUP: u32 = 8;
/// The most layers for which the matrix of covariances is kept; beyond, only the total's variance is.
pub const MAX_COVARIANCE_LAYERS: usize = 128;
/// Pixels whose cross products are added up in one piece; pieces are added in order.
pub const PIECE: usize = 1024;

/// Count, means, squared deviations and their cross products between layers.
#[derive(Clone, Debug)]
pub struct ImageMoments {
    /// Number of replicates.
    pub count: u32,
    /// Means, `[pixel][layer][channel]`.
    pub mean: Vec<f64>,
    /// Sums of squared deviations, `[pixel][layer][channel]`.
    pub m2: Vec<f64>,
    /// Sums over pixels of products of deviations of the layers that make up the image, `[i · series + j]` for `j ≤ i`; the last entry
    /// is that of their sum.
    pub products: Vec<[f64; 3]>,
    layers: usize,
    series: usize,
}

stored!(ImageMoments { count, mean, m2, products, layers, series });

impl ImageMoments {
    /// No replicates yet, of an image of so many layers, of which the first `series` make up the image. Of no pixels, it takes those of the first
    /// replicate that is pushed.
    pub fn new(pixels: usize, layers: usize, series: usize) -> Self {
        let matrix = if series <= MAX_COVARIANCE_LAYERS { series * series } else { 0 };
        Self {
            count: 0,
            mean: vec![0.0; pixels * layers * 3],
            m2: vec![0.0; pixels * layers * 3],
            products: vec![[0.0; 3]; matrix + 1],
            layers,
            series,
        }
    }

    /// Layers of the image, those that it is taken apart into included.
    pub fn layers(&self) -> usize {
        self.layers
    }

    /// Whether these are moments of images of the same pixels and layers.
    pub fn is_like(&self, other: &Self) -> bool {
        self.has_layers_of(other) && [self.mean.len(), self.m2.len()] == [other.mean.len(), other.m2.len()]
    }

    /// Whether these are moments of images of the same layers.
    pub fn has_layers_of(&self, other: &Self) -> bool {
        let lengths = |m: &Self| [m.layers, m.series, m.products.len()];
        lengths(self) == lengths(other)
    }

    /// Forgets all replicates.
    pub fn clear(&mut self) {
        self.count = 0;
        let piece = PIECE * self.layers * 3;
        self.mean.par_chunks_mut(piece).zip(self.m2.par_chunks_mut(piece)).for_each(|(mean, m2)| {
            mean.fill(0.0);
            m2.fill(0.0);
        });
        self.products.fill([0.0; 3]);
    }

    /// Adds a replicate whose image is the film's sums divided by `samples` \[Welford62\]. Returns the layers' image means.
    pub fn push(&mut self, film: &Film, samples: u32) -> Vec<[f64; 3]> {
        if self.mean.is_empty() {
            (self.mean, self.m2) = (vec![0.0; film.sums.len()], vec![0.0; film.sums.len()]);
        }
        self.count += 1;
        let (n, scale) = (self.count as f64, 1.0 / samples as f64);
        let (layers, stride, pixels) = (self.layers, self.layers * 3, self.mean.len() / (self.layers * 3));
        let entries = self.products.len();
        let pieces: Vec<_> = self
            .mean
            .par_chunks_mut(PIECE * stride)
            .zip(self.m2.par_chunks_mut(PIECE * stride))
            .zip(film.sums.par_chunks(PIECE * stride))
            .map(|((mean, m2), sums)| {
                let mut piece = Piece::new(layers, self.series, entries);
                piece.push((mean, m2), sums, (n, scale));
                piece
            })
            .collect();
        add_pieces(&pieces, pixels, &mut self.products)
    }

    /// Adds all replicates of another set \[Chan83\]. Returns what that adds to the products: those of the other set, and those of the
    /// distance between the two means.
    pub fn merge(&mut self, other: &Self) -> Vec<[f64; 3]> {
        let mut added = other.products.clone();
        if other.count > 0 {
            self.move_means(0, other.count, &other.mean, &mut added);
            add_numbers(&mut self.m2, &other.m2);
            self.count_in(other.count, &added);
        }
        added
    }

    /// The same for a set of so many replicates with such products whose means, and then squared deviations, follow as bytes
    /// (little-endian); few are in memory at once.
    ///
    /// # Errors
    /// If they cannot be read; some of them have been added then.
    pub fn merge_from(&mut self, count: u32, products: &[[f64; 3]], from: &mut dyn Read) -> io::Result<Vec<[f64; 3]>> {
        let mut added = products.to_vec();
        let length = self.mean.len();
        let at_once = 2 * rayon::current_num_threads() * PIECE * self.layers * 3;
        let mut numbers = vec![[0; 8]; at_once.min(length)];
        for first in (0..length).step_by(at_once) {
            let means = &mut numbers[..at_once.min(length - first)];
            from.read_exact(means.as_flattened_mut())?;
            self.move_means(first, count, means, &mut added);
        }
        for m2 in self.m2.chunks_mut(at_once) {
            let others = &mut numbers[..m2.len()];
            from.read_exact(others.as_flattened_mut())?;
            add_numbers(m2, others);
        }
        self.count_in(count, &added);
        Ok(added)
    }

    /// Moves some of the means, from the first pixel of a piece on, to those of both sets, and adds what follows from the distance between
    /// the two to squared deviations and to `products`.
    fn move_means<N: Number>(&mut self, first: usize, count: u32, others: &[N], products: &mut [[f64; 3]]) {
        let (share, factor) = self.weights_of(count);
        let (layers, stride, entries) = (self.layers, self.layers * 3, self.products.len());
        let range = first..first + others.len();
        let pieces: Vec<_> = self.mean[range.clone()]
            .par_chunks_mut(PIECE * stride)
            .zip(self.m2[range].par_chunks_mut(PIECE * stride))
            .zip(others.par_chunks(PIECE * stride))
            .map(|((mean, m2), others)| {
                let mut piece = Piece::new(layers, self.series, entries);
                piece.move_means((mean, m2), others, (share, factor));
                piece.products
            })
            .collect();
        pieces.iter().for_each(|piece| add(products, piece));
    }

    /// By which part of their distance means move when so many replicates are added, and what its square counts for.
    fn weights_of(&self, count: u32) -> (f64, f64) {
        let (a, b) = (self.count as f64, count as f64);
        (b / (a + b), a * b / (a + b))
    }

    /// Ends the merge with a set of so many replicates that adds this to the products.
    fn count_in(&mut self, count: u32, added: &[[f64; 3]]) {
        add(&mut self.products, added);
        self.count += count;
    }
}

/// An `f64`, or the bytes of one, little-endian.
trait Number: Sync {
    /// The number.
    fn value(&self) -> f64;
}

impl Number for f64 {
    #[inline]
    fn value(&self) -> f64 {
        *self
    }
}

impl Number for [u8; 8] {
    #[inline]
    fn value(&self) -> f64 {
        f64::from_le_bytes(*self)
    }
}

/// Adds numbers to as many sums.
fn add_numbers<N: Number>(sums: &mut [f64], numbers: &[N]) {
    sums.par_chunks_mut(PIECE).zip(numbers.par_chunks(PIECE)).for_each(|(sums, numbers)| {
        sums.iter_mut().zip(numbers).for_each(|(sum, number)| *sum += number.value());
    });
}

fn add(sum: &mut [[f64; 3]], other: &[[f64; 3]]) {
    sum.iter_mut().zip(other).for_each(|(s, o)| (0..3).for_each(|c| s[c] += o[c]));
}

/// Adds up what the pieces of a replicate add to the products. Returns the layers' means over so many pixels.
fn add_pieces<'p>(
    pieces: impl IntoIterator<Item = &'p Piece>,
    pixels: usize,
    products: &mut [[f64; 3]],
) -> Vec<[f64; 3]> {
    let mut means = Vec::new();
    for piece in pieces {
        means.resize(piece.sums.len() / 3, [0.0; 3]);
        piece.sums.iter().enumerate().for_each(|(i, sum)| means[i / 3][i % 3] += sum / pixels as f64);
        add(products, &piece.products);
    }
    means
}

/// Partial sums over a run of pixels.
struct Piece {
    /// The layers that make up the image: the first ones.
    series: usize,
    before: Vec<f64>,
    after: Vec<f64>,
    sums: Vec<f64>,
    products: Vec<[f64; 3]>,
}

impl Piece {
    fn new(layers: usize, series: usize, entries: usize) -> Self {
        let stride = layers * 3;
        Self {
            series,
            before: vec![0.0; stride],
            after: vec![0.0; stride],
            sums: vec![0.0; stride],
            products: vec![[0.0; 3]; entries],
        }
    }

    /// Without what it is worked out in, for those that are kept.
    fn kept(self) -> Self {
        Self { before: Vec::new(), after: Vec::new(), ..self }
    }

    /// Adds replicate number `n` of some pixels, sums times `scale`, to their moments \[Welford62\].
    fn push<N: Number>(&mut self, (mean, m2): (&mut [f64], &mut [f64]), sums: &[N], (n, scale): (f64, f64)) {
        let stride = self.sums.len();
        for ((mean, m2), sums) in mean.chunks_mut(stride).zip(m2.chunks_mut(stride)).zip(sums.chunks(stride)) {
            for i in 0..stride {
                let x = sums[i].value() * scale;
                let before = x - mean[i];
                mean[i] += before / n;
                let after = x - mean[i];
                m2[i] += before * after;
                self.before[i] = before;
                self.after[i] = after;
                self.sums[i] += x;
            }
            self.add_products();
        }
    }

    /// Moves the means of some pixels to those of both sets.
    fn move_means<N: Number>(
        &mut self,
        (mean, m2): (&mut [f64], &mut [f64]),
        others: &[N],
        (share, factor): (f64, f64),
    ) {
        let stride = self.sums.len();
        let pixels = mean.chunks_exact_mut(stride).zip(m2.chunks_exact_mut(stride));
        for ((mean, m2), others) in pixels.zip(others.chunks_exact(stride)) {
            for (i, ((mean, m2), other)) in mean.iter_mut().zip(m2).zip(others).enumerate() {
                let delta = other.value() - *mean;
                *mean += delta * share;
                *m2 += delta * delta * factor;
                self.before[i] = delta;
                self.after[i] = delta * factor;
            }
            self.add_products();
        }
    }

    /// Adds the products of one pixel's deviations, before and after its means moved.
    #[inline]
    fn add_products(&mut self) {
        let entries = self.products.len();
        let (matrix, total) = self.products.split_at_mut(entries - 1);
        if !matrix.is_empty() {
            for i in 0..self.series {
                let row = &mut matrix[i * self.series..i * self.series + i + 1];
                let before = [self.before[i * 3], self.before[i * 3 + 1], self.before[i * 3 + 2]];
                for (entry, after) in row.iter_mut().zip(self.after.chunks_exact(3)) {
                    (0..3).for_each(|c| entry[c] += before[c] * after[c]);
                }
            }
        }
        let (before, after) = (&self.before[..self.series * 3], &self.after[..self.series * 3]);
        for (c, total) in total[0].iter_mut().enumerate() {
            let sum = |deviations: &[f64]| deviations.iter().skip(c).step_by(3).sum::<f64>();

            *total += fault!("covariance_dropped", sum(before) * sum(after), diagonal(before, after, c));
        }
    }
}

/// The products of a channel's deviations within each layer.
#[cfg(mutate)]
fn diagonal(before: &[f64], after: &[f64], channel: usize) -> f64 {
    before.iter().zip(after).skip(channel).step_by(3).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAYERS: usize = 3;
    const PIXELS: usize = 5;

    fn films(count: u32) -> Vec<Film> {
        let value = |i: usize, r: u32| ((i as f64 * 12.9898 + r as f64 * 78.233).sin() * 43758.5453).fract() + 2.0;
        (0..count)
            .map(|r| {
                let mut film = Film::new(PIXELS as u32, 1, LAYERS);
                film.sums.iter_mut().enumerate().for_each(|(i, s)| *s = 4.0 * value(i, r));
                film
            })
            .collect()
    }

    fn moments(films: &[Film]) -> ImageMoments {
        let mut moments = ImageMoments::new(PIXELS, LAYERS, LAYERS);
        films.iter().for_each(|f| {
            moments.push(f, 4);
        });
        moments
    }

    #[test]
    fn products_are_those_of_two_passes_and_the_total_is_the_sum_of_all_entries() {
        let films = films(7);
        let m = moments(&films);
        let mean = |i: usize| films.iter().map(|f| f.sums[i] / 4.0).sum::<f64>() / 7.0;
        let mut total = [0.0; 3];
        for (i, j, c) in (0..LAYERS).flat_map(|i| (0..LAYERS).flat_map(move |j| (0..3).map(move |c| (i, j, c)))) {
            let mut expected = 0.0;
            for p in 0..PIXELS {
                let (a, b) = ((p * LAYERS + i) * 3 + c, (p * LAYERS + j) * 3 + c);
                expected +=
                    films.iter().map(|f| (f.sums[a] / 4.0 - mean(a)) * (f.sums[b] / 4.0 - mean(b))).sum::<f64>();
            }
            if j <= i {
                assert!((m.products[i * LAYERS + j][c] - expected).abs() < 1e-12);
            }
            total[c] += expected;
        }
        (0..3).for_each(|c| assert!((m.products[LAYERS * LAYERS][c] - total[c]).abs() < 1e-12));
    }

    #[test]
    fn merging_groups_equals_one_long_run_to_rounding() {
        let films = films(11);
        let (long, mut merged) = (moments(&films), moments(&films[..8]));
        let before = merged.products.clone();
        let added = merged.merge(&moments(&films[8..]));
        assert_eq!(merged.count, long.count);
        let grown = |i: usize| (0..3).all(|c| (merged.products[i][c] - before[i][c] - added[i][c]).abs() < 1e-12);
        assert!((0..before.len()).all(grown));
        let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
        assert!(close(&merged.mean, &long.mean) && close(&merged.m2, &long.m2));
        assert!(close(merged.products.as_flattened(), long.products.as_flattened()));
    }
}
