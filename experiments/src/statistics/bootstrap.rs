//! Resampling by seeded streams: the same values and salt give the same interval.

use super::{COVERAGE, Interval};
use sampling::rng::{Stream, mix2};

/// Samples of each bootstrap.
pub const RESAMPLES: usize = 1000;

/// The random numbers of a bootstrap, keyed by `salt`.
pub fn stream(salt: u64) -> Stream {
    Stream::new(mix2(0x6e65_756d_616e_6e00, salt), salt)
}

/// One of the first `n` numbers.
pub fn draw(n: usize, stream: &mut Stream) -> usize {
    ((u64::from(stream.next_u32()) * n as u64) >> 32) as usize
}

/// The middle 95 % of the values; NaN of none.
pub fn middle(mut values: Vec<f64>) -> Interval {
    values.sort_by(f64::total_cmp);
    (quantile(&values, 0.5 - COVERAGE / 2.0), quantile(&values, 0.5 + COVERAGE / 2.0))
}

/// A quantile of sorted values, linear in between; NaN of none.
pub fn quantile(sorted: &[f64], q: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let at = q * last as f64;
    let (below, share) = (at as usize, at.fract());
    sorted[below] + share * (sorted[(below + 1).min(last)] - sorted[below])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_interpolate() {
        assert_eq!(quantile(&[0.0, 1.0, 2.0, 3.0], 0.5), 1.5);
        assert_eq!(quantile(&[7.0], 0.3), 7.0);
        assert!(quantile(&[], 0.3).is_nan());
    }

    /// Each of 8 numbers is expected 10 000 times, with a standard deviation of 94.
    #[test]
    fn every_number_is_drawn_as_often_as_any_other() {
        let (mut counts, mut stream) = ([0_i32; 8], stream(1));
        (0..80_000).for_each(|_| counts[draw(8, &mut stream)] += 1);
        assert!(counts.iter().all(|n| (n - 10_000).abs() < 500), "{counts:?}");
    }
}
