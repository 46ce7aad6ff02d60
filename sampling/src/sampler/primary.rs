//! Points of the primary sample space as a Markov chain visits them `[Kelemen02]`: all the numbers that a sample may ask for.
//!
//! A chain's state is the numbers of the sample that it last began afresh, and the small steps that it has taken since. Both are found
//! by address, as the numbers of independent samples are: what a number is does not depend on which others were asked for, nor when.
//! So nothing has to be undone where a step is refused, and a number that nobody has asked for costs nothing: those kept here
//! only save finding the same steps again (Kelemen's lazy mutation, with the count of steps for a time stamp).
//!
//! Numbers are fractions of 2³², and a small step is added modulo 2³²: a translation of a cycle, which keeps uniform numbers
//! exactly uniform, and goes either way with the same probability.

use super::{Purpose, Sampler, SamplerKind, StreamKey, Subpath, stream};
use crate::math::elementary::exp;
use crate::rng::unit_f32;

/// The ratio of the largest of small steps to the smallest, that of `[Kelemen02]`: 1/64 to 1/1024.
const RATIO: f32 = 16.0;

/// Addresses of one vertex of one subpath.
const PURPOSES: usize = Purpose::LAST as usize + 1;

/// The numbers at one address, as they were after some of the steps that the chain has taken.
#[derive(Clone, Copy, Debug, Default)]
struct Slot {
    bits: [u32; 2],
    /// Which of the chain's fresh samples they are of; 0 is none.
    era: u32,
    /// How many steps after it.
    steps: u32,
}

/// A chain's state.
#[derive(Clone, Debug, Default)]
pub(super) struct Primary {
    /// The largest small step, as a fraction of 2³².
    largest: f32,
    /// Whether the sample at work is a small step from the state.
    pub near: bool,
    /// Keys the numbers of the last fresh sample that was accepted.
    fresh: u64,
    /// How many of them there were.
    era: u32,
    /// Keys the small steps accepted since.
    steps: Vec<u64>,
    slots: Vec<Slot>,
}

impl Sampler {
    /// A sampler for a Markov chain through the space of all numbers that a sample may ask for, none at vertices beyond some
    /// thousands. Samples begin [afresh](Self::start_sample), as independent ones do, or [near](Self::start_near) the last one that was
    /// [accepted](Self::accept), every number a small step from what it was there: `largest_step` or less, at the most ½.
    pub fn of_chain(key: StreamKey, largest_step: f32) -> Self {
        let independent = Self::new(SamplerKind::Independent, key, 1, (1, 1));
        let largest = largest_step * 4_294_967_296.0;
        Self { kind: None, primary: Primary { largest, ..Primary::default() }, ..independent }
    }

    /// Turns to a sample near the last one that was accepted; steps of different addresses, as of `start_sample`, are independent.
    pub fn start_near(&mut self, pixel: u64, sample: u32) {
        self.start_sample(pixel, sample);
        self.primary.near = true;
    }

    /// Takes the sample at work for the chain's state, from which the next ones step.
    pub fn accept(&mut self) {
        self.primary.accept(self.sample_state);
    }
}

impl Primary {
    /// Takes the sample keyed by `sample_state` for the chain's state.
    fn accept(&mut self, sample_state: u64) {
        if self.near {
            self.steps.push(sample_state);
            return;
        }
        self.fresh = sample_state;
        self.era += 1;
        self.steps.clear();
    }

    /// The numbers of the sample at work at an address.
    #[inline(never)]
    pub fn numbers<const N: usize>(
        &mut self,
        sample_state: u64,
        address: u64,
        (subpath, vertex, purpose): (Subpath, u32, Purpose),
    ) -> [f32; N] {
        if !self.near {
            return fresh(sample_state, address).map(unit_f32);
        }
        let index = (vertex as usize * 2 + subpath as usize) * PURPOSES + purpose as usize;
        if index >= self.slots.len() {
            self.slots.resize(index + 1, Slot::default());
        }
        let slot = &mut self.slots[index];
        let mut bits: [u32; N] = std::array::from_fn(|i| slot.bits[i]);
        if slot.era != self.era {
            bits = fresh(self.fresh, address);
            slot.steps = 0;
        }
        for &step in &self.steps[slot.steps as usize..] {
            bits = moved(bits, self.largest, step, address);
        }
        slot.bits[..N].copy_from_slice(&bits);
        (slot.era, slot.steps) = (self.era, self.steps.len() as u32);
        moved(bits, self.largest, sample_state, address).map(unit_f32)
    }
}

/// The numbers of an independent sample, as bits.
#[inline]
fn fresh<const N: usize>(state: u64, address: u64) -> [u32; N] {
    let mut stream = stream(state, address);
    std::array::from_fn(|_| stream.next_u32())
}

/// Numbers one small step on.
#[inline]
fn moved<const N: usize>(bits: [u32; N], largest: f32, state: u64, address: u64) -> [u32; N] {
    let mut stream = stream(state, address);
    bits.map(|bits| small_step(bits, largest, stream.next_u32()))
}

