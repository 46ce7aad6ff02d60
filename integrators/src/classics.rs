//! The classics: emission, local illumination and Whitted's ray tracing.
//!
//! Each is path tracing of some path classes alone, told in the lecture's notation: what is emitted, `LE`; what is scattered once,
//! `L(D|S)?E`; and what mirrors and glass show of that, `LD?S*E` [Whitted80; Heckbert90]. They are kept as methods because
//! they are what others are compared with: what they lose is light that is not there.
//!
//! Whitted's tree of rays has a branch for every delta lobe of a surface. Here a walk takes one of its lobes, by chance and divided by
//! its probability: the expectation is that of the tree, and its cost does not grow with the order. A walk ends where it would
//! scatter by any other lobe; what such lobes scatter comes from sampled points of emitters alone.

use crate::bias::Bias;
use crate::contribution::{Sink, Technique};
use crate::integrator::{Estimator, Pixel};
use crate::next_event::Strategy;
use crate::path::Path;
use crate::request::Request;
use crate::roulette::Roulette;
use crate::scratch::Scratch;
use sampling::bsdf::Lobes;
use sampling::sampler::Sampler;
use scenes::{Needs, Scene};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// What is emitted towards the camera; it has no settings.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Emission {}

/// Local illumination's settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Local {
    /// Whether surfaces cast shadows. Without them every emitter lights every point that faces it, and the image has a bias that
    /// stays.
    pub shadows: bool,
}

impl Default for Local {
    fn default() -> Self {
        Self { shadows: true }
    }
}

/// The settings of Whitted's ray tracing.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Whitted {
    /// How walks end between mirrors and in glass.
    pub roulette: Roulette,
    /// The number of scatterings from which roulette is played.
    pub roulette_start: usize,
}

impl Default for Whitted {
    fn default() -> Self {
        Self { roulette: Roulette::Throughput, roulette_start: 3 }
    }
}

/// The light of emitters that no walk meets, where next-event estimation cannot reach them either.
pub(crate) fn lost_behind_mirrors(needs: &Needs) -> Vec<String> {
    let lost = needs.delta_emitters && needs.delta_lobes;
    let class = "LS+E from points, spots and directional emitters: no walk meets them behind a mirror or glass";
    if lost { vec![class.to_owned()] } else { Vec::new() }
}

impl Estimator for Emission {
    const CLASSIFIES: bool = true;

    fn expression(&self) -> &'static str {
        "LE"
    }

    fn orders(&self, _: usize) -> RangeInclusive<usize> {
        0..=0
    }

    fn makes(&self, technique: Technique) -> bool {
        technique == Technique::Connect { s: 0, t: 2 }
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        request.tail().then(|| "it ends at order 0; leave out the tail".to_owned())
    }

    fn missing_light(&self, _: &Needs) -> Vec<String> {
        vec!["L(D|S)+E: what is scattered".to_owned()]
    }

    fn splats(&self) -> bool {
        false
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
        Path::default().estimate(scene, request, pixel, sampler, scratch, out);
    }
}

impl Estimator for Local {
    const CLASSIFIES: bool = true;

    fn expression(&self) -> &'static str {
        "L(D|S)?E"
    }

    fn bias(&self) -> Bias {
        if self.shadows { Bias::None } else { Bias::Lasting }
    }

    fn orders(&self, max_order: usize) -> RangeInclusive<usize> {
        0..=max_order.min(1)
    }

    fn makes(&self, technique: Technique) -> bool {
        matches!(technique, Technique::Connect { s: 0, t: 2 | 3 } | Technique::Connect { s: 1, t: 2 })
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        request.tail().then(|| "it ends at order 1; leave out the tail".to_owned())
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        let mut missing = vec!["L(D|S)(D|S)+E: what is scattered more than once".to_owned()];
        missing.extend(lost_behind_mirrors(needs));
        missing
    }

    fn splats(&self) -> bool {
        false
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
        // Orders end it: a walk that follows delta lobes scatters once.
        let whitted = Whitted { roulette: Roulette::None, ..Whitted::default() };
        Path { shadows: self.shadows, ..whitted.path() }.estimate(scene, request, pixel, sampler, scratch, out);
    }
}

impl Whitted {
    /// As path tracing.
    fn path(&self) -> Path {
        let Self { roulette, roulette_start } = *self;
        let roulette = roulette.into();
        Path { strategy: Strategy::Emitter, roulette, roulette_start, followed: Lobes::DELTA, ..Path::default() }
    }
}

impl Estimator for Whitted {
    const CLASSIFIES: bool = true;

    fn expression(&self) -> &'static str {
        "LD?S*E"
    }

    fn makes(&self, technique: Technique) -> bool {
        self.path().makes(technique)
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        self.path().unsupported_request(request)
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        let mut missing =
            vec!["L.+D.*E: what other than delta lobes scatter, but for the scattering next to the light".to_owned()];
        missing.extend(lost_behind_mirrors(needs));
        missing
    }

    fn splats(&self) -> bool {
        false
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
        self.path().estimate(scene, request, pixel, sampler, scratch, out);
    }
}
