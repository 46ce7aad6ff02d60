//! The largest contributions of a render, each with what it takes to make it again, and how heavy the tail of all samples is.

use crate::contribution::{Contribution, Technique};
use crate::state::{Stored, damaged};
use sampling::Vec2;
use sampling::math::Spectrum;
use sampling::tail::Tail;
use serde::{Deserialize, Serialize};
use std::io::{self, Read, Write};

/// How many are kept of every layer.
pub const KEPT: usize = 8;

/// A contribution, and the sample that it came from: all that [`Pass::replay`](crate::integrator::Pass::replay) asks for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Firefly {
    /// Which independent image.
    pub replicate: u32,
    /// Column and row of the pixel whose sample it is.
    pub pixel: (u32, u32),
    /// Number of the sample in its pixel and replicate.
    pub sample: u32,
    /// How the path was built.
    pub technique: Technique,
    /// Where it lands \[pixels, y down\].
    pub raster: Vec2,
    /// The unweighted estimate.
    pub value: Spectrum,
    /// The MIS weight; of a run of a composite times how often it counts.
    pub weight: f64,
}

impl Firefly {
    /// What the image gets, mean of channels; infinite where that is not finite, so that no finite one is larger.
    pub fn size(&self) -> f32 {
        size(self.value * self.weight as f32)
    }

    /// A total order, the largest first, by which lists have one order however they were gathered.
    fn rank(&self) -> (std::cmp::Reverse<u32>, u32, (u32, u32), u32, u32) {
        let (row, column) = (self.pixel.1, self.pixel.0);
        let technique = match self.technique {
            Technique::Connect { s, t } | Technique::Merge { s, t } => u32::from(s) << 16 | u32::from(t),
            Technique::Whole { order } => u32::from(order),
        };
        // The bits of numbers that are not negative rise with them.
        (std::cmp::Reverse(self.size().to_bits()), self.replicate, (row, column), self.sample, technique)
    }
}

/// By which contributions are compared: whatever their sign, as optimal weights may give it.
#[inline]
pub(crate) fn size(value: Spectrum) -> f32 {
    brought(value).abs()
}

/// What a contribution brings, mean of channels; infinite where that is not finite.
#[inline]
pub(crate) fn brought(value: Spectrum) -> f32 {
    let [r, g, b] = value.to_array();
    let mean = (r + g + b) / 3.0;
    if mean.is_finite() { mean } else { f32::INFINITY }
}

/// The largest contributions of every layer, and the tails of what its samples bring.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Fireflies {
    layers: Vec<Vec<Firefly>>,
    /// Of each layer the size above which a contribution is kept.
    least: Vec<f32>,
    /// Of each layer of the film; in a block those of the samples that brought it anything.
    tails: Vec<Tail>,
    /// Samples that have ended.
    samples: u64,
    /// Of each layer of the film what the sample at work has brought.
    sample: Vec<f32>,
    /// The layers to which it has brought anything.
    met: Vec<usize>,
    /// Whether there is a sample at work.
    at_work: bool,
}

impl Fireflies {
    /// None yet, of a film of so many layers, of which the first `series` make up the image.
    pub fn new(series: usize, layers: usize) -> Self {
        Self {
            layers: vec![Vec::new(); series],
            least: vec![0.0; series],
            tails: vec![Tail::default(); layers],
            samples: 0,
            sample: vec![0.0; layers],
            met: Vec::new(),
            at_work: false,
        }
    }

    /// Of each layer of the film the tail of what single samples bring: of a sample all that it contributes to the layer, mean of
    /// channels, wherever it lands. Of parts they are those of raw strategies; the others' are of nothing.
    pub fn tails(&self) -> &[Tail] {
        &self.tails
    }

    /// Of each layer the largest contributions, the largest first. Those that are not finite come before all others.
    pub fn layers(&self) -> &[Vec<Firefly>] {
        &self.layers
    }

    /// Forgets the contributions of the last block; tails go on to the end of the replicate.
    pub(crate) fn start(&mut self) {
        self.layers.iter_mut().for_each(Vec::clear);
        self.least.fill(0.0);
    }

    /// Ends the sample at work, if there is one.
    pub(crate) fn end_sample(&mut self) {
        if std::mem::take(&mut self.at_work) {
            for &layer in &self.met {
                self.tails[layer].add(f64::from(std::mem::take(&mut self.sample[layer]).abs()));
            }
            self.met.clear();
            self.samples += 1;
        }
    }