/// A number one small step on, up or down by `largest · 16^(−u)` with a uniform u: the logarithm of the step is uniform
/// `[Kelemen02, §4]`.
#[inline]
fn small_step(bits: u32, largest: f32, random: u32) -> u32 {
    let size = (largest * exp(unit_f32(random) * -RATIO.ln())) as u32;
    // The bit is none of those that the size is made of.
    if random & 1 == 0 { bits.wrapping_add(size) } else { bits.wrapping_sub(size) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rng::mix;
    use crate::sampler::Role;
    use glam::Vec2;

    const LARGEST: f32 = 1.0 / 64.0;

    fn sampler() -> Sampler {
        Sampler::of_chain(StreamKey::new(3, "chain", Role::Estimate, 0), LARGEST)
    }

    /// The numbers at some addresses, in the order asked for.
    fn look(sampler: &mut Sampler, vertices: &[u32]) -> Vec<(f32, Vec2)> {
        let mut look = |&vertex: &u32| {
            sampler.start_vertex(Subpath::Light, vertex);
            let uc = sampler.get_1d(Purpose::Lobe);
            (uc, sampler.get_2d(Purpose::Direction))
        };
        vertices.iter().map(&mut look).collect()
    }

    /// Proposes samples by turns; some are accepted. `often` is how often a number is looked at besides.
    fn wander(often: u32) -> Sampler {
        let mut sampler = sampler();
        sampler.start_sample(0, 0);
        sampler.accept();
        for number in 1..200 {
            if number % 7 == 0 {
                sampler.start_sample(0, number)
            } else {
                sampler.start_near(0, number)
            }
            if number % often == 0 {
                look(&mut sampler, &[3, 0, 9, 3]);
            }
            if number % 3 != 0 {
                sampler.accept();
            }
        }
        sampler
    }

    #[test]
    fn laziness_is_eagerness() {
        let seen = |often: u32| {
            let mut sampler = wander(often);
            sampler.start_near(1, 0);
            look(&mut sampler, &[9, 0, 3])
        };
        let eager = seen(1);
        assert_eq!(eager, seen(5));
        assert_eq!(eager, seen(1000));
    }

    #[test]
    fn fresh_samples_are_those_of_independent_numbers() {
        let key = StreamKey::new(3, "chain", Role::Estimate, 0);
        let mut independent = Sampler::new(SamplerKind::Independent, key, 1, (1, 1));
        let mut chain = wander(2);
        for sampler in [&mut independent, &mut chain] {
            sampler.start_sample(17, 4);
        }
        assert_eq!(look(&mut independent, &[0, 5, 2]), look(&mut chain, &[0, 5, 2]));
    }

    /// Numbers that are kept at one address are those of no other.
    #[test]
    fn every_address_keeps_its_own_numbers() {
        let step = 1e-6;
        let mut chain = Sampler::of_chain(StreamKey::new(3, "chain", Role::Estimate, 0), step);
        let looked = |chain: &mut Sampler| -> Vec<Vec2> {
            let vertices = [Subpath::Camera, Subpath::Light].into_iter().flat_map(|s| (0..4).map(move |v| (s, v)));
            let mut numbers = Vec::new();
            for (subpath, vertex) in vertices {
                chain.start_vertex(subpath, vertex);
                numbers.extend(crate::sampler::tests::PURPOSES.map(|purpose| chain.get_2d(purpose)));
            }
            numbers
        };
        chain.start_sample(0, 0);
        let fresh = looked(&mut chain);
        chain.accept();
        for number in 1..4 {
            chain.start_near(0, number);
            for (near, fresh) in looked(&mut chain).into_iter().zip(&fresh) {
                let way = near - *fresh;
                assert!((way - way.round()).abs().max_element() < 4.0 * step, "{near} after {fresh}");
            }
            chain.accept();
        }
    }

    /// 4096 numbers after 50 small steps, in 16 cells: χ² beyond 6 standard deviations has probability 10⁻⁷ by chance, and so have the
    /// other two beyond 5.
    #[test]
    fn small_steps_keep_numbers_uniform_and_do_not_lean() {
        const CHAINS: u32 = 4096;
        let mut cells = [0_u32; 16];
        let (mut ups, mut logarithms) = (0_u32, Vec::new());
        for chain in 0..CHAINS {
            let mut sampler = sampler();
            sampler.start_sample(u64::from(chain), 0);
            sampler.accept();
            let before = look(&mut sampler, &[1])[0].0;
            for number in 1..50 {
                sampler.start_near(u64::from(chain), number);
                if number == 1 {
                    let step = look(&mut sampler, &[1])[0].0 - before;
                    let step = step - step.round();
                    ups += u32::from(step > 0.0);
                    logarithms.push(f64::from((LARGEST / step.abs()).ln() / RATIO.ln()));
                }
                sampler.accept();
            }
            sampler.start_near(u64::from(chain), 50);
            let after = look(&mut sampler, &[1])[0].0;
            assert!((0.0..1.0).contains(&after));
            cells[(after * 16.0) as usize] += 1;
        }
        let expected = f64::from(CHAINS) / 16.0;
        let chi2: f64 = cells.iter().map(|&n| (f64::from(n) - expected).powi(2) / expected).sum();
        assert!((chi2 - 15.0) / 30.0_f64.sqrt() < 6.0, "{cells:?}");
        let z = (f64::from(ups) - f64::from(CHAINS) / 2.0) / (f64::from(CHAINS) / 4.0).sqrt();
        assert!(z.abs() < 5.0, "{ups} of {CHAINS} steps go up");
        // Their logarithms are uniform between those of the largest and the smallest: mean ½, variance 1/12.
        let mean = logarithms.iter().sum::<f64>() / f64::from(CHAINS);
        assert!((mean - 0.5).abs() < 5.0 * (1.0 / 12.0 / f64::from(CHAINS)).sqrt(), "{mean}");
        assert!(logarithms.iter().all(|u| (-1e-4..1.0001).contains(u)));
    }

    /// A step and its opposite have the same probability: what leads there leads back with its last bit turned, to the bit.
    #[test]
    fn steps_lead_back() {
        for bits in [0, 5, 1 << 31, u32::MAX - 3] {
            for random in (0..1000).map(|i| mix(i) as u32) {
                let there = small_step(bits, 1e8, random);
                assert_ne!(there, bits);
                assert_eq!(small_step(there, 1e8, random ^ 1), bits);
            }
        }
    }
}
