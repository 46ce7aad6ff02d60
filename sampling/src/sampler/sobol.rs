//! Sobol's sequence under Owen's scrambling, in eight dimensions, and its first two by a handful of integer operations.
//!
//! What a path's first scattering depends on, from the place on the film on, are the eight dimensions of one sequence, so that samples
//! are spread over all of it: a highlight that one of many emitters makes in a part of a pixel needs place and choice together.
//! Every further direction shares a sequence with the point on an emitter that is sampled where it leads, and purposes that no dimension is
//! left for have a sequence each: such padding `[Burley20]` gives it an order and a scrambling of its own. Scrambled, a point is uniform in
//! the cube, so estimates are unbiased; every aligned block of 2ᵏ points has one in each elementary interval of volume 2⁻ᵏ of the first two
//! dimensions.

use super::{Purpose, Subpath};

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

/// The dimensions of [`coordinates`].
pub const DIMENSIONS: usize = 8;

/// The group of addresses that share a sequence, and the first of an address's dimensions there; `None` where it has a sequence of its own.
///
/// Group 1 is a walk's start and its first scattering; then there is one for every vertex that a walk scatters at. What is sampled of
/// emitters for a vertex is in the group of the vertex before, from which the direction came. Those for vertices 1 and 2 take the same dimensions of
/// group 1, each under a scrambling of its own: no order depends on both, and scrambled apart they are uncorrelated.
///
/// Points in a plane take a pair each, (0, 1), (2, 3) and (4, 5), whose projections are better spread than (3, 4) and (5, 6) are: of 16
/// points, (2, 3) has one in each of 16 equal parts of the square, however it is divided, and (3, 4) is sure of no more than four points in
/// each of 4 parts. Choices, which are of few, take what is left.
#[inline]
pub fn dimension(subpath: Subpath, vertex: u32, purpose: Purpose) -> Option<(u32, usize)> {
    use {Purpose::*, Subpath::*};
    match (vertex, subpath, purpose) {
        (0, Camera, Film) | (0, Light, EmitterPosition) => Some((1, 0)),
        (0, Light, EmitterDirection) => Some((1, 2)),
        (0, Light, EmitterChoice) => Some((1, 4)),
        (0, ..) => None,
        (1 | 2, Camera, NextPosition) => Some((1, 2)),
        (1 | 2, Camera, NextEmitter) => Some((1, 6)),
        (1, Camera, Direction) => Some((1, 4)),
        (1, Light, Direction) => Some((1, 5)),
        (1, _, Lobe) => Some((1, 7)),
        (1, ..) => None,
        (_, _, Direction) => Some((vertex, 0)),
        (_, Camera, NextPosition) => Some((vertex - 1, 2)),
        (_, Camera, NextEmitter) => Some((vertex - 1, 4)),
        (_, _, Lobe) => Some((vertex, 5)),
        (_, _, Roulette) => Some((vertex, 6)),
        _ => None,
    }
}

/// The point numbered `index`, in an order that `seed` chooses, before scrambling; bits in reverse, as [`scrambled`] takes them.
#[inline]
pub fn coordinates(index: u32, seed: u64) -> [u32; DIMENSIONS] {
    let index = shuffled(index, seed as u32);
    let mut point = [0; DIMENSIONS];
    for (digit, rows) in TABLE.iter().enumerate() {
        let row = &rows[(index >> (4 * digit) & 15) as usize];
        point.iter_mut().zip(row).for_each(|(x, bits)| *x ^= bits);
    }
    point
}

/// A coordinate under the scrambling that `seed` chooses, as a fraction of 2³².
#[inline]
pub fn scrambled(coordinate: u32, seed: u32) -> u32 {
    scramble(coordinate, seed).reverse_bits()
}

/// Primitive polynomials and first direction numbers of dimensions 2 to 8 `[Joe08]`: the degree; the inner coefficients, the highest
/// first; the numbers.
const POLYNOMIALS: [(usize, u32, [u32; 5]); DIMENSIONS - 1] = [
    (1, 0, [1, 0, 0, 0, 0]),
    (2, 1, [1, 3, 0, 0, 0]),
    (3, 1, [1, 3, 1, 0, 0]),
    (3, 2, [1, 1, 1, 0, 0]),
    (4, 1, [1, 1, 3, 3, 0]),
    (4, 4, [1, 3, 5, 13, 0]),
    (5, 2, [1, 1, 5, 5, 17]),
];

