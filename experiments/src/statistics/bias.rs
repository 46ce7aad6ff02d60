//! bias²: what is left of the error when noise is taken out.
//!
//! `c_r = ⟨(x_r − ref)(x̄_{r−1} − ref)⟩ − v̂`, and its weighted mean `Σ w_r c_r`, `w_r = 2 (r − 1)/(R (R − 1))`, is the mean over all pairs of
//! replicates. Let `S = Σ w_r² (c_r − c̄)²`. Where there is no bias, the `(r − 1) c_r` are martingale differences, and S estimates the
//! variance. Where bias dominates, `c_r − c̄ ≈ ⟨b (δ_r + δ̄_{r−1})⟩` is correlated over r and S is a third of the variance
//! `4 Var⟨b x_r⟩/R`, which itself grows with b². So the interval holds all values θ of bias² with `(c̄ − θ)² ≤ t² V(θ)` [as Wilson 1927
//! does for proportions], where V(θ) lies between S (or 3 S, above the estimate) and what S says of the worst case, a bias along the noise's
//! largest principal component: `S + √8 θ √S`. Student's t is that of R/2 − 1 degrees of freedom, since late c_r weigh most. The
//! interval is too wide rather than too narrow, by a factor of up to 3 above and 1.3 below where there is no bias.

use super::means::{NORMAL_QUANTILE, student_quantile};
use super::{Estimate, Interval};
use statrs::distribution::{ContinuousCDF, StudentsT};

/// Replicates from which on the interval of bias² is valid.
pub const BIAS_VALID_FROM: usize = 8;

/// bias² from `c_r` of the second replicate and those after it, and the standard error that the reference gives to it.
pub fn bias2(cross: &[f64], shared: f64) -> Estimate {
    let replicates = cross.len() + 1;
    let (value, spread) = mean_and_spread(cross);
    let interval = (replicates >= 6).then(|| bias2_interval(value, spread, shared, replicates));
    Estimate::new(value, interval, replicates, BIAS_VALID_FROM)
}

/// The p-value of the test that there is no bias: how often bias² looks as large as this where it is 0, by Student's t of R/2 − 1 degrees of
/// freedom. `None` for fewer replicates than it holds for.
pub fn no_bias(cross: &[f64], shared: f64) -> Option<f64> {
    let replicates = cross.len() + 1;
    if replicates < BIAS_VALID_FROM {
        return None;
    }
    let (value, spread) = mean_and_spread(cross);
    let t = value / spread.sqrt().hypot(shared);
    // Where nothing varies, nothing differs.
    if t.is_nan() {
        return Some(1.0);
    }
    StudentsT::new(0.0, 1.0, replicates as f64 / 2.0 - 1.0).ok().map(|d| d.sf(t))
}

/// The weighted mean, and S; neither is a number for a single replicate.
fn mean_and_spread(cross: &[f64]) -> (f64, f64) {
    if cross.is_empty() {
        return (f64::NAN, f64::NAN);
    }
    let all = ((cross.len() + 1) * cross.len()) as f64;
    let weights = (1..=cross.len()).map(|r| 2.0 * r as f64 / all);
    let value: f64 = weights.clone().zip(cross).map(|(w, c)| w * c).sum();
    (value, weights.zip(cross).map(|(w, c)| (w * (c - value)).powi(2)).sum())
}

/// All θ with `(value − θ)² ≤ t² V(θ)`: see this file's head.
fn bias2_interval(value: f64, spread: f64, shared: f64, replicates: usize) -> Interval {
    let t = student_quantile(replicates as f64 / 2.0 - 1.0);
    let worst = |theta: f64| spread + 8.0_f64.sqrt() * theta.max(0.0) * spread.sqrt();
    let above = |theta: f64| (3.0 * spread).max((3.0 * spread * theta / value.abs()).min(worst(theta)));
    let below = |theta: f64| (3.0 * spread).min(worst(theta));
    let reach = |variance: f64| (t * t * variance).sqrt().hypot(NORMAL_QUANTILE * shared);
    // Above, the noise grows with θ, but slower: the sequence rises to the end.
    let high = (0..100).fold(value, |high, _| value + reach(above(high)));
    // Below, it shrinks with θ, and the end lies where θ crosses what it reaches to.
    let (mut low, mut held) = (value - reach(3.0 * spread), value);
    for _ in 0..60 {
        let middle = 0.5 * (low + held);
        if middle < value - reach(below(middle)) { low = middle } else { held = middle }
    }
    (low, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_noisy_reference_widens_the_interval() {
        let cross = [0.01, -0.02, 0.015, 0.0, -0.01, 0.02, 0.005];
        let width = |shared: f64| bias2(&cross, shared).interval.map(|(low, high)| high - low).unwrap();
        assert!(width(0.1) > width(0.0));
        assert_eq!(bias2(&cross[..6], 0.0).interval, None);
        assert!(no_bias(&cross, 0.1) > Some(0.3) && no_bias(&cross[..6], 0.0).is_none());
        assert_eq!(no_bias(&[0.0; 9], 0.0), Some(1.0));
        let raised = cross.map(|c| c + 0.1);
        assert!(no_bias(&raised, 0.0) < Some(1e-3) && no_bias(&raised, 1.0) > Some(0.3));
    }
}
