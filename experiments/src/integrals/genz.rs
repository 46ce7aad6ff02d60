//! The test functions of [Genz 1984].
//!
//! Each has a vector a, which says how hard it is in every dimension, and a vector u, which says where its feature lies. Here a
//! rises from dimension to dimension and its sum is given, so that a function is about as hard in many dimensions as in few; u is
//! a fixed sequence that no power of two divides.

use statrs::function::erf::erf;
use std::f64::consts::{PI, TAU};

/// A family of functions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Genz {
    /// cos(2πu₁ + Σ aᵢxᵢ).
    Oscillatory,
    /// Π 1 / (aᵢ⁻² + (xᵢ − uᵢ)²).
    ProductPeak,
    /// (1 + Σ aᵢxᵢ)⁻⁽ᵈ⁺¹⁾.
    CornerPeak,
    /// exp(−Σ aᵢ²(xᵢ − uᵢ)²).
    Gaussian,
    /// exp(−Σ aᵢ|xᵢ − uᵢ|), which has a kink.
    Continuous,
    /// exp(Σ aᵢxᵢ) where x₁ < u₁ and x₂ < u₂, else 0.
    Discontinuous,
}

impl Genz {
    /// All families.
    pub const ALL: [Self; 6] =
        [Self::Oscillatory, Self::ProductPeak, Self::CornerPeak, Self::Gaussian, Self::Continuous, Self::Discontinuous];

    /// What it is called.
    pub fn name(self) -> &'static str {
        match self {
            Self::Oscillatory => "oscillatory",
            Self::ProductPeak => "product_peak",
            Self::CornerPeak => "corner_peak",
            Self::Gaussian => "gaussian",
            Self::Continuous => "continuous",
            Self::Discontinuous => "discontinuous",
        }
    }

    /// The sum of all aᵢ.
    fn difficulty(self) -> f64 {
        match self {
            Self::Oscillatory => 9.0,
            Self::ProductPeak => 7.25,
            Self::CornerPeak => 1.85,
            Self::Gaussian => 7.03,
            Self::Continuous => 20.4,
            Self::Discontinuous => 4.3,
        }
    }

    /// (aᵢ, uᵢ) of a dimension counted from 0, out of `d`. The odd numbers up to 2d − 1 add up to d².
    #[inline]
    fn parameters(self, i: usize, d: usize) -> (f64, f64) {
        let place = ((i + 1) as f64 * 0.618_033_988_749_895).fract();
        (self.difficulty() * (2 * i + 1) as f64 / (d * d) as f64, 0.3 + 0.4 * place)
    }

    /// Its value at x, in as many dimensions as that has.
    #[inline]
    pub fn eval(self, x: &[f64]) -> f64 {
        let d = x.len();
        let terms = || x.iter().enumerate().map(|(i, &x)| (x, self.parameters(i, d)));
        let weighted = || terms().map(|(x, (a, _))| a * x).sum::<f64>();
        match self {
            Self::Oscillatory => (TAU * self.parameters(0, d).1 + weighted()).cos(),
            Self::ProductPeak => terms().map(|(x, (a, u))| 1.0 / (1.0 / (a * a) + (x - u) * (x - u))).product(),
            Self::CornerPeak => (1.0 + weighted()).powi(-(d as i32 + 1)),
            Self::Gaussian => (-terms().map(|(x, (a, u))| (a * (x - u)).powi(2)).sum::<f64>()).exp(),
            Self::Continuous => (-terms().map(|(x, (a, u))| a * (x - u).abs()).sum::<f64>()).exp(),
            Self::Discontinuous if terms().take(2).all(|(x, (_, u))| x < u) => weighted().exp(),
            Self::Discontinuous => 0.0,
        }
    }

    /// Its integral over the unit cube of `d` dimensions.
    pub fn exact(self, d: usize) -> f64 {
        let all = || (0..d).map(|i| self.parameters(i, d));
        let product = |factor: &dyn Fn(f64, f64) -> f64| all().map(|(a, u)| factor(a, u)).product::<f64>();
        match self {
            // The real part of exp(2πiu₁) Π (exp(iaⱼ) − 1) / iaⱼ.
            Self::Oscillatory => {
                let phase = TAU * self.parameters(0, d).1 + all().map(|(a, _)| a / 2.0).sum::<f64>();
                phase.cos() * product(&|a, _| (a / 2.0).sin() / (a / 2.0))
            }
            Self::ProductPeak => product(&|a, u| a * ((a * (1.0 - u)).atan() + (a * u).atan())),
            Self::CornerPeak => corner_peak(&all().map(|(a, _)| a).collect::<Vec<_>>()),
            Self::Gaussian => product(&|a, u| PI.sqrt() / (2.0 * a) * (erf(a * (1.0 - u)) + erf(a * u))),
            Self::Continuous => product(&|a, u| (2.0 - (-a * u).exp() - (-a * (1.0 - u)).exp()) / a),
            Self::Discontinuous => {
                let end = |i: usize, u: f64| if i < 2 { u } else { 1.0 };
                all().enumerate().map(|(i, (a, u))| (a * end(i, u)).exp_m1() / a).product()
            }
        }
    }
}

/// Σ over the corners v of (−1)^|v| / (1 + a·v), over d! Π aᵢ.
fn corner_peak(a: &[f64]) -> f64 {
    let corner = |v: usize| {
        let chosen = || a.iter().enumerate().filter(move |(i, _)| v >> i & 1 == 1);
        let sign = if chosen().count() % 2 == 0 { 1.0 } else { -1.0 };
        sign / (1.0 + chosen().map(|(_, a)| a).sum::<f64>())
    };
    let factorial: f64 = (1..=a.len()).map(|n| n as f64).product();
    (0..1 << a.len()).map(corner).sum::<f64>() / (factorial * a.iter().product::<f64>())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By the midpoint rule, whose error is quadratic in the step, and linear along the jump of the last family.
    #[test]
    fn closed_forms_are_the_integrals_in_two_dimensions() {
        const N: usize = 2000;
        for family in Genz::ALL {
            let middle = |i: usize| (i as f64 + 0.5) / N as f64;
            let row = |i: usize| (0..N).map(|j| family.eval(&[middle(i), middle(j)])).sum::<f64>();
            let quadrature = (0..N).map(row).sum::<f64>() / (N * N) as f64;
            let error = if family == Genz::Discontinuous { 2e-3 } else { 2e-6 };
            let exact = family.exact(2);
            assert!((quadrature - exact).abs() < error * exact.abs(), "{family:?}: {quadrature} {exact}");
        }
    }
}
