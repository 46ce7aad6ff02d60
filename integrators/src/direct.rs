//! Direct illumination: what is emitted (order 0) and what is scattered once (order 1).
//!
//! The smallest method in which emitter sampling, BSDF sampling and their combination can be compared [Veach97, §9.3].

use crate::contribution::{Contribution, PathView, Sink, Technique};
use crate::integrator::{Estimator, Pixel};
use crate::next_event::{Strategy, pdf_next_event, pdf_next_event_environment, sample_next_event, weight2};
use crate::request::Request;
use crate::scratch::Scratch;
use crate::start::{CameraStart, start_camera};
use crate::trail::{self, Bounce, Trails};
use crate::vertex::PathVertex;
use sampling::Vec3;
use sampling::bsdf::TransportMode;
use sampling::math::Spectrum;
use sampling::mis::Heuristic;
use sampling::sampler::{Purpose, Sampler, Subpath};
use scenes::{EmitterId, EmitterOdds, Endpoint, Interaction, Needs, Scene};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// A direct-illumination method's settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Direct {
    /// Which techniques estimate order 1.
    pub strategy: Strategy,
    /// How they are weighted where both are.
    pub mis: Heuristic,
}

impl Default for Direct {
    fn default() -> Self {
        Self { strategy: Strategy::Mis, mis: Heuristic::POWER }
    }
}

impl Estimator for Direct {
    const CLASSIFIES: bool = true;

    fn expression(&self) -> &'static str {
        if self.strategy == Strategy::Emitter { "LD?E" } else { "L(D|S)?E" }
    }

    fn makes(&self, technique: Technique) -> bool {
        match technique {
            Technique::Connect { s: 0, t: 2 } => true,
            Technique::Connect { s: 0, t: 3 } => self.strategy != Strategy::Emitter,
            Technique::Connect { s: 1, t: 2 } => self.strategy != Strategy::Bsdf,
            _ => false,
        }
    }

    fn orders(&self, max_order: usize) -> RangeInclusive<usize> {
        0..=max_order.min(1)
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        request.tail().then(|| "it ends at order 1; leave out the tail".to_owned())
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        let mut missing = vec!["L(D|S)(D|S)+E: what is scattered more than once".to_owned()];
        if self.strategy == Strategy::Emitter && needs.delta_lobes {
            missing.push("LSE: sampled emitter points are not seen in mirrors or through glass".to_owned());
        }
        if self.strategy == Strategy::Bsdf && needs.delta_emitters {
            missing.push("LDE from points, spots and directional emitters: no sampled direction meets them".to_owned());
        }
        if self.strategy != Strategy::Emitter && needs.delta_emitters && needs.delta_lobes {
            missing.push("LSE from points, spots and directional emitters".to_owned());
        }
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
        let CameraStart { raster, sample: start } = start_camera(scene, pixel, sampler, &mut scratch.counters);
        let beta = Spectrum::splat(start.weight);
        scratch.counters.closest += 1;
        let classifier = request.parts().classifier().filter(|_| S::WANTS.classes);
        let mut add = |(s, t), emitter, value: Spectrum, weight, trails: &mut Trails, path: PathView<'_>| {
            let Trails { camera, classes, .. } = trails;
            classes.clear();
            if let (Some(classifier), Some(emitter)) = (classifier, emitter) {
                trail::end(classifier, camera.at(camera.last()), emitter, classes);
            }
            let plain = Contribution::new(raster, Technique::connect(s, t), beta * value, weight);
            out.add(Contribution { emitter, classes, path, ..plain });
        };
        if let Some(classifier) = classifier {
            scratch.trails.camera.clear();
            scratch.trails.camera.begin(classifier.camera_start());
        }
        // Shown to sinks that ask for vertices.
        let mut camera: Vec<PathVertex> = Vec::new();
        let d = start.ray.d;
        if S::WANTS.vertices {
            camera.push(PathVertex::of_camera(scene, start.at, start.weight));
        }
        let met = scene.intersect(&start.ray);
        let Some(hit) = &met else {
            if S::WANTS.vertices {
                camera.extend(PathVertex::of_environment(scene, d, beta, start.pdf_d));
            }
            let path = PathView { light: &[], camera: &camera };
            return add((0, 2), scene.environment, scene.environment_le(d), 1.0, &mut scratch.trails, path);
        };
        let wo = -d;
        if S::WANTS.vertices {
            camera.push(PathVertex::of_surface(hit, d, beta, start.pdf_d, &camera[0]));
        }
        if hit.emitter.is_some() {
            let path = PathView { light: &[], camera: &camera };
            add((0, 2), hit.emitter, scene.le(hit, wo), 1.0, &mut scratch.trails, path);
        }
        if !request.wants(1) {
            return;
        }
        sampler.start_vertex(Subpath::Camera, 1);
        let odds = if self.strategy == Strategy::Bsdf { None } else { scene.emitter_odds(hit, wo) };
        let found = [
            ((1, 2), self.by_emitter(scene, (hit, wo, odds.as_ref()), sampler, scratch)),
            ((0, 3), self.by_bsdf(scene, (hit, wo, odds.as_ref()), sampler, scratch)),
        ];
        for (technique, found) in found {
            let Some(Found { emitter, value, weight, wi, delta, end }) = found else { continue };
            if let Some(classifier) = classifier {
                let trail = &mut scratch.trails.camera;
                trail.scatter(classifier, Subpath::Camera, 0, &Bounce { hit, wo, wi, delta });
            }
            let end = S::WANTS.vertices.then(|| end.vertex(scene, emitter, wi, &camera[1])).flatten();
            let path = match (&end, technique) {
                (Some(end), (1, _)) => PathView { light: std::slice::from_ref(end), camera: &camera },
                _ => {
                    camera.extend(end);
                    PathView { light: &[], camera: &camera }
                }
            };
            add(technique, Some(emitter), value, weight, &mut scratch.trails, path);
        }
    }
}

