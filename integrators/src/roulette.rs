//! Russian roulette: ends walks at random without moving the mean.

use sampling::fault;
use sampling::math::Spectrum;
use serde::{Deserialize, Serialize};

/// The highest survival probability, so that a walk in a scene that absorbs nothing ends too.
pub const MAX_SURVIVAL: f32 = 0.95;

/// Roulette of methods that weight their paths without its probabilities.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Roulette {
    /// Walks end at the last order asked for.
    None,
    /// From a few scatterings on, survival by the walk's throughput.
    Throughput,
}

impl Roulette {
    /// The factor by which a surviving walk's throughput grows, or `None` where the walk ends.
    ///
    /// `throughput` is the walk's weight so far relative to its start, `scatterings` how often it has scattered.
    #[inline]
    pub fn survive(
        self,
        throughput: Spectrum,
        scatterings: usize,
        start: usize,
        u: impl FnOnce() -> f32,
    ) -> Option<f32> {
        if self == Roulette::None || scatterings < start {
            return Some(1.0);
        }
        compensated(throughput.max_component().min(MAX_SURVIVAL), u())
    }
}

/// The factor by which the throughput of a walk grows that survives with this probability; `None` where it ends.
#[inline]
pub fn compensated(survival: f32, u: f32) -> Option<f32> {
    (u < survival).then(|| fault!("roulette_not_compensated", 1.0 / survival, 1.0))
}

/// Roulette of walks from the camera alone, whose weights know nothing of its probabilities.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraRoulette {
    /// Walks end at the last order asked for.
    None,
    /// From a few scatterings on, survival by the walk's throughput.
    Throughput,
    /// From a few scatterings on, survival by what the walk may still find and what that costs, as a [pilot](crate::efficiency) finds.
    Efficiency,
}

impl CameraRoulette {
    /// What it does by throughput: all that it does, or all before a pilot has found anything.
    #[inline]
    pub fn by_throughput(self) -> Roulette {
        match self {
            Self::None => Roulette::None,
            Self::Throughput | Self::Efficiency => Roulette::Throughput,
        }
    }
}

impl From<Roulette> for CameraRoulette {
    fn from(roulette: Roulette) -> Self {
        match roulette {
            Roulette::None => Self::None,
            Roulette::Throughput => Self::Throughput,
        }
    }
}

/// Roulette of bidirectional walks. What is part of the densities must be the same seen from both ends of a path; what cannot
/// be, since the other end does not know it, is left out of both ends' densities, and weights are what they are without it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SubpathRoulette {
    /// Walks end at the last order asked for.
    None,
    /// At every scattering, survival by the surface's largest albedo, which does not depend on directions; it is part of
    /// the densities of both ends.
    Local,
    /// From a few scatterings on, survival by the walk's throughput; it is part of neither end's densities.
    Throughput,
}

impl SubpathRoulette {
    /// Probability, as part of the densities, of going on at a surface of the given largest albedo; `cap` bounds it where walks
    /// have no last order.
    #[inline]
    pub fn survival(self, albedo: f32, cap: f32) -> f32 {
        match self {
            Self::None | Self::Throughput => 1.0,
            Self::Local => albedo.min(cap),
        }
    }

    /// What it does by throughput.
    #[inline]
    pub fn by_throughput(self) -> Roulette {
        match self {
            Self::None | Self::Local => Roulette::None,
            Self::Throughput => Roulette::Throughput,
        }
    }
}
