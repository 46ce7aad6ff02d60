//! Vertex connection and merging \[Georgiev12; Hachisuka12\].
//!
//! All strategies of bidirectional path tracing, and beside them those that merge the camera subpath's vertices with the vertices of
//! every light subpath of the iteration, wherever these lie within a radius. MIS weights them all, by the sums of
//! [`connect`](crate::connect). Merging finds what no connection can: paths on which every other vertex is a mirror's or glass's.
//!
//! A replicate of n samples per pixel is n iterations, whose radius falls. Merged vertices are two and counted as one, which is a
//! bias: in one iteration O(r²) where surfaces are smooth, so that in the mean of n iterations it is O(n^(α−1)) \[Georgiev12\]; within
//! the radius of an edge or a shadow's it is of the order of what is seen, so that an image mean has O(r), and O(n^((α−1)/2)). So
//! images of few samples are biased, and more samples per replicate, not more replicates, are what makes the bias vanish.
//!
//! Of the light subpaths photons alone are kept. The subpath whose vertices a sample connects is traced again when its turn has come:
//! it has the same random numbers, and its vertices take ten times a photon's memory.

use crate::bdpt::Bdpt;
use crate::bias::Bias;
use crate::classics::lost_behind_mirrors;
use crate::contribution::{Sink, Technique};
use crate::integrator::{Estimator, Pixel, Replicate};
use crate::measurement::Counters;
use crate::photons::{Alpha, Photons, Radius, Schedule};
use crate::request::Request;
use crate::roulette::SubpathRoulette;
use crate::scratch::Scratch;
use sampling::mis::Heuristic;
use sampling::sampler::Sampler;
use scenes::{Needs, Scene};
use serde::{Deserialize, Serialize};

/// The settings of vertex connection and merging.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Vcm {
    /// How strategies are weighted.
    pub mis: Heuristic,
    /// How walks end.
    pub roulette: SubpathRoulette,
    /// The first radius, in radii of the scene's bounding sphere.
    pub radius: Radius,
    /// How the radius falls.
    pub alpha: Alpha,
    /// What connects and merges; no setting.
    #[serde(skip)]
    pub bdpt: Bdpt,
}

impl Default for Vcm {
    fn default() -> Self {
        Self {
            mis: Heuristic::Balance,
            roulette: SubpathRoulette::Local,
            radius: Radius::default(),
            alpha: Alpha::default(),
            bdpt: Bdpt::default(),
        }
    }
}

impl Estimator for Vcm {
    const CLASSIFIES: bool = true;
    const ITERATES: bool = true;

    fn bias(&self) -> Bias {
        Bias::Consistent
    }

    fn makes(&self, technique: Technique) -> bool {
        matches!(technique, Technique::Connect { .. } | Technique::Merge { .. })
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        Bdpt { roulette: self.roulette, ..Bdpt::default() }.unsupported_request(request)
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        lost_behind_mirrors(needs)
    }

    fn bytes(&self, pixels: u64, request: &Request) -> u64 {
        Photons::bytes(pixels, request, self.roulette)
    }

    fn prepare(&self, _: &Scene, _: &Request, _: &Replicate) -> Option<Self> {
        let Self { mis, roulette, .. } = *self;
        let bdpt = Bdpt { mis: mis.into(), roulette, photons: Some(Photons::default()), ..Bdpt::default() };
        Some(Self { bdpt, ..self.clone() })
    }

    fn iterate(&mut self, scene: &Scene, request: &Request, replicate: &Replicate, number: u32) -> Counters {
        let schedule = Schedule { radius: self.radius, alpha: self.alpha };
        self.bdpt.trace_photons(scene, request, &schedule, replicate, number)
    }

    fn estimate<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        self.bdpt.estimate(scene, request, pixel, sampler, scratch, out);
    }
}
