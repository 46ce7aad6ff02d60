//! The seconds to a given relative mean squared error, by more replicates of the same size.
//!
//! A replicate has the relative variance `V` and the relative bias² `B`, and takes `T` seconds; the mean of n of them has the error
//! `V/n + B`, whatever the sampler. It falls to ε after `V T / (ε − B)` seconds, and never where `B ≥ ε`.
//!
//! Where no bias was found, because its interval holds 0, B counts as 0 in the estimate, and not in its interval.
//!
//! `V T` has the interval of a product of means ([`super::positive`]), `B` that of [`super::bias`]. The lower end takes both lower ends,
//! and 0 for one of B below it, since no bias² is negative; the upper end takes both upper ends, and is infinite where B may be ε. The time
//! lies outside only if one of the two does, so that the interval covers with at least 90 %; as measured, with 95 % and more.

use super::positive::{self, Stratum, power_product, recursion};
use super::{Estimate, Interval};

/// When an error is reached.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimeToError {
    /// The relative mean squared error.
    pub target: f64,
    /// Seconds until then; infinite where the bias forbids it.
    pub seconds: f64,
    /// Its 95 % interval, whose upper end is infinite where the bias may forbid it, and both ends where it does. `None` for fewer
    /// replicates than it holds for, and where nothing varies.
    pub interval: Option<Interval>,
}

impl TimeToError {
    /// Whether the error is never reached, as sure as intervals are.
    pub fn is_never(&self) -> bool {
        self.interval.is_some_and(|(low, _)| low.is_infinite())
    }
}

/// The time from relative recursive squares, the seconds of the same replicates, and relative bias².
pub fn time_to_error(squares: &[f64], seconds: &[f64], bias2: &Estimate, target: f64, salt: u64) -> TimeToError {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let until = |work: f64, bias2: f64| if bias2 < target { work / (target - bias2) } else { f64::INFINITY };
    let columns = vec![(1.0, squares), (1.0, seconds)];
    let work = power_product(&[Stratum::new(columns)], recursion(squares.len()), salt).map(|(_, interval)| interval);
    let enough = squares.len() + 1 >= positive::VALID_FROM;
    let interval = work.zip(bias2.interval).filter(|_| enough);
    let interval = interval.map(|(work, bias2)| (until(work.0, bias2.0.max(0.0)), until(work.1, bias2.1)));
    let found = bias2.interval.is_some_and(|(low, _)| low > 0.0);
    let seconds = until(mean(squares) * mean(seconds), if found { bias2.value } else { 0.0 });
    TimeToError { target, seconds, interval }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn time(bias2: f64, reach: f64, target: f64) -> TimeToError {
        let squares: Vec<f64> = (0..15).map(|r| 0.2 + 0.02 * f64::from(r).sin()).collect();
        let bias2 = Estimate::new(bias2, Some((bias2 - reach, bias2 + reach)), 16, 8);
        time_to_error(&squares, &[0.5; 15], &bias2, target, 1)
    }

    #[test]
    fn an_error_is_reached_when_the_variance_has_fallen_to_what_the_bias_leaves() {
        let found = time(0.0, 0.0, 0.01);
        let (low, high) = found.interval.unwrap();
        assert!((found.seconds / 10.0 - 1.0).abs() < 0.05 && low < found.seconds && found.seconds < high, "{found:?}");
        assert!((time(0.005, 0.0, 0.01).seconds / found.seconds - 2.0).abs() < 1e-9);
        // A bias that is none tells nothing against the estimate and the lower end.
        let none = time(0.001, 0.002, 0.01);
        assert_eq!((none.seconds, none.interval.unwrap().0), (found.seconds, low));
        assert!(none.interval.unwrap().1 > high);
    }

    #[test]
    fn a_bias_forbids_smaller_errors() {
        let never = time(0.02, 0.001, 0.01);
        assert!(never.is_never() && never.seconds.is_infinite());
        let perhaps = time(0.009, 0.002, 0.01);
        assert!(!perhaps.is_never() && perhaps.interval.unwrap().1.is_infinite() && perhaps.seconds.is_finite());
        assert_eq!(time_to_error(&[1.0; 5], &[1.0; 5], &Estimate::new(0.0, None, 6, 8), 0.1, 0).interval, None);
    }
}
