//! From linear light to what a screen shows: exposure in powers of two, then the exact sRGB curve, then 8 bits.

use std::fmt;

/// The 8-bit colour of a value that isn't finite: shown, not hidden.
const NOT_FINITE: [u8; 3] = [255, 0, 255];
/// What is bright, in linear light, once an image is well exposed.
const BRIGHT: f64 = 0.8;
/// The share of an image's lit pixels that is no brighter than [`BRIGHT`].
const SHARE: f64 = 0.95;

/// A factor of brightness, always a power of two.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Exposure {
    /// The exponent: +1 doubles.
    pub stops: i32,
}

impl Exposure {
    /// The factor itself.
    pub fn factor(self) -> f64 {
        (self.stops as f64).exp2()
    }

    /// The exposure under which 95 % of the lit pixels are at most bright; `None` where no pixel is lit.
    pub fn of(pixels: impl Iterator<Item = [f64; 3]>) -> Option<Self> {
        let mut lit: Vec<f64> =
            pixels.map(|p| p[0].max(p[1]).max(p[2])).filter(|&x| x > 0.0 && x.is_finite()).collect();
        if lit.is_empty() {
            return None;
        }
        let index = ((lit.len() - 1) as f64 * SHARE) as usize;
        let (_, bright, _) = lit.select_nth_unstable_by(index, f64::total_cmp);
        Some(Self { stops: (BRIGHT / *bright).log2().round() as i32 })
    }

    /// The middle one of several, so that images side by side share one exposure and no single method decides it.
    pub fn middle(exposures: impl Iterator<Item = Option<Self>>) -> Option<Self> {
        let mut known: Vec<Self> = exposures.flatten().collect();
        known.sort();
        known.get(known.len() / 2).copied()
    }

    /// The pixel on the screen. Negative light shows as black, light beyond the screen's as its brightest.
    pub fn apply(self, linear: [f64; 3]) -> [u8; 3] {
        if linear.iter().any(|x| !x.is_finite()) {
            return NOT_FINITE;
        }
        linear.map(|x| srgb(x * self.factor()))
    }
}

impl fmt::Display for Exposure {
    /// `×4`, `×1/16`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.stops {
            0.. => write!(f, "×{}", self.factor()),
            _ => write!(f, "×1/{}", 1.0 / self.factor()),
        }
    }
}

/// The sRGB curve of a linear value, in 8 bits [IEC 61966-2-1]; clamped to [0, 1], which a screen can't leave.
pub fn srgb(linear: f64) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let encoded = if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
    (encoded * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_has_its_known_values() {
        assert_eq!([0.0, 1.0, 0.5, 0.215_86, 0.003, 7.0, -1.0].map(srgb), [0, 255, 188, 128, 10, 255, 0]);
    }

    #[test]
    fn exposure_brings_the_bright_pixels_just_below_white_whatever_a_few_fireflies_do() {
        let mut pixels = vec![[0.05, 0.1, 0.02]; 1000];
        pixels.extend([[1e9; 3]; 5]);
        pixels.extend([[0.0; 3]; 5000]);
        let exposure = Exposure::of(pixels.into_iter()).unwrap();
        assert_eq!((exposure.stops, exposure.to_string().as_str()), (3, "×8"));
        assert_eq!(Exposure { stops: -4 }.to_string(), "×1/16");
        assert_eq!(Exposure::of([[0.0; 3], [f64::NAN; 3]].into_iter()), None);
    }

    #[test]
    fn what_is_not_finite_is_seen() {
        assert_eq!(Exposure::default().apply([0.1, f64::NAN, 0.1]), NOT_FINITE);
        assert_eq!(Exposure::default().apply([f64::INFINITY; 3]), NOT_FINITE);
    }

    #[test]
    fn side_by_side_the_middle_exposure_counts_and_black_images_do_not() {
        let exposures = [Some(3), None, Some(2), Some(9)].map(|s| s.map(|stops| Exposure { stops }));
        assert_eq!(Exposure::middle(exposures.into_iter()), Some(Exposure { stops: 3 }));
        assert_eq!(Exposure::middle(std::iter::empty()), None);
    }
}
