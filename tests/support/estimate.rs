//! Estimates and what is known of their distribution.

/// An estimate: the mean of independent replicates.
#[derive(Clone, Copy, Debug)]
pub struct Estimate {
    /// The mean.
    pub mean: f64,
    /// Its standard error.
    pub error: f64,
    /// Skewness of its distribution: the standardised third cumulant of the mean, that of a replicate over √n.
    pub skewness: f64,
    /// Degrees of freedom of its standard error; infinite for a number that is known.
    pub freedom: f64,
}

impl Estimate {
    /// The mean of independent values.
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let moment = |power: i32| values.iter().map(|x| (x - mean).powi(power)).sum::<f64>() / n;
        let variance = moment(2);
        let skewness = if variance > 0.0 { moment(3) / variance.powf(1.5) } else { 0.0 };
        Self {
            mean,
            error: (variance / (n - 1.0)).sqrt(),
            // Fisher's correction for bias, then that of a mean of n.
            skewness: skewness * (n * (n - 1.0)).sqrt() / (n - 2.0) / n.sqrt(),
            freedom: n - 1.0,
        }
    }

    /// A number that is known.
    pub fn exact(value: f64) -> Self {
        Self { mean: value, error: 0.0, skewness: 0.0, freedom: f64::INFINITY }
    }

    /// Whether it is a known number.
    pub fn is_exact(&self) -> bool {
        self.freedom.is_infinite()
    }

    /// How strongly its distribution leans: its skewness, or the least that a mean of values ≥ 0 can have if that is more.
    ///
    /// A sum of rare contributions X ≥ 0 is compound Poisson; its standardised third cumulant E X³ / (√N (E X²)^(3/2)) is at
    /// least its relative error √(E X²) / (√N E X), since (E X²)² ≤ E X · E X³. It is infinite where nothing was seen.
    pub fn lean(&self) -> f64 {
        match (self.is_exact(), self.mean == 0.0) {
            (true, _) => 0.0,
            (false, true) => f64::INFINITY,
            (false, false) => self.skewness.max(self.error / self.mean.abs()),
        }
    }

    /// The same towards large values: only what a filter's negative lobes bring leads there.
    pub fn lean_upwards(&self) -> f64 {
        match (self.is_exact(), self.mean <= 0.0) {
            (true, _) => 0.0,
            (false, true) => Self { mean: -self.mean, skewness: -self.skewness, ..*self }.lean(),
            (false, false) => -self.skewness,
        }
    }
}
