//! Are these p-values uniform?

/// The Kolmogorov–Smirnov distance of values in [0, 1] from the uniform distribution: the largest difference between the share of
/// values below a number and that number.
pub fn distance(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let n = sorted.len() as f64;
    let steps = sorted.iter().enumerate().map(|(i, &x)| (x - i as f64 / n).max((i + 1) as f64 / n - x));
    steps.fold(0.0, f64::max)
}

/// The probability that so many uniform values have at least this distance.
///
/// Kolmogorov's series `2 Σ (−1)^(j−1) exp(−2 j² λ²)` at Stephens' `λ = (√n + 0.12 + 0.11/√n) d`, which makes it good to a
/// fiftieth from a few values on [Stephens 1970].
pub fn p_value(distance: f64, n: usize) -> f64 {
    let root = (n as f64).sqrt();
    let lambda = (root + 0.12 + 0.11 / root) * distance;
    if lambda < 0.2 {
        return 1.0;
    }
    let term = |j: i32| (if j % 2 == 1 { 2.0 } else { -2.0 }) * (-2.0 * f64::from(j * j) * lambda * lambda).exp();
    (1..=100).map(term).sum::<f64>().clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_are_those_of_scipy() {
        // scipy.stats.kstest([0.1, 0.4, 0.7], "uniform")
        assert!((distance(&[0.4, 0.7, 0.1]) - 0.3).abs() < 1e-12);
        assert!((distance(&[0.5]) - 0.5).abs() < 1e-12);
    }

    /// scipy.stats.kstwo.sf(d, n)
    #[test]
    fn p_values_are_those_of_scipy() {
        for (d, n, expected) in KNOWN {
            let p = p_value(d, n);
            assert!((p - expected).abs() < 0.02 * expected.max(0.1), "{d}, {n}: {p} for {expected}");
        }
    }

    const KNOWN: [(f64, usize, f64); 4] =
        [(0.3, 20, 0.043_07), (0.1, 100, 0.252_69), (0.03, 2000, 0.053_55), (0.04, 2000, 0.003_231)];
}
