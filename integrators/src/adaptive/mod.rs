//! Samples where the image needs them: how many each pixel takes, as a pilot finds, for `adaptive` and `adaptive_bdpt`.
//!
//! Up to an eighth of the samples is a pilot: two images A and B of as many samples each, with numbers of their own. Their squared difference,
//! relative as in the error that counts, tells what a pixel errs by; smoothed over neighbours it says where samples are wanted, as many as the
//! root of the error over the time of a sample \[Neyman34\]. Then the pilot is thrown away: numbers of samples that depend on the very samples
//! that are averaged would bias their mean \[Kirk91\], and those that do not, whatever they are, cost efficiency at worst.
//!
//! A pixel takes the number of samples of a replicate times a power of two, from a quarter to sixteen times, of sequences of their own, so that
//! where that number is a power of two these are as even as ever; which of the two next to what it wants is settled by a pattern over the image.
//! What a sample brings to its own pixel counts by that pixel's number; what it splats counts by the mean, since light may land wherever it came
//! from.

mod pilot;
mod smoothing;
mod spread;

use crate::film::Counts;
use crate::integrator::{Estimator, Replicate};
use crate::measurement::Counters;
use crate::request::Request;
use pilot::{errors_and_times, image};
use sampling::fault;
use sampling::sampler::StreamKey;
use scenes::Scene;
use spread::levels;
use std::ops::{Range, RangeInclusive};

/// Binary logarithms of the least and of the most samples that a pixel takes, over those of the replicate.
const LEVELS: RangeInclusive<i32> = -2..=4;
/// How often a sample counts, at most.
pub(crate) const MOST_COUNTS: f64 = 4.0;
/// With fewer samples there is no pilot.
const FEWEST: u32 = 16;
/// Samples in one of the pilot's images, at most.
const MOST_IN_PILOT: u32 = 16;

/// How many samples each pixel takes.
pub(crate) struct Allocation {
    /// Pixels in a row.
    width: u32,
    /// Samples of a pixel of the replicate.
    samples: u32,
    /// Of each pixel, which of [`LEVELS`].
    levels: Vec<u8>,
    /// How often what a sample splats counts.
    splats: f32,
    /// The pilot's work.
    pub work: Counters,
}

impl Allocation {
    /// Bytes of a pixel, while it is made.
    pub const BYTES: u64 = 192;

    /// The most samples of a pixel where a replicate has so many.
    pub fn most(samples: u32) -> u32 {
        if samples < FEWEST { samples } else { of_level(samples, *LEVELS.end()) }
    }

    /// As a pilot of these samples finds; `None` where a replicate has too few.
    pub fn find<E: Estimator>(estimator: &E, scene: &Scene, request: &Request, replicate: &Replicate) -> Option<Self> {
        let samples = replicate.samples;
        if samples < FEWEST {
            return None;
        }
        let of_pilot = (samples / 16).min(MOST_IN_PILOT);
        let mut work = Counters::default();
        let [a, b] = [0, 1].map(|part| {
            let key = replicate.key.of_pilot().of_part(part);
            let of_pilot = Replicate { key, samples: of_pilot, ..*replicate };
            image(estimator, scene, request, &of_pilot, &mut work)
        });
        let (width, height) = (scene.camera.width(), scene.camera.height());
        let size = (width as usize, height as usize);
        let left = f64::from(samples - 2 * of_pilot) / f64::from(samples);
        let (errors, times) = errors_and_times(&a, &b, size);
        let levels = levels(&errors, &times, size, left);
        let taken: f64 = levels.iter().map(|&level| f64::from(of_level(samples, level))).sum();
        let splats = f64::from(samples) * levels.len() as f64 / taken;
        let levels = levels.into_iter().map(|level| (level - LEVELS.start()) as u8).collect();
        Some(Self { width, samples, levels, splats: splats as f32, work })
    }

    /// For each number of samples that pixels take, the key of their random numbers and that number.
    pub fn numbers_of_samples(&self, key: StreamKey) -> impl Iterator<Item = (StreamKey, u32)> + use<> {
        let samples = self.samples;
        LEVELS.zip(0..).map(move |(level, part)| (key.of_part(part), of_level(samples, level)))
    }

    /// Which of the [numbers of samples](Self::numbers_of_samples) a pixel takes.
    #[inline]
    pub fn of(&self, (x, y): (u32, u32)) -> usize {
        self.levels[y as usize * self.width as usize + x as usize].into()
    }

    /// Samples that a pixel takes.
    #[inline]
    pub fn samples(&self, pixel: (u32, u32)) -> u32 {
        of_level(self.samples, LEVELS.start() + self.of(pixel) as i32)
    }

    /// Those that it takes in a block of these of the replicate's.
    #[inline]
    pub fn within(&self, pixel: (u32, u32), block: &Range<u32>) -> Range<u32> {
        let all = u64::from(self.samples(pixel));
        let at = |n: u32| (u64::from(n) * all / u64::from(self.samples)) as u32;
        at(block.start)..at(block.end)
    }

    /// How often a sample of a pixel counts.
    #[inline]
    pub fn counts(&self, pixel: (u32, u32)) -> Counts {
        let own = self.samples as f32 / self.samples(pixel) as f32;
        Counts {
            own: fault!("samples_of_a_pixel_taken_for_all", own, 1.0),
            splats: fault!("splats_of_fewer_samples_taken_for_all", self.splats, 1.0),
        }
    }
}

/// Samples of a pixel, where a replicate has so many.
#[inline]
fn of_level(samples: u32, level: i32) -> u32 {
    if level < 0 { samples.div_ceil(1 << -level) } else { samples.saturating_mul(1 << level) }
}

#[cfg(test)]
mod tests;
