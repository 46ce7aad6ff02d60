//! Pixel filters: how a pixel weights the light around its centre.
//!
//! A pixel's value is ∫ f(x − centre) L(x) dx over the film, with ∫ f = 1. Camera samples are placed by f itself; what lands on the
//! film anywhere, as a splat, is added to every pixel within reach, weighted by the same f.

use crate::distribution::Piecewise1D;
use crate::fault;
use glam::{Vec2, vec2};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::sync::OnceLock;
use std::{fmt, str::FromStr};

/// A pixel filter, the product of one function of x and the same of y. This is the list that settings and help read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Filter {
    /// The pixel's own square, all alike.
    #[default]
    Box,
    /// A tent of radius 1.
    Triangle,
    /// A Gaussian of standard deviation ½, less its value at radius 1.5, where it ends.
    Gaussian,
    /// A Gaussian of standard deviation ½, less its value at radius 2, where it ends.
    GaussianFull,
    /// The cubic of `[Mitchell88]` with B = C = ⅓ and radius 2; it has negative lobes.
    Mitchell,
    /// The window of `[Harris78]` with four terms, of radius 1.5.
    BlackmanHarris,
}

/// A place sampled by a filter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSample {
    /// The distance from the pixel's centre \[pixels\].
    pub offset: Vec2,
    /// f / density: 1 of positive filters but for the coarseness of a table. Of [`Mitchell`](Filter::Mitchell), whose density is
    /// that of |f|, some ±(∫ |f|)² = ±1.14; negative in its negative lobes.
    pub weight: f32,
}

/// The pieces of the tables by which filters without a simple inverse are sampled.
const PIECES: usize = 256;

impl Filter {
    /// Every filter.
    pub const ALL: &[Self] =
        &[Self::Box, Self::Triangle, Self::Gaussian, Self::GaussianFull, Self::Mitchell, Self::BlackmanHarris];

    /// Where it ends, in x and in y \[pixels\].
    #[inline]
    pub fn radius(self) -> f32 {
        match self {
            Self::Box => 0.5,
            Self::Triangle => 1.0,
            Self::Gaussian | Self::BlackmanHarris => 1.5,
            Self::GaussianFull | Self::Mitchell => 2.0,
        }
    }

    /// Whether f is negative somewhere, so that the weights of samples differ.
    #[inline]
    pub fn has_negative_lobes(self) -> bool {
        self == Self::Mitchell
    }

    /// f at a distance from the pixel's centre \[1/pixel²\].
    #[inline]
    pub fn eval(self, offset: Vec2) -> f32 {
        self.eval_1d(offset.x) * self.eval_1d(offset.y)
    }

    /// The factor of one coordinate \[1/pixel\].
    #[inline]
    pub fn eval_1d(self, x: f32) -> f32 {
        let (x, radius) = (x.abs(), self.radius());
        if x >= radius {
            return 0.0;
        }
        match self {
            Self::Box => 1.0,
            Self::Triangle => 1.0 - x,
            Self::Gaussian => GAUSSIAN_SCALE * ((-2.0 * x * x).exp() - GAUSSIAN_END),
            Self::GaussianFull => GAUSSIAN_FULL_SCALE * ((-2.0 * x * x).exp() - GAUSSIAN_FULL_END),
            Self::Mitchell => mitchell(x),
            Self::BlackmanHarris => blackman_harris(x / radius) / radius,
        }
    }

    /// A place with a density near |f|, from a point of the unit square; neighbouring points give neighbouring places.
    #[inline]
    pub fn sample(self, u: Vec2) -> FilterSample {
        match self {
            Self::Box => FilterSample { offset: u - 0.5, weight: 1.0 },
            Self::Triangle => FilterSample { offset: vec2(tent(u.x), tent(u.y)), weight: 1.0 },
            _ => {
                let ((x, weight_x), (y, weight_y)) = (self.sample_1d(u.x), self.sample_1d(u.y));
                FilterSample { offset: vec2(x, y), weight: fault!("filter_weight_dropped", weight_x * weight_y, 1.0) }
            }
        }
    }

    fn sample_1d(self, u: f32) -> (f32, f32) {
        let (place, pdf, _) = self.table().sample(u);
        let diameter = 2.0 * self.radius();
        let x = (place - 0.5) * diameter;
        (x, self.eval_1d(x) * diameter / pdf)
    }

    fn table(self) -> &'static Piecewise1D {
        static TABLES: [OnceLock<Piecewise1D>; Filter::ALL.len()] = [const { OnceLock::new() }; Filter::ALL.len()];
        TABLES[self as usize].get_or_init(|| {
            let middle = |i: usize| ((i as f32 + 0.5) / PIECES as f32 - 0.5) * 2.0 * self.radius();
            let weights: Vec<f64> = (0..PIECES).map(|i| f64::from(self.eval_1d(middle(i)).abs())).collect();
            Piecewise1D::new(&weights).expect("a filter is positive somewhere")
        })
    }
}

/// exp(−2 · 1.5²).
const GAUSSIAN_END: f32 = 0.011_108_997;
/// 1 / ∫ (exp(−2x²) − exp(−4.5)) dx over \[−1.5, 1.5\] = 1 / (√(π/2) erf(1.5 √2) − 3 exp(−4.5)).
const GAUSSIAN_SCALE: f32 = 0.821_960_5;

