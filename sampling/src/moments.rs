//! Running means, variances and covariances in f64 that can be merged `[Welford62]` `[Chan83]`.

use serde::{Deserialize, Serialize};

/// Count, mean and sum of squared deviations of a scalar.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Moments {
    /// The number of values.
    pub n: u64,
    /// Their mean; 0 of none.
    pub mean: f64,
    /// Σ (x − mean)².
    pub m2: f64,
}

impl Moments {
    /// Adds one value, by Welford's update `[Welford62]`.
    #[inline]
    pub fn push(&mut self, x: f64) {
        self.n += 1;
        let delta = x - self.mean;
        self.mean += delta / self.n as f64;
        self.m2 += delta * (x - self.mean);
    }

    /// Adds all that `other` has seen, by the pairwise update `[Chan83]`.
    #[inline]
    pub fn merge(&mut self, other: &Self) {
        if other.n == 0 {
            return;
        }
        let n = self.n + other.n;
        let delta = other.mean - self.mean;
        let share = other.n as f64 / n as f64;
        self.mean += delta * share;
        self.m2 += other.m2 + delta * delta * (self.n as f64 * share);
        self.n = n;
    }

    /// The unbiased sample variance; NaN for fewer than two values.
    #[inline]
    pub fn variance(&self) -> f64 {
        self.m2 / (self.n as f64 - 1.0).max(0.0)
    }

    /// The variance of the mean, [`variance`](Self::variance) / n.
    #[inline]
    pub fn variance_of_mean(&self) -> f64 {
        self.variance() / self.n as f64
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<I: IntoIterator<Item = f64>>(values: I) -> Self {
        let mut moments = Self::default();
        values.into_iter().for_each(|x| moments.push(x));
        moments
    }
}

/// Count, means and sums of products of deviations of a vector: the full covariance matrix.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CovarianceMoments {
    n: u64,
    mean: Vec<f64>,
    /// Σ (x_i − mean_i)(x_j − mean_j), rows of the lower triangle: i (i + 1) / 2 + j for j ≤ i.
    m2: Vec<f64>,
}

impl CovarianceMoments {
    /// No values yet of `dimensions` components.
    pub fn new(dimensions: usize) -> Self {
        Self { n: 0, mean: vec![0.0; dimensions], m2: vec![0.0; dimensions * (dimensions + 1) / 2] }
    }

    /// The number of components.
    pub fn dimensions(&self) -> usize {
        self.mean.len()
    }

    /// The number of vectors seen.
    pub fn n(&self) -> u64 {
        self.n
    }

    /// The mean of each component; 0 of none.
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Adds one vector.
    pub fn push(&mut self, x: &[f64]) {
        assert_eq!(x.len(), self.dimensions(), "components of a vector");
        self.n += 1;
        let n = self.n as f64;
        // Σ dx dyᵀ grows by (n − 1)/n · δδᵀ, with δ the deviation from the mean before this value.
        let growth = (n - 1.0) / n;
        let mut k = 0;
        for (i, xi) in x.iter().enumerate() {
            let di = growth * (xi - self.mean[i]);
            for (xj, mj) in x[..=i].iter().zip(&self.mean) {
                self.m2[k] += di * (xj - mj);
                k += 1;
            }
        }
        for (mean, x) in self.mean.iter_mut().zip(x) {
            *mean += (x - *mean) / n;
        }
    }

    /// Adds all that `other` has seen, by the pairwise update `[Chan83]`.
    pub fn merge(&mut self, other: &Self) {
        assert_eq!(other.dimensions(), self.dimensions(), "components of a vector");
        if other.n == 0 {
            return;
        }
        let n = self.n + other.n;
        let share = other.n as f64 / n as f64;
        let growth = self.n as f64 * share;
        let mut k = 0;
        for i in 0..self.dimensions() {
            let di = growth * (other.mean[i] - self.mean[i]);
            for j in 0..=i {
                self.m2[k] += other.m2[k] + di * (other.mean[j] - self.mean[j]);
                k += 1;
            }
        }
        for (mean, other) in self.mean.iter_mut().zip(&other.mean) {
            *mean += (other - *mean) * share;
        }
        self.n = n;
    }

