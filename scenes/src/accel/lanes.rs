//! Eight numbers side by side: what the kernels are written in, once for all processors.

use glam::Vec4;
use std::ops::{Add, Div, Mul, Sub};

/// How many numbers there are.
pub(super) const WIDTH: usize = 8;

/// Eight numbers, and what is done to all of them at once. Every operation but two is rounded by itself, so that all kinds give the
/// same bits; of those two no more is asked than what bounds cover.
pub(super) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Says that this machine can do it.
    type Proof: Copy;

    /// The same number in all lanes.
    fn splat(proof: Self::Proof, x: f32) -> Self;

    /// Eight numbers.
    fn load(proof: Self::Proof, from: &[f32; WIDTH]) -> Self;

    /// Four numbers, twice.
    fn load_twice(proof: Self::Proof, from: &[f32; WIDTH / 2]) -> Self;

    /// The numbers.
    fn to_array(self) -> [f32; WIDTH];

    /// The sum with a product, rounded once or twice, as is faster: for what has a bound on its rounding only.
    fn plus(self, a: Self, b: Self) -> Self;

    /// The difference to a product, rounded once or twice.
    fn minus(self, a: Self, b: Self) -> Self;

    /// The lesser of two, lane by lane; the second if either is NaN or they are equal.
    fn min(self, other: Self) -> Self;

    /// The greater of two, lane by lane; the second if either is NaN or they are equal.
    fn max(self, other: Self) -> Self;

    /// The magnitudes.
    fn abs(self) -> Self;

    /// The lanes that are at most those of another, as bits.
    fn at_most(self, other: Self) -> u32;

    /// The lanes whose sign is not that of another's, as bits.
    fn differs_in_sign(self, other: Self) -> u32;
}

/// Eight numbers in two vectors of four, for any processor.
#[derive(Clone, Copy)]
pub(super) struct Portable(Vec4, Vec4);

impl Add for Portable {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Portable(self.0 + other.0, self.1 + other.1)
    }
}

impl Sub for Portable {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Portable(self.0 - other.0, self.1 - other.1)
    }
}

impl Mul for Portable {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Portable(self.0 * other.0, self.1 * other.1)
    }
}

impl Div for Portable {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        Portable(self.0 / other.0, self.1 / other.1)
    }
}

impl Lanes for Portable {
    type Proof = ();

    #[inline(always)]
    fn splat(_: (), x: f32) -> Self {
        Portable(Vec4::splat(x), Vec4::splat(x))
    }

    #[inline(always)]
    fn load(_: (), from: &[f32; WIDTH]) -> Self {
        let [a, b, c, d, e, f, g, h] = *from;
        Portable(Vec4::new(a, b, c, d), Vec4::new(e, f, g, h))
    }

    #[inline(always)]
    fn load_twice(_: (), from: &[f32; WIDTH / 2]) -> Self {
        let four = Vec4::from_array(*from);
        Portable(four, four)
    }

    #[inline(always)]
    fn to_array(self) -> [f32; WIDTH] {
        let ([a, b, c, d], [e, f, g, h]) = (self.0.to_array(), self.1.to_array());
        [a, b, c, d, e, f, g, h]
    }

    #[inline(always)]
    fn plus(self, a: Self, b: Self) -> Self {
        self + a * b
    }

    #[inline(always)]
    fn minus(self, a: Self, b: Self) -> Self {
        self - a * b
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Portable(self.0.min(other.0), self.1.min(other.1))
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Portable(self.0.max(other.0), self.1.max(other.1))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Portable(self.0.abs(), self.1.abs())
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> u32 {
        self.0.cmple(other.0).bitmask() | self.1.cmple(other.1).bitmask() << 4
    }

    #[inline(always)]
    fn differs_in_sign(self, other: Self) -> u32 {
        let signs = |v: Vec4| v.is_negative_bitmask();
        (signs(self.0) ^ signs(other.0)) | (signs(self.1) ^ signs(other.1)) << 4
    }
}
