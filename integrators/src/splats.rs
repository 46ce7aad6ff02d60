//! Contributions that land outside the block that made them, kept until their turn comes.

/// One contribution to a pixel of another block's tile.
#[derive(Clone, Copy, Debug)]
pub struct Splat {
    /// Pixel number within the film, `y · width + x`.
    pub pixel: u32,
    /// Layer of the film.
    pub layer: u32,
    /// Weighted value.
    pub value: [f32; 3],
}

/// The splats of one block, bucketed by the row of tiles they land in, in the order they were made.
#[derive(Clone, Debug, Default)]
pub struct Splats {
    buckets: Vec<Vec<Splat>>,
}

impl Splats {
    /// For a film of so many rows of tiles.
    pub fn set_bands(&mut self, bands: usize) {
        self.buckets.resize(bands, Vec::new());
    }

    /// Keeps a splat that lands in the given row of tiles.
    #[inline]
    pub fn push(&mut self, band: usize, splat: Splat) {
        self.buckets[band].push(splat);
    }

    /// The splats of one row of tiles.
    pub fn band(&self, band: usize) -> &[Splat] {
        &self.buckets[band]
    }

    /// Forgets the splats and keeps their memory.
    pub fn clear(&mut self) {
        self.buckets.iter_mut().for_each(Vec::clear);
    }
}
