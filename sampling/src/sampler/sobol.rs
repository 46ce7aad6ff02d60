//! Sobol's (0,2)-sequence under Owen's scrambling, both by a handful of integer operations.
//!
//! Higher dimensions are padded `[Burley20]`: every address has this same sequence, in an order and under a scrambling of its own.
//! Scrambled, a point is uniform in the square, so estimates are unbiased; every aligned block of 2ᵏ points has one in each
//! elementary interval of volume 2⁻ᵏ.

/// The point numbered `index`, in an order and under a scrambling that `seed` chooses; fractions of 2³².
#[inline]
pub fn point(index: u32, seed: u64) -> [u32; 2] {
    let index = shuffled(index, seed as u32);
    let seed_x = (seed >> 32) as u32;
    let seed_y = (seed.wrapping_mul(0xd6e8_feb8_6659_fd93) >> 32) as u32;
    [scramble(index, seed_x).reverse_bits(), scramble(pascal(index), seed_y).reverse_bits()]
}

/// The first coordinate of [`point`].
#[inline]
pub fn point_1d(index: u32, seed: u64) -> u32 {
    scramble(shuffled(index, seed as u32), (seed >> 32) as u32).reverse_bits()
}

/// The place of a sample in a nested uniform shuffle, which maps aligned blocks of 2ᵏ to such blocks.
#[inline]
fn shuffled(index: u32, seed: u32) -> u32 {
    scramble(index.reverse_bits(), seed).reverse_bits()
}

/// The bits of the second coordinate, least significant first: the product with Pascal's triangle modulo 2, which is a Kronecker
/// power of [1 1; 0 1] and so takes five steps instead of 32.
#[inline]
fn pascal(mut index: u32) -> u32 {
    index ^= (index >> 1) & 0x5555_5555;
    index ^= (index >> 2) & 0x3333_3333;
    index ^= (index >> 4) & 0x0f0f_0f0f;
    index ^= (index >> 8) & 0x00ff_00ff;
    index ^ (index >> 16)
}

/// Owen's scrambling of a number whose bits are given in reverse: each bit is flipped or not by a hash of the bits below it. The
/// hash is that of `[Laine11]`, which only carries upwards, with the multipliers of `[Vegdahl21]`.
#[inline]
fn scramble(mut bits: u32, seed: u32) -> u32 {
    bits ^= bits.wrapping_mul(0x3d20_adea);
    bits = bits.wrapping_add(seed);
    bits = bits.wrapping_mul((seed >> 16) | 1);
    bits ^= bits.wrapping_mul(0x0552_6c56);
    bits ^ bits.wrapping_mul(0x53a2_2864)
}

/// The permutations of four digits.
const PERMUTATIONS: [[u8; 4]; 24] = permutations();

const fn permutations() -> [[u8; 4]; 24] {
    let mut all = [[0; 4]; 24];
    let (mut code, mut count) = (0, 0);
    while code < 256 {
        let digits = [code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6];
        let mut seen = 0;
        let mut i = 0;
        while i < 4 {
            seen |= 1 << digits[i];
            i += 1;
        }
        if seen == 15 {
            all[count] = [digits[0] as u8, digits[1] as u8, digits[2] as u8, digits[3] as u8];
            count += 1;
        }
        code += 1;
    }
    all
}

/// Binary logarithms, rounded up, of what [`screen_index`] numbers.
#[derive(Clone, Copy, Debug)]
pub struct Screen {
    /// Of the longer side of the screen in pixels.
    pub log2_side: u32,
    /// Of the samples of a pixel.
    pub log2_samples: u32,
}

/// The place of a sample in one sequence for the whole screen `[Ahmed20]`: pixels follow one another along Morton's curve, whose
/// quarters are permuted at every level by a hash of the levels above it, and so are the samples of a pixel. So neighbouring
/// pixels share out the strata of the square among them, and their errors cancel when they are seen together.
#[inline]
pub fn screen_index(screen: Screen, (x, y): (u32, u32), sample: u32, seed: u64) -> u64 {
    let index = (spread(x) | spread(y) << 1) << screen.log2_samples | u64::from(sample);
    let mut result = 0;
    let mut shift = 2 * screen.log2_side + screen.log2_samples;
    // Digits of two bits from the top; a single bit at the end if their number is odd.
    while shift >= 2 {
        shift -= 2;
        let above = index >> (shift + 2);
        let permutation = crate::rng::mix2(seed, above << 6 | u64::from(shift)) >> 32;
        let digit = index >> shift & 3;
        result |= u64::from(PERMUTATIONS[((permutation * 24) >> 32) as usize][digit as usize]) << shift;
    }
    if shift == 1 {
        let flip = crate::rng::mix2(seed, (index >> 1) << 6 | 63) >> 63;
        result |= index & 1 ^ flip;
    }
    result
}

