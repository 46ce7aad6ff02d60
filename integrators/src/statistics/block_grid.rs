//! The grid of blocks whose means are followed over replicates.

use super::Number;
use crate::film::Film;
use rayon::prelude::*;
use std::ops::Range;

/// The grid of blocks, at most so many each way, whose means are followed over replicates: the pixels of a splatting method
/// are correlated, so the variance of a block's mean cannot be had from its pixels' variances.
pub const BLOCK_GRID: u32 = 16;

/// How an image is divided into blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BlockGrid {
    width: u32,
    height: u32,
    /// Blocks in a row.
    pub columns: u32,
    /// Rows of blocks.
    pub rows: u32,
}

impl BlockGrid {
    /// The grid of an image of the given size.
    pub fn new(width: u32, height: u32) -> Self {
        Self { width, height, columns: width.min(BLOCK_GRID), rows: height.min(BLOCK_GRID) }
    }

    /// Number of blocks.
    pub fn count(&self) -> usize {
        (self.columns * self.rows) as usize
    }

    /// The means over blocks of a film's pixels.
    pub fn average(&self, film: &Film, layers: usize) -> Film {
        let stride = layers * 3;
        let mut blocks = self.black(layers);
        blocks.sums.par_chunks_mut(self.columns as usize * stride).enumerate().for_each(|(i, blocks)| {
            for y in part(i as u32, self.rows, self.height) {
                let row = &film.sums[y * self.width as usize * stride..][..self.width as usize * stride];
                self.add_row(blocks, 0, row, stride);
            }
            self.divide_row(i, blocks, stride);
        });
        blocks
    }

    /// No sums over blocks yet.
    pub(super) fn black(&self, layers: usize) -> Film {
        Film::new(self.columns, self.rows, layers)
    }

    /// Adds successive pixels to the sums over blocks, which have the bits of [`Self::average`] when all have been added in order.
    pub(super) fn add<N: Number>(&self, blocks: &mut Film, first: usize, numbers: &[N], layers: usize) {
        let (stride, width) = (layers * 3, self.width as usize);
        let (mut pixel, mut left) = (first, numbers);
        while !left.is_empty() {
            let (x, y) = (pixel % width, pixel / width);
            let (row, rest) = left.split_at(left.len().min((width - x) * stride));
            let i = y * self.rows as usize / self.height as usize;
            let blocks = blocks.sums.chunks_exact_mut(self.columns as usize * stride).nth(i);
            self.add_row(blocks.unwrap_or_default(), x, row, stride);
            (pixel, left) = (pixel + width - x, rest);
        }
    }

    /// Turns sums over blocks into means.
    pub(super) fn divide(&self, blocks: &mut Film, layers: usize) {
        let rows = blocks.sums.chunks_exact_mut(self.columns as usize * layers * 3);
        rows.enumerate().for_each(|(i, blocks)| self.divide_row(i, blocks, layers * 3));
    }

    /// Adds pixels of a row, from a column on, to the sums over the blocks that the row crosses.
    fn add_row<N: Number>(&self, blocks: &mut [f64], first: usize, row: &[N], stride: usize) {
        let end = first + row.len() / stride;
        for (i, sums) in blocks.chunks_exact_mut(stride).enumerate() {
            let columns = part(i as u32, self.columns, self.width);
            let [from, to] = [columns.start, columns.end].map(|x| (x.clamp(first, end) - first) * stride);
            for pixel in row[from..to].chunks_exact(stride) {
                sums.iter_mut().zip(pixel).for_each(|(a, b)| *a += b.value());
            }
        }
    }

    fn divide_row(&self, row: usize, blocks: &mut [f64], stride: usize) {
        let rows = part(row as u32, self.rows, self.height).len();
        for (i, sums) in blocks.chunks_exact_mut(stride).enumerate() {
            let pixels = (rows * part(i as u32, self.columns, self.width).len()) as f64;
            sums.iter_mut().for_each(|s| *s /= pixels);
        }
    }
}

/// The pixels of one of so many parts of a row or column of such a size: those `x` for which `x · parts / size`, rounded down, is its number.
fn part(number: u32, parts: u32, size: u32) -> Range<usize> {
    let first = |number: u32| (u64::from(number) * u64::from(size)).div_ceil(u64::from(parts)) as usize;
    first(number)..first(number + 1)
}
