//! Light tracing: walks from the emitters, every vertex connected to the camera.
//!
//! The adjoint of path tracing without next-event estimation \[Dutre93\]: a particle's weight times the
//! emitted importance of the camera is splatted where the connection meets the film.

use crate::contribution::{Contribution, PathView, Sink, Technique};
use crate::integrator::{Estimator, Pixel};
use crate::lpe::Classifier;
use crate::next_event::camera_response;
use crate::request::Request;
use crate::roulette::Roulette;
use crate::scratch::Scratch;
use crate::start::{LightStart, start_light};
use crate::trail::{self, Bounce, Trails};
use crate::vertex::{PathVertex, Site};
use sampling::bsdf::TransportMode;
use sampling::fault;
use sampling::math::Spectrum;
use sampling::sampler::{Purpose, Sampler, Subpath};
use sampling::{Vec2, Vec3};
use scenes::{EmitterId, EndpointKind, Interaction, LeSample, Needs, Ray, Rays, Scene, SurfacePoint};
use serde::{Deserialize, Serialize};

/// A light tracer's settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Light {
    /// How walks end.
    pub roulette: Roulette,
    /// The number of scatterings from which roulette is played.
    pub roulette_start: usize,
}

impl Default for Light {
    fn default() -> Self {
        Self { roulette: Roulette::Throughput, roulette_start: 3 }
    }
}

impl Estimator for Light {
    const CLASSIFIES: bool = true;

    fn expression(&self) -> &'static str {
        "L(.*D)?E"
    }

    fn makes(&self, technique: Technique) -> bool {
        matches!(technique, Technique::Connect { t: 1, .. })
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        let endless = request.tail() && self.roulette == Roulette::None;
        endless.then(|| {
            "without roulette its walks have no end beyond max_order; set roulette=throughput or leave out the tail"
                .into()
        })
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        let class = "L.*SE: what a mirror or glass sends to the camera cannot be met by a connection";
        if needs.delta_lobes { vec![class.to_owned()] } else { Vec::new() }
    }

    fn estimate<S: Sink>(
        &self,
        scene: &Scene,
        request: &Request,
        _: Pixel,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        out: &mut S,
    ) {
        sampler.start_vertex(Subpath::Light, 0);
        let Some(start) = start_light(scene, sampler, &mut scratch.counters) else { return };
        let classifier = request.parts().classifier().filter(|_| S::WANTS.classes);
        let mut walk = Walk { scene, request, settings: self, emitter: start.emitter, classifier, out };
        if let Some(classifier) = classifier {
            scratch.trails.light.clear();
            scratch.trails.light.begin(classifier.light_start(start.emitter.0 as usize));
        }
        if S::WANTS.vertices {
            let LeSample { endpoint, pdf_p, .. } = start.sample;
            let first = PathVertex::first(Site::Emitter(start.emitter, endpoint), endpoint.at, Spectrum::ONE);
            scratch.light.clear();
            scratch.light.push(PathVertex { pdf_fwd: f64::from(pdf_p * start.pmf), ..first });
        }
        if request.wants(0) {
            walk.connect_emitter(&start, sampler, scratch);
        }
        walk.run(&start, sampler, scratch);
    }
}

/// The state of a walk.
struct Walk<'a, S> {
    scene: &'a Scene,
    request: &'a Request,
    settings: &'a Light,
    emitter: EmitterId,
    /// Where classes are asked for, what tells them.
    classifier: Option<&'a Classifier>,
    out: &'a mut S,
}

