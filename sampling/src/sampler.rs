//! Samplers: uniform random numbers by address.
//!
//! A number is found by *where it is used*, `(key, pixel, sample)` and `(subpath, vertex, purpose)`, not by how many
//! numbers were drawn before it. The order of draws is irrelevant, a draw that is skipped shifts nothing, and work can
//! be cut among threads in any way. The other side of the coin: drawing twice at one address gives the same number
//! twice.

use crate::fault;
use crate::rng::{Stream, mix2};
use glam::{Vec2, vec2};
use serde::{Deserialize, Serialize};
use std::{fmt, str::FromStr};

/// What a render is for. Estimates, pilots and references share no random number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Role {
    /// What is measured.
    Estimate = 0,
    /// A first look, whose results steer the estimate.
    Pilot = 1,
    /// What estimates are judged by.
    Reference = 2,
}

/// The key of all random numbers of one replicate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct StreamKey(u64);

impl StreamKey {
    /// The key of a replicate of a method instance in a role; keys that differ in any of the four are independent.
    pub fn new(seed: u64, instance: &str, role: Role, replicate: u32) -> Self {
        let name = instance.bytes().fold(mix2(seed, instance.len() as u64), |h, byte| mix2(h, u64::from(byte)));
        let replicate = fault!("streams_shared_between_replicates", replicate, 0);
        let role = fault!("streams_shared_between_roles", role, Role::Estimate);
        Self(mix2(name, (role as u64) << 32 | u64::from(replicate)))
    }
}

/// How the numbers of a pixel's samples are spread. This is the list that settings and help read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SamplerKind {
    /// Independent uniform numbers.
    #[default]
    Independent,
    /// The samples of a pixel lie one in each cell of a grid, jittered, in an order of their own at every address.
    Stratified,
}

impl SamplerKind {
    /// Every kind of sampler.
    pub const ALL: &[Self] = &[Self::Independent, Self::Stratified];
}

impl fmt::Display for SamplerKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Independent => "independent",
            Self::Stratified => "stratified",
        })
    }
}

impl FromStr for SamplerKind {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        Self::ALL.iter().copied().find(|kind| kind.to_string() == name).ok_or_else(|| {
            let names: Vec<String> = Self::ALL.iter().map(Self::to_string).collect();
            format!("`{name}` is not a sampler; there are {}", names.join(", "))
        })
    }
}

/// The end that a walk starts from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Subpath {
    /// A walk from the camera.
    Camera = 0,
    /// A walk from an emitter.
    Light = 1,
}

/// What a number decides at a vertex. The values are part of every result: append, never renumber.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(u8)]
pub enum Purpose {
    /// The point on the film.
    Film = 0,
    /// The point on the lens.
    Lens = 1,
    /// Which emitter a light walk starts from.
    EmitterChoice = 2,
    /// Where on the emitter.
    EmitterPosition = 3,
    /// In which direction.
    EmitterDirection = 4,
    /// Which lobe scatters.
    Lobe = 5,
    /// The scattered direction.
    Direction = 6,
    /// Whether the walk goes on.
    Roulette = 7,
    /// Which emitter next-event estimation connects to.
    NextEmitter = 8,
    /// Where on it.
    NextPosition = 9,
    /// Where on the camera a connection ends.
    NextCamera = 10,
}

/// A source of uniform numbers in [0, 1), one address at a time.
#[derive(Clone, Debug)]
pub struct Sampler {
    kind: SamplerKind,
    key: StreamKey,
    strata: Strata,
    stratum: u32,
    pixel_state: u64,
    sample_state: u64,
    vertex: u64,
}

impl Sampler {
    /// A sampler for one replicate that takes `samples_per_pixel` samples, at sample 0 of pixel 0.
    ///
    /// Stratified samples come in rounds of that number; samples beyond it begin further, independent rounds.
    pub fn new(kind: SamplerKind, key: StreamKey, samples_per_pixel: u32) -> Self {
        let strata = Strata::new(samples_per_pixel.max(1));
        let mut sampler = Self { kind, key, strata, stratum: 0, pixel_state: 0, sample_state: 0, vertex: 0 };
        sampler.start_sample(0, 0);
        sampler
    }

