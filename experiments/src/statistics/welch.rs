//! Do two means differ, and what difference would have been found?

use sampling::moments::Moments;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// The probability with which a detectable bias is found.
pub const POWER: f64 = 0.9;

/// Two means compared with their variances [Welch 1947].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Welch {
    /// Difference of the means, second less first, in standard errors.
    pub t: f64,
    /// Degrees of freedom; infinite where there is no variance.
    pub freedom: f64,
    /// Two-sided p-value.
    pub p: f64,
    /// Standard error of the difference.
    pub standard_error: f64,
    /// Whether neither has any variance, so that equality is the only question.
    pub exact: bool,
}

/// Mean, variance and number of independent values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Their mean.
    pub mean: f64,
    /// Variance of one value.
    pub variance: f64,
    /// Their number.
    pub n: u32,
}

impl Sample {
    /// The same with at least this variance.
    pub fn with_variance_from(self, least: f64) -> Self {
        Self { variance: self.variance.max(least), ..self }
    }
}

impl From<&Moments> for Sample {
    fn from(moments: &Moments) -> Self {
        Self { mean: moments.mean, variance: moments.variance(), n: moments.n as u32 }
    }
}

/// Tests two means for equality. A difference within `rounding` (relative to the larger mean) counts as none: methods carry
/// transport in `f32`, and where they have no variance that is all that is left.
pub fn welch(a: Sample, b: Sample, rounding: f64) -> Welch {
    let (var_a, var_b) = (a.variance / f64::from(a.n), b.variance / f64::from(b.n));
    let (difference, standard_error) = (b.mean - a.mean, (var_a + var_b).sqrt());
    let tolerance = rounding * a.mean.abs().max(b.mean.abs());
    let exact = standard_error <= tolerance;
    let share = |variance: f64, n: u32| variance * variance / (f64::from(n) - 1.0);
    let freedom = match standard_error > 0.0 {
        true => (var_a + var_b).powi(2) / (share(var_a, a.n) + share(var_b, b.n)),
        false => f64::INFINITY,
    };
    if difference.abs() <= tolerance {
        return Welch { t: 0.0, freedom, p: 1.0, standard_error, exact };
    }
    let t = difference / standard_error;
    Welch { t, freedom, p: two_sided(t, freedom), standard_error, exact }
}

/// Relative error that rounding in `f32` may leave in light scattered `order` times: a dozen operations at a vertex.
pub fn rounding(order: usize) -> f64 {
    12.0 * f64::from(f32::EPSILON) * (order + 1) as f64
}

/// Two-sided p-value of Student's t.
fn two_sided(t: f64, freedom: f64) -> f64 {
    if !t.is_finite() || !freedom.is_finite() {
        return 0.0;
    }
    match StudentsT::new(0.0, 1.0, freedom) {
        Ok(distribution) => 2.0 * distribution.cdf(-t.abs()),
        Err(_) => f64::NAN,
    }
}

/// The difference that Welch's test at `level` finds with probability [`POWER`]: the level's quantile and the power's, added,
/// times the standard error.
pub fn detectable(test: &Welch, level: f64) -> f64 {
    if test.standard_error == 0.0 {
        return 0.0;
    }
    let quantile = |q: f64| StudentsT::new(0.0, 1.0, test.freedom).map_or(f64::NAN, |d| d.inverse_cdf(q));
    (quantile(1.0 - level / 2.0) + quantile(POWER)) * test.standard_error
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::rng::{Stream, mix2};

    fn sample(mean: f64, variance: f64, n: u32) -> Sample {
        Sample { mean, variance, n }
    }

    #[test]
    fn welch_is_that_of_the_textbook() {
        // scipy.stats.ttest_ind_from_stats(20.6, 9.62**.5, 11, 22.1, 0.58**.5, 11, equal_var=False):
        // t = −1.5577, Satterthwaite's 11.2 degrees of freedom.
        let test = welch(sample(20.6, 9.62, 11), sample(22.1, 0.58, 11), 0.0);
        assert!((test.t - 1.5577).abs() < 1e-4, "{test:?}");
        assert!((test.freedom - 11.203).abs() < 1e-2, "{test:?}");
        assert!((test.p - 0.1470).abs() < 1e-3, "{test:?}");
    }

    #[test]
    fn where_there_is_no_variance_equality_to_rounding_is_asked_for() {
        let rounding = rounding(3);
        let equal = welch(sample(1.0, 0.0, 4), sample(1.0 + 0.5 * rounding, 0.0, 4), rounding);
        assert!(equal.exact && equal.p == 1.0 && equal.t == 0.0);
        let different = welch(sample(1.0, 0.0, 4), sample(1.0 + 2.0 * rounding, 0.0, 4), rounding);
        assert!(different.exact && different.p == 0.0);
        let black = welch(sample(0.0, 0.0, 4), sample(0.0, 0.0, 4), rounding);
        assert!(black.exact && black.p == 1.0);
    }

    #[test]
    fn p_values_are_uniform_where_means_are_equal_and_the_detectable_bias_is_found() {
        let mut stream = Stream::new(mix2(1, 2), 3);
        let mut values = |n: usize, mean: f64| -> Moments {
            let mut normal = || (0..12).map(|_| f64::from(stream.next_f32())).sum::<f64>() - 6.0;
            (0..n).map(|_| mean + normal()).collect()
        };
        const RUNS: usize = 2000;
        let (mut small, mut found) = (0, 0);
        for _ in 0..RUNS {
            let (a, b) = (values(8, 0.0), values(8, 0.0));
            small += usize::from(welch((&a).into(), (&b).into(), 0.0).p < 0.05);
            // The true standard error is ½: at 14 degrees of freedom a level of 0.01 asks for 2.98, a power of 0.9 for 1.35 more.
            let b = values(8, 0.5 * (2.977 + 1.345));
            found += usize::from(welch((&a).into(), (&b).into(), 0.0).p < 0.01);
        }
        // Six standard deviations of a binomial count: false alarms below 10⁻⁸.
        let near =
            |count: usize, p: f64| (count as f64 - RUNS as f64 * p).abs() < 6.0 * (RUNS as f64 * p * (1.0 - p)).sqrt();
        assert!(near(small, 0.05), "{small} of {RUNS} p-values below 0.05");
        assert!(near(found, 0.88), "{found} of {RUNS} biases found");
    }
}
