//! Renders that are timed in turn, so that whatever else the machine does meets them alike.

use super::clock::spent;
use crate::budget;
use crate::error::Error;
use crate::statistics::bootstrap::quantile;
use integrators::Render;
use serde::Serialize;

/// A render and the processor time of each of its replicates but the first, which warms up.
pub(super) struct Timed<'a> {
    pub render: Render<'a>,
    pub seconds: Vec<f64>,
}

impl<'a> Timed<'a> {
    pub fn new(render: Render<'a>) -> Self {
        Self { render, seconds: Vec::new() }
    }

    /// Samples of all pixels in a round.
    pub fn samples(&self) -> f64 {
        let window = self.render.window();
        let pixels = f64::from(window.width()) * f64::from(window.height());
        pixels * f64::from(self.render.settings().samples_per_replicate)
    }

    /// Nanoseconds of a sample.
    pub fn nanoseconds(&self) -> Middle {
        Middle::of(self.seconds.iter().map(|seconds| seconds * 1e9 / self.samples()))
    }

    /// The time of each round relative to that of another.
    pub fn relative_to(&self, other: &Self) -> Middle {
        Middle::of(self.seconds.iter().zip(&other.seconds).map(|(own, other)| own / other))
    }
}

/// Renders replicates of all in turn on one thread. `seen` is told of each that counts, by its number in the list.
pub(super) fn in_turns(list: &mut [Timed], rounds: u32, mut seen: impl FnMut(usize, &Timed)) -> Result<(), Error> {
    let pool = budget::pool(Some(1))?;
    for round in 0..=rounds {
        for turn in 0..list.len() {
            // There and back again, so that none always comes after the same other.
            let index = if round.is_multiple_of(2) { turn } else { list.len() - 1 - turn };
            let timed = &mut list[index];
            let render = &mut timed.render;
            let seconds = pool.install(|| spent(|| render.run_replicate(&|_| {})));
            if round > 0 {
                timed.seconds.push(seconds);
                seen(index, timed);
            }
        }
    }
    Ok(())
}

/// The median of what was measured, and an interval that holds the median of all such measurements with at least 95 %; of fewer
/// than six, all that were measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Middle {
    pub median: f64,
    pub low: f64,
    pub high: f64,
}

impl Middle {
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut values: Vec<f64> = values.collect();
        values.sort_by(f64::total_cmp);
        let n = values.len();
        let outside = left_outside(n);
        let at = |index: usize| values.get(index).copied().unwrap_or(f64::NAN);
        Self { median: quantile(&values, 0.5), low: at(outside), high: at(n.wrapping_sub(1 + outside)) }
    }
}

/// How many of `n` sorted values lie outside of the interval of their median, on either side: the median is below the value after
/// the first `j` unless at most `j` of `n` tosses of a coin are heads [Conover 1999, §3.2].
fn left_outside(n: usize) -> usize {
    let (mut term, mut sum, mut outside) = (0.5f64.powi(n as i32), 0.0, 0);
    for j in 0..n / 2 {
        sum += term;
        if sum > 0.025 {
            break;
        }
        outside = j;
        term *= (n - j) as f64 / (j + 1) as f64;
    }
    outside
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::rng::Stream;

    #[test]
    fn intervals_leave_out_what_the_binomial_distribution_says() {
        // The least rank of a 95 % interval for a median, from tables, less one.
        for (n, outside) in [(1, 0), (5, 0), (8, 0), (9, 1), (12, 2), (25, 7), (31, 9), (100, 39)] {
            assert_eq!(left_outside(n), outside, "{n}");
        }
        assert!(Middle::of(std::iter::empty()).median.is_nan());
    }

    #[test]
    fn intervals_hold_the_median() {
        // Of 400 intervals of at least 95 %, fewer than 360 with a probability below 10⁻⁵.
        let mut stream = Stream::new(5, 1);
        let covered = (0..400).filter(|_| {
            let Middle { low, high, .. } = Middle::of((0..9).map(|_| f64::from(stream.next_f32()).powi(3)));
            (low..=high).contains(&0.125)
        });
        let covered = covered.count();
        assert!(covered >= 360, "{covered} of 400");
    }
}
