//! What successive replicates add up to.

use crate::film::Film;
use crate::fireflies::Fireflies;
use crate::measurement::Counters;
use crate::statistics::{BlockGrid, ImageMoments};
use crate::stored;
use std::io::{self, Read};

/// Moments, lists and counts of successive replicates: of a group at work, or of all groups before it.
///
/// Groups are merged in order, so that a tally of groups has the same bits whoever rendered each of them, and when.
#[derive(Clone, Debug)]
pub struct Tally {
    /// Moments of pixels.
    pub pixels: ImageMoments,
    /// Moments of the means of blocks of pixels.
    pub blocks: ImageMoments,
    /// Image means, `[replicate][layer]`.
    pub means: Vec<Vec<[f64; 3]>>,
    /// Seconds of transport (wall time), per replicate.
    pub seconds: Vec<f64>,
    /// Non-finite contributions, per layer.
    pub invalid: Vec<u64>,
    /// Work done.
    pub counters: Counters,
    /// The largest contributions and the tails of samples, where they are asked for.
    pub fireflies: Fireflies,
}

stored!(Tally { pixels, blocks, means, seconds, invalid, counters, fireflies });

impl Tally {
    /// No replicates yet, of an image of so many pixels and layers, of which the first `series` make up the image.
    pub fn new(pixels: usize, grid: &BlockGrid, layers: usize, series: usize) -> Self {
        Self {
            pixels: ImageMoments::new(pixels, layers, series),
            blocks: ImageMoments::new(grid.count(), layers, series),
            means: Vec::new(),
            seconds: Vec::new(),
            invalid: vec![0; series],
            counters: Counters::default(),
            fireflies: Fireflies::new(series, layers),
        }
    }

    /// Replicates in it.
    pub fn count(&self) -> u32 {
        self.pixels.count
    }

    /// Adds a replicate's film of so many samples, which took so many seconds. Its counts are added by who traces it.
    pub fn push(&mut self, film: &Film, grid: &BlockGrid, samples: u32, seconds: f64) {
        self.means.push(self.pixels.push(film, samples));
        self.blocks.push(&grid.average(film, self.pixels.layers()), samples);
        self.seconds.push(seconds);
    }

    /// Adds a tally of the replicates that follow. Returns what that adds to the products of the pixels' deviations.
    pub fn merge(&mut self, other: &Self) -> Vec<[f64; 3]> {
        self.merge_beside(other);
        self.pixels.merge(&other.pixels)
    }

    /// The same where the pixels' means and squared deviations, not in the other tally, are still to be read.
    ///
    /// # Errors
    /// If they cannot be read; some of it has been added then.
    pub fn merge_from(&mut self, other: &Self, numbers: &mut dyn Read) -> io::Result<Vec<[f64; 3]>> {
        self.merge_beside(other);
        self.pixels.merge_from(other.count(), &other.pixels.products, numbers)
    }

    /// Adds all but the moments of pixels.
    pub(crate) fn merge_beside(&mut self, other: &Self) {
        self.blocks.merge(&other.blocks);
        self.means.extend_from_slice(&other.means);
        self.seconds.extend_from_slice(&other.seconds);
        self.invalid.iter_mut().zip(&other.invalid).for_each(|(sum, n)| *sum += n);
        self.counters += other.counters;
        self.fireflies.merge(&other.fireflies);
    }

    /// Forgets all replicates.
    pub fn clear(&mut self) {
        self.pixels.clear();
        self.blocks.clear();
        self.means.clear();
        self.seconds.clear();
        self.invalid.fill(0);
        self.counters = Counters::default();
        self.fireflies = Fireflies::new(self.invalid.len(), self.pixels.layers());
    }

    /// Whether it is one of images of the same pixels and layers, whole in itself.
    pub fn is_like(&self, other: &Self) -> bool {
        self.pixels.is_like(&other.pixels) && self.is_like_beside(other)
    }

    /// The same, whatever pixels there are.
    pub fn is_like_beside(&self, other: &Self) -> bool {
        let count = self.count() as usize;
        self.pixels.has_layers_of(&other.pixels)
            && self.blocks.is_like(&other.blocks)
            && self.blocks.count == self.pixels.count
            && self.invalid.len() == other.invalid.len()
            && self.fireflies.layers().len() == other.fireflies.layers().len()
            && self.fireflies.tails().len() == other.fireflies.tails().len()
            && [self.means.len(), self.seconds.len()] == [count; 2]
            && self.means.iter().all(|means| means.len() == self.pixels.layers())
    }
}
