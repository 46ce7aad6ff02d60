//! Path tracing: walks from the camera, with next-event estimation and multiple importance sampling.
//!
//! Order `k` is estimated twice, by emitters that the walk hits after `k` scatterings and by an emitter point sampled at
//! its `k`-th scattering; the two are weighted by MIS [Veach97, ch. 9]. \[Kajiya86\]
//!
//! At the boundary of a body a walk is reflected, or goes on from where light came in; that is one scattering.

use crate::contribution::{Contribution, PathView, Sink, Technique};
use crate::efficiency::Efficiency;
use crate::guide::{Guide, Unguided};
use crate::lpe::Classifier;
use crate::measurement::Counters;
use crate::method::{Estimator, Pixel, Replicate};
use crate::next_event::{Candidates, Scattered, Strategy, pdf_next_event, pdf_next_event_environment, weight2};
use crate::request::Request;
use crate::roulette::{CameraRoulette, compensated};
use crate::scratch::Scratch;
use crate::start::{CameraStart, start_camera};
use crate::subsurface::enter;
use crate::trail::{self, Bounce, Trails};
use crate::vertex::PathVertex;
use sampling::Vec2;
use sampling::Vec3;
use sampling::bsdf::{Lobes, TransportMode};
use sampling::fault;
use sampling::math::Spectrum;
use sampling::mis::Heuristic;
use sampling::sampler::{Purpose, Sampler, Subpath};
use sampling::subsurface::Subsurface;
use scenes::{EmitterId, Interaction, Needs, Ray, Scene, SurfacePoint};
use serde::{Deserialize, Serialize};
use std::num::NonZeroU16;
use std::sync::Arc;

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
            roulette_start: 3,
            next_event_candidates: NonZeroU16::MIN,
            followed: Lobes::ALL,
            shadows: true,
            efficiency: None,
        }
    }
}

/// Where the walk last scattered by a lobe that next-event estimation could also have used.
#[derive(Clone, Copy)]
struct Scattering {
    at: SurfacePoint,
    /// Density of the direction taken [1/sr].
    pdf: f32,
}

/// The state of a walk.
struct Walk<'a, G, S> {
    scene: &'a Scene,
    request: &'a Request,
    settings: &'a Path,
    guide: G,
    raster: Vec2,
    beta: Spectrum,
    /// Scatterings so far.
    order: usize,
    /// `None` where only this walk can meet emitters: at the camera, after a delta lobe, without next-event estimation.
    last: Option<Scattering>,
    /// Density of the walk's direction [1/sr], or the probability of a delta lobe's; kept for sinks that ask for vertices.
    pdf: f32,
    /// Where classes are asked for, what tells them.
    classifier: Option<&'a Classifier>,
    out: &'a mut S,
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
        let mut walk =
            Walk { scene, request, settings, guide, raster, beta, order: 0, last: None, pdf, classifier, out };
        walk.run(sample.ray, sampler, scratch);
    }
}

