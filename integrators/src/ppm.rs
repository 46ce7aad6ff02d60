//! Progressive photon mapping \[Hachisuka08; Knaus11\].
//!
//! Photons are the vertices of light subpaths, one subpath for every pixel and iteration. A camera walk goes through mirrors, glass and
//! glossy surfaces and ends at the first diffuse one, which is merged with the photons near it: the corner of
//! [`vcm`](crate::vcm) that merges and connects nothing, so that each path is made in one way and no weights are needed. What a walk
//! meets on its way that shines is added as it is.
//!
//! The radius of iteration i is `r_1 i^((α−1)/2)`, the same everywhere \[Knaus11\]; Hachisuka's own, which follows the photons found at
//! every point, would make samples depend on one another. The bias is as vcm's.

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
use sampling::sampler::Sampler;
use scenes::{Needs, Scene};
use serde::{Deserialize, Serialize};

/// The settings of progressive photon mapping.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Ppm {
    /// How walks end.
    pub roulette: SubpathRoulette,
    /// The first radius, in radii of the scene's bounding sphere.
    pub radius: Radius,
    /// How the radius falls.
    pub alpha: Alpha,
    /// What traces and merges; no setting.
    #[serde(skip)]
    pub bdpt: Bdpt,
}

impl Default for Ppm {
    fn default() -> Self {
        Self {
            roulette: SubpathRoulette::Local,
            radius: Radius::default(),
            alpha: Alpha::default(),
            bdpt: Bdpt::default(),
        }
    }
}

impl Estimator for Ppm {
    const CLASSIFIES: bool = true;
    const ITERATES: bool = true;

    fn bias(&self) -> Bias {
        Bias::Consistent
    }

    fn makes(&self, technique: Technique) -> bool {
        matches!(technique, Technique::Connect { s: 0, .. } | Technique::Merge { .. })
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        Bdpt { roulette: self.roulette, ..Bdpt::default() }.unsupported_request(request)
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        lost_behind_mirrors(needs)
    }

    fn splats(&self) -> bool {
        false
    }

    fn bytes(&self, pixels: u64, request: &Request) -> u64 {
        Photons::bytes(pixels, request, self.roulette)
    }

    fn prepare(&self, _: &Scene, _: &Request, _: &Replicate) -> Option<Self> {
        let bdpt = Bdpt { roulette: self.roulette, photons: Some(Photons::default()), ..Bdpt::default() };
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
        self.bdpt.gather(scene, request, pixel, sampler, scratch, out);
    }
}
