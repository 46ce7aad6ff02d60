//! Samplers: uniform random numbers by address.
//!
//! A number is found by *where it is used*, `(key, pixel, sample)` and `(subpath, vertex, purpose)`, not by how many
//! numbers were drawn before it. The order of draws is irrelevant, a draw that is skipped shifts nothing, and work can
//! be cut among threads in any way. The other side of the coin: drawing twice at one address gives the same number
//! twice.

use crate::fault;
use crate::rng::{Stream, mix2, unit_f32};
use glam::{Vec2, vec2};
use primary::Primary;
use serde::{Deserialize, Serialize};
use sobol::Screen;
use std::{fmt, str::FromStr};
use strata::{Strata, permute};

mod halton;
mod primary;
mod sobol;
mod strata;

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
        let instance = fault!("streams_shared_between_methods", instance, "");
        let name = instance.bytes().fold(mix2(seed, instance.len() as u64), |h, byte| mix2(h, u64::from(byte)));
        let replicate = fault!("streams_shared_between_replicates", replicate, 0);
        let role = fault!("streams_shared_between_roles", role, Role::Estimate);
        Self(mix2(name, (role as u64) << 32 | u64::from(replicate)))
    }

    /// The key of a pilot that steers what this one is the key of; independent of it.
    pub fn of_pilot(self) -> Self {
        Self(mix2(self.0, Role::Pilot as u64))
    }

    /// The key of a part of what this one is the key of; independent of it, of its pilot and of other parts.
    pub fn of_part(self, number: u32) -> Self {
        Self(mix2(self.0, (u64::from(number) + 1) << 32))
    }
}

/// How the numbers of a pixel's samples are spread. This is the list that settings and help read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SamplerKind {
    /// Independent uniform numbers.
    #[default]
    Independent,
    /// The samples of a pixel lie one in each cell of a grid, jittered, in an order of their own at every address.
    Stratified,
    /// Correlated multi-jitter `[Kensler13]`: stratified, and in each coordinate as well as on the grid.
    MultiJittered,
    /// Halton's sequence under random digit scrambling, a scrambling for every pixel.
    Halton,
    /// Sobol's sequence under Owen's scrambling: eight dimensions for a path up to its first scattering, then a sequence for every
    /// direction and the emitter's point where it leads; a scrambling for every pixel. Light walks of the whole image share one sequence.
    Sobol,
    /// The same with one sequence for the whole screen too, whose errors in neighbouring pixels cancel `[Ahmed20]`.
    Zsobol,
}

impl SamplerKind {
    /// Every kind of sampler.
    pub const ALL: &[Self] =
        &[Self::Independent, Self::Stratified, Self::MultiJittered, Self::Halton, Self::Sobol, Self::Zsobol];

    /// What it is, in one line.
    pub fn about(self) -> &'static str {
        match self {
            Self::Independent => "independent uniform numbers",
            Self::Stratified => "one sample in each cell of a grid, jittered",
            Self::MultiJittered => "correlated multi-jitter: stratified on the grid and in each coordinate",
            Self::Halton => "Halton's sequence with random digit scrambling",
            Self::Sobol => "Owen-scrambled Sobol' points; one sequence for all light walks",
            Self::Zsobol => "the same along Morton's curve over the screen: blue noise",
        }
    }
}

impl fmt::Display for SamplerKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Independent => "independent",
            Self::Stratified => "stratified",
            Self::MultiJittered => "multi_jittered",
            Self::Halton => "halton",
            Self::Sobol => "sobol",
            Self::Zsobol => "zsobol",
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
    /// Which channel's profile probes a body.
    ProbeChannel = 11,
    /// How far and where to a body is probed.
    ProbePosition = 12,
    /// Which of the places found is taken.
    ProbeChoice = 13,
    /// Which of several sampled emitter points is connected to.
    NextEventChoice = 14,
    /// Which of several connections is made.
    ConnectionChoice = 15,
    /// Whether a connection is made.
    ConnectionRoulette = 16,
    /// Which order is sampled.
    Order = 17,
    /// By which strategy it is.
    Strategy = 18,
    /// How a chain goes on.
    Mutation = 19,
}

impl Purpose {
    /// The last of them.
    const LAST: Self = Self::Mutation;
}

/// Stands for the purpose in the addresses of sequences that several purposes share.
const GROUP: u64 = 0xff;