/// exp(−2 · 2²).
const GAUSSIAN_FULL_END: f32 = 3.354_626_2e-4;
/// The same over \[−2, 2\]: 1 / (√(π/2) erf(2 √2) − 4 exp(−8)).
const GAUSSIAN_FULL_SCALE: f32 = 0.798_790_4;

/// The density 1 − |x| at the place where its integral is u.
#[inline]
fn tent(u: f32) -> f32 {
    if u < 0.5 { (2.0 * u).sqrt() - 1.0 } else { 1.0 - (2.0 * (1.0 - u)).sqrt() }
}

/// Equation (8) of `[Mitchell88]` at x in \[0, 2) with B = C = ⅓.
fn mitchell(x: f32) -> f32 {
    if x < 1.0 {
        return ((7.0 * x - 12.0) * x * x + 16.0 / 3.0) / 6.0;
    }
    (((-7.0 / 3.0 * x + 12.0) * x - 20.0) * x + 32.0 / 3.0) / 6.0
}

/// The window on \[−1, 1\], normalised there.
fn blackman_harris(x: f32) -> f32 {
    const A: [f64; 4] = [0.358_75, 0.488_29, 0.141_28, 0.011_68];
    let angle = PI * (f64::from(x) + 1.0);
    let value = A[0] - A[1] * angle.cos() + A[2] * (2.0 * angle).cos() - A[3] * (3.0 * angle).cos();
    (value / (2.0 * A[0])) as f32
}

impl fmt::Display for Filter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Box => "box",
            Self::Triangle => "triangle",
            Self::Gaussian => "gaussian",
            Self::GaussianFull => "gaussian_full",
            Self::Mitchell => "mitchell",
            Self::BlackmanHarris => "blackman_harris",
        })
    }
}

impl FromStr for Filter {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.iter().copied().find(|filter| filter.to_string() == name).ok_or_else(|| {
            let names: Vec<String> = Self::ALL.iter().map(Self::to_string).collect();
            format!("`{name}` is not a pixel filter; there are {}", names.join(", "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ g over the filter's width, by the midpoint rule.
    fn integral(filter: Filter, g: impl Fn(f64) -> f64) -> f64 {
        const N: usize = 1 << 16;
        let radius = f64::from(filter.radius());
        (0..N).map(|i| g(((i as f64 + 0.5) / N as f64 - 0.5) * 2.0 * radius)).sum::<f64>() * 2.0 * radius / N as f64
    }

    #[test]
    fn filters_are_normalised_even_and_end_at_their_radius() {
        for &filter in Filter::ALL {
            let f = |x: f64| f64::from(filter.eval_1d(x as f32));
            assert!((integral(filter, f) - 1.0).abs() < 1e-6, "{filter}: {}", integral(filter, f));
            for i in 0..=50 {
                let x = i as f32 * 0.05;
                assert_eq!(filter.eval_1d(x), filter.eval_1d(-x), "{filter} at {x}");
                assert!(x < filter.radius() || filter.eval_1d(x) == 0.0, "{filter} at {x}");
            }
            let end = filter.eval_1d(filter.radius() - 1e-3);
            assert!(filter == Filter::Box || end.abs() < 3e-3, "{filter} ends at {end}");
        }
    }

    #[test]
    fn samples_give_the_integral_of_anything() {
        // The mean of weight · g over samples is ∫ f g. Midpoints of a fine grid of u take the place of chance.
        const N: usize = 1 << 19;
        for &filter in Filter::ALL {
            for g in
                [|x: f64| 1.0 + 0.0 * x, |x: f64| x, |x: f64| x * x, |x: f64| (3.0 * x).cos(), |x: f64| (2.0 * x).exp()]
            {
                let exact = integral(filter, |x| g(x) * f64::from(filter.eval_1d(x as f32)));
                let mean = (0..N)
                    .map(|i| {
                        let u = (i as f32 + 0.5) / N as f32;
                        let (x, weight) = match filter {
                            Filter::Box | Filter::Triangle => (filter.sample(vec2(u, 0.5)).offset.x, 1.0),
                            _ => filter.sample_1d(u),
                        };
                        f64::from(weight) * g(f64::from(x))
                    })
                    .sum::<f64>()
                    / N as f64;
                assert!((mean - exact).abs() < 2e-4 * exact.abs().max(1.0), "{filter}: {mean} {exact}");
            }
        }
    }

    #[test]
    fn places_stay_within_the_radius_and_follow_the_numbers() {
        for &filter in Filter::ALL {
            let mut last = -filter.radius();
            for i in 0..=1000 {
                let u = (i as f32 / 1000.0).min(1.0_f32.next_down());
                let x = filter.sample(vec2(u, 0.5)).offset.x;
                assert!(x >= last && x <= filter.radius(), "{filter}: {x} after {last}");
                last = x;
            }
        }
    }

    #[test]
    fn names_read_back() {
        for &filter in Filter::ALL {
            assert_eq!(filter.to_string().parse(), Ok(filter));
        }
        assert!("mitchel".parse::<Filter>().unwrap_err().contains("mitchell"));
    }
}
