//! Variances, efficiencies and ratios: positive numbers, whose intervals are made on a logarithmic scale.
//!
//! All of them have the form `log θ = Σ a_j log m_j` with means m_j over replicates. A replicate's influence on that is
//! `u_r = Σ a_j (x_jr / m_j − 1)`, and the standard error of log θ is that of the mean influence [Efron & Tibshirani 1993, ch. 21].
//! To either side the interval takes the wider of Student's and the studentised bootstrap's, in which replicates are drawn with all
//! that belongs to them.
//!
//! # Recursive squares
//!
//! A variance is given by what each replicate but the first adds to it, as [`crate::convergence::Deviations`] keeps it:
//! `q_r = (r − 1)/r · (x_r − x̄_{r−1})²`, whose mean is the sample variance. These are independent for normal pixels, and for no
//! others: with an excess kurtosis κ (large where a few paths carry most of the light) `q_r` and a later `q_s` have the
//! covariance `κσ⁴ / (s (s − 1))`, and early ones vary less than late ones, `κσ⁴ (1 − 1/r)² (1 + (r − 1)⁻³)`. The naive
//! standard error `s_q/√(R−1)` is too small then. [`recursion`] is the factor by which, for κ → ∞; for normal pixels, with it, the
//! interval is too wide by as much: 21 % for 8 replicates, 13 % for 16, 8 % for 32.

use super::bootstrap::{self, RESAMPLES};
use super::means::{student_quantile, wider};
use super::{Estimate, Interval};

/// Replicates from which on the intervals of this file are valid.
pub const VALID_FROM: usize = 8;

/// Most columns of a stratum.
pub const COLUMNS: usize = 5;

/// One or more means over the same replicates, each with its coefficient in a sum of logarithms.
#[derive(Clone, Debug)]
pub struct Stratum<'a> {
    /// Coefficient and values, by replicate: one to five columns with the same number of values.
    pub columns: Vec<(f64, &'a [f64])>,
}

impl<'a> Stratum<'a> {
    /// Means over the same replicates.
    pub fn new(columns: Vec<(f64, &'a [f64])>) -> Self {
        assert!((1..=COLUMNS).contains(&columns.len()), "one to five columns");
        assert!(columns.windows(2).all(|c| c[0].1.len() == c[1].1.len()), "columns of one length");
        Self { columns }
    }
}

/// A stratum as deviations from its means, `x/m − 1`.
struct Deviations {
    coefficients: Vec<f64>,
    /// Σ a log m.
    log: f64,
    /// By replicate.
    rows: Vec<[f64; COLUMNS]>,
}

impl Deviations {
    /// `None` where a mean is not positive or rests on a single replicate.
    fn new(stratum: &Stratum) -> Option<Self> {
        let n = stratum.columns[0].1.len();
        let mut rows = vec![[0.0; COLUMNS]; n];
        let mut log = 0.0;
        for (c, (a, values)) in stratum.columns.iter().enumerate() {
            let mean = values.iter().sum::<f64>() / n as f64;
            if n < 2 || !(mean > 0.0 && mean.is_finite()) {
                return None;
            }
            log += a * mean.ln();
            rows.iter_mut().zip(*values).for_each(|(row, x)| row[c] = x / mean - 1.0);
        }
        Some(Self { coefficients: stratum.columns.iter().map(|(a, _)| *a).collect(), log, rows })
    }

