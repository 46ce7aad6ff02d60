//! Path tracing: walks from the camera, with next-event estimation and multiple importance sampling.
//!
//! Order `k` is estimated twice, by emitters that the walk hits after `k` scatterings and by an emitter point sampled at
//! its `k`-th scattering; the two are weighted by MIS [Veach97, ch. 9]. \[Kajiya86\]
//!
//! At the boundary of a body a walk is reflected, or goes on from where light came in; that is one scattering.

use crate::contribution::{Sink, Technique};
use crate::efficiency::Efficiency;
use crate::guide::{Guide, Unguided};
use crate::integrator::{Estimator, Pixel, Replicate};
use crate::measurement::Counters;
use crate::next_event::Strategy;
use crate::request::Request;
use crate::roulette::CameraRoulette;
use crate::scratch::Scratch;
use crate::start::{CameraStart, start_camera};
use crate::vertex::PathVertex;
use sampling::bsdf::Lobes;
use sampling::math::Spectrum;
use sampling::mis::Heuristic;
use sampling::sampler::Sampler;
use scenes::{Needs, Scene};
use serde::{Deserialize, Serialize};
use std::num::NonZeroU16;
use std::sync::Arc;
use walk::Walk;

mod walk;

/// A path tracer's settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Path {
    /// Which techniques find emitters. By sampled points alone, walks still meet those that nothing else finds: seen by the camera,
    /// in mirrors and through glass.
    pub strategy: Strategy,
    /// How the two techniques are weighted.
    pub mis: Heuristic,
    /// How walks end.
    pub roulette: CameraRoulette,
    /// The number of scatterings from which roulette is played.
    pub roulette_start: usize,
    /// Emitter points from which next-event estimation chooses one, in proportion to what they would contribute unshadowed.
    pub next_event_candidates: NonZeroU16,
    /// The lobes by which walks go on; no setting, but what makes this one of the [`classics`](crate::classics).
    #[serde(skip)]
    pub followed: Lobes,
    /// Whether what stands between a point and an emitter's sampled point blocks it; no setting, as before.
    #[serde(skip)]
    pub shadows: bool,
    /// What roulette by efficiency goes by; no setting, but found by a pilot.
    #[serde(skip)]
    pub efficiency: Option<Arc<Efficiency>>,
}

impl Default for Path {
    fn default() -> Self {
        Self {
            strategy: Strategy::Mis,
            mis: Heuristic::POWER,
            roulette: CameraRoulette::Throughput,
            roulette_start: 5,
            next_event_candidates: NonZeroU16::MIN,
            followed: Lobes::ALL,
            shadows: true,
            efficiency: None,
        }
    }
}

impl Estimator for Path {
    const SUBSURFACE: bool = true;
    const CLASSIFIES: bool = true;

    fn makes(&self, technique: Technique) -> bool {
        match technique {
            Technique::Connect { s: 0, .. } => true,
            Technique::Connect { s: 1, t } => self.strategy != Strategy::Bsdf && t > 1,
            _ => false,
        }
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        let endless = request.tail() && self.roulette == CameraRoulette::None;
        endless.then(|| {
            "without roulette its walks have no end beyond max_order; set roulette=throughput or leave out the tail"
                .into()
        })
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        let mut missing = Vec::new();
        if needs.delta_emitters && self.strategy == Strategy::Bsdf {
            missing.push(
                "L.*E from points, spots and directional emitters: no walk meets them, and next-event estimation is off"
                    .to_owned(),
            );
        }
        if needs.delta_emitters && needs.delta_lobes {
            missing.push(
                "LS.*E from points, spots and directional emitters: no walk meets them behind a mirror or glass"
                    .to_owned(),
            );
        }
        missing
    }

    fn splats(&self) -> bool {
        false
    }

    fn prepare(&self, scene: &Scene, request: &Request, replicate: &Replicate) -> Option<Self> {
        let learned = || Efficiency::learn(self, scene, request, replicate);
        let needed = self.roulette == CameraRoulette::Efficiency;
        needed.then(|| Self { efficiency: Some(Arc::new(learned())), ..self.clone() })
    }

    fn pilot(&self) -> Counters {
        self.efficiency.as_ref().map_or(Counters::default(), |efficiency| efficiency.work)
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
        self.trace(Unguided, (scene, request), pixel, sampler, scratch, out);
    }
}

impl Path {
    /// Takes one sample of a pixel by walks that are guided.
    #[inline]
    pub(crate) fn trace<G: Guide, S: Sink>(
        &self,
        guide: G,
        (scene, request): (&Scene, &Request),
        pixel: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        let CameraStart { raster, sample } = start_camera(scene, pixel, sampler, &mut scratch.counters);
        let beta = Spectrum::splat(sample.weight);
        let classifier = request.parts().classifier().filter(|_| S::WANTS.classes);
        if let Some(classifier) = classifier {
            scratch.trails.camera.clear();
            scratch.trails.camera.begin(classifier.camera_start());
        }
        if S::WANTS.vertices {
            scratch.camera.clear();
            scratch.camera.push(PathVertex::of_camera(scene, sample.at, sample.weight));
        }
        let (settings, pdf) = (self, sample.pdf_d);
        let mut walk = Walk {
            scene,
            request,
            settings,
            guide,
            raster,
            beta,
            order: 0,
            last: None,
            odds: None,
            pdf,
            classifier,
            out,
        };
        walk.run(sample.ray, sampler, scratch);
    }
}
