//! Pseudo-random bits: PCG32 streams `[ONeill14]` and the mixing that starts them. The only file that knows `rand_pcg`.

use rand::Rng;
use rand_pcg::Pcg32;

/// A PCG32 generator of uniform numbers.
#[derive(Clone, Debug)]
pub struct Stream(Pcg32);

impl Stream {
    /// The generator with this initial state and sequence.
    ///
    /// States must be well mixed, as [`mix`] leaves them: two PCG sequences that start from the same state are
    /// strongly correlated, so the sequence number alone does not make draws independent.
    #[inline]
    pub fn new(state: u64, sequence: u64) -> Self {
        Self(Pcg32::new(state, sequence))
    }

    /// 32 random bits.
    #[inline]
    pub fn next_u32(&mut self) -> u32 {
        self.0.next_u32()
    }

    /// A uniform multiple of 2⁻²⁴ in [0, 1).
    #[inline]
    pub fn next_f32(&mut self) -> f32 {
        unit_f32(self.next_u32())
    }
}

/// The upper 24 of 32 random bits as a number in [0, 1); the largest is 1 − 2⁻²⁴.
#[inline]
pub fn unit_f32(bits: u32) -> f32 {
    (bits >> 8) as f32 * (1.0 / (1 << 24) as f32)
}

/// 64 bits that each depend on all bits of `x` as if by chance; a bijection, the finaliser of SplitMix64 `[Steele14]`.
#[inline]
pub fn mix(x: u64) -> u64 {
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

/// The `index`-th output of the SplitMix64 generator with state `seed` `[Steele14]`: a bijection in either argument.
///
/// Repeated, it mixes any number of words: `mix2(mix2(a, b), c)`.
#[inline]
pub fn mix2(seed: u64, index: u64) -> u64 {
    mix(seed.wrapping_add(index.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stream_is_the_published_pcg32() {
        // First outputs of pcg32_srandom(42, 54) in O'Neill's reference implementation.
        let mut stream = Stream::new(42, 54);
        assert_eq!([0; 3].map(|_| stream.next_u32()), [0xa15c_02b7, 0x7b47_f409, 0xba1d_3330]);
    }

    #[test]
    fn the_unit_interval_is_half_open() {
        assert_eq!(unit_f32(0), 0.0);
        assert_eq!(unit_f32(u32::MAX), 1.0_f32.next_down());
    }

    #[test]
    fn mixing_avalanches() {
        // Flipping any input bit flips each output bit with a probability near one half. 64·64 cells of 4096
        // trials; a deviation beyond 6.5 standard errors has probability 4096 · 8e-11 by chance.
        const TRIALS: u64 = 4096;
        for bit in 0..64 {
            let mut flips = [0_u32; 64];
            for i in 0..TRIALS {
                let x = mix2(i, 7);
                let change = mix(x) ^ mix(x ^ (1 << bit));
                for (out, count) in flips.iter_mut().enumerate() {
                    *count += (change >> out & 1) as u32;
                }
            }
            for count in flips {
                let z = (f64::from(count) - 2048.0) / 32.0;
                assert!(z.abs() < 6.5, "bit {bit}: z = {z}");
            }
        }
    }
}