impl<G: Guide, S: Sink> Walk<'_, G, S> {
    fn run(&mut self, mut ray: Ray, sampler: &mut Sampler, scratch: &mut Scratch) {
        loop {
            // Where no emitter can be met, a ray serves the scatterings from its end on.
            if !self.scene.needs.hittable_emitters && !self.request.wants_from(self.order + 1) {
                return;
            }
            scratch.counters.closest += 1;
            let Some(hit) = self.scene.intersect(&ray) else { return self.escape(ray.d, scratch) };
            let wo = -ray.d;
            if S::WANTS.vertices {
                let before = scratch.camera[scratch.camera.len() - 1];
                scratch.camera.push(PathVertex::of_surface(&hit, ray.d, self.beta, self.pdf, &before));
            }
            self.emission(&hit, wo, scratch);
            if !self.request.wants_from(self.order + 1) {
                return;
            }
            sampler.start_vertex(Subpath::Camera, self.order as u32 + 1);
            let next = match self.scene.body_of(&hit) {
                Some(body) => self.meet_body(&body.subsurface, &hit, wo, sampler, scratch),
                None => self.meet_surface(&hit, wo, sampler, scratch),
            };
            let Some(next) = next else { return };
            ray = next;
        }
    }

    /// Whether an emitter that the walk meets now is part of the image.
    #[inline]
    fn counts_what_it_meets(&self) -> bool {
        let left_to_next_event = self.settings.strategy == Strategy::Emitter && self.last.is_some();
        self.request.wants(self.order) && !left_to_next_event
    }

    /// Adds what the hit surface emits along the walk.
    #[inline]
    fn emission(&mut self, hit: &Interaction, wo: Vec3, scratch: &mut Scratch) {
        let Some(emitter) = hit.emitter else { return };
        if !self.counts_what_it_meets() {
            return;
        }
        let le = self.scene.le(hit, wo);
        if le.is_zero() {
            return;
        }
        let weight = match self.last {
            None => 1.0,
            Some(last) => {
                let pdf = pdf_next_event(self.scene, &last.at, emitter, hit, -wo);
                fault!("emission_counted_twice", weight2(self.settings.mis, last.pdf, pdf), 1.0)
            }
        };
        self.add((0, &[]), emitter, self.beta * le, weight, scratch);
    }

    /// Adds what the environment sends along the walk.
    fn escape(&mut self, direction: Vec3, scratch: &mut Scratch) {
        let Some(emitter) = self.scene.environment else { return };
        if !self.counts_what_it_meets() {
            return;
        }
        let weight = match self.last {
            None => 1.0,
            Some(last) => {
                let pdf = pdf_next_event_environment(self.scene, &last.at, emitter, direction);
                weight2(self.settings.mis, last.pdf, pdf)
            }
        };
        let le = self.scene.environment_le(direction);
        if S::WANTS.vertices {
            scratch.camera.extend(PathVertex::of_environment(self.scene, direction, self.beta, self.pdf));
        }
        self.add((0, &[]), emitter, self.beta * le, weight, scratch);
    }

    /// Takes the walk on from a surface, or ends it.
    #[inline]
    fn meet_surface(
        &mut self,
        hit: &Interaction,
        wo: Vec3,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
    ) -> Option<Ray> {
        if hit.is_connectable() {
            let guide = self.guide;
            let scattered = |wi: Vec3| {
                let (f, pdf) = hit.eval_pdf(wo, wi, TransportMode::Radiance);
                let pdf = guide.pdf(hit, wi, pdf);
                Scattered { f, cos: fault!("next_event_cosine_dropped", wi.dot(hit.ns()).abs(), 1.0), pdf }
            };
            self.next_event(&hit.point, scattered, Some((hit, wo)), sampler, scratch);
        }
        self.scatter(hit, wo, sampler, scratch)
    }

    /// Takes the walk on from the boundary of a body, which reflects it or lets it through, or ends it.
    #[inline(never)]
    fn meet_body(
        &mut self,
        body: &Subsurface,
        hit: &Interaction,
        wo: Vec3,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
    ) -> Option<Ray> {
        let boundary = body.boundary(wo.dot(hit.ns()).abs());
        let reflected = body.reflection_pmf(boundary);
        if sampler.get_1d(Purpose::Lobe) < reflected {
            self.beta = self.beta / reflected;
            return self.scatter(hit, wo, sampler, scratch);
        }
        if body.albedo().is_zero() {
            return None;
        }
        if let Some(classifier) = self.classifier {
            scratch.trails.camera.pass_body(classifier, hit);
        }
        let Scratch { found, counters, .. } = scratch;
        let (entrance, weight) = enter(self.scene, body, (hit, wo), sampler, found, counters)?;
        self.beta *= weight * body.passage_weight(boundary);
        if S::WANTS.vertices
            && let Some(last) = scratch.camera.last_mut()
        {
            last.at = entrance.point;
        }
        self.next_event(&entrance.point, |wi| entrance.eval(wi), None, sampler, scratch);
        scratch.counters.bsdf_samples += 1;
        let (wi, weight, pdf) = entrance.sample(sampler.get_2d(Purpose::Direction))?;
        self.advance(Spectrum::splat(weight), (entrance.point.p, wi), sampler)?;
        self.last = (self.settings.strategy != Strategy::Bsdf).then_some(Scattering { at: entrance.point, pdf });
        if S::WANTS.vertices {
            self.leave(pdf, false, scratch);
        }
        Some(entrance.point.spawn(wi))
    }

    /// Samples an emitter as seen from a point; `scattered` is what the point makes of light from a direction. `bounce` is the
    /// surface and the direction back along the walk, where the word of the path does not have the scattering yet.
    #[inline]
    fn next_event(
        &mut self,
        from: &SurfacePoint,
        scattered: impl Fn(Vec3) -> Scattered,
        bounce: Option<(&Interaction, Vec3)>,
        sampler: &mut Sampler,
        scratch: &mut Scratch,
    ) {
        if self.settings.strategy == Strategy::Bsdf || !self.request.wants(self.order + 1) {
            return;
        }
        let candidates = Candidates { vertex: self.order as u32 + 1, count: self.settings.next_event_candidates };
        let chosen = candidates.choose(self.scene, from, sampler, |event| {
            scratch.counters.connections += 1;
            let Scattered { f, cos, pdf } = scattered(event.wi);
            (self.beta * f * event.radiance * cos, pdf)
        });
        let Some((event, value, pdf)) = chosen else { return };
        if value.is_zero() {
            return;
        }
        if self.settings.shadows {
            scratch.counters.shadow += 1;
            if self.scene.occluded(&event.shadow_ray(from)) {
                return;
            }
        }
        let heuristic = fault!("heuristics_differ_between_sides", self.settings.mis, Heuristic::Balance);
        let alone = event.delta || self.settings.strategy == Strategy::Emitter;
        let weight = if alone { 1.0 } else { weight2(heuristic, event.pdf, pdf) };
        let y = S::WANTS.vertices.then(|| PathVertex::of_emitter(event.emitter, event.endpoint));
        match (self.classifier, bounce) {
            (Some(classifier), Some((hit, wo))) => {
                let bounce = Bounce { hit, wo, wi: event.wi, delta: false };
                let trail = &mut scratch.trails.camera;
                trail.scatter(classifier, Subpath::Camera, trail.last(), &bounce);
                self.add((1, y.as_slice()), event.emitter, value, weight, scratch);
                scratch.trails.camera.pop();
            }
            _ => self.add((1, y.as_slice()), event.emitter, value, weight, scratch),
        }
    }

    /// Takes the walk one scattering on, or ends it.
    #[inline]
    fn scatter(&mut self, hit: &Interaction, wo: Vec3, sampler: &mut Sampler, scratch: &mut Scratch) -> Option<Ray> {
        let chooses = G::CHOOSES || !self.scene.needs.only_lambertian;
        let uc = if chooses { sampler.get_1d(Purpose::Lobe) } else { 0.0 };
        let u = sampler.get_2d(Purpose::Direction);
        scratch.counters.bsdf_samples += 1;
        let sample = self.guide.sample(hit, wo, uc, u)?;
        if !sample.lobe.intersects(self.settings.followed) {
            return None;
        }
        self.advance(sample.weight, (hit.point.p, sample.wi), sampler)?;
        let also_next_event = self.settings.strategy != Strategy::Bsdf && !sample.lobe.is_delta();
        self.last = also_next_event.then_some(Scattering { at: hit.point, pdf: sample.pdf });
        if S::WANTS.vertices {
            self.leave(sample.pdf, sample.lobe.is_delta(), scratch);
        }
        if let Some(classifier) = self.classifier {
            let trail = &mut scratch.trails.camera;
            let bounce = Bounce { hit, wo, wi: sample.wi, delta: sample.lobe.is_delta() };
            trail.scatter(classifier, Subpath::Camera, trail.last(), &bounce);
        }
        Some(hit.point.spawn(sample.wi))
    }

    /// Counts a scattering of this weight, at a point into a direction, and plays roulette; `None` where the walk ends.
    #[inline]
    fn advance(&mut self, weight: Spectrum, (p, wi): (Vec3, Vec3), sampler: &mut Sampler) -> Option<()> {
        self.beta *= weight;
        if self.beta.is_zero() {
            return None;
        }
        self.order += 1;
        let Path { roulette, roulette_start, efficiency, .. } = self.settings;
        let mut u = || sampler.get_1d(Purpose::Roulette);
        self.beta *= match efficiency.as_deref() {
            Some(efficiency) if self.order >= *roulette_start => {
                compensated(efficiency.survival(self.beta, p, wi), u())?
            }
            Some(_) => 1.0,
            None => roulette.by_throughput().survive(self.beta, self.order, *roulette_start, u)?,
        };
        self.out.goes_on(p, wi, self.beta);
        Some(())
    }

    /// Notes how the walk leaves its last vertex.
    fn leave(&mut self, pdf: f32, delta: bool, scratch: &mut Scratch) {
        self.pdf = pdf;
        if let Some(last) = scratch.camera.last_mut() {
            last.delta = delta;
        }
    }

    /// Hands a path over that ends at an emitter: met by the walk, or at the one vertex of a light subpath, which only sinks that
    /// ask for vertices are shown.
    #[inline]
    fn add(
        &mut self,
        (s, light): (usize, &[PathVertex]),
        emitter: EmitterId,
        value: Spectrum,
        weight: f64,
        scratch: &mut Scratch,
    ) {
        let Trails { camera, classes, .. } = &mut scratch.trails;
        if let Some(classifier) = self.classifier {
            trail::end(classifier, camera.at(camera.last()), emitter, classes);
        }
        let classes = if self.classifier.is_some() { &classes[..] } else { &[] };
        let path = if S::WANTS.vertices { PathView { light, camera: &scratch.camera } } else { PathView::default() };
        let technique = Technique::connect(s, self.order + fault!("order_off_by_one", 2, 2 - s));
        let plain = Contribution::new(self.raster, technique, value, weight);
        self.out.add(Contribution { emitter: Some(emitter), classes, path, ..plain });
    }
}
