//! How the work of a replicate is cut into blocks: a tile of pixels and a range of their samples.

use scenes::{Crop, Scene};
use std::ops::Range;

/// Width and height of a tile \[pixels\].
pub const TILE: u32 = 16;
/// Samples per pixel in one block, at least, where there are so many.
const FEWEST: u32 = 4;
/// Samples per pixel in one block, at most: what a block ends with, and what is new to caches when it begins, is shared by them.
const MOST: u32 = 64;
/// With as many blocks, no thread waits long for another's last one.
const ENOUGH: u64 = 256;
/// Samples per pixel in one chain.
pub const SAMPLES_PER_CHAIN: u32 = 4;

/// A rectangle of pixels, ends excluded.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Window {
    /// Columns.
    pub x: Range<u32>,
    /// Rows.
    pub y: Range<u32>,
}

impl Window {
    /// All pixels of an image.
    pub fn whole(width: u32, height: u32) -> Self {
        Self { x: 0..width, y: 0..height }
    }

    /// Those that a scene asks for: its crop, or all.
    pub fn of(scene: &Scene) -> Self {
        match scene.crop {
            Some(Crop { x, y, width, height }) => Self { x: x..x + width, y: y..y + height },
            None => Self::whole(scene.camera.width(), scene.camera.height()),
        }
    }

    /// Pixels in a row.
    #[inline]
    pub fn width(&self) -> u32 {
        self.x.end - self.x.start
    }

    /// Rows.
    #[inline]
    pub fn height(&self) -> u32 {
        self.y.end - self.y.start
    }

    /// Whether a pixel is in it.
    #[inline]
    pub fn contains(&self, (x, y): (u32, u32)) -> bool {
        self.x.contains(&x) && self.y.contains(&y)
    }

    /// Row by row.
    pub fn pixels(&self) -> impl Iterator<Item = (u32, u32)> + use<> {
        let x = self.x.clone();
        self.y.clone().flat_map(move |y| x.clone().map(move |x| (x, y)))
    }

    /// Whether it has no pixel.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.x.is_empty() || self.y.is_empty()
    }

    /// The pixels that are in both, which may be none.
    pub(crate) fn within(&self, other: &Self) -> Self {
        let both = |a: &Range<u32>, b: &Range<u32>| {
            let start = a.start.max(b.start);
            start..a.end.min(b.end).max(start)
        };
        Self { x: both(&self.x, &other.x), y: both(&self.y, &other.y) }
    }
}

/// One piece of a replicate's work.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Block {
    /// The pixels whose samples are taken.
    pub tile: Window,
    /// Which of their samples.
    pub samples: Range<u32>,
}

/// How a replicate is cut into blocks. Depends on the image, the pixels whose samples are taken, and the number of samples, or that of the replicate as
/// whose it is cut, alone.
#[derive(Clone, Debug)]
pub struct Blocks {
    /// The pixels whose samples are taken.
    pixels: Window,
    /// The tiles that hold them.
    columns: Range<u32>,
    rows: Range<u32>,
    samples: u32,
    /// Samples per pixel in one block.
    at_once: u32,
}

impl Blocks {
    /// The blocks of an image of so many samples of each pixel, which so many runs of a composite share, if any.
    pub fn new(image: Window, samples: u32, runs: u32) -> Self {
        let whole = Self::of(image, samples, samples);
        let at_once = (whole.tiles() * u64::from(samples) / ENOUGH).clamp(FEWEST.into(), MOST.into()) as u32;
        // What a run has in caches serves several samples.
        Self { at_once: at_once.max(FEWEST * runs), ..whole }
    }

    /// The same with one sample per pixel in each.
    pub fn of_iterations(image: Window, samples: u32) -> Self {
        Self::of(image, samples, 1)
    }

    /// The same with a chain's in each.
    pub fn of_chains(image: Window, samples: u32) -> Self {
        Self::of(image, samples, SAMPLES_PER_CHAIN)
    }