    /// The unbiased sample covariance of two components; NaN for fewer than two vectors.
    pub fn covariance(&self, i: usize, j: usize) -> f64 {
        let (i, j) = (i.max(j), i.min(j));
        self.m2[i * (i + 1) / 2 + j] / (self.n as f64 - 1.0).max(0.0)
    }

    /// The unbiased sample variance of a component; NaN for fewer than two vectors.
    pub fn variance(&self, i: usize) -> f64 {
        self.covariance(i, i)
    }

    /// The unbiased sample variance of the sum of all components: the sum of the whole matrix.
    pub fn variance_of_sum(&self) -> f64 {
        let d = self.dimensions();
        (0..d).map(|i| (0..d).map(|j| self.covariance(i, j)).sum::<f64>()).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::Stream;

    /// Values with a mean of 10⁸ and a deviation of 1, where Σx² − n·mean² would lose every digit.
    fn values(n: usize) -> Vec<f64> {
        let mut stream = Stream::new(1, 2);
        (0..n).map(|_| 1e8 + f64::from(stream.next_f32()) * 12.0_f64.sqrt()).collect()
    }

    fn two_pass(x: &[f64], y: &[f64]) -> f64 {
        let n = x.len() as f64;
        let (mx, my) = (x.iter().sum::<f64>() / n, y.iter().sum::<f64>() / n);
        x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>() / (n - 1.0)
    }

    fn close(a: f64, b: f64, relative: f64) -> bool {
        (a - b).abs() <= relative * a.abs().max(b.abs())
    }

    #[test]
    fn the_variance_agrees_with_two_passes() {
        let x = values(1000);
        let m: Moments = x.iter().copied().collect();
        assert!(close(m.variance(), two_pass(&x, &x), 1e-6), "{} {}", m.variance(), two_pass(&x, &x));
        assert!(close(m.variance_of_mean() * 1000.0, m.variance(), 1e-15));
    }

    #[test]
    fn merging_any_partition_is_pushing_all() {
        let x = values(1000);
        let whole: Moments = x.iter().copied().collect();
        for cut in [0, 1, 2, 37, 500, 999, 1000] {
            let mut left: Moments = x[..cut].iter().copied().collect();
            let right: Moments = x[cut..].iter().copied().collect();
            let mut reversed = right;
            reversed.merge(&left);
            left.merge(&right);
            for merged in [left, reversed] {
                assert_eq!(merged.n, 1000);
                assert!(close(merged.mean, whole.mean, 1e-15), "cut {cut}");
                assert!(close(merged.variance(), whole.variance(), 1e-6), "cut {cut}");
            }
        }
    }

    #[test]
    fn the_variance_of_less_than_two_values_is_unknown() {
        assert!(Moments::default().variance().is_nan());
        assert!(std::iter::once(3.0).collect::<Moments>().variance().is_nan());
        assert!(CovarianceMoments::new(2).covariance(0, 1).is_nan());
    }

    #[test]
    fn equal_values_have_no_variance() {
        let m: Moments = std::iter::repeat_n(0.1, 100).collect();
        assert_eq!((m.mean, m.variance()), (0.1, 0.0));
    }

    #[test]
    fn covariances_agree_with_two_passes_and_merge() {
        let (a, b) = (values(900), values(1200)[300..].to_vec());
        let c: Vec<f64> = a.iter().zip(&b).map(|(a, b)| 0.5 * a - 2.0 * b).collect();
        let columns = [&a, &b, &c];
        let mut parts = [CovarianceMoments::new(3), CovarianceMoments::new(3), CovarianceMoments::new(3)];
        for row in 0..900 {
            parts[row % 3].push(&[a[row], b[row], c[row]]);
        }
        let mut merged = CovarianceMoments::new(3);
        parts.iter().for_each(|part| merged.merge(part));
        assert_eq!(merged.n(), 900);
        for i in 0..3 {
            for j in 0..3 {
                let expected = two_pass(columns[i], columns[j]);
                assert!((merged.covariance(i, j) - expected).abs() < 1e-6 * 4.0, "({i}, {j})");
            }
        }
        let sum: Vec<f64> = (0..900).map(|r| a[r] + b[r] + c[r]).collect();
        assert!(close(merged.variance_of_sum(), two_pass(&sum, &sum), 1e-5));
    }
}