/// A source of uniform numbers in [0, 1), one address at a time.
#[derive(Clone, Debug)]
pub struct Sampler {
    /// How numbers are spread; `None` where a chain goes from each to the next.
    kind: Option<SamplerKind>,
    key: StreamKey,
    strata: Strata,
    screen: Screen,
    /// Pixels in a row of the image.
    width: u64,
    pixel: u64,
    sample: u32,
    /// The sample's place among the strata.
    stratum: u32,
    /// Keys what all samples of a pixel share.
    sequence_state: u64,
    pixel_state: u64,
    sample_state: u64,
    subpath: Subpath,
    vertex: u32,
    /// The group whose point of Sobol's sequence `coordinates` and `scrambling` are, if any has been asked for.
    group: Option<(Subpath, u32)>,
    coordinates: [u32; sobol::DIMENSIONS],
    scrambling: u64,
    /// The state of the chain, where there is one.
    primary: Primary,
}

impl Sampler {
    /// A sampler for one replicate that takes `samples_per_pixel` samples of every pixel of an image of this width and height, at
    /// sample 0 of pixel 0. What is no image has a height of 1.
    ///
    /// Stratified samples come in rounds of that number; samples beyond it begin further, independent rounds, but for
    /// the sequences of a pixel, which go on.
    pub fn new(kind: SamplerKind, key: StreamKey, samples_per_pixel: u32, (width, height): (u32, u32)) -> Self {
        let log2 = |n: u32| n.max(1).checked_next_power_of_two().map_or(31, u32::trailing_zeros);
        let samples = samples_per_pixel.max(1);
        let mut sampler = Self {
            kind: Some(kind),
            key,
            strata: Strata::new(samples),
            screen: Screen { log2_side: log2(width.max(height)), log2_samples: log2(samples).min(28) },
            width: u64::from(width.max(1)),
            pixel: 0,
            sample: 0,
            stratum: 0,
            sequence_state: 0,
            pixel_state: 0,
            sample_state: 0,
            subpath: Subpath::Camera,
            vertex: 0,
            group: None,
            coordinates: [0; sobol::DIMENSIONS],
            scrambling: 0,
            primary: Primary::default(),
        };
        sampler.start_sample(0, 0);
        sampler
    }

    /// Turns to a sample of a pixel, the pixels being numbered row by row, and there to the camera's vertex 0.
    #[inline]
    pub fn start_sample(&mut self, pixel: u64, sample: u32) {
        let (round, stratum) = (sample / self.strata.n, sample % self.strata.n);
        self.pixel = pixel;
        self.sample = sample;
        self.stratum = stratum;
        let pixel_key = mix2(self.key.0, pixel);
        self.sequence_state = !pixel_key;
        self.pixel_state = mix2(pixel_key, u64::from(round));
        self.sample_state = mix2(self.pixel_state, u64::from(stratum));
        (self.subpath, self.vertex) = (Subpath::Camera, 0);
        self.primary.near = false;
        self.group = None;
    }

    /// Turns to a vertex of a subpath of the current sample.
    #[inline]
    pub fn start_vertex(&mut self, subpath: Subpath, vertex: u32) {
        self.subpath = subpath;
        self.vertex = vertex;
    }

    /// Finds the point of Sobol's sequence from which this group takes its numbers; the seed by which the current vertex scrambles a dimension of it.
    #[inline]
    fn turn_to_group(&mut self, group: u32, dimension: usize) -> u64 {
        if self.group != Some((self.subpath, group)) {
            let (index, seed) = self.place(u64::from(group) << 16 | (self.subpath as u64) << 8 | GROUP);
            self.group = Some((self.subpath, group));
            self.coordinates = sobol::coordinates(index, seed);
            self.scrambling = seed;
        }
        mix2(self.scrambling, u64::from(self.vertex) << 8 | dimension as u64)
    }

    /// The number in [0, 1) for a purpose at the current vertex.
    #[inline]
    pub fn get_1d(&mut self, purpose: Purpose) -> f32 {
        let address = self.address(purpose);
        match self.kind {
            Some(SamplerKind::Independent) => stream(self.sample_state, address).next_f32(),
            Some(SamplerKind::Stratified | SamplerKind::MultiJittered) => {
                self.strata.jitter_1d(self.shuffled_stratum(address), stream(self.sample_state, address).next_f32())
            }
            Some(SamplerKind::Halton) => match halton::dimension(self.subpath, self.vertex, purpose) {
                Some(dimension) => unit_f32(halton::coordinate(self.sample, dimension, self.sequence_state)),
                None => stream(self.sample_state, address).next_f32(),
            },
            Some(SamplerKind::Sobol | SamplerKind::Zsobol) => {
                match sobol::dimension(self.subpath, self.vertex, purpose) {
                    Some((group, dimension)) => {
                        let seed = self.turn_to_group(group, dimension);
                        unit_f32(sobol::scrambled(self.coordinates[dimension], (seed >> 32) as u32))
                    }
                    None => {
                        let (index, seed) = self.place(address);
                        unit_f32(sobol::point_1d(index, seed))
                    }
                }
            }
            None => {
                let [u] = self.primary.numbers(self.sample_state, address, (self.subpath, self.vertex, purpose));
                u
            }
        }
    }

