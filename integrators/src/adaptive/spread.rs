//! Samples spread over pixels by what these err by.

use super::LEVELS;
use super::smoothing::{Size, Smoothing};
use rayon::prelude::*;

/// Standard deviations of which one is chosen to smooth errors \[pixels\].
const SMOOTHINGS: [f64; 3] = [1.5, 3.0, 6.0];
/// What all pixels want at least, of the mean of what they want.
const WANTED: f64 = 1e-3;

/// Levels for pixels that err by these and take these times, whose numbers of samples have this mean, in those of the replicate: by the smoothing for
/// which error times time is the least where errors are told by a pixel's neighbours alone, or the same for all where that is less.
pub fn levels(errors: &[[f64; 1]], times: &[f64], size: Size, mean: f64) -> Vec<i32> {
    let product = |levels: &[i32]| {
        let number = |level: &i32| f64::from(*level).exp2();
        let error: f64 = errors.iter().zip(levels).map(|([error], level)| error / number(level)).sum();
        error * times.iter().zip(levels).map(|(time, level)| time * number(level)).sum::<f64>()
    };
    let spread = |errors: &[[f64; 1]]| {
        let wanted = errors.iter().zip(times).map(|([error], time)| (error / time).sqrt()).collect();
        spread(wanted, size.0, mean)
    };
    let mut best = vec![0; errors.len()];
    let mut least = product(&best);
    for deviation in SMOOTHINGS {
        let smoothing = Smoothing::new(deviation);
        let smoothed = smoothing.smoothed(errors, size);
        let found = product(&spread(&smoothing.of_others(errors, &smoothed, size)));
        if found < least {
            (best, least) = (spread(&smoothed), found);
        }
    }
    best
}

/// Levels that are to what pixels want as nearly as may be, for a mean of that much, or a little less.
pub fn spread(wanted: Vec<f64>, width: usize, mean: f64) -> Vec<i32> {
    let pixels = wanted.len() as f64;
    let least = wanted.iter().sum::<f64>() / pixels * WANTED;
    if !(least > 0.0 && least.is_finite()) {
        return vec![0; wanted.len()];
    }
    let (lowest, highest) = (f64::from(*LEVELS.start()), f64::from(*LEVELS.end()));
    let logs: Vec<f64> = wanted.iter().map(|wanted| (wanted + least).log2()).collect();
    let patterns: Vec<f64> = (0..logs.len()).map(|i| pattern((i % width) as f64, (i / width) as f64)).collect();
    let level = |log: f64, pattern: f64, shift: f64| {
        ((log + shift).clamp(lowest, highest) + pattern).floor().min(highest) as i32
    };
    let taken = |shift: f64| {
        let times = |(&log, &pattern): (&f64, &f64)| 1_u64 << (level(log, pattern, shift) - LEVELS.start());
        logs.par_iter().zip(&patterns).map(times).sum::<u64>() as f64 * lowest.exp2() / pixels
    };
    let most = logs.iter().copied().fold(f64::MIN, f64::max);
    let (mut low, mut high) = (lowest - most, highest - least.log2());
    for _ in 0..24 {
        let middle = 0.5 * (low + high);
        *(if taken(middle) > mean { &mut high } else { &mut low }) = middle;
    }
    logs.iter().zip(&patterns).map(|(&log, &pattern)| level(log, pattern, low)).collect()
}

/// A number in [0, 1) for a pixel that differs much from those of its neighbours \[Jimenez14\].
fn pattern(x: f64, y: f64) -> f64 {
    (52.982_918_9 * (0.067_110_56 * x + 0.005_837_15 * y).fract()).fract()
}
