//! A walk from the camera.

use super::Path;
use crate::contribution::{Contribution, PathView, Sink, Technique};
use crate::guide::Guide;
use crate::lpe::Classifier;
use crate::next_event::{Candidates, Scattered, Strategy, pdf_next_event, pdf_next_event_environment, weight2};
use crate::request::Request;
use crate::roulette::compensated;
use crate::scratch::Scratch;
use crate::subsurface::enter;
use crate::trail::{self, Bounce, Trails};
use crate::vertex::PathVertex;
use sampling::Vec2;
use sampling::Vec3;
use sampling::bsdf::TransportMode;
use sampling::fault;
use sampling::math::Spectrum;
use sampling::sampler::{Purpose, Sampler, Subpath};
use sampling::subsurface::Subsurface;
use scenes::{EmitterId, EmitterOdds, Interaction, Ray, Scene, SurfacePoint};

/// Where the walk last scattered by a lobe that next-event estimation could also have used.
#[derive(Clone, Copy)]
pub(super) struct Scattering {
    pub(super) at: SurfacePoint,
    /// Density of the direction taken [1/sr].
    pub(super) pdf: f32,
}

/// The state of a walk.
pub(super) struct Walk<'a, G, S> {
    pub(super) scene: &'a Scene,
    pub(super) request: &'a Request,
    pub(super) settings: &'a Path,
    pub(super) guide: G,
    pub(super) raster: Vec2,
    pub(super) beta: Spectrum,
    /// Scatterings so far.
    pub(super) order: usize,
    /// `None` where only this walk can meet emitters: at the camera, after a delta lobe, without next-event estimation.
    pub(super) last: Option<Scattering>,
    /// How next-event estimation chose among emitters there, if the surface had a say in it.
    pub(super) odds: Option<EmitterOdds>,
    /// Density of the walk's direction [1/sr], or the probability of a delta lobe's; kept for sinks that ask for vertices.
    pub(super) pdf: f32,
    /// Where classes are asked for, what tells them.
    pub(super) classifier: Option<&'a Classifier>,
    pub(super) out: &'a mut S,
}

impl<G: Guide, S: Sink> Walk<'_, G, S> {
    pub(super) fn run(&mut self, mut ray: Ray, sampler: &mut Sampler, scratch: &mut Scratch) {
        loop {
            // Where no emitter can be met, a ray serves the scatterings from its end on.
            if !self.scene.needs.hittable_emitters && !self.request.wants_from(self.order + 1) {
                return;
            }
            scratch.counters.closest += 1;
            let met = self.scene.intersect(&ray);
            let Some(hit) = &met else { return self.escape(ray.d, scratch) };
            let wo = -ray.d;
            if S::WANTS.vertices {
                let before = scratch.camera[scratch.camera.len() - 1];
                scratch.camera.push(PathVertex::of_surface(hit, ray.d, self.beta, self.pdf, &before));
            }
            self.emission(hit, wo, scratch);
            if !self.request.wants_from(self.order + 1) {
                return;
            }
            sampler.start_vertex(Subpath::Camera, self.order as u32 + 1);
            // Each by itself, so that a ray that leaves a surface stays in registers.
            ray = match self.scene.body_of(hit) {
                Some(body) => match self.meet_body(&body.subsurface, hit, wo, sampler, scratch) {
                    Some(next) => next,
                    None => return,
                },
                None => match self.meet_surface(hit, wo, sampler, scratch) {
                    Some(next) => next,
                    None => return,
                },
            };
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
                let pdf = pdf_next_event(self.scene, (&last.at, self.odds.as_ref()), emitter, hit, -wo);
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
                let pdf = pdf_next_event_environment(self.scene, (&last.at, self.odds.as_ref()), emitter, direction);
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
    #[inline(always)]
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
        self.odds = None;
        if self.settings.strategy == Strategy::Bsdf || !self.request.wants(self.order + 1) {
            return;
        }
        let candidates = Candidates { vertex: self.order as u32 + 1, count: self.settings.next_event_candidates };
        self.odds = bounce.and_then(|(hit, wo)| self.scene.emitter_odds(hit, wo));
        let chosen = candidates.choose(self.scene, (from, self.odds.as_ref()), sampler, |event| {
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
        let heuristic = fault!("heuristics_differ_between_sides", self.settings.mis, sampling::mis::Heuristic::Balance);
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
    #[inline(always)]
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