impl<S: Sink> Walk<'_, S> {
    fn run(&mut self, start: &LightStart, sampler: &mut Sampler, scratch: &mut Scratch) {
        let emitted = start.beta();
        // What has become of the emitted flux: the part of the weight that roulette looks at.
        let mut throughput = Spectrum::ONE;
        let (mut ray, mut pdf) = (start.sample.ray, start.sample.pdf_d);
        let mut order = 0;
        while self.request.wants_from(order + 1) {
            scratch.counters.closest += 1;
            let met = self.scene.intersect(&ray);
            let Some(hit) = &met else { return };
            let wo = -ray.d;
            order += 1;
            sampler.start_vertex(Subpath::Light, order as u32);
            if S::WANTS.vertices {
                let before = scratch.light[scratch.light.len() - 1];
                scratch.light.push(PathVertex::of_surface(hit, ray.d, emitted * throughput, pdf, &before));
            }
            if self.request.wants(order) && hit.is_connectable() {
                self.connect(hit, wo, emitted * throughput, order, sampler, scratch);
            }
            if !self.request.wants_from(order + 1) {
                return;
            }
            let uc = if !self.scene.needs.only_lambertian { sampler.get_1d(Purpose::Lobe) } else { 0.0 };
            let u = sampler.get_2d(Purpose::Direction);
            scratch.counters.bsdf_samples += 1;
            let Some(sample) = hit.sample(wo, uc, u, TransportMode::Importance) else { return };
            throughput *= sample.weight;
            if throughput.is_zero() {
                return;
            }
            let survived = self
                .settings
                .roulette
                .survive(throughput, order, self.settings.roulette_start, || sampler.get_1d(Purpose::Roulette));
            let Some(factor) = survived else { return };
            throughput *= factor;
            if let Some(classifier) = self.classifier {
                let trail = &mut scratch.trails.light;
                let bounce = Bounce { hit, wo, wi: sample.wi, delta: sample.lobe.is_delta() };
                trail.scatter(classifier, Subpath::Light, trail.last(), &bounce);
            }
            if S::WANTS.vertices {
                pdf = sample.pdf;
                let last = scratch.light.len() - 1;
                scratch.light[last].delta = sample.lobe.is_delta();
            }
            ray = hit.point.spawn(sample.wi);
        }
    }

    /// Splats what a surface point scatters into the camera.
    #[inline]
    fn connect(
        &mut self,
        hit: &Interaction,
        wo: Vec3,
        beta: Spectrum,
        order: usize,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
    ) {
        let u = if !self.scene.needs.pinhole { sampler.get_2d(Purpose::NextCamera) } else { Vec2::ZERO };
        let Some(camera) = self.scene.camera.sample_wi(hit.point.p, u) else { return };
        scratch.counters.connections += 1;
        let f = hit.eval(wo, camera.wi, TransportMode::Importance);
        let value = beta * f * (camera.we * camera.wi.dot(hit.ns()).abs() / camera.pdf);
        if value.is_zero() {
            return;
        }
        scratch.counters.shadow += 1;
        if self.scene.occluded(&hit.point.segment_to(&camera.at)) {
            return;
        }
        self.add((camera.at, camera.raster), order, value, Some((hit, wo, camera.wi)), scratch);
    }

    /// Splats what the emitter's point itself sends into the camera. What is certain of direction or place is too
    /// small to be seen.
    fn connect_emitter(&mut self, start: &LightStart, sampler: &mut Sampler, scratch: &mut Scratch) {
        let endpoint = &start.sample.endpoint;
        let camera = &self.scene.camera;
        let u = if self.scene.needs.pinhole { Vec2::ZERO } else { sampler.get_2d(Purpose::NextCamera) };
        let (value, film, ray) = match endpoint.kind {
            EndpointKind::Point | EndpointKind::Direction => return,
            EndpointKind::Surface => {
                let Some(seen) = camera.sample_wi(endpoint.at.p, u) else { return };
                let le = self.scene.le_at(start.emitter, &start.sample, seen.wi);
                let geometry = endpoint.at.ng.dot(seen.wi).abs() * seen.we / seen.pdf;
                (le * geometry, (seen.at, seen.raster), endpoint.at.segment_to(&seen.at))
            }
            EndpointKind::Infinite => {
                let Some((at, ray, raster, response)) = self.towards_infinity(start, u) else { return };
                (self.scene.environment_le(ray.d) * response, (at, raster), ray)
            }
        };
        scratch.counters.connections += 1;
        if value.is_zero() {
            return;
        }
        scratch.counters.shadow += 1;
        if self.scene.occluded(&ray) {
            return;
        }
        self.add(film, 0, value / (start.pmf * start.sample.pdf_p), None, scratch);
    }

    /// A ray from a point of the camera to where a walk comes from that starts infinitely far; where it meets the film; and what the
    /// camera makes of the radiance along it, by the measure in which the start was sampled.
    fn towards_infinity(&self, start: &LightStart, u: Vec2) -> Option<(SurfacePoint, Ray, Vec2, f32)> {
        let camera = &self.scene.camera;
        if camera.rays() == Rays::Parallel {
            // No sampled direction is that of the camera's rays: it is taken instead, for certain, at a place of the film.
            let (raster, area) = camera.raster().reached(u);
            let seen = camera.sample_we(raster, Vec2::ZERO);
            return Some((seen.at, seen.ray, raster, start.sample.pdf_p * area));
        }
        // Any point of the lens will do.
        let (at, d) = (camera.sample_we(Vec2::ZERO, u).at, -start.sample.endpoint.at.ng);
        let (we_cos, raster) = camera_response(self.scene, &at, d)?;
        Some((at, at.spawn(d), raster, we_cos))
    }

    /// Hands a path over to a point of the camera and a place on the film. Its last scattering, if there is one, is at a point and
    /// between two directions.
    fn add(
        &mut self,
        (at, raster): (SurfacePoint, Vec2),
        order: usize,
        value: Spectrum,
        last: Option<(&Interaction, Vec3, Vec3)>,
        scratch: &mut Scratch,
    ) {
        let technique = Technique::connect(order + 1, 1);
        let value = fault!("light_paths_miscounted", value, value * 0.5);
        let emitter = Some(self.emitter);
        let Trails { light, classes, .. } = &mut scratch.trails;
        if let Some(classifier) = self.classifier {
            let camera = [(classifier.camera_start(), Spectrum::ONE)];
            match last {
                None => trail::join(classifier, &camera, light.at(light.last()), classes),
                Some((hit, wo, wi)) => {
                    light.scatter(classifier, Subpath::Light, light.last(), &Bounce { hit, wo, wi, delta: false });
                    trail::join(classifier, &camera, light.at(light.last()), classes);
                    light.pop();
                }
            }
        }
        let classes = if self.classifier.is_some() { &classes[..] } else { &[] };
        let camera = S::WANTS.vertices.then(|| PathVertex::of_camera(self.scene, at, 1.0));
        let path = match &camera {
            Some(camera) => PathView { light: &scratch.light, camera: std::slice::from_ref(camera) },
            None => PathView::default(),
        };
        self.out.add(Contribution { emitter, classes, path, ..Contribution::new(raster, technique, value, 1.0) });
    }
}
