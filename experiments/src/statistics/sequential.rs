//! Intervals that may be looked at after every replicate: when to stop, without paying for having looked.
//!
//! An ordinary 95 % interval misses the truth in 5 % of experiments at a number of replicates fixed before; whoever looks again
//! after every replicate and stops when pleased misses it far more often. A *confidence sequence* misses it in 5 % of experiments
//! at any time at all, so the stopping rule may be anything: this one is not the spending of α over planned looks, since the
//! number of looks is unknown, and the methods take turns by single replicates.
//!
//! Derivation. Let replicate means be normal with mean μ and any variance σ². Under `μ = μ₀`, with the right Haar prior 1/σ on the
//! nuisance and, as alternative, a normal prior of variance g on the effect `(μ − μ₀)/σ`, the ratio of marginal likelihoods after n
//! values is, with `t = (x̄ − μ₀)√n/s` and ν = n − 1 [Lai 1976; Gönen et al. 2005],
//!
//! `E_n = (1 + n g)^(−1/2) · ((1 + t²/ν) / (1 + t²/(ν (1 + n g))))^(n/2)`.
//!
//! It is the likelihood ratio of the maximal invariant under changes of scale, hence a non-negative martingale of mean 1 whatever σ
//! is (in the filtration of those invariants) [Wang & Ramdas 2025; Pérez-Ortiz et al. 2024], and by Ville's inequality
//! `P(E_n ≥ 1/α for any n) ≤ α`: the intervals hold all together, and so at whatever time one stops. Solved for
//! t, with `K = (√(1 + n g)/α)^(2/n)`: `t² = ν (K − 1) / (1 − K/(1 + n g))`; while `K ≥ 1 + n g`, nothing is excluded yet.
//! For g = 1 and α = 5 % the interval is `x̄ ± 4.3 s/√n` after 8 replicates, 3.5 after 16 and 3.3 after 64: half again as
//! wide as one that may be looked at once.

use super::COVERAGE;
use super::welch::POWER;
use sampling::moments::Moments;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// The prior variance of the effect size: the interval is narrowest around ten to a hundred replicates.
const PRIOR: f64 = 1.0;

/// Intervals of a mean, all of which hold together with probability `1 − alpha`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConfidenceSequence {
    /// The probability that any of the intervals misses the mean. For several quantities, divide it among them.
    pub alpha: f64,
}

impl Default for ConfidenceSequence {
    /// As sure as all other intervals are.
    fn default() -> Self {
        Self { alpha: 1.0 - COVERAGE }
    }
}

impl ConfidenceSequence {
    /// How far the interval reaches to either side of the mean; infinite as long as nothing is excluded, and where no variance has
    /// been seen yet in fewer than four values.
    pub fn reach(&self, values: &Moments) -> f64 {
        let n = values.n as f64;
        let growth = 1.0 + n * PRIOR;
        let k = (growth.sqrt() / self.alpha).powf(2.0 / n);
        if values.n < 4 || k >= growth {
            return f64::INFINITY;
        }
        let t = ((n - 1.0) * (k - 1.0) / (1.0 - k / growth)).sqrt();
        t * values.variance_of_mean().sqrt()
    }

    /// Evidence against `mean` being the mean: an e-value, whose expectation is at most 1 at any time if it is. Its inverse is a
    /// p-value that stays valid under peeking.
    pub fn evidence(values: &Moments, mean: f64) -> f64 {
        let n = values.n as f64;
        if values.n < 2 {
            return 1.0;
        }
        let square = (values.mean - mean).powi(2) / values.variance_of_mean() / (n - 1.0);
        if square.is_nan() {
            return 1.0;
        }
        let growth = 1.0 + n * PRIOR;
        // (1 + a)/(1 + a/g), which is g in the limit of a large a.
        let ratio = if square.is_infinite() { growth } else { (1.0 + square) / (1.0 + square / growth) };
        ratio.powf(n / 2.0) / growth.sqrt()
    }

    /// The largest relative error `|x̄ − μ| / |μ|` that the mean may have; infinite as long as the interval holds 0. To stop when it
    /// falls below a target leaves an error above the target with at most the probability alpha.
    pub fn relative_error(&self, values: &Moments) -> f64 {
        let (mean, reach) = (values.mean.abs(), self.reach(values));
        if mean > reach { reach / (mean - reach) } else { f64::INFINITY }
    }

    /// The bias between two methods that is found with probability [`POWER`] if it is there, given the differences of their
    /// replicates' means, one by one. (Methods take turns, and so have as many replicates each.) A bias is *found* when
    /// 0 is farther from the mean difference than [`reach`](Self::reach); that happens without a bias, at any time, with at most the
    /// probability alpha. Paired differences need no approximation where the variances are not the same, as Welch's test does.
    pub fn detectable_bias(&self, differences: &Moments) -> f64 {
        let power = StudentsT::new(0.0, 1.0, differences.n as f64 - 1.0).map_or(f64::NAN, |d| d.inverse_cdf(POWER));
        let reach = self.reach(differences);
        if reach.is_finite() { reach + power * differences.variance_of_mean().sqrt() } else { reach }
    }

    /// Whether the differences have another mean than 0.
    pub fn differ(&self, differences: &Moments) -> bool {
        differences.mean.abs() > self.reach(differences)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moments(n: u64, mean: f64, variance: f64) -> Moments {
        Moments { n, mean, m2: variance * (n as f64 - 1.0) }
    }

    #[test]
    fn reaches_are_those_of_the_formula() {
        let sequence = ConfidenceSequence::default();
        for (n, expected) in [(8, 4.25), (16, 3.51), (64, 3.32)] {
            let reach = sequence.reach(&moments(n, 0.0, 1.0)) * (n as f64).sqrt();
            assert!((reach - expected).abs() < 0.01, "{n}: {reach}");
        }
        assert_eq!(sequence.reach(&moments(3, 0.0, 1.0)), f64::INFINITY);
    }

    #[test]
    fn the_evidence_at_the_end_of_the_interval_is_one_over_alpha() {
        for n in [5, 8, 30, 1000] {
            let sequence = ConfidenceSequence { alpha: 0.01 };
            let values = moments(n, 3.0, 2.0);
            let reach = sequence.reach(&values);
            if reach.is_finite() {
                let evidence = ConfidenceSequence::evidence(&values, 3.0 + reach);
                assert!((evidence * 0.01 - 1.0).abs() < 1e-9, "{n}: {evidence}");
            }
        }
        assert_eq!(ConfidenceSequence::evidence(&moments(4, 1.0, 0.0), 1.0), 1.0);
        assert!(ConfidenceSequence::evidence(&moments(100, 1.0, 0.0), 2.0) > 1e90);
    }

    #[test]
    fn bounds_follow_from_the_reach() {
        let sequence = ConfidenceSequence::default();
        let values = moments(16, 10.0, 1.0);
        let reach = sequence.reach(&values);
        assert_eq!(sequence.relative_error(&values), reach / (10.0 - reach));
        assert_eq!(sequence.relative_error(&moments(16, 0.1, 1.0)), f64::INFINITY);
        assert!(sequence.detectable_bias(&values) > reach + 0.25 * 1.3);
        assert!(sequence.differ(&values) && !sequence.differ(&moments(16, 0.5, 1.0)));
        assert_eq!(sequence.reach(&moments(8, 1.0, 0.0)), 0.0);
    }
}