    /// Begins a sample.
    #[inline]
    pub(crate) fn start_sample(&mut self) {
        self.end_sample();
        self.at_work = true;
    }

    /// Counts a contribution of the sample at work to a layer of the film. What is beyond all numbers counts as the largest.
    #[inline]
    pub(crate) fn count(&mut self, layer: usize, brought: f32) {
        if brought != 0.0 {
            // A sum may come back to 0.
            if self.sample[layer] == 0.0 && !self.met.contains(&layer) {
                self.met.push(layer);
            }
            self.sample[layer] = (self.sample[layer] + brought).clamp(-f32::MAX, f32::MAX);
        }
    }

    /// Whether a contribution of this size would be kept.
    #[inline]
    pub(crate) fn takes(&self, layer: usize, size: f32) -> bool {
        size > self.least[layer]
    }

    /// Keeps a contribution that is larger than those kept.
    #[cold]
    #[inline(never)]
    pub(crate) fn keep(&mut self, layer: usize, c: &Contribution, scale: f64, (pixel, sample): ((u32, u32), u32)) {
        let Contribution { technique, raster, value, weight, .. } = *c;
        let firefly = Firefly { replicate: 0, pixel, sample, technique, raster, value, weight: weight * scale };
        let kept = &mut self.layers[layer];
        kept.push(firefly);
        if kept.len() >= 2 * KEPT {
            self.cut(layer);
        }
    }

    fn cut(&mut self, layer: usize) {
        let kept = &mut self.layers[layer];
        kept.sort_by_key(Firefly::rank);
        kept.truncate(KEPT);
        if kept.len() == KEPT {
            self.least[layer] = kept[KEPT - 1].size();
        }
    }

    /// Takes in those of a block of a replicate.
    pub(crate) fn add_block(&mut self, block: &Self, replicate: u32) {
        for (layer, found) in block.layers.iter().enumerate() {
            let larger = found.iter().filter(|firefly| firefly.size() > self.least[layer]);
            let found: Vec<Firefly> = larger.map(|&firefly| Firefly { replicate, ..firefly }).collect();
            if !found.is_empty() {
                self.layers[layer].extend(found);
                self.cut(layer);
            }
        }
    }

    /// Takes in those of replicates that follow.
    pub(crate) fn merge(&mut self, other: &Self) {
        for (layer, found) in other.layers.iter().enumerate() {
            self.layers[layer].extend(found);
            self.cut(layer);
        }
        self.add_tails(other);
    }

    /// Takes in the tails that a block's film has gathered over a replicate, or those of replicates that follow.
    pub(crate) fn add_tails(&mut self, other: &Self) {
        self.samples += other.samples;
        for (tail, other_tail) in self.tails.iter_mut().zip(&other.tails) {
            tail.merge(other_tail);
            // Samples that brought it nothing were not counted.
            tail.add_zeros(other.samples - other_tail.count);
        }
    }
}

impl Stored for Fireflies {
    fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        self.layers.write(to)?;
        let tails: Vec<StoredTail> = self.tails.iter().map(|tail| StoredTail(tail.clone())).collect();
        tails.write(to)
    }

    fn read(from: &mut dyn Read) -> io::Result<Self> {
        let layers = <Vec<Vec<Firefly>>>::read(from)?;
        let tails = <Vec<StoredTail>>::read(from)?;
        if tails.len() < layers.len() {
            return Err(damaged("tails of other layers"));
        }
        let mut found = Self::new(layers.len(), tails.len());
        found.tails = tails.into_iter().map(|StoredTail(tail)| tail).collect();
        found.samples = found.tails.first().map_or(0, |tail| tail.count);
        if found.tails.iter().any(|tail| tail.count != found.samples) {
            return Err(damaged("tails of other samples"));
        }
        for (layer, fireflies) in layers.into_iter().enumerate() {
            found.layers[layer] = fireflies;
            found.cut(layer);
        }
        Ok(found)
    }
}

