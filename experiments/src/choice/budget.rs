//! The time that choosing takes.

use super::pilot::REPLICATES;
use std::time::Instant;

/// The part of a short render's time that is taken for choosing, if a sample a pixel of each pilot takes no more.
const PILOT_PART: f64 = 0.08;
/// Up to how long a render is short: samples of every pixel of the pilots' image, by the mean method, in as much time.
const SHORT: f64 = 4096.0;
/// The part of that time that the first pilot has. What it leaves to the second and to timing also pays for counting rays.
const FIRST_PART: f64 = 0.3;
/// The part of what is left for a second pilot that is kept for timing.
const TIMING_PART: f64 = 0.4;
/// The most samples of an image of the second one: where there are more than [`REPLICATES`] images of these, there are more images. They tell a
/// variance better than many samples of few do, and what slows a machine for a while hits all methods alike.
const SECOND_SAMPLES: f64 = 4.0;

/// The seconds that choosing may take.
pub struct Budget {
    start: Instant,
    /// What is meant to be taken.
    seconds: f64,
    /// The most, where there is a reason.
    most: f64,
}

impl Budget {
    /// Of a render that takes `whole` seconds, where a sample of every pixel of the pilots' image takes `sample` by the mean method.
    ///
    /// Those of long renders grow by the root of their length: what pilots of n samples leave unknown costs a part of it in proportion to 1/n, and they
    /// cost n.
    pub fn new(start: Instant, sample: f64, whole: f64) -> Self {
        let most = PILOT_PART * whole;
        Self { start, seconds: most * (SHORT * sample / whole.max(1e-9)).sqrt().min(1.0), most }
    }

    /// The samples of a first pilot's image, where one of each method's takes so many seconds.
    pub fn first_samples(&self, sample: f64) -> u32 {
        (FIRST_PART * self.seconds / (f64::from(REPLICATES) * sample.max(1e-9))).max(1.0) as u32
    }

    /// How many more images the first pilot may have, where one of each method takes so many seconds.
    pub fn first_images(&self, images: f64) -> u32 {
        (FIRST_PART * self.left() / images.max(1e-9)) as u32
    }

    /// The seconds that the second pilot may take, or go on for.
    pub fn second(&self) -> f64 {
        (1.0 - TIMING_PART) * self.left()
    }

    /// What is left; negative if more has been taken.
    pub fn left(&self) -> f64 {
        self.seconds - self.start.elapsed().as_secs_f64()
    }

    /// Lets all be taken that may be.
    pub fn extend(&mut self) {
        self.seconds = self.most;
    }
}

/// The images of the second pilot, and the samples of each, by the seconds that all may take, and those of one sample.
pub fn second_size(budget: f64, sample: f64) -> (u32, u32) {
    let samples = budget / sample.max(1e-9);
    let replicates = (samples / SECOND_SAMPLES).max(f64::from(REPLICATES)).floor();
    (replicates as u32, (samples / replicates).clamp(1.0, SECOND_SAMPLES) as u32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_second_pilot_takes_what_it_may_in_many_images_of_few_samples() {
        assert_eq!(
            [0.0, 2.0, 40.0, 400.0].map(|budget| second_size(budget, 1.0)),
            [(16, 1), (16, 1), (16, 2), (100, 4)]
        );
    }

    #[test]
    fn pilots_of_four_times_as_long_a_render_take_twice_as_long() {
        let of = |samples: f64| Budget::new(Instant::now(), 0.01, 0.01 * samples).seconds;
        let close = |a: f64, b: f64| assert!((a / b - 1.0).abs() < 1e-12, "{a} is not {b}");
        close(of(1024.0), 0.08 * 10.24);
        close(of(4096.0), 0.08 * 40.96);
        close(of(4.0 * 4096.0), 2.0 * of(4096.0));
    }

    #[test]
    fn all_may_be_taken_where_there_is_a_reason() {
        let mut budget = Budget::new(Instant::now(), 0.01, 0.01 * 4.0 * 4096.0);
        let (before, most) = (budget.seconds, 0.08 * 0.01 * 4.0 * 4096.0);
        budget.extend();
        assert!((before / most - 0.5).abs() < 1e-12 && budget.left() <= most && budget.second() < 0.6 * most);
    }
}