    /// The point in [0, 1)² for a purpose at the current vertex.
    #[inline]
    pub fn get_2d(&mut self, purpose: Purpose) -> Vec2 {
        let address = self.address(purpose);
        match self.kind {
            Some(SamplerKind::Independent) => self.independent_2d(address),
            Some(SamplerKind::Stratified) => {
                self.strata.jitter_2d(self.shuffled_stratum(address), self.independent_2d(address))
            }
            Some(SamplerKind::MultiJittered) => {
                let seed = mix2(!self.pixel_state, address) >> 32;
                self.strata.multi_jitter(self.stratum, seed as u32, self.independent_2d(address))
            }
            Some(SamplerKind::Halton) => match halton::dimension(self.subpath, self.vertex, purpose) {
                Some(dimension) => {
                    let coordinate = |d| unit_f32(halton::coordinate(self.sample, d, self.sequence_state));
                    vec2(coordinate(dimension), coordinate(dimension + 1))
                }
                None => self.independent_2d(address),
            },
            Some(SamplerKind::Sobol | SamplerKind::Zsobol) => {
                match sobol::dimension(self.subpath, self.vertex, purpose) {
                    Some((group, dimension)) => {
                        let seed = self.turn_to_group(group, dimension);
                        let x = sobol::scrambled(self.coordinates[dimension], (seed >> 32) as u32);
                        vec2(unit_f32(x), unit_f32(sobol::scrambled(self.coordinates[dimension + 1], seed as u32)))
                    }
                    None => {
                        let (index, seed) = self.place(address);
                        Vec2::from_array(sobol::point(index, seed).map(unit_f32))
                    }
                }
            }
            None => self.primary.numbers(self.sample_state, address, (self.subpath, self.vertex, purpose)).into(),
        }
    }

    #[inline]
    fn address(&self, purpose: Purpose) -> u64 {
        u64::from(fault!("vertices_share_their_numbers", self.vertex, 0)) << 16
            | (self.subpath as u64) << 8
            | purpose as u64
    }

    #[inline]
    fn independent_2d(&self, address: u64) -> Vec2 {
        let mut stream = stream(self.sample_state, address);
        let x = stream.next_f32();
        vec2(x, fault!("number_used_twice", stream.next_f32(), x))
    }

    /// The stratum of this sample at this address: an order of its own for every pixel and address.
    #[inline]
    fn shuffled_stratum(&self, address: u64) -> u32 {
        // The complement keeps these seeds apart from the states of samples.
        let seed = mix2(!self.pixel_state, address) >> 32;
        permute(self.stratum, self.strata.n, seed as u32)
    }

    /// The place of this sample in a sequence of Sobol's at this address, and the seed of that sequence: one for each pixel, or one
    /// for all where samples of different pixels share the work of covering the square.
    #[inline]
    fn place(&self, address: u64) -> (u32, u64) {
        let index = match (self.subpath, self.kind) {
            // A light walk goes where it likes, whatever pixel it is counted to.
            (Subpath::Light, _) => self.pixel * u64::from(self.strata.n) + u64::from(self.stratum),
            (Subpath::Camera, Some(SamplerKind::Zsobol)) if self.sample < self.strata.n => {
                let (x, y) = ((self.pixel % self.width) as u32, (self.pixel / self.width) as u32);
                sobol::screen_index(self.screen, (x, y), self.sample, mix2(!self.key.0, address))
            }
            (Subpath::Camera, _) => return (self.sample, mix2(self.sequence_state, address)),
        };
        // Further rounds, and what is beyond 32 bits, are sequences of their own.
        let (shared, high) = (mix2(!self.key.0, address), index >> 32 | u64::from(self.sample / self.strata.n) << 32);
        (index as u32, if high == 0 { shared } else { mix2(shared, high) })
    }
}

/// The generator at an address. States of neighbouring addresses are mixed apart, see [`Stream::new`].
#[inline]
fn stream(state: u64, address: u64) -> Stream {
    Stream::new(mix2(state, address), address)
}

#[cfg(test)]
mod tests;