/// The bits of a number, each followed by a zero.
#[inline]
fn spread(x: u32) -> u64 {
    let mut x = u64::from(x);
    x = (x | x << 16) & 0x0000_ffff_0000_ffff;
    x = (x | x << 8) & 0x00ff_00ff_00ff_00ff;
    x = (x | x << 4) & 0x0f0f_0f0f_0f0f_0f0f;
    x = (x | x << 2) & 0x3333_3333_3333_3333;
    (x | x << 1) & 0x5555_5555_5555_5555
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By direction numbers, as defined: those of dimension 2 have the primitive polynomial x + 1.
    fn by_definition(index: u32) -> [u32; 2] {
        let mut direction = 1_u32 << 31;
        let mut point = [0; 2];
        for bit in 0..32 {
            if index >> bit & 1 == 1 {
                point[0] ^= 1 << (31 - bit);
                point[1] ^= direction;
            }
            direction ^= direction >> 1;
        }
        point
    }

    #[test]
    fn the_sequence_is_sobols() {
        for index in (0..5000).chain([u32::MAX, 0x8000_0001, 0xdead_beef]) {
            assert_eq!([index.reverse_bits(), pascal(index).reverse_bits()], by_definition(index), "{index}");
        }
    }

    #[test]
    fn every_block_is_a_net_however_scrambled() {
        for seed in (0..40).map(|i| crate::rng::mix(i + 1)) {
            for k in [1, 4, 7, 10] {
                let n = 1_u32 << k;
                let points: Vec<[u32; 2]> = (3 * n..4 * n).map(|i| point(i, seed)).collect();
                for a in 0..=k {
                    let mut cells = vec![0; n as usize];
                    for [x, y] in &points {
                        let (column, row) = (u64::from(*x) >> (32 - a), u64::from(*y) >> (32 - (k - a)));
                        cells[(column << (k - a) | row) as usize] += 1;
                    }
                    assert!(cells.iter().all(|&count| count == 1), "seed {seed}, {n} points, 2^{a} columns");
                }
            }
        }
    }

    #[test]
    fn scrambling_flips_each_bit_by_those_above_it_as_if_by_chance() {
        // Over seeds, each of the upper bits is one half of the time; given its prefix, two numbers that differ there agree about
        // half of the time below. A count beyond 6 standard errors has probability 2e-9 by chance.
        const SEEDS: u64 = 4096;
        for bit in 0..24 {
            let (mut ones, mut agree) = (0_i64, 0_i64);
            for seed in 0..SEEDS {
                let seed = crate::rng::mix(seed + 99);
                let scrambled = |x: u32| scramble(x.reverse_bits(), (seed >> 32) as u32).reverse_bits();
                let (a, b) = (scrambled(0x1234_5678), scrambled(0x1234_5678 ^ 1 << (31 - bit)));
                ones += i64::from(a >> (31 - bit) & 1);
                agree += i64::from(a >> (30 - bit) & 1 == b >> (30 - bit) & 1);
                assert_eq!((a ^ b) >> (31 - bit), 1, "bit {bit}");
            }
            for count in [ones, agree] {
                let z = (count as f64 - SEEDS as f64 / 2.0) / (SEEDS as f64 / 4.0).sqrt();
                assert!(z.abs() < 6.0, "bit {bit}: z = {z}");
            }
        }
    }

    #[test]
    fn the_screen_is_numbered_once() {
        for log2_samples in 0..4 {
            let screen = Screen { log2_side: 4, log2_samples };
            let mut seen = vec![false; 256 << log2_samples];
            for i in 0..256 << log2_samples {
                let index = screen_index(screen, (i & 15, i >> 4 & 15), i >> 8, 7);
                assert!(!std::mem::replace(&mut seen[index as usize], true), "{i}");
            }
        }
    }
}
