//! Direct illumination: what is emitted (order 0) and what is scattered once (order 1).
//!
//! The smallest method in which emitter sampling, BSDF sampling and their combination can be compared [Veach97, §9.3].

use crate::contribution::{Contribution, PathView, Sink, Technique};
use crate::method::{Estimator, Pixel};
use crate::next_event::{pdf_next_event, pdf_next_event_environment, sample_next_event, weight2};
use crate::request::Request;
use crate::scratch::Scratch;
use crate::start::{CameraStart, start_camera};
use sampling::Vec3;
use sampling::bsdf::TransportMode;
use sampling::math::Spectrum;
use sampling::mis::Heuristic;
use sampling::sampler::{Purpose, Sampler, Subpath};
use scenes::{Interaction, Needs, Scene};
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// Which techniques estimate order 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Strategy {
    /// A point on an emitter.
    Emitter,
    /// A direction from the BSDF.
    Bsdf,
    /// Both, weighted by MIS.
    Mis,
}

/// A direct-illumination method's settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Direct {
    /// Which techniques are used.
    pub strategy: Strategy,
    /// How they are weighted where both are.
    pub mis: Heuristic,
}

impl Default for Direct {
    fn default() -> Self {
        Self { strategy: Strategy::Mis, mis: Heuristic::Power }
    }
}

impl Estimator for Direct {
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
        let mut add = |s, t, value: Spectrum, weight| {
            let technique = Technique::connect(s, t);
            out.add(Contribution { raster, technique, value: beta * value, weight, path: PathView::default() });
        };
        let Some(hit) = scene.intersect(&start.ray) else {
            return add(0, 2, scene.environment_le(start.ray.d), 1.0);
        };
        let wo = -start.ray.d;
        if hit.emitter.is_some() {
            add(0, 2, scene.le(&hit, wo), 1.0);
        }
        if !request.wants(1) {
            return;
        }
        sampler.start_vertex(Subpath::Camera, 1);
        if let Some((value, weight)) = self.by_emitter(scene, &hit, wo, sampler, scratch) {
            add(1, 2, value, weight);
        }
        if let Some((value, weight)) = self.by_bsdf(scene, &hit, wo, sampler, scratch) {
            add(0, 3, value, weight);
        }
    }
}

impl Direct {
    /// Order 1 by a point on an emitter: value and weight.
    fn by_emitter(
        &self,
        scene: &Scene,
        hit: &Interaction,
        wo: Vec3,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
    ) -> Option<(Spectrum, f64)> {
        if self.strategy == Strategy::Bsdf || !hit.is_connectable() {
            return None;
        }
        let event = sample_next_event(scene, &hit.point, sampler)?;
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
        Some((value, if alone { 1.0 } else { weight2(self.mis, event.pdf, pdf) }))
    }

    /// Order 1 by a direction from the BSDF: value and weight.
    fn by_bsdf(
        &self,
        scene: &Scene,
        hit: &Interaction,
        wo: Vec3,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
    ) -> Option<(Spectrum, f64)> {
        if self.strategy == Strategy::Emitter {
            return None;
        }
        let uc = if !scene.needs.only_lambertian { sampler.get_1d(Purpose::Lobe) } else { 0.0 };
        let u = sampler.get_2d(Purpose::Direction);
        scratch.counters.bsdf_samples += 1;
        let sample = hit.sample(wo, uc, u, TransportMode::Radiance)?;
        scratch.counters.closest += 1;
        let (le, pdf) = match scene.intersect(&hit.point.spawn(sample.wi)) {
            Some(next) => {
                (scene.le(&next, -sample.wi), pdf_next_event(scene, &hit.point, next.emitter?, &next, sample.wi))
            }
            None => {
                let emitter = scene.environment?;
                (scene.environment_le(sample.wi), pdf_next_event_environment(scene, &hit.point, emitter, sample.wi))
            }
        };
        let alone = self.strategy == Strategy::Bsdf || sample.lobe.is_delta();
        Some((sample.weight * le, if alone { 1.0 } else { weight2(self.mis, sample.pdf, pdf) }))
    }
}
