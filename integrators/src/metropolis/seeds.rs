//! Independent points: what they say of the image's brightness, and the chains that begin at them.

use super::Explored;
use super::point::{Point, Space};
use crate::measurement::Counters;
use crate::scratch::Scratch;
use rayon::prelude::*;
use sampling::sampler::{Role, Sampler, SamplerKind, StreamKey};
use std::ops::Range;

/// Set in the pixel's number of those that are no chain's, to the sampler.
const SEEDS: u64 = 1 << 62;

/// Points that are looked at one after another.
const AT_ONCE: u64 = 256;
/// Such pieces that are kept at once.
const WAVE: usize = 1024;

/// Points of which one sum is kept; to find one of them, all are looked at again.
pub(super) const GROUP: u64 = 16;

/// Points that are looked at for light before any work.
pub(super) const SCOUTS: u64 = 1 << 16;

/// Independent points of a space.
pub(super) struct Seeds {
    /// How many.
    count: u64,
    /// The sums of sizes up to the end of each group.
    sums: Vec<f64>,
    /// Mean size by layer.
    pub sizes: Vec<f64>,
    /// Contributions that were not finite, by layer.
    pub invalid: Vec<u64>,
    /// Work done.
    pub counters: Counters,
}

impl Seeds {
    /// So many.
    pub fn find<E: Explored>(space: &Space<E>, key: StreamKey, count: u64) -> Self {
        let layers = space.request.layers().len();
        let some = |piece: u64| {
            let (mut sampler, mut scratch) = (independent(key), Scratch::default());
            let mut point = Point::<false>::new(space.request);
            let (mut sums, mut sizes) = (Vec::new(), vec![0.0; layers]);
            for number in piece * AT_ONCE..((piece + 1) * AT_ONCE).min(count) {
                turn_to_seed(&mut sampler, number);
                space.look(&mut sampler, &mut scratch, &mut point);
                point.add_sizes(&mut sizes);
                if number.is_multiple_of(GROUP) {
                    sums.push(0.0);
                }
                sums.iter_mut().last().into_iter().for_each(|sum| *sum += point.size);
            }
            Self { count, sums, sizes, invalid: point.invalid, counters: scratch.counters }
        };
        let pieces = count.div_ceil(AT_ONCE);
        let (sums, sizes, invalid) = (Vec::new(), vec![0.0; layers], vec![0; layers]);
        let mut all = Self { count, sums, sizes, invalid, counters: Counters::default() };
        let mut sum = 0.0;
        for first in (0..pieces).step_by(WAVE) {
            let wave: Vec<Self> = (first..pieces.min(first + WAVE as u64)).into_par_iter().map(some).collect();
            all.add_wave(&wave, &mut sum);
        }
        all
    }

    fn add_wave(&mut self, wave: &[Self], sum: &mut f64) {
        for piece in wave {
            self.add_work(piece);
            self.sizes.iter_mut().zip(&piece.sizes).for_each(|(all, size)| *all += size / self.count as f64);
            for size in &piece.sums {
                *sum += size;
                self.sums.push(*sum);
            }
        }
    }

    /// Counts the work of others too, and what was not finite there.
    pub fn add_work(&mut self, others: &Self) {
        self.counters += others.counters;
        self.invalid.iter_mut().zip(&others.invalid).for_each(|(all, n)| *all += n);
    }

    /// Their mean size, b̂.
    pub fn mean(&self) -> f64 {
        self.sums.last().map_or(0.0, |sum| sum / self.count as f64)
    }

    /// The numbers of the group of points at a place in [0, 1) of the sum of all sizes, and how far in their own sum; `None` where all
    /// sizes are 0.
    pub fn at(&self, place: f64) -> Option<(Range<u64>, f64)> {
        let sum = *self.sums.last().filter(|&&sum| sum > 0.0)?;
        // Rounding may lead to the end, which is in the last group of any size.
        let last = self.sums.partition_point(|&up_to| up_to < sum);
        let group = self.sums.partition_point(|&up_to| up_to <= place * sum).min(last);
        let before = if group > 0 { self.sums[group - 1] } else { 0.0 };
        let first = group as u64 * GROUP;
        Some((first..(first + GROUP).min(self.count), place * sum - before))
    }
}

/// Whether any of [`SCOUTS`] points has a size, by numbers that no replicate has.
pub(super) fn finds_light<E: Explored>(space: &Space<E>) -> bool {
    let key = StreamKey::new(0, "seeds", Role::Pilot, 0);
    (0..SCOUTS / AT_ONCE).into_par_iter().any(|piece| {
        let (mut sampler, mut scratch) = (independent(key), Scratch::default());
        let mut point = Point::<false>::new(space.request);
        (piece * AT_ONCE..(piece + 1) * AT_ONCE).any(|number| {
            turn_to_seed(&mut sampler, number);
            space.look(&mut sampler, &mut scratch, &mut point);
            point.size > 0.0
        })
    })
}

fn independent(key: StreamKey) -> Sampler {
    Sampler::new(SamplerKind::Independent, key, 1, (1, 1))
}

/// Turns to the point of a number.
pub(super) fn turn_to_seed(sampler: &mut Sampler, number: u64) {
    sampler.start_sample(SEEDS | number, 0);
}
