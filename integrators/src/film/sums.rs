//! The sums of a replicate, which blocks are added up in.

use super::{BlockFilm, TILE};
use rayon::prelude::*;

/// The sums of one replicate, `[pixel][layer][channel]`.
#[derive(Clone, Debug)]
pub struct Film {
    /// The sums.
    pub sums: Vec<f64>,
    band_stride: usize,
    length: usize,
}

impl Film {
    /// A black film.
    pub fn new(width: u32, height: u32, layers: usize) -> Self {
        let film = Self::unexposed(width, height, layers);
        Self { sums: vec![0.0; film.length], ..film }
    }

    /// One that has no memory before it is cleared.
    pub fn unexposed(width: u32, height: u32, layers: usize) -> Self {
        let row = width as usize * layers * 3;
        Self { sums: Vec::new(), band_stride: row * TILE as usize, length: row * height as usize }
    }

    /// Makes it black again.
    pub fn clear(&mut self) {
        if self.sums.is_empty() {
            // Not written yet: the threads that fill it are the first to touch its pages.
            self.sums = vec![0.0; self.length];
        }
        self.sums.par_chunks_mut(self.band_stride).for_each(|band| band.fill(0.0));
    }

    /// Adds blocks in their order; rows of tiles go side by side.
    pub fn reduce(&mut self, blocks: &[BlockFilm]) {
        self.sums.par_chunks_mut(self.band_stride).enumerate().for_each(|(band, rows)| {
            blocks.iter().for_each(|block| block.reduce_band(band, rows));
        });
    }
}
