//! Errors over a screen of which every pixel estimates the same integral: what the eye sees of a sampler.

use super::{Integral, Numbers};
use sampling::sampler::{Role, Sampler, SamplerKind, StreamKey};
use std::f64::consts::TAU;

/// Errors, row by row from the top, of a square screen.
pub struct Screen {
    /// Pixels in a row, and rows.
    pub side: usize,
    /// Estimate less truth.
    pub errors: Vec<f64>,
}

impl Screen {
    /// The errors of one replicate at so many samples a pixel.
    pub fn new(integral: Integral, kind: SamplerKind, samples: u32, side: u32, replicate: u32) -> Self {
        let key = StreamKey::new(0, &format!("screen, {kind}"), Role::Estimate, replicate);
        let mut sampler = Sampler::new(kind, key, samples, (side, side));
        let exact = integral.exact();
        let mut error = |pixel| {
            let value = |sample| {
                sampler.start_sample(pixel, sample);
                integral.eval(&Numbers::draw(&mut sampler))
            };
            (0..samples).map(value).sum::<f64>() / f64::from(samples) - exact
        };
        let errors = (0..u64::from(side) * u64::from(side)).map(&mut error).collect();
        Self { side: side as usize, errors }
    }

    /// Root of the mean squared error.
    pub fn rms(&self) -> f64 {
        (self.errors.iter().map(|e| e * e).sum::<f64>() / self.errors.len() as f64).sqrt()
    }

    /// Mean squared error by spatial frequency: |Fourier transform|² over the number of pixels, frequency zero in the middle. Its
    /// mean is the mean squared error.
    pub fn power(&self) -> Vec<f64> {
        let n = self.side;
        let wave: Vec<(f64, f64)> = (0..n).map(|i| (TAU * i as f64 / n as f64).sin_cos()).collect();
        // One dimension at a time: rows, then columns of the result.
        let transform = |line: &dyn Fn(usize) -> (f64, f64), frequency: usize| {
            let term = |i: usize| {
                let ((re, im), (sin, cos)) = (line(i), wave[i * frequency % n]);
                (re * cos + im * sin, im * cos - re * sin)
            };
            (0..n).map(term).fold((0.0, 0.0), |sum, t| (sum.0 + t.0, sum.1 + t.1))
        };
        let places = || (0..n * n).map(|at| (at / n, (at % n + n - n / 2) % n));
        let rows: Vec<(f64, f64)> = places().map(|(y, u)| transform(&|x| (self.errors[y * n + x], 0.0), u)).collect();
        let power = |(v, at): (usize, usize)| {
            let (re, im) = transform(&|y| rows[y * n + at], (v + n - n / 2) % n);
            (re * re + im * im) / (n * n) as f64
        };
        (0..n * n).map(|i| power((i / n, i % n))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn power_is_that_of_the_errors_and_a_wave_has_its_frequency() {
        let screen = Screen::new(Integral::Edge, SamplerKind::Zsobol, 4, 8, 0);
        let mean = screen.power().iter().sum::<f64>() / 64.0;
        assert!((mean - screen.rms().powi(2)).abs() < 1e-12, "{mean} {}", screen.rms().powi(2));

        let wave = |x: usize, y: usize| (TAU * (2.0 * x as f64 + y as f64) / 8.0).cos();
        let power = Screen { side: 8, errors: (0..64).map(|i| wave(i % 8, i / 8)).collect() }.power();
        // Frequencies (2, 1) and (−2, −1), zero being at (4, 4).
        for (i, p) in power.into_iter().enumerate() {
            let expected = if i == 5 * 8 + 6 || i == 3 * 8 + 2 { 16.0 } else { 0.0 };
            assert!((p - expected).abs() < 1e-9, "{i}: {p}");
        }
    }
}
