//! Path tracing: walks from the camera, with next-event estimation and multiple importance sampling.
//!
//! Order `k` is estimated twice, by emitters that the walk hits after `k` scatterings and by an emitter point sampled at
//! its `k`-th scattering; the two are weighted by MIS [Veach97, ch. 9]. \[Kajiya86\]

use crate::contribution::{Contribution, PathView, Sink, Technique};
use crate::method::{Estimator, Pixel};
use crate::next_event::{pdf_next_event, pdf_next_event_environment, sample_next_event, weight2};
use crate::request::Request;
use crate::roulette::Roulette;
use crate::scratch::Scratch;
use crate::start::{CameraStart, start_camera};
use sampling::Vec2;
use sampling::Vec3;
use sampling::bsdf::TransportMode;
use sampling::fault;
use sampling::math::Spectrum;
use sampling::mis::Heuristic;
use sampling::sampler::{Purpose, Sampler, Subpath};
use scenes::{Interaction, Needs, Ray, Scene};
use serde::{Deserialize, Serialize};

/// A path tracer's settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Path {
    /// Whether emitters are also sampled from every vertex.
    pub next_event: bool,
    /// How the two techniques are weighted.
    pub mis: Heuristic,
    /// How walks end.
    pub roulette: Roulette,
    /// The number of scatterings from which roulette is played.
    pub roulette_start: usize,
}

impl Default for Path {
    fn default() -> Self {
        Self { next_event: true, mis: Heuristic::Power, roulette: Roulette::Throughput, roulette_start: 3 }
    }
}

/// Where the walk last scattered by a lobe that next-event estimation could also have used.
#[derive(Clone, Copy)]
struct Scattering {
    p: Vec3,
    /// Density of the direction taken [1/sr].
    pdf: f32,
}

/// The state of a walk.
struct Walk<'a, S> {
    scene: &'a Scene,
    request: &'a Request,
    settings: &'a Path,
    raster: Vec2,
    beta: Spectrum,
    /// Scatterings so far.
    order: usize,
    /// `None` where only this walk can meet emitters: at the camera, after a delta lobe, without next-event estimation.
    last: Option<Scattering>,
    out: &'a mut S,
}

impl Estimator for Path {
    fn unsupported_request(&self, request: &Request) -> Option<String> {
        let endless = request.tail() && self.roulette == Roulette::None;
        endless.then(|| {
            "without roulette its walks have no end beyond max_order; set roulette=throughput or leave out the tail"
                .into()
        })
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        let mut missing = Vec::new();
        if needs.delta_emitters && !self.next_event {
            missing.push(
                "L.*E from point emitters: walks cannot hit a point, and next-event estimation is off".to_owned(),
            );
        }
        if needs.delta_emitters && needs.delta_lobes {
            missing.push("LS.*E from point emitters: no walk can hit a point behind a mirror or glass".to_owned());
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
        let CameraStart { raster, sample } = start_camera(scene, pixel, sampler, &mut scratch.counters);
        let beta = Spectrum::splat(sample.weight);
        let mut walk = Walk { scene, request, settings: self, raster, beta, order: 0, last: None, out };
        walk.run(sample.ray, sampler, scratch);
    }
}

impl<S: Sink> Walk<'_, S> {
    fn run(&mut self, mut ray: Ray, sampler: &mut Sampler, scratch: &mut Scratch) {
        loop {
            scratch.counters.closest += 1;
            let Some(hit) = self.scene.intersect(&ray) else { return self.escape(ray.d) };
            let wo = -ray.d;
            self.emission(&hit, wo);
            if !self.request.wants_from(self.order + 1) {
                return;
            }
            sampler.start_vertex(Subpath::Camera, self.order as u32 + 1);
            if self.settings.next_event && hit.is_connectable() {
                self.next_event(&hit, wo, sampler, scratch);
            }
            let Some(next) = self.scatter(&hit, wo, sampler, scratch) else { return };
            ray = next;
        }
    }

    /// Adds what the hit surface emits along the walk.
    #[inline]
    fn emission(&mut self, hit: &Interaction, wo: Vec3) {
        let Some(emitter) = hit.emitter else { return };
        if !self.request.wants(self.order) {
            return;
        }
        let le = self.scene.le(hit, wo);
        if le.is_zero() {
            return;
        }
        let weight = match self.last {
            None => 1.0,
            Some(last) => {
                let pdf = pdf_next_event(self.scene, last.p, emitter, hit, -wo);
                fault!("emission_counted_twice", weight2(self.settings.mis, last.pdf, pdf), 1.0)
            }
        };
        self.add(Technique::connect(0, self.order + 2), self.beta * le, weight);
    }

    /// Adds what the environment sends along the walk.
    fn escape(&mut self, direction: Vec3) {
        let Some(emitter) = self.scene.environment else { return };
        if !self.request.wants(self.order) {
            return;
        }
        let weight = match self.last {
            None => 1.0,
            Some(last) => {
                let pdf = pdf_next_event_environment(self.scene, last.p, emitter, direction);
                weight2(self.settings.mis, last.pdf, pdf)
            }
        };
        let le = self.scene.environment_le(direction);
        self.add(Technique::connect(0, self.order + 2), self.beta * le, weight);
    }

    /// Samples an emitter from the hit point.
    #[inline]
    fn next_event(&mut self, hit: &Interaction, wo: Vec3, sampler: &mut Sampler, scratch: &mut Scratch) {
        if !self.request.wants(self.order + 1) {
            return;
        }
        let Some(event) = sample_next_event(self.scene, hit.point.p, sampler) else { return };
        scratch.counters.connections += 1;
        let (f, pdf) = hit.eval_pdf(wo, event.wi, TransportMode::Radiance);
        let cos = fault!("next_event_cosine_dropped", event.wi.dot(hit.ns()).abs(), 1.0);
        let value = self.beta * f * event.radiance * cos;
        if value.is_zero() {
            return;
        }
        scratch.counters.shadow += 1;
        if self.scene.occluded(&event.shadow_ray(&hit.point)) {
            return;
        }
        let heuristic = fault!("heuristics_differ_between_sides", self.settings.mis, Heuristic::Balance);
        let weight = if event.delta { 1.0 } else { weight2(heuristic, event.pdf, pdf) };
        let t = self.order + fault!("order_off_by_one", 2, 1);
        self.add(Technique::connect(1, t), value, weight);
    }

    /// Takes the walk one scattering on, or ends it.
    #[inline]
    fn scatter(&mut self, hit: &Interaction, wo: Vec3, sampler: &mut Sampler, scratch: &mut Scratch) -> Option<Ray> {
        let uc = if !self.scene.needs.only_lambertian { sampler.get_1d(Purpose::Lobe) } else { 0.0 };
        let u = sampler.get_2d(Purpose::Direction);
        scratch.counters.bsdf_samples += 1;
        let sample = hit.sample(wo, uc, u, TransportMode::Radiance)?;
        self.beta *= sample.weight;
        if self.beta.is_zero() {
            return None;
        }
        self.order += 1;
        let settings = self.settings;
        self.beta *= settings
            .roulette
            .survive(self.beta, self.order, settings.roulette_start, || sampler.get_1d(Purpose::Roulette))?;
        let also_next_event = settings.next_event && !sample.lobe.is_delta();
        self.last = also_next_event.then_some(Scattering { p: hit.point.p, pdf: sample.pdf });
        Some(hit.point.spawn(sample.wi))
    }

    #[inline]
    fn add(&mut self, technique: Technique, value: Spectrum, weight: f64) {
        self.out.add(Contribution { raster: self.raster, technique, value, weight, path: PathView::default() });
    }
}
