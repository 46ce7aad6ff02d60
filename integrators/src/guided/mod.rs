//! Path tracing that is guided to where light comes from [Müller, Gross & Novák 2017; Müller 2019].
//!
//! A pilot learns, for every part of space, from which directions light arrives that next-event estimation leaves to walks; then
//! walks take some directions by that density and the rest by the BSDF, as one mixture, which is what MIS weights know.
//! Only light of the orders that are asked for is learned. What a pilot learns steers samples that are independent of it, so that
//! the mean of every replicate is the truth whatever it was.

mod quadtree;
#[cfg(test)]
mod tests;
mod training;
mod tree;

use crate::contribution::{Sink, Technique};
use crate::guide::Guide;
use crate::integrator::{Estimator, Pixel, Replicate};
use crate::measurement::Counters;
use crate::path::Path;
use crate::request::Request;
use crate::roulette::Roulette;
use crate::scratch::Scratch;
use sampling::bsdf::{BsdfSample, Lobes, TransportMode};
use sampling::fault;
use sampling::mis::Heuristic;
use sampling::sampler::Sampler;
use sampling::{Vec2, Vec3};
use scenes::{Interaction, Needs, Scene};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tree::{Part, Tree};

/// The part of a replicate's samples that are taken once more to learn from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "f32", into = "f32")]
pub struct Training(f32);

impl TryFrom<f32> for Training {
    type Error = String;
    fn try_from(part: f32) -> Result<Self, String> {
        if part > 0.0 && part <= 10.0 {
            return Ok(Self(part));
        }
        Err(format!("training on {part} times the samples; give a number above 0 and up to 10"))
    }
}

impl From<Training> for f32 {
    fn from(training: Training) -> Self {
        training.0
    }
}

/// The settings of guided path tracing.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Guided {
    /// How many samples a pilot takes, as a part of those of its replicate; at least one per pixel. They are in no image, but in its time.
    pub training: Training,
    /// How sampled points and walks that meet emitters are weighted.
    pub mis: Heuristic,
    /// How walks end.
    pub roulette: Roulette,
    /// The number of scatterings from which roulette is played.
    pub roulette_start: usize,
    /// What the pilot learned, and its work; no setting.
    #[serde(skip)]
    learned: Option<Arc<(Tree, Counters)>>,
}

impl Default for Guided {
    fn default() -> Self {
        let Path { mis, roulette_start, .. } = Path::default();
        Self { training: Training(0.25), mis, roulette: Roulette::Throughput, roulette_start, learned: None }
    }
}

impl Guided {
    fn path(&self) -> Path {
        Path { mis: self.mis, roulette: self.roulette.into(), roulette_start: self.roulette_start, ..Path::default() }
    }
}

impl Estimator for Guided {
    const SUBSURFACE: bool = Path::SUBSURFACE;
    const CLASSIFIES: bool = Path::CLASSIFIES;

    fn makes(&self, technique: Technique) -> bool {
        self.path().makes(technique)
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        self.path().unsupported_request(request)
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        self.path().missing_light(needs)
    }

    fn splats(&self) -> bool {
        false
    }

    fn prepare(&self, scene: &Scene, request: &Request, replicate: &Replicate) -> Option<Self> {
        let samples = (self.training.0 * replicate.samples as f32).ceil() as u32;
        let learned = training::train(self, scene, request, replicate, samples);
        Some(Self { learned: Some(Arc::new(learned)), ..self.clone() })
    }

    fn pilot(&self) -> Counters {
        self.learned.as_ref().map_or(Counters::default(), |learned| learned.1)
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
        let Some(learned) = &self.learned else { return };
        self.path().trace(Led(&learned.0), (scene, request), pixel, sampler, scratch, out);
    }
}

/// Walks that a tree guides.
#[derive(Clone, Copy)]
struct Led<'t>(&'t Tree);

impl Led<'_> {
    /// The part of space that guides a walk from a surface; `None` where there is nothing to choose.
    #[inline]
    fn part(&self, hit: &Interaction) -> Option<&Part> {
        Some(self.0.part(hit.point.p)).filter(|part| part.share() > 0.0 && hit.is_connectable())
    }
}

impl Guide for Led<'_> {
    const CHOOSES: bool = true;

    #[inline]
    fn sample(self, hit: &Interaction, wo: Vec3, uc: f32, u: Vec2) -> Option<BsdfSample> {
        let Some(part) = self.part(hit) else { return hit.sample(wo, uc, u, TransportMode::Radiance) };
        let share = part.share();
        if uc < share {
            let wi = part.density().sample(u);
            let (f, pdf) = hit.eval_pdf(wo, wi, TransportMode::Radiance);
            let pdf = part.mixed(wi, pdf);
            let weight = f * (wi.dot(hit.ns()).abs() / pdf);
            return (pdf > 0.0).then_some(BsdfSample { wi, weight, pdf, lobe: Lobes::NON_DELTA, eta: 1.0 });
        }
        let uc = ((uc - share) / (1.0 - share)).min(1.0_f32.next_down());
        let sample = hit.sample(wo, uc, u, TransportMode::Radiance)?;
        let pdf = if sample.lobe.is_delta() { (1.0 - share) * sample.pdf } else { part.mixed(sample.wi, sample.pdf) };
        Some(BsdfSample { weight: sample.weight * (sample.pdf / pdf), pdf, ..sample })
    }

    #[inline]
    fn pdf(self, hit: &Interaction, wi: Vec3, pdf: f32) -> f32 {
        let Some(part) = self.part(hit) else { return pdf };
        fault!("guide_left_out_of_weights", part.mixed(wi, pdf), pdf)
    }
}
