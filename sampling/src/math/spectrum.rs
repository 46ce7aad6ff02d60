//! Linear RGB.

use glam::Vec3A;
use serde::{Deserialize, Serialize};
use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Sub};

/// A quantity per colour channel: linear light with sRGB primaries, unclamped.
#[derive(Clone, Copy, Default, PartialEq, Debug, Serialize, Deserialize)]
#[serde(from = "[f32; 3]", into = "[f32; 3]")]
pub struct Spectrum(Vec3A);

impl Spectrum {
    /// Zero in every channel.
    pub const ZERO: Self = Self(Vec3A::ZERO);
    /// One in every channel.
    pub const ONE: Self = Self(Vec3A::ONE);

    /// Red, green and blue.
    #[inline]
    pub const fn new(r: f32, g: f32, b: f32) -> Self {
        Self(Vec3A::new(r, g, b))
    }

    /// The same value in every channel.
    #[inline]
    pub const fn splat(v: f32) -> Self {
        Self(Vec3A::splat(v))
    }

    /// Red, green and blue.
    #[inline]
    pub const fn to_array(self) -> [f32; 3] {
        self.0.to_array()
    }

    /// The largest channel.
    #[inline]
    pub fn max_component(self) -> f32 {
        self.0.max_element()
    }

    /// The mean of the channels.
    #[inline]
    pub fn mean(self) -> f32 {
        self.0.element_sum() * (1.0 / 3.0)
    }

    /// The relative luminance Y, of the primaries and the white of ITU-R BT.709.
    #[inline]
    pub fn luminance(self) -> f32 {
        self.0.dot(Vec3A::new(0.212_671, 0.715_160, 0.072_169))
    }

    /// Whether every channel is zero.
    #[inline]
    pub fn is_zero(self) -> bool {
        self.0 == Vec3A::ZERO
    }

    /// Whether no channel is infinite or NaN.
    #[inline]
    pub fn is_finite(self) -> bool {
        self.0.is_finite()
    }

    /// The square root of each channel.
    #[inline]
    pub fn sqrt(self) -> Self {
        Self(self.0.sqrt())
    }

    /// The exponential of each channel.
    #[inline]
    pub fn exp(self) -> Self {
        Self(self.0.exp())
    }

    /// The function applied to each channel.
    #[inline]
    pub fn map(self, f: impl Fn(f32) -> f32) -> Self {
        let [r, g, b] = self.to_array();
        Self::new(f(r), f(g), f(b))
    }

    /// The larger of the two, channel by channel.
    #[inline]
    pub fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    /// Channel by channel `if_true` where `self` ≥ 0, else `if_false`.
    #[inline]
    pub(crate) fn select_nonnegative(self, if_true: Self, if_false: Self) -> Self {
        Self(Vec3A::select(self.0.cmpge(Vec3A::ZERO), if_true.0, if_false.0))
    }

    /// The magnitude of each channel.
    #[inline]
    pub fn abs(self) -> Self {
        Self(self.0.abs())
    }
}

impl From<[f32; 3]> for Spectrum {
    #[inline]
    fn from(rgb: [f32; 3]) -> Self {
        Self(Vec3A::from_array(rgb))
    }
}

impl From<Spectrum> for [f32; 3] {
    #[inline]
    fn from(s: Spectrum) -> Self {
        s.to_array()
    }
}

macro_rules! binary_operators {
    ($($operator:ident $function:ident),*) => {$(
        impl $operator for Spectrum {
            type Output = Self;
            #[inline]
            fn $function(self, other: Self) -> Self {
                Self(self.0.$function(other.0))
            }
        }
        impl $operator<f32> for Spectrum {
            type Output = Self;
            #[inline]
            fn $function(self, other: f32) -> Self {
                Self(self.0.$function(other))
            }
        }
    )*};
}

binary_operators!(Add add, Sub sub, Mul mul, Div div);

impl Mul<Spectrum> for f32 {
    type Output = Spectrum;
    #[inline]
    fn mul(self, other: Spectrum) -> Spectrum {
        Spectrum(self * other.0)
    }
}

impl AddAssign for Spectrum {
    #[inline]
    fn add_assign(&mut self, other: Self) {
        self.0 += other.0;
    }
}

impl MulAssign for Spectrum {
    #[inline]
    fn mul_assign(&mut self, other: Self) {
        self.0 *= other.0;
    }
}

impl MulAssign<f32> for Spectrum {
    #[inline]
    fn mul_assign(&mut self, other: f32) {
        self.0 *= other;
    }
}

impl Sum for Spectrum {
    fn sum<I: Iterator<Item = Self>>(iter: I) -> Self {
        iter.fold(Self::ZERO, Add::add)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arithmetic_is_per_channel() {
        let a = Spectrum::new(1.0, 2.0, 4.0);
        assert_eq!((a * a + a - a / 2.0).to_array(), [1.5, 5.0, 18.0]);
        assert_eq!((2.0 * a).to_array(), [2.0, 4.0, 8.0]);
        assert_eq!([a, a].into_iter().sum::<Spectrum>(), a * 2.0);
        assert_eq!((a.max_component(), a.mean()), (4.0, 7.0 * (1.0 / 3.0)));
        assert_eq!(a.sqrt().to_array(), [1.0, 2.0_f32.sqrt(), 2.0]);
    }

    #[test]
    fn white_has_luminance_one() {
        assert!((Spectrum::ONE.luminance() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn the_hidden_fourth_lane_is_never_seen() {
        // 0/0 in the padding lane must not make a finite spectrum look infinite, nor zero look non-zero.
        let s = Spectrum::ZERO / Spectrum::ONE;
        assert!(s.is_finite() && s.is_zero());
        assert!((Spectrum::ONE / Spectrum::splat(2.0)).is_finite());
        assert!(!Spectrum::new(0.0, f32::NAN, 0.0).is_finite());
        assert!(!Spectrum::new(0.0, f32::NAN, 0.0).is_zero());
    }
}
