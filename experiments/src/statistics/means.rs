//! Intervals of the mean of independent values.

use super::bootstrap::{self, RESAMPLES};
use super::{COVERAGE, Estimate, Interval};
use sampling::fault;
use sampling::moments::Moments;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Replicates from which on [`mean`] is valid: any, if image means are normal, and measured from so many on.
pub const MEAN_VALID_FROM: usize = 4;
/// Replicates from which on [`skewed_mean`] is valid.
pub const SKEWED_VALID_FROM: usize = 8;

/// The quantile of the normal distribution that 95 % intervals take.
pub const NORMAL_QUANTILE: f64 = 1.959_963_984_540_054;

/// The quantile of Student's t that 95 % intervals take; NaN for no degrees of freedom.
pub fn student_quantile(freedom: f64) -> f64 {
    let freedom = fault!("normal_quantile_for_students", freedom, 1e6);
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::NAN, |d| d.inverse_cdf(0.5 + COVERAGE / 2.0))
}

/// The mean of normal values with Student's interval `x̄ ± t s/√n` [Student 1908], exact for normal ones.
///
/// It is meant for image means: sums of so many contributions that their skewness γ over replicates is small; the error of the
/// coverage is of the order γ²/n [Hall 1992, ch. 3].
pub fn mean(values: &[f64]) -> Estimate {
    let moments: Moments = values.iter().copied().collect();
    Estimate::new(moments.mean, student(&moments), values.len(), MEAN_VALID_FROM)
}

/// Student's interval; `None` for fewer than two values.
pub fn student(moments: &Moments) -> Option<Interval> {
    if moments.n < 2 {
        return None;
    }
    let half = student_quantile(moments.n as f64 - 1.0) * moments.variance_of_mean().sqrt();
    Some((moments.mean - half, moments.mean + half))
}

/// The mean of values that may be skewed and have a positive mean, such as squared errors. (Those of a noisy reference, debiased, may be
/// negative themselves.)
///
/// To either side the interval takes the wider of Student's and the studentised bootstrap's [Efron & Tibshirani 1993, ch. 12].
/// The bootstrap follows the skewness, which Student's cannot; of a few values it knows little, and Student's then is the wider one
/// on the side that the skewness has not shown yet. Above, Student's is that of the logarithm, `x̄ exp(t s/(x̄ √n))`, up to `t s/(x̄ √n) = 3/2`.
pub fn skewed_mean(values: &[f64], salt: u64) -> Estimate {
    let moments: Moments = values.iter().copied().collect();
    let (below, above) = skewed_reach(values, salt);
    let interval = (values.len() >= 2).then_some((moments.mean - below, moments.mean + above));
    Estimate::new(moments.mean, interval, values.len(), SKEWED_VALID_FROM)
}

/// How far below and above the mean the interval of [`skewed_mean`] reaches.
pub fn skewed_reach(values: &[f64], salt: u64) -> (f64, f64) {
    let moments: Moments = values.iter().copied().collect();
    let error = moments.variance_of_mean().sqrt();
    if error.is_nan() || error == 0.0 {
        return (error, error);
    }
    let t = student_quantile(moments.n as f64 - 1.0);
    let (low, high) = studentised(values, moments.mean, salt);
    let relative = if moments.mean > 0.0 { (t * error / moments.mean).min(1.5) } else { 1.5 };
    (error * wider(t, high), error * wider(t * relative.exp_m1() / relative, -low))
}

/// The wider of Student's quantile and the bootstrap's. The latter has no bound: a resample in which nearly all values are one and the
/// same has a ratio as large as may be. So it counts up to twice the former.
pub fn wider(t: f64, bootstrap: f64) -> f64 {
    t.max(bootstrap.min(MOST * t))
}

/// How often Student's quantile the bootstrap's may be.
const MOST: f64 = 2.0;

/// The middle 95 % of `(x̄* − x̄)/(s*/√n)` over resamples. One in which all values are the same has no such number and is left out.
pub fn studentised(values: &[f64], mean: f64, salt: u64) -> Interval {
    if values.len() < 2 {
        return (f64::NAN, f64::NAN);
    }
    let n = values.len();
    let mut stream = bootstrap::stream(salt);
    let mut ratios = Vec::with_capacity(RESAMPLES);
    for _ in 0..RESAMPLES {
        let (mut sum, mut squares) = (0.0, 0.0);
        for _ in 0..n {
            let deviation = values[bootstrap::draw(n, &mut stream)] - mean;
            sum += deviation;
            squares += deviation * deviation;
        }
        let shift = sum / n as f64;
        let variance = (squares - sum * shift) / ((n - 1) * n) as f64;
        if variance > 1e-12 * squares / (n * n) as f64 {
            ratios.push(shift / variance.sqrt());
        }
    }
    bootstrap::middle(ratios)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn students_interval_is_that_of_the_textbook() {
        // scipy.stats.t.interval(0.95, 4, 3, (2.5/5)**.5)
        let e = mean(&[1.0, 2.0, 3.0, 4.0, 5.0]);
        let (low, high) = e.interval.unwrap();
        assert!((e.value - 3.0).abs() < 1e-12 && (low - 1.036_756_838_5).abs() < 1e-8, "{e:?}");
        assert!((low + high - 6.0).abs() < 1e-9, "{e:?}");
    }

    #[test]
    fn too_few_values_have_no_interval() {
        assert_eq!(mean(&[1.0, 2.0, 3.0]).interval, None);
        assert_eq!(skewed_mean(&[1.0; 7], 0).interval, None);
        assert!(mean(&[]).interval.is_none() && skewed_mean(&[], 0).interval.is_none());
        assert!(skewed_mean(&[2.0], 0).value == 2.0);
    }

    #[test]
    fn the_interval_reaches_further_to_where_the_tail_is() {
        let values = [1.0, 1.1, 0.9, 1.2, 0.8, 1.0, 1.3, 4.0];
        let (below, above) = skewed_reach(&values, 0);
        assert!(above > 1.5 * below, "{below} {above}");
        assert_eq!(skewed_reach(&values, 0), skewed_reach(&values, 0));
        assert_eq!(skewed_mean(&[2.0; 8], 0).interval, Some((2.0, 2.0)));
    }
}
