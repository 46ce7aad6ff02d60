//! The replicates of a group side by side: a few pixels of all of them at once, added to the whole, so that no more of the group, and of no
//! replicate more, is in memory. Sums have the bits of a group whose replicates are added one after the other and that is merged then.

use super::{BlockGrid, ImageMoments, PIECE, Piece, add, add_numbers, add_pieces};
use crate::film::Film;
use crate::tally::Tally;
use rayon::prelude::*;
use std::io::{self, Read};
use std::ops::Range;

/// Successive pixels of all replicates of a group, a multiple of [`PIECE`] of them, except at the end.
pub struct Pixels {
    first: usize,
    layers: usize,
    samples: u32,
    /// By replicate, sums over samples, `[pixel][layer][channel]`, as they lie in a file: little-endian.
    numbers: Vec<Vec<[u8; 8]>>,
}

impl Pixels {
    /// None yet, of so many replicates of so many layers and samples.
    pub fn new(replicates: usize, layers: usize, samples: u32) -> Self {
        Self { first: 0, layers, samples, numbers: vec![Vec::new(); replicates] }
    }

    /// Of how many replicates they are.
    pub fn replicates(&self) -> usize {
        self.numbers.len()
    }

    /// Which pixels they are.
    pub fn range(&self) -> Range<usize> {
        self.first..self.first + self.numbers[0].len() / (self.layers * 3)
    }

    /// A pixel, one of the range, of a layer of a replicate.
    #[inline]
    pub fn value(&self, replicate: usize, layer: usize, pixel: usize) -> [f64; 3] {
        let at = ((pixel - self.first) * self.layers + layer) * 3;
        let scale = 1.0 / self.samples as f64;
        [0, 1, 2].map(|c| f64::from_le_bytes(self.numbers[replicate][at + c]) * scale)
    }

    /// Goes on to those that follow, as many as threads want at once but no more than a sixteenth, of so many pixels in all. Says whether there are any.
    ///
    /// # Errors
    /// If they cannot be read.
    pub fn read<R: Read + Send>(&mut self, pixels: usize, from: &mut [R]) -> io::Result<bool> {
        self.first = self.range().end;
        let most = (pixels / 16).next_multiple_of(PIECE).max(PIECE);
        let count = (rayon::current_num_threads() * PIECE).min(most).min(pixels - self.first);
        self.numbers.par_iter_mut().zip(from).try_for_each(|(numbers, from)| {
            numbers.resize(count * self.layers * 3, [0; 8]);
            from.read_exact(numbers.as_flattened_mut())
        })?;
        Ok(count > 0)
    }
}

/// What a piece adds.
struct Added {
    /// By replicate, to their group.
    of_replicates: Vec<Piece>,
    /// By the distance of the group's means from those of the whole.
    of_group: Piece,
}

/// A group whose replicates are side by side, as far as its pixels have been added to the whole.
pub struct SideBySide {
    grid: BlockGrid,
    pieces: Vec<Added>,
    /// By replicate, sums over blocks of pixels.
    blocks: Vec<Film>,
}

impl SideBySide {
    /// Nothing yet, of so many replicates of so many layers.
    pub fn new(grid: BlockGrid, replicates: usize, layers: usize) -> Self {
        Self { grid, pieces: Vec::new(), blocks: vec![grid.black(layers); replicates] }
    }

    /// Adds the pixels that follow.
    pub fn add(&mut self, whole: &mut ImageMoments, pixels: &Pixels) {
        let stride = whole.layers * 3;
        let (layers, series, entries) = (whole.layers, whole.series, whole.products.len());
        let (replicates, scale) = (pixels.replicates(), 1.0 / pixels.samples as f64);
        let weights = whole.weights_of(replicates as u32);
        let range = pixels.range().start * stride..pixels.range().end * stride;
        let of_pieces = whole.mean[range.clone()]
            .par_chunks_mut(PIECE * stride)
            .zip(whole.m2[range].par_chunks_mut(PIECE * stride))
            .enumerate()
            .map(|(i, (mean, m2))| {
                let new = || Piece::new(layers, series, entries);
                let (mut group_mean, mut group_m2) = (vec![0.0; mean.len()], vec![0.0; mean.len()]);
                let push = |(replicate, numbers): (usize, &Vec<[u8; 8]>)| {
                    let (mut piece, sums) = (new(), &numbers[i * PIECE * stride..][..group_mean.len()]);
                    piece.push((&mut group_mean, &mut group_m2), sums, ((replicate + 1) as f64, scale));
                    piece.kept()
                };
                let of_replicates = pixels.numbers.iter().enumerate().map(push).collect();
                let mut of_group = new();
                of_group.move_means((mean, m2), &group_mean, weights);
                add_numbers(m2, &group_m2);
                Added { of_replicates, of_group: of_group.kept() }
            });
        self.pieces.par_extend(of_pieces);
        let grid = self.grid;
        let blocks = self.blocks.par_iter_mut().zip(&pixels.numbers);
        blocks.for_each(|(blocks, numbers)| grid.add(blocks, pixels.first, numbers, layers));
    }

    /// Ends it, all pixels having been added: adds all else to the whole, the group's counts and seconds being in `group`, which has no pixels.
    /// Returns what the group adds to the products of deviations.
    pub fn end(self, whole: &mut Tally, mut group: Tally, samples: u32) -> Vec<[f64; 3]> {
        let layers = whole.pixels.layers;
        let pixels = whole.pixels.mean.len() / (layers * 3);
        for (replicate, mut blocks) in self.blocks.into_iter().enumerate() {
            let pieces = self.pieces.iter().map(|piece| &piece.of_replicates[replicate]);
            group.means.push(add_pieces(pieces, pixels, &mut group.pixels.products));
            group.pixels.count += 1;
            self.grid.divide(&mut blocks, layers);
            group.blocks.push(&blocks, samples);
        }
        let mut added = group.pixels.products.clone();
        self.pieces.iter().for_each(|piece| add(&mut added, &piece.of_group.products));
        whole.merge_beside(&group);
        whole.pixels.count_in(group.count(), &added);
        added
    }
}
