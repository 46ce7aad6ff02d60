//! The settings of methods whose pixels share random numbers.

use crate::bdpt::Bdpt;
use crate::integrator::Estimator;
use crate::path::Path;
use crate::roulette::{Roulette, SubpathRoulette};
use sampling::mis::Heuristic;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

/// How far a pixel's neighbours are \[pixels\].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "u32", into = "u32")]
pub struct Reach(u32);

impl TryFrom<u32> for Reach {
    type Error = String;
    fn try_from(pixels: u32) -> Result<Self, String> {
        if (1..=8).contains(&pixels) {
            return Ok(Self(pixels));
        }
        Err(format!("neighbours {pixels} pixels away; give a number from 1 to 8"))
    }
}

impl From<Reach> for u32 {
    fn from(reach: Reach) -> Self {
        reach.0
    }
}

/// What such a method is asked for.
pub(crate) trait Settings: Serialize + DeserializeOwned + Default + Send + Sync + 'static {
    /// What takes its samples, none of which brings light to another pixel than its own.
    type Walks: Estimator;

    /// What takes them.
    fn walks(&self) -> Self::Walks;

    /// What takes those with numbers of their own, if not the same.
    fn own(&self) -> Option<Path> {
        None
    }

    /// How far the neighbours are.
    fn radius(&self) -> Reach;
}

/// The settings of path tracing with common numbers.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Coherent {
    /// How far the neighbours are that share their error \[pixels\].
    pub radius: Reach,
    /// How sampled points and walks that meet emitters are weighted.
    pub mis: Heuristic,
    /// How walks end.
    pub roulette: Roulette,
    /// The number of scatterings from which roulette is played.
    pub roulette_start: usize,
}

impl Default for Coherent {
    fn default() -> Self {
        let Path { mis, roulette_start, .. } = Path::default();
        Self { radius: Reach(2), mis, roulette: Roulette::Throughput, roulette_start }
    }
}

impl Settings for Coherent {
    type Walks = Path;

    fn walks(&self) -> Path {
        let Self { mis, roulette, roulette_start, .. } = *self;
        Path { mis, roulette: roulette.into(), roulette_start, ..Path::default() }
    }

    fn radius(&self) -> Reach {
        self.radius
    }
}

/// What takes the samples with numbers of their own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OwnSamples {
    /// The same as those with common numbers.
    Bdpt,
    /// Path tracing: in less than half the time, for about the error where walks find the light that there is.
    Path,
}

/// The settings of bidirectional path tracing with common numbers.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CoherentBdpt {
    /// How far the neighbours are that share their error \[pixels\].
    pub radius: Reach,
    /// What takes the samples with numbers of their own.
    pub own_samples: OwnSamples,
    /// How strategies are weighted.
    pub mis: Heuristic,
    /// How walks end; those of path tracing by throughput, and as `path`'s, where others do locally.
    pub roulette: SubpathRoulette,
    /// The number of scatterings from which roulette by throughput is played.
    pub roulette_start: usize,
}

impl Default for CoherentBdpt {
    fn default() -> Self {
        let Bdpt { roulette, roulette_start, .. } = Bdpt::default();
        // Light subpaths that many pixels share err more alike further away than walks of their own.
        let (own_samples, mis) = (OwnSamples::Bdpt, Heuristic::POWER);
        Self { radius: Reach(5), own_samples, mis, roulette, roulette_start }
    }
}

impl Settings for CoherentBdpt {
    type Walks = Bdpt;

    fn walks(&self) -> Bdpt {
        let Self { mis, roulette, roulette_start, .. } = *self;
        Bdpt { mis: mis.into(), roulette, roulette_start, camera_connections: false, ..Bdpt::default() }
    }

    fn own(&self) -> Option<Path> {
        let (path, mis) = (Path::default(), self.mis);
        let (roulette, roulette_start) = match self.roulette {
            SubpathRoulette::None => (Roulette::None, path.roulette_start),
            SubpathRoulette::Local => (Roulette::Throughput, path.roulette_start),
            SubpathRoulette::Throughput => (Roulette::Throughput, self.roulette_start),
        };
        let path = Path { mis, roulette: roulette.into(), roulette_start, ..path };
        (self.own_samples == OwnSamples::Path).then_some(path)
    }

    fn radius(&self) -> Reach {
        self.radius
    }
}