impl Stored for Firefly {
    fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        let (kind, s, t) = match self.technique {
            Technique::Connect { s, t } => (0, s, t),
            Technique::Merge { s, t } => (1, s, t),
            Technique::Whole { order } => (2, order, 0),
        };
        let [r, g, b] = self.value.to_array();
        let numbers = [self.replicate, self.pixel.0, self.pixel.1, self.sample, kind, u32::from(s), u32::from(t)];
        numbers.write(to)?;
        [self.raster.x, self.raster.y, r, g, b].map(f32::to_bits).write(to)?;
        self.weight.write(to)
    }

    fn read(from: &mut dyn Read) -> io::Result<Self> {
        let [replicate, x, y, sample, kind, s, t] = <[u32; 7]>::read(from)?;
        let small = |n: u32| u16::try_from(n).map_err(|_| damaged("a number of vertices"));
        let technique = match kind {
            0 => Technique::Connect { s: small(s)?, t: small(t)? },
            1 => Technique::Merge { s: small(s)?, t: small(t)? },
            2 => Technique::Whole { order: small(s)? },
            _ => return Err(damaged("a technique")),
        };
        let [u, v, r, g, b] = <[u32; 5]>::read(from)?.map(f32::from_bits);
        let (raster, value) = (Vec2::new(u, v), Spectrum::new(r, g, b));
        Ok(Self { replicate, pixel: (x, y), sample, technique, raster, value, weight: f64::read(from)? })
    }
}

/// A tail as bytes.
struct StoredTail(Tail);

impl Stored for StoredTail {
    fn write(&self, to: &mut dyn Write) -> io::Result<()> {
        self.0.count.write(to)?;
        self.0.sums.write(to)?;
        self.0.bins().map(|(i, ..)| i).collect::<Vec<usize>>().write(to)?;
        self.0.bins().map(|(_, count, _)| count).collect::<Vec<u64>>().write(to)?;
        self.0.bins().map(|(.., square)| square).collect::<Vec<f64>>().write(to)
    }

    fn read(from: &mut dyn Read) -> io::Result<Self> {
        let (count, sums) = (u64::read(from)?, <[f64; 4]>::read(from)?);
        let (places, counts, squares) = (<Vec<usize>>::read(from)?, <Vec<u64>>::read(from)?, <Vec<f64>>::read(from)?);
        let bins = places.into_iter().zip(counts).zip(squares).map(|((i, count), square)| (i, count, square));
        Tail::of(count, sums, bins).map(Self).ok_or_else(|| damaged("a histogram of other bins"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::vec2;

    fn block(values: &[f32]) -> Fireflies {
        let mut block = Fireflies::new(1, 2);
        for (i, &value) in values.iter().enumerate() {
            let technique = Technique::Connect { s: 1, t: 2 };
            let c = Contribution::new(vec2(0.0, 0.0), technique, Spectrum::splat(value), 1.0);
            if block.takes(0, size(c.value)) {
                block.keep(0, &c, 1.0, ((0, 0), i as u32));
            }
        }
        block
    }

    #[test]
    fn the_largest_are_kept_whatever_the_blocks() {
        let values: Vec<f32> = (0..400_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 12) as f32).collect();
        let mut sorted = values.clone();
        sorted.sort_by(|a, b| b.total_cmp(a));
        for pieces in [1, 3, 50] {
            let mut all = Fireflies::new(1, 2);
            values.chunks(values.len().div_ceil(pieces)).for_each(|chunk| all.add_block(&block(chunk), 0));
            let sizes: Vec<f32> = all.layers()[0].iter().map(Firefly::size).collect();
            assert_eq!(sizes, sorted[..KEPT], "{pieces}");
        }
    }

    #[test]
    fn what_is_read_is_what_was_written() {
        let mut all = Fireflies::new(1, 2);
        for replicate in 0..3 {
            let mut block = block(&[1.0, 0.0, 5e-9, 7.0 + replicate as f32]);
            block.start_sample();
            block.count(0, 3.0);
            block.count(1, 0.0);
            block.count(1, 2.0 + replicate as f32);
            block.start_sample();
            block.end_sample();
            all.add_block(&block, replicate);
            all.add_tails(&block);
        }
        assert_eq!(all.tails().iter().map(|tail| (tail.count, tail.sums[0])).collect::<Vec<_>>(), [(6, 9.0), (6, 9.0)]);
        let mut bytes = Vec::new();
        all.write(&mut bytes).unwrap();
        assert_eq!(Fireflies::read(&mut bytes.as_slice()).unwrap(), all);
        assert!((0..bytes.len()).all(|length| Fireflies::read(&mut &bytes[..length]).is_err()));
    }

    #[test]
    fn what_is_not_finite_comes_first() {
        let mut all = Fireflies::new(1, 2);
        all.add_block(&block(&[1.0, f32::NAN, 3.0, f32::INFINITY]), 5);
        let samples: Vec<u32> = all.layers()[0].iter().map(|firefly| firefly.sample).collect();
        assert_eq!(samples, [1, 3, 2, 0]);
        assert!(all.layers()[0].iter().all(|firefly| firefly.replicate == 5));
    }
}
