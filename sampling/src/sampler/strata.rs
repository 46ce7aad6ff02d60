//! Strata: cells of equal size with one sample in each, and permutations of their numbers.

use glam::{Vec2, vec2};

/// `n` cells of the unit square, `nx` × `ny`, as square as divisors of `n` allow (a prime gives a row).
#[derive(Clone, Copy, Debug)]
pub struct Strata {
    /// How many.
    pub n: u32,
    /// In a row.
    pub nx: u32,
    /// In a column.
    pub ny: u32,
}

impl Strata {
    /// The cells for `n` samples.
    pub fn new(n: u32) -> Self {
        let ny = (1..=n.isqrt()).rev().find(|d| n.is_multiple_of(*d)).unwrap_or(1);
        Self { n, nx: n / ny, ny }
    }

    /// The point `u` of a cell of the interval.
    #[inline]
    pub fn jitter_1d(self, stratum: u32, u: f32) -> f32 {
        in_cell(stratum, self.n, u)
    }

    /// The point `u` of a cell of the square.
    #[inline]
    pub fn jitter_2d(self, stratum: u32, u: Vec2) -> Vec2 {
        vec2(in_cell(stratum % self.nx, self.nx, u.x), in_cell(stratum / self.nx, self.ny, u.y))
    }

    /// Sample `i` of the correlated multi-jittered pattern numbered `seed` `[Kensler13]`: one sample in each cell, and one in
    /// each of the `n` rows and columns as well, where cells of a row share one order of their columns. `u` jitters within
    /// the finest cell.
    #[inline]
    pub fn multi_jitter(self, i: u32, seed: u32, u: Vec2) -> Vec2 {
        let i = permute(i, self.n, seed.wrapping_mul(0x5163_3e2d));
        let (column, row) = (i % self.nx, i / self.nx);
        let fine_x = permute(row, self.ny, seed.wrapping_mul(0x63d8_3595));
        let fine_y = permute(column, self.nx, seed.wrapping_mul(0xa511_e9b3));
        vec2(in_cell(column * self.ny + fine_x, self.n, u.x), in_cell(row * self.nx + fine_y, self.n, u.y))
    }
}

/// The point `u` of cell `i` of `n` in [0, 1); where rounding would reach 1, the number below it.
#[inline]
pub fn in_cell(i: u32, n: u32, u: f32) -> f32 {
    ((i as f32 + u) / n as f32).min(1.0_f32.next_down())
}

/// The image of `i` under the permutation of 0…`length`−1 numbered `seed` `[Kensler13]`.
#[inline]
pub fn permute(i: u32, length: u32, seed: u32) -> u32 {
    if length == 1 {
        return 0;
    }
    let mask = u32::MAX >> (length - 1).leading_zeros();
    let mut i = i;
    // A bijection of 0…mask, repeated until it falls below `length`: less than twice on average.
    loop {
        i ^= seed;
        i = i.wrapping_mul(0xe170_893d);
        i ^= seed >> 16;
        i ^= (i & mask) >> 4;
        i ^= seed >> 8;
        i = i.wrapping_mul(0x0929_eb3f);
        i ^= seed >> 23;
        i ^= (i & mask) >> 1;
        i = i.wrapping_mul(1 | seed >> 27);
        i = i.wrapping_mul(0x6935_fa69);
        i ^= (i & mask) >> 11;
        i = i.wrapping_mul(0x74dc_b303);
        i ^= (i & mask) >> 2;
        i = i.wrapping_mul(0x9e50_1cc3);
        i ^= (i & mask) >> 2;
        i = i.wrapping_mul(0xc860_a3df);
        i &= mask;
        i ^= i >> 5;
        if i < length {
            break;
        }
    }
    // (i + seed) mod length; the listing's own sum may wrap at 2³², which is no bijection.
    let shift = seed % length;
    if i < length - shift { i + shift } else { i - (length - shift) }
}