/// The share of every value of every four bits of an index in all coordinates, bits in reverse.
static TABLE: [[[u32; DIMENSIONS]; 16]; 8] = table();

const fn table() -> [[[u32; DIMENSIONS]; 16]; 8] {
    let mut table = [[[0; DIMENSIONS]; 16]; 8];
    let mut dimension = 0;
    while dimension < DIMENSIONS {
        let directions = directions(dimension);
        let mut value = 0;
        while value < 8 * 16 {
            let (digit, bits) = (value / 16, value % 16);
            let mut bit = 0;
            while bit < 4 {
                if bits >> bit & 1 == 1 {
                    table[digit][bits][dimension] ^= directions[4 * digit + bit].reverse_bits();
                }
                bit += 1;
            }
            value += 1;
        }
        dimension += 1;
    }
    table
}

/// The direction numbers of a dimension, as fractions of 2³² `[Joe08, (1) and (2)]`.
const fn directions(dimension: usize) -> [u32; 32] {
    let mut v = [0_u32; 32];
    let mut bit = 0;
    while bit < 32 {
        v[bit] = 1 << (31 - bit);
        if dimension > 0 {
            let (degree, inner, first) = POLYNOMIALS[dimension - 1];
            if bit < degree {
                v[bit] = first[bit] << (31 - bit);
            } else {
                v[bit] = v[bit - degree] ^ v[bit - degree] >> degree;
                let mut back = 1;
                while back < degree {
                    if inner >> (degree - 1 - back) & 1 == 1 {
                        v[bit] ^= v[bit - back];
                    }
                    back += 1;
                }
            }
        }
        bit += 1;
    }
    v
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

    /// The second coordinate by direction numbers, as defined, those of dimension 2 having the primitive polynomial x + 1.
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

    /// A point before shuffling and scrambling.
    fn plain(index: u32) -> [u32; DIMENSIONS] {
        let all = (0..8).map(|digit| TABLE[digit][(index >> (4 * digit) & 15) as usize]);
        all.fold([0; DIMENSIONS], |sum, row| std::array::from_fn(|d| sum[d] ^ row[d])).map(u32::reverse_bits)
    }

    #[test]
    fn the_sequence_is_sobols() {
        for index in (0..5000).chain([u32::MAX, 0x8000_0001, 0xdead_beef]) {
            let expected = by_definition(index);
            assert_eq!([index.reverse_bits(), pascal(index).reverse_bits()], expected, "{index}");
            assert_eq!(plain(index)[..2], expected, "{index}");
        }
        // The points numbered 1 to 4, in eighths, from the recurrence by hand.
        let eighths = |index| plain(index).map(|x| x >> 29);
        assert_eq!(eighths(1), [4; 8]);
        assert_eq!(eighths(2), [2, 6, 6, 6, 2, 2, 6, 2]);
        assert_eq!(eighths(3), [6, 2, 2, 2, 6, 6, 2, 6]);
        assert_eq!(eighths(4), [1, 5, 3, 1, 1, 3, 5, 5]);
    }

    /// Coordinates are scrambled by the upper half of a seed, and the order of points is chosen by the lower.
    #[test]
    fn every_bit_of_a_seed_counts() {
        let seed = 0x1234_5678_9abc_def0;
        for bit in 0..64 {
            let other = seed ^ 1 << bit;
            let differs = |number: &dyn Fn(u32, u64) -> u32| (0..64).any(|i| number(i, seed) != number(i, other));
            let (x, y) = (|i, seed| point(i, seed)[0], |i, seed| point(i, seed)[1]);
            assert!(differs(&x) && differs(&y) && differs(&point_1d), "bit {bit}");
        }
    }

    #[test]
    fn bits_are_spread_one_by_one() {
        for x in (0..32).map(|bit| 1 << bit).chain([0, u32::MAX, 0xdead_beef]) {
            let expected = (0..32).fold(0, |sum, bit| sum | u64::from(x >> bit & 1) << (2 * bit));
            assert_eq!(spread(x), expected, "{x:x}");
        }
    }

    /// Where a direction leads, an emitter is sampled by numbers of the same sequence.
    #[test]
    fn emitters_are_sampled_with_the_direction_that_led_there() {
        use Purpose::*;
        let group = |vertex, purpose| dimension(Subpath::Camera, vertex, purpose).map(|(group, _)| group);
        for vertex in 2..9 {
            let before = group(vertex - 1, Direction);
            assert!(before.is_some() && before == group(vertex, NextPosition) && before == group(vertex, NextEmitter));
            assert_ne!(before, group(vertex, Direction), "{vertex}");
        }
        assert_eq!((group(0, Film), group(1, Lobe)), (Some(1), Some(1)));
    }

    /// Every dimension is spread evenly, and so are any two and, where a place on the film meets what happens there, any five: a block
    /// of 2ᵏ points has 2ᵗ in each interval of volume 2ᵗ⁻ᵏ, with a small t that is part of the choice of polynomials.
    #[test]
    fn projections_are_nets() {
        let is_net = |dimensions: &[usize], k: u32, t: u32| {
            let points: Vec<[u32; DIMENSIONS]> = (0..1 << k).map(plain).collect();
            splits(k - t, dimensions.len()).iter().all(|split| {
                let cell = |point: &[u32; DIMENSIONS]| {
                    let digits =
                        dimensions.iter().zip(split).map(|(&d, &bits)| (u64::from(point[d]) >> (32 - bits), bits));
                    digits.fold(0, |cell, (digit, bits)| cell << bits | digit as usize)
                };
                let mut counts = vec![0; 1 << (k - t)];
                points.iter().for_each(|point| counts[cell(point)] += 1);
                counts.iter().all(|&count| count == 1 << t)
            })
        };
        for k in [4, 6, 8] {
            (0..DIMENSIONS).for_each(|d| assert!(is_net(&[d], k, 0), "{d}"));
            let expected: [(&[usize], u32); 6] =
                [(&[0, 1], 0), (&[3, 4], 2), (&[5, 6], 2), (&[0, 1, 2], 1), (&[0, 1, 2, 3, 4], 3), (&[0, 1, 5, 6], 3)];
            for (dimensions, t) in expected {
                assert!(is_net(dimensions, k, t), "{dimensions:?} at {k}");
            }
        }
    }

    /// All ways to share so many bits among so many dimensions.
    fn splits(bits: u32, dimensions: usize) -> Vec<Vec<u32>> {
        if dimensions == 1 {
            return vec![vec![bits]];
        }
        let first = |n: u32| splits(bits - n, dimensions - 1).into_iter().map(move |rest| [vec![n], rest].concat());
        (0..=bits).flat_map(first).collect()
    }

    /// But what is sampled of emitters for vertices 1 and 2, on which no order depends together.
    #[test]
    fn no_two_addresses_of_a_group_share_a_dimension() {
        use Purpose::*;
        let ones = [EmitterChoice, Lobe, Roulette, NextEmitter];
        let twos = [Film, Lens, EmitterPosition, EmitterDirection, Direction, NextPosition, NextCamera];
        let purposes = || ones.map(|p| (p, 1)).into_iter().chain(twos.map(|p| (p, 2)));
        for subpath in [Subpath::Camera, Subpath::Light] {
            for without in [1, 2] {
                let mut seen = std::collections::BTreeSet::new();
                for (vertex, (purpose, count)) in (0..6).flat_map(|v| purposes().map(move |p| (v, p))) {
                    let Some((group, first)) = dimension(subpath, vertex, purpose) else { continue };
                    if matches!(purpose, NextPosition | NextEmitter) && vertex == without {
                        continue;
                    }
                    for dimension in first..first + count {
                        assert!(dimension < DIMENSIONS, "{subpath:?}, vertex {vertex}, {purpose:?}");
                        assert!(seen.insert((group, dimension)), "{subpath:?}, vertex {vertex}, {purpose:?}");
                    }
                }
            }
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