    /// Turns to a sample of a pixel (or of whatever is numbered so), and there to the camera's vertex 0.
    #[inline]
    pub fn start_sample(&mut self, pixel: u64, sample: u32) {
        let (round, stratum) = (sample / self.strata.n, sample % self.strata.n);
        self.stratum = stratum;
        self.pixel_state = mix2(mix2(self.key.0, pixel), u64::from(round));
        self.sample_state = mix2(self.pixel_state, u64::from(stratum));
        self.start_vertex(Subpath::Camera, 0);
    }

    /// Turns to a vertex of a subpath of the current sample.
    #[inline]
    pub fn start_vertex(&mut self, subpath: Subpath, vertex: u32) {
        self.vertex = u64::from(vertex) << 16 | (subpath as u64) << 8;
    }

    /// The number in [0, 1) for a purpose at the current vertex.
    #[inline]
    pub fn get_1d(&mut self, purpose: Purpose) -> f32 {
        let address = self.vertex | purpose as u64;
        let u = stream(self.sample_state, address).next_f32();
        match self.kind {
            SamplerKind::Independent => u,
            SamplerKind::Stratified => self.strata.jitter_1d(self.shuffled_stratum(address), u),
        }
    }

    /// The point in [0, 1)² for a purpose at the current vertex.
    #[inline]
    pub fn get_2d(&mut self, purpose: Purpose) -> Vec2 {
        let address = self.vertex | purpose as u64;
        let mut stream = stream(self.sample_state, address);
        let x = stream.next_f32();
        let u = vec2(x, stream.next_f32());
        match self.kind {
            SamplerKind::Independent => u,
            SamplerKind::Stratified => self.strata.jitter_2d(self.shuffled_stratum(address), u),
        }
    }

    /// The stratum of this sample at this address: an order of its own for every pixel and address.
    #[inline]
    fn shuffled_stratum(&self, address: u64) -> u32 {
        // The complement keeps these seeds apart from the states of samples.
        let seed = mix2(!self.pixel_state, address) >> 32;
        permute(self.stratum, self.strata.n, seed as u32)
    }
}

/// The generator at an address. States of neighbouring addresses are mixed apart, see [`Stream::new`].
#[inline]
fn stream(state: u64, address: u64) -> Stream {
    Stream::new(mix2(state, address), address)
}

/// `n` cells of the unit square, `nx` × `ny`, as square as divisors of `n` allow (a prime gives a row).
#[derive(Clone, Copy, Debug)]
struct Strata {
    n: u32,
    nx: u32,
    ny: u32,
}

impl Strata {
    fn new(n: u32) -> Self {
        let ny = (1..=n.isqrt()).rev().find(|d| n.is_multiple_of(*d)).unwrap_or(1);
        Self { n, nx: n / ny, ny }
    }

    #[inline]
    fn jitter_1d(self, stratum: u32, u: f32) -> f32 {
        in_cell(stratum, self.n, u)
    }

    #[inline]
    fn jitter_2d(self, stratum: u32, u: Vec2) -> Vec2 {
        vec2(in_cell(stratum % self.nx, self.nx, u.x), in_cell(stratum / self.nx, self.ny, u.y))
    }
}

/// The point `u` of cell `i` of `n` in [0, 1); where rounding would reach 1, the number below it.
#[inline]
fn in_cell(i: u32, n: u32, u: f32) -> f32 {
    ((i as f32 + u) / n as f32).min(1.0_f32.next_down())
}

/// The image of `i` under the permutation of 0…`length`−1 numbered `seed` `[Kensler13]`.
#[inline]
fn permute(i: u32, length: u32, seed: u32) -> u32 {
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

#[cfg(test)]
mod tests;