/// Light that was scattered once.
struct Found {
    emitter: EmitterId,
    /// What arrives, unweighted.
    value: Spectrum,
    weight: f64,
    /// Towards where it came from.
    wi: Vec3,
    /// Whether a delta lobe scattered it.
    delta: bool,
    end: End,
}

/// Where light that was scattered once comes from: a sampled point, or what a direction of this weight and density [1/sr] met, a surface
/// or nothing.
struct End {
    sampled: Option<Endpoint>,
    met: Option<Interaction>,
    weight: Spectrum,
    pdf: f32,
}

impl End {
    /// As the next vertex after one that a walk reached.
    fn vertex(&self, scene: &Scene, emitter: EmitterId, wi: Vec3, before: &PathVertex) -> Option<PathVertex> {
        let beta = before.beta * self.weight;
        match (self.sampled, &self.met) {
            (Some(endpoint), _) => Some(PathVertex { wo: -wi, ..PathVertex::of_emitter(emitter, endpoint) }),
            (None, Some(hit)) => Some(PathVertex::of_surface(hit, wi, beta, self.pdf, before)),
            (None, None) => PathVertex::of_environment(scene, wi, beta, self.pdf),
        }
    }
}

impl Direct {
    /// Order 1 by a point on an emitter.
    fn by_emitter(
        &self,
        scene: &Scene,
        (hit, wo, odds): (&Interaction, Vec3, Option<&EmitterOdds>),
        sampler: &mut Sampler,
        scratch: &mut Scratch,
    ) -> Option<Found> {
        if self.strategy == Strategy::Bsdf || !hit.is_connectable() {
            return None;
        }
        let event = sample_next_event(scene, &hit.point, odds, sampler)?;
        scratch.counters.connections += 1;
        let (f, pdf) = hit.eval_pdf(wo, event.wi, TransportMode::Radiance);
        let value = f * event.radiance * event.wi.dot(hit.ns()).abs();
        if value.is_zero() {
            return None;
        }
        scratch.counters.shadow += 1;
        if scene.occluded(&event.shadow_ray(&hit.point)) {
            return None;
        }
        let alone = self.strategy == Strategy::Emitter || event.delta;
        let weight = if alone { 1.0 } else { weight2(self.mis, event.pdf, pdf) };
        let end = End { sampled: Some(event.endpoint), met: None, weight: Spectrum::ONE, pdf: event.pdf };
        Some(Found { emitter: event.emitter, value, weight, wi: event.wi, delta: false, end })
    }

    /// Order 1 by a direction from the BSDF.
    fn by_bsdf(
        &self,
        scene: &Scene,
        (hit, wo, odds): (&Interaction, Vec3, Option<&EmitterOdds>),
        sampler: &mut Sampler,
        scratch: &mut Scratch,
    ) -> Option<Found> {
        if self.strategy == Strategy::Emitter || !scene.needs.hittable_emitters {
            return None;
        }
        let uc = if !scene.needs.only_lambertian { sampler.get_1d(Purpose::Lobe) } else { 0.0 };
        let u = sampler.get_2d(Purpose::Direction);
        scratch.counters.bsdf_samples += 1;
        let sample = hit.sample(wo, uc, u, TransportMode::Radiance)?;
        scratch.counters.closest += 1;
        let met = scene.intersect(&hit.point.spawn(sample.wi));
        let (emitter, le, pdf) = match &met {
            Some(next) => {
                let emitter = next.emitter?;
                let pdf = pdf_next_event(scene, (&hit.point, odds), emitter, next, sample.wi);
                (emitter, scene.le(next, -sample.wi), pdf)
            }
            None => {
                let emitter = scene.environment?;
                let pdf = pdf_next_event_environment(scene, (&hit.point, odds), emitter, sample.wi);
                (emitter, scene.environment_le(sample.wi), pdf)
            }
        };
        let delta = sample.lobe.is_delta();
        let alone = self.strategy == Strategy::Bsdf || delta;
        let weight = if alone { 1.0 } else { weight2(self.mis, sample.pdf, pdf) };
        let end = End { sampled: None, met, weight: sample.weight, pdf: sample.pdf };
        Some(Found { emitter, value: sample.weight * le, weight, wi: sample.wi, delta, end })
    }
}