    /// By how much `Σ a log m` is larger over some of the rows, and the variance of its estimate from them.
    fn shift_and_variance(&self, chosen: impl Iterator<Item = usize>) -> (f64, f64) {
        let columns = self.coefficients.len();
        let (mut sums, mut products) = ([0.0; COLUMNS], [[0.0; COLUMNS]; COLUMNS]);
        for row in chosen.map(|r| &self.rows[r]) {
            for c in 0..columns {
                sums[c] += row[c];
                (0..=c).for_each(|d| products[c][d] += row[c] * row[d]);
            }
        }
        let n = self.rows.len() as f64;
        let (mut shift, mut variance, mut influence) = (0.0, 0.0, [0.0; COLUMNS]);
        for (c, a) in self.coefficients.iter().enumerate() {
            shift += a * (sums[c] / n).ln_1p();
            influence[c] = a / (1.0 + sums[c] / n);
            for d in 0..=c {
                let twice = if c == d { 1.0 } else { 2.0 };
                variance += twice * influence[c] * influence[d] * (products[c][d] - sums[c] * sums[d] / n);
            }
        }
        (shift, variance / (n * (n - 1.0)))
    }
}

/// `Σ a log m` over all strata, and how far its interval reaches below and above; `None` where a mean is not positive, or
/// rests on a single replicate. Standard errors are multiplied by `scale`.
pub fn log_sum(strata: &[Stratum], scale: f64, salt: u64) -> Option<(f64, (f64, f64))> {
    let strata: Vec<Deviations> = strata.iter().map(Deviations::new).collect::<Option<_>>()?;
    let (mut log, mut variance) = (0.0, 0.0);
    for stratum in &strata {
        let (_, v) = stratum.shift_and_variance(0..stratum.rows.len());
        (log, variance) = (log + stratum.log, variance + v);
    }
    // What is proportional in every replicate has no variance but by rounding.
    if variance.is_nan() || variance < 1e-24 {
        return (!strata.is_empty()).then_some((log, (0.0, 0.0)));
    }
    // The degrees of freedom of the smallest stratum: those of Satterthwaite [1946] hold for normal values, and are too many here.
    let least = strata.iter().map(|s| s.rows.len()).min()?;
    let t = student_quantile(least as f64 - 1.0);
    let (low, high) = studentised(&strata, salt);
    let error = scale * variance.sqrt();
    Some((log, (error * wider(t, high), error * wider(t, -low))))
}

/// The middle 95 % of the studentised shift over resamples. Those in which nothing varies, or nothing is left, have none.
fn studentised(strata: &[Deviations], salt: u64) -> Interval {
    let mut stream = bootstrap::stream(salt);
    let mut ratios = Vec::with_capacity(RESAMPLES);
    for _ in 0..RESAMPLES {
        let (mut shift, mut variance) = (0.0, 0.0);
        for stratum in strata {
            let n = stratum.rows.len();
            let (s, v) = stratum.shift_and_variance((0..n).map(|_| bootstrap::draw(n, &mut stream)));
            (shift, variance) = (shift + s, variance + v);
        }
        let ratio = shift / variance.sqrt();
        if variance > 1e-24 && ratio.is_finite() {
            ratios.push(ratio);
        }
    }
    bootstrap::middle(ratios)
}

/// `exp(Σ a log m)` with its interval.
pub fn power_product(strata: &[Stratum], scale: f64, salt: u64) -> Option<(f64, Interval)> {
    let (log, (below, above)) = log_sum(strata, scale, salt)?;
    Some((log.exp(), ((log - below).exp(), (log + above).exp())))
}

/// What the standard error of a mean of recursive squares is multiplied by: see this file's head. `squares` is their number, one
/// less than the replicates; 1 in the limit of many.
pub fn recursion(squares: usize) -> f64 {
    let n = squares as f64;
    if squares < 2 {
        return 1.0;
    }
    let vary = |r: f64| (1.0 - 1.0 / r).powi(2) * (1.0 + (r - 1.0).powi(-3));
    let own: f64 = (2..=squares + 1).map(|r| vary(r as f64)).sum();
    // Of R = n + 1 replicates the sample variance has the variance κ/R; the naive estimate expects (own − n/R) / (n (n − 1)).
    (n * (n - 1.0) / ((n + 1.0) * own - n)).sqrt()
}

/// The variance of one replicate from its recursive squares.
pub fn variance(squares: &[f64], salt: u64) -> Estimate {
    estimate(vec![(1.0, squares)], recursion(squares.len()), squares.len() + 1, salt)
}

/// `1 / (variance · seconds)` \[1/s per squared unit\]: what a method achieves in its time [Hammersley & Handscomb 1964, §5.1].
///
/// `squares` are recursive squares, `seconds` those of the same replicates, the second and those after it. For the efficiency of
/// one order by itself, give the seconds that this order adds to those before it, where they are known (its marginal cost).
pub fn efficiency(squares: &[f64], seconds: &[f64], salt: u64) -> Estimate {
    estimate(vec![(-1.0, squares), (-1.0, seconds)], recursion(squares.len()), squares.len() + 1, salt)
}

/// `√(a/b)` of two variances by recursive squares of the same replicates, drawn in pairs: below 1, the first has the smaller error.
pub fn rmse_ratio(a: &[f64], b: &[f64], salt: u64) -> Estimate {
    estimate(vec![(0.5, a), (-0.5, b)], recursion(a.len()), a.len() + 1, salt)
}

/// The first's efficiency over the second's, each with its own seconds, replicates drawn in pairs.
pub fn efficiency_ratio(a: (&[f64], &[f64]), b: (&[f64], &[f64]), salt: u64) -> Estimate {
    let columns = vec![(-1.0, a.0), (-1.0, a.1), (1.0, b.0), (1.0, b.1)];
    estimate(columns, recursion(a.0.len()), a.0.len() + 1, salt)
}

fn estimate(columns: Vec<(f64, &[f64])>, scale: f64, replicates: usize, salt: u64) -> Estimate {
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    let value = columns.iter().map(|(a, values)| mean(values).powf(*a)).product();
    let interval = power_product(&[Stratum::new(columns)], scale, salt).map(|(_, interval)| interval);
    Estimate::new(value, interval, replicates, VALID_FROM)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_means_and_their_products() {
        let (q, t) = ([1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 3.0], [0.5; 7]);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        near(variance(&q, 0).value, 2.0);
        near(efficiency(&q, &t, 0).value, 1.0);
        near(rmse_ratio(&q, &t, 0).value, 2.0);
        near(efficiency_ratio((&q, &t), (&t, &t), 0).value, 0.25);
        let (low, high) = variance(&q, 0).interval.unwrap();
        assert!(0.0 < low && low < 2.0 && 2.0 < high, "{low} {high}");
    }

    #[test]
    fn what_varies_together_has_a_narrow_ratio() {
        let b: Vec<f64> = (1..=31).map(|r| f64::from(r * r)).collect();
        let a: Vec<f64> = b.iter().map(|x| 4.0 * x).collect();
        let ratio = rmse_ratio(&a, &b, 3);
        let (low, high) = ratio.interval.unwrap();
        assert!((ratio.value - 2.0).abs() < 1e-12 && high - low < 1e-9, "{ratio:?}");
    }

    #[test]
    fn nothing_and_too_little_have_no_interval() {
        assert_eq!(variance(&[0.0; 8], 0).interval, None);
        assert_eq!(variance(&[1.0; 6], 0).interval, None);
        assert_eq!(efficiency(&[1.0; 8], &[-1.0; 8], 0).interval, None);
        assert!(variance(&[], 0).interval.is_none());
    }

    /// Against the sums of the head's formulae, with the covariances written out.
    #[test]
    fn the_factor_of_recursive_squares_is_that_of_its_formulae() {
        let direct = |replicates: usize| {
            let n = (replicates - 1) as f64;
            let all = 2..=replicates;
            let own: f64 =
                all.clone().map(|r| (1.0 - 1.0 / r as f64).powi(2) * (1.0 + ((r - 1) as f64).powi(-3))).sum();
            let pairs = all.flat_map(|s| (2..s).map(move |_| 1.0 / (s * (s - 1)) as f64));
            let total = own + 2.0 * pairs.sum::<f64>();
            assert!((total / (n * n) - 1.0 / replicates as f64).abs() < 1e-12);
            let naive = (own - total / n) / (n - 1.0) / n;
            (total / (n * n) / naive).sqrt()
        };
        for replicates in [3, 4, 8, 16, 32, 100] {
            let (found, expected) = (recursion(replicates - 1), direct(replicates));
            assert!((found - expected).abs() < 1e-12, "{replicates}: {found} {expected}");
        }
        assert!((recursion(7) - 1.214).abs() < 1e-3 && recursion(1) == 1.0);
    }
}