    fn of(pixels: Window, samples: u32, at_once: u32) -> Self {
        let tiles = |pixels: &Range<u32>| pixels.start / TILE..pixels.end.div_ceil(TILE);
        Self { columns: tiles(&pixels.x), rows: tiles(&pixels.y), pixels, samples, at_once }
    }

    /// The same with another number of samples, cut in pieces as long as before.
    pub fn of_samples(self, samples: u32) -> Self {
        Self { samples, ..self }
    }

    /// Those of some of the image's pixels. Tiles and ranges of samples are those of the whole image, so that its pixels have the same bits.
    pub fn of_pixels(self, pixels: Window) -> Self {
        Self::of(pixels, self.samples, self.at_once)
    }

    /// The tiles: so many blocks share the numbers of their samples.
    pub fn tiles(&self) -> u64 {
        self.columns.len() as u64 * self.rows.len() as u64
    }

    /// Number of blocks.
    pub fn count(&self) -> u64 {
        self.tiles() * self.samples.div_ceil(self.at_once) as u64
    }

    /// The block of a number below [`Blocks::count`]: all tiles of the first samples, then of the next.
    pub fn block(&self, index: u64) -> Block {
        let columns = self.columns.len() as u64;
        let (chunk, tile) = ((index / self.tiles()) as u32, index % self.tiles());
        let x = (self.columns.start + (tile % columns) as u32) * TILE;
        let y = (self.rows.start + (tile / columns) as u32) * TILE;
        let first = chunk * self.at_once;
        Block {
            tile: Window { x: x..x + TILE, y: y..y + TILE }.within(&self.pixels),
            samples: first..(first + self.at_once).min(self.samples),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_cover_every_sample_of_every_pixel_once() {
        let image = Window::whole(37, 18);
        let runs = Blocks::new(image.clone(), 6, 3);
        let as_long = Blocks::new(image.clone(), 1024, 1).of_samples(6);
        for blocks in [Blocks::new(image.clone(), 6, 1), Blocks::of_iterations(image, 6), runs, as_long] {
            let mut seen = vec![0_u32; 37 * 18 * 6];
            for index in 0..blocks.count() {
                let block = blocks.block(index);
                for (x, y) in block.tile.pixels() {
                    block.samples.clone().for_each(|s| seen[((y * 37 + x) * 6 + s) as usize] += 1);
                }
            }
            assert!(seen.iter().all(|&n| n == 1));
        }
    }

    #[test]
    fn blocks_hold_more_samples_where_there_are_many_of_them() {
        let at_once = |side: u32, samples: u32, runs: u32| {
            Blocks::new(Window::whole(side, side), samples, runs).block(0).samples.len()
        };
        assert_eq!([at_once(64, 64, 1), at_once(256, 8, 1), at_once(256, 64, 1), at_once(1024, 2, 1)], [4, 8, 64, 2]);
        assert_eq!([at_once(64, 64, 0), at_once(64, 64, 3), at_once(256, 64, 3), at_once(256, 64, 5)], [4, 12, 64, 64]);
    }

    #[test]
    fn blocks_of_a_window_are_parts_of_the_tiles_of_the_image() {
        let window = Window { x: 15..33, y: 3..17 };
        let blocks = Blocks::new(Window::whole(37, 18), 5, 1).of_pixels(window.clone());
        let mut seen = vec![0_u32; 37 * 18 * 5];
        for block in (0..blocks.count()).map(|index| blocks.block(index)) {
            assert!(block.tile.x.start / TILE == (block.tile.x.end - 1) / TILE);
            for (x, y) in block.tile.pixels() {
                block.samples.clone().for_each(|s| seen[((y * 37 + x) * 5 + s) as usize] += 1);
            }
        }
        for (i, &n) in seen.iter().enumerate() {
            let pixel = (i as u32 / 5 % 37, i as u32 / 5 / 37);
            assert_eq!(n, u32::from(window.contains(pixel)), "{pixel:?}");
        }
    }
}
