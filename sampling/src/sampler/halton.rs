//! Halton's sequence under random digit scrambling.

use super::{Purpose, Subpath};
use crate::rng::mix2;

/// How many dimensions there are: beyond, bases are so large that the points say nothing that chance does not.
const DIMENSIONS: usize = 512;

/// The bases: the first primes.
const PRIMES: [u16; DIMENSIONS] = primes();

const fn primes() -> [u16; DIMENSIONS] {
    let mut primes = [0; DIMENSIONS];
    let (mut count, mut candidate) = (0, 2);
    while count < DIMENSIONS {
        let mut i = 0;
        while i < count && candidate % primes[i] != 0 {
            i += 1;
        }
        if i == count {
            primes[count] = candidate;
            count += 1;
        }
        candidate += 1;
    }
    primes
}

/// The first of the dimensions of an address; `None` where there are none left.
///
/// The start of a path has eleven, then every vertex nine for each subpath.
#[inline]
pub fn dimension(subpath: Subpath, vertex: u32, purpose: Purpose) -> Option<usize> {
    let start = |offset| (vertex == 0).then_some(offset);
    let along = |offset| {
        let surface = (vertex as usize).checked_sub(1)?;
        let dimension = 11 + 9 * (2 * surface + subpath as usize) + offset;
        (dimension + 1 < DIMENSIONS).then_some(dimension)
    };
    match purpose {
        Purpose::Film => start(0),
        Purpose::Lens => start(2),
        Purpose::EmitterChoice => start(4),
        Purpose::EmitterPosition => start(5),
        Purpose::EmitterDirection => start(7),
        Purpose::Lobe => along(0),
        Purpose::Direction => along(1),
        Purpose::Roulette => along(3),
        Purpose::NextEmitter => along(4),
        Purpose::NextPosition => along(5),
        Purpose::NextCamera if vertex == 0 => start(9),
        Purpose::NextCamera => along(7),
        // So few scenes and settings ask for these that they leave the dimensions to the others.
        Purpose::ProbeChannel
        | Purpose::ProbePosition
        | Purpose::ProbeChoice
        | Purpose::NextEventChoice
        | Purpose::ConnectionChoice
        | Purpose::ConnectionRoulette
        | Purpose::Order
        | Purpose::Strategy
        | Purpose::Mutation => None,
    }
}

/// The radical inverse of `index` in the base of a dimension, every digit under a random permutation of its own, as a fraction of
/// 2³². `seed` chooses the permutations. The zeros beyond the last digit are permuted as well, down to the rounding of `f32`.
///
/// Permutations are affine, d ↦ a·d + c modulo the base, a ≠ 0 `[Matousek98]`: the base being prime, two digits go to any two that
/// differ with the same probability, so that variances are those of permutations chosen from all.
#[inline]
pub fn coordinate(index: u32, dimension: usize, seed: u64) -> u32 {
    let base = u32::from(PRIMES[dimension]);
    let mut rest = index;
    let (mut value, mut scale) = (0_u64, 1_u64);
    let mut place = 0;
    while scale < 1 << 26 {
        let hash = mix2(seed, (dimension as u64) << 8 | place);
        let (a, c) = (1 + below(base - 1, hash as u32), below(base, (hash >> 32) as u32));
        let digit = (a * (rest % base) + c) % base;
        value = value * u64::from(base) + u64::from(digit);
        scale *= u64::from(base);
        rest /= base;
        place += 1;
    }
    // Both are below 2³⁸, which f64 holds exactly.
    (value as f64 / scale as f64 * (1_u64 << 32) as f64) as u32
}

/// A number below `n` from random bits.
#[inline]
fn below(n: u32, bits: u32) -> u32 {
    ((u64::from(bits) * u64::from(n)) >> 32) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bases_are_primes() {
        assert_eq!(PRIMES[..6], [2, 3, 5, 7, 11, 13]);
        assert_eq!(PRIMES[511], 3671);
    }

    #[test]
    fn blocks_of_a_power_of_the_base_have_one_point_in_every_interval() {
        for (dimension, base) in [(0, 2_u32), (1, 3), (4, 11), (30, 127), (511, 3671)] {
            for seed in 1..20 {
                let n = if base < 20 { base * base } else { base };
                for first in [2, (1_u32 << 31) / n] {
                    let mut seen = vec![false; n as usize];
                    for index in first * n..(first + 1) * n {
                        let u = coordinate(index, dimension, seed);
                        // The middle of the finest interval, so that rounding leaves it where it is.
                        let cell = ((u64::from(u) + 32) * u64::from(n)) >> 32;
                        assert!(
                            !std::mem::replace(&mut seen[cell as usize], true),
                            "base {base}, seed {seed}, {index}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn places_on_the_camera_have_dimensions_from_every_vertex() {
        for subpath in [Subpath::Camera, Subpath::Light] {
            assert!((0..5).all(|vertex| dimension(subpath, vertex, Purpose::NextCamera).is_some()));
        }
    }

    #[test]
    fn no_two_addresses_share_a_dimension() {
        let purposes = [
            (Purpose::Lobe, 1),
            (Purpose::Direction, 2),
            (Purpose::Roulette, 1),
            (Purpose::NextEmitter, 1),
            (Purpose::NextPosition, 2),
            (Purpose::NextCamera, 2),
        ];
        let starts = [
            (Purpose::Film, 2),
            (Purpose::Lens, 2),
            (Purpose::EmitterChoice, 1),
            (Purpose::EmitterPosition, 2),
            (Purpose::EmitterDirection, 2),
            (Purpose::NextCamera, 2),
        ];
        let mut seen = vec![false; DIMENSIONS];
        let mut take = |first: usize, count: usize| {
            (first..first + count).for_each(|d| assert!(!std::mem::replace(&mut seen[d], true), "dimension {d}"));
        };
        starts.iter().for_each(|&(purpose, count)| take(dimension(Subpath::Camera, 0, purpose).unwrap(), count));
        for vertex in 1..40 {
            for subpath in [Subpath::Camera, Subpath::Light] {
                for (purpose, count) in purposes {
                    if let Some(first) = dimension(subpath, vertex, purpose) {
                        take(first, count);
                    }
                }
            }
        }
    }
}
