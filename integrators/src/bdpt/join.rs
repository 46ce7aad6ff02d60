//! The connections between a camera subpath and light subpaths.

use super::{Bdpt, Connections, Weighting};
use crate::connect::{Densities, EmitterEnd, Strategies};
use crate::contribution::{Contribution, PathView, Sink, Technique};
use crate::lpe::Classifier;
use crate::measurement::Counters;
use crate::next_event::{Candidates, FURTHER, NextEvent, camera_response, sample_next_event};
use crate::request::Request;
use crate::reservoir::Reservoir;
use crate::scratch::LightPath;
use crate::trail::{self, Trails};
use crate::vertex::{PathVertex, Site};
use sampling::Vec2;
use sampling::bsdf::TransportMode;
use sampling::fault;
use sampling::math::Spectrum;
use sampling::sampler::{Purpose, Sampler, Subpath};
use scenes::{EmitterId, Ray, Scene};

/// Subpaths being connected.
pub(super) struct Join<'a, S> {
    pub scene: &'a Scene,
    pub request: &'a Request,
    pub settings: &'a Bdpt,
    pub strategies: Strategies,
    pub raster: Vec2,
    /// The vertices of all light subpaths.
    pub light: &'a [PathVertex],
    pub paths: &'a [LightPath],
    pub camera: &'a [PathVertex],
    pub counters: &'a mut Counters,
    pub trails: &'a mut Trails,
    pub out: &'a mut S,
}

/// A path that is whole but for a ray between its two subpaths.
pub(super) struct Connection<'c> {
    pub raster: Vec2,
    /// The number of its first vertex among those of all light subpaths.
    pub first: usize,
    pub light: &'c [PathVertex],
    pub camera: &'c [PathVertex],
    /// Density of the emitter's vertex as seen from the next one.
    pub next_event: f64,
    pub value: Spectrum,
    pub ray: Ray,
}

impl<'a, S: Sink> Join<'a, S> {
    /// What tells classes, where they are asked for; nothing is compiled of that for sinks that never ask.
    #[inline]
    pub fn classifier(&self) -> Option<&'a Classifier> {
        if S::WANTS.classes { self.request.parts().classifier() } else { None }
    }

    pub fn run(&mut self, sampler: &mut Sampler) {
        if let Some(classifier) = self.classifier() {
            self.follow(classifier);
        }
        if self.strategies.emitter_to_camera && self.request.wants(0) {
            self.emitter_to_camera(sampler);
        }
        let splatted = if self.strategies.camera_connections { self.paths } else { &[] };
        for (number, path) in splatted.iter().enumerate() {
            for s in 2..=path.vertices.len() {
                if self.request.wants(s - 1) {
                    self.splat(number, s, sampler);
                }
            }
        }
        for t in 2..=self.camera.len() {
            if self.request.wants(t - 2) {
                self.emission(t);
            }
            if !self.camera[t - 1].is_connectable() || self.camera[t - 1].is_infinite() {
                continue;
            }
            if self.request.wants(t - 1) {
                self.next_event(t, sampler);
            }
            if let Some(photons) = &self.settings.photons {
                self.merge_weighted(t, photons, sampler);
            }
            match self.settings.connections {
                Connections::Resampled => self.connect_one(t, sampler),
                Connections::All | Connections::Roulette => self.connect_all(t, sampler),
            }
        }
    }

    /// The path of one strategy alone, of the whole subpaths.
    pub fn run_strategy(&mut self, (s, t): (usize, usize), sampler: &mut Sampler) {
        if let Some(classifier) = self.classifier() {
            self.follow(classifier);
        }
        match (s, t) {
            (0, _) => self.emission(t),
            (1, 1) if self.strategies.emitter_to_camera => self.emitter_to_camera(sampler),
            (1, 1) => {}
            (_, 1) if self.strategies.camera_connections => self.splat(0, s, sampler),
            (_, 1) => {}
            _ if !self.camera[t - 1].is_connectable() || self.camera[t - 1].is_infinite() => {}
            (1, _) => self.next_event(t, sampler),
            _ => {
                if let Some(value) = self.unshadowed(0, s, t) {
                    self.connect_surfaces((0, s, t), value, sampler);
                }
            }
        }
    }

    /// `s = 0`: the camera subpath's vertex `t − 1` emits.
    fn emission(&mut self, t: usize) {
        let Some((end, value)) = self.emitted(t) else { return };
        let camera = &self.camera[..t];
        let weight = match self.learnt(self.raster, t - 2) {
            Some(learnt) => {
                self.weight_by(learnt, &self.strategies.densities_emission(self.scene, camera, &end), value)
            }
            None => self.strategies.weight_emission(self.scene, camera, &end),
        };
        self.add_emission(t, end.emitter, value, weight);
    }

    /// What the camera subpath's vertex `t − 1` emits; `None` for nothing.
    pub(super) fn emitted(&self, t: usize) -> Option<(EmitterEnd, Spectrum)> {
        let z = &self.camera[t - 1];
        let (end, le) = match &z.site {
            Site::Surface(interaction) => {
                let emitter = interaction.emitter?;
                let le = self.scene.le(interaction, z.wo);
                (EmitterEnd { emitter, endpoint: self.scene.endpoint_of(interaction) }, le)
            }
            Site::Emitter(emitter, endpoint) => {
                (EmitterEnd { emitter: *emitter, endpoint: *endpoint }, self.scene.environment_le(-z.wo))
            }
            Site::Camera(_) => return None,
        };
        let value = z.beta * le;
        (!value.is_zero()).then_some((end, value))
    }

    /// Adds what was emitted.
    pub(super) fn add_emission(&mut self, t: usize, emitter: EmitterId, value: Spectrum, weight: f64) {
        if let Some(classifier) = self.classifier() {
            trail::end(classifier, self.trails.camera.at(t - 1), emitter, &mut self.trails.classes);
        }
        self.add(self.raster, (&[], &self.camera[..t]), emitter, value, weight);
    }

    /// `s = 1`: an emitter's point as seen from the camera subpath's vertex `t − 1`.
    fn next_event(&mut self, t: usize, sampler: &mut Sampler) {
        let camera = &self.camera[..t];
        let z = &camera[t - 1];
        let Some((event, value)) = self.sample_next_event(t, sampler) else { return };
        if value.is_zero() {
            return;
        }
        let y = PathVertex::of_emitter(event.emitter, event.endpoint);
        let next_event = if event.delta { event.pdf as f64 } else { y.density(event.pdf, z.at.p) };
        let ray = event.shadow_ray(&z.at);
        self.connect(
            Connection { raster: self.raster, first: 0, light: &[y], camera, next_event, value, ray },
            sampler,
        );
    }

    /// A point on an emitter and what it would contribute: the one that was sampled, or one of several.
    fn sample_next_event(&mut self, t: usize, sampler: &mut Sampler) -> Option<(NextEvent, Spectrum)> {
        let z = &self.camera[t - 1];
        let Site::Surface(interaction) = &z.site else { return None };
        sampler.start_vertex(Subpath::Camera, t as u32 - 1);
        let candidates = Candidates { vertex: t as u32 - 1, count: self.settings.next_event_candidates };
        let chosen = candidates.choose(self.scene, (&z.at, None), sampler, |event| {
            self.counters.connections += 1;
            let f = interaction.eval(z.wo, event.wi, TransportMode::Radiance);
            (z.beta * f * event.radiance * event.wi.dot(interaction.ns()).abs(), ())
        });
        chosen.map(|(event, value, ())| (event, value))
    }

    /// `(1, 1)`: an emitter's point as seen from the camera, splatted.
    fn emitter_to_camera(&mut self, sampler: &mut Sampler) {
        let from = self.camera[0].at;
        // It is seen wherever it is, whatever pixel it is counted to, as a light walk is.
        sampler.start_vertex(Subpath::Light, 0);
        let Some(event) = sample_next_event(self.scene, &from, None, sampler) else { return };
        if event.delta {
            return;
        }
        self.counters.connections += 1;
        let Some((we_cos, raster)) = camera_response(self.scene, &from, event.wi) else { return };
        let value = event.radiance * we_cos;
        if value.is_zero() {
            return;
        }
        let y = PathVertex::of_emitter(event.emitter, event.endpoint);
        let next_event = y.density(event.pdf, from.p);
        let camera = [PathVertex::of_camera(self.scene, from, 1.0)];
        let ray = event.shadow_ray(&from);
        self.connect(Connection { raster, first: 0, light: &[y], camera: &camera, next_event, value, ray }, sampler);
    }

    /// `t = 1`: a light subpath's vertex `s − 1` as seen by the camera, splatted.
    fn splat(&mut self, path: usize, s: usize, sampler: &mut Sampler) {
        let LightPath { vertices, next_event } = &self.paths[path];
        let light = &self.light[vertices.start..vertices.start + s];
        let y = &light[s - 1];
        let Site::Surface(interaction) = &y.site else { return };
        if !interaction.is_connectable() {
            return;
        }
        sampler.start_vertex(Subpath::Light, s as u32 - 1 + path as u32 * FURTHER);
        let u = if !self.scene.needs.pinhole { sampler.get_2d(Purpose::NextCamera) } else { Vec2::ZERO };
        let Some(seen) = self.scene.camera.sample_wi(y.at.p, u) else { return };
        self.counters.connections += 1;
        let f = interaction.eval(y.wo, seen.wi, TransportMode::Importance);
        let value = y.beta * f * (seen.we * seen.wi.dot(interaction.ns()).abs() / seen.pdf);
        if value.is_zero() {
            return;
        }
        let camera = [PathVertex::of_camera(self.scene, seen.at, 1.0)];
        let ray = y.at.segment_to(&seen.at);
        let (raster, first, next_event) = (seen.raster, vertices.start, *next_event);
        self.connect(Connection { raster, first, light, camera: &camera, next_event, value, ray }, sampler);
    }

    /// `s, t ≥ 2`: the camera subpath's vertex `t − 1` to every vertex of the light subpaths.
    fn connect_all(&mut self, t: usize, sampler: &mut Sampler) {
        for path in 0..self.paths.len() {
            for s in 2..=self.paths[path].vertices.len() {
                if !self.request.wants(s + t - 2) {
                    continue;
                }
                let Some(value) = self.unshadowed(path, s, t) else { continue };
                if self.settings.connections == Connections::Roulette {
                    let number = (path as u32).wrapping_mul(251).wrapping_add(t as u32).wrapping_mul(FURTHER);
                    sampler.start_vertex(Subpath::Light, number.wrapping_add(s as u32 - 1));
                }
                self.connect_surfaces((path, s, t), value, sampler);
            }
        }
    }

    /// `s, t ≥ 2`: the camera subpath's vertex `t − 1` to one vertex of the light subpaths.
    fn connect_one(&mut self, t: usize, sampler: &mut Sampler) {
        sampler.start_vertex(Subpath::Camera, t as u32 - 1);
        let mut reservoir = Reservoir::new(sampler.get_1d(Purpose::ConnectionChoice));
        for path in 0..self.paths.len() {
            for s in 2..=self.paths[path].vertices.len() {
                if self.request.wants(s + t - 2)
                    && let Some(value) = self.unshadowed(path, s, t)
                {
                    reservoir.offer((path, s, value), value.luminance());
                }
            }
        }
        if let Some(((path, s, value), inverse)) = reservoir.take() {
            self.connect_surfaces((path, s, t), value * inverse, sampler);
        }
    }

    /// What a connection between two surfaces contributes if nothing is between them; `None` for nothing.
    #[inline]
    fn unshadowed(&mut self, path: usize, s: usize, t: usize) -> Option<Spectrum> {
        let (y, z) = (&self.light[self.paths[path].vertices.start + s - 1], &self.camera[t - 1]);
        let (Site::Surface(at_y), Site::Surface(at_z)) = (&y.site, &z.site) else { return None };
        if !at_y.is_connectable() {
            return None;
        }
        self.counters.connections += 1;
        let d = z.at.p - y.at.p;
        let distance_squared = d.length_squared();
        if distance_squared == 0.0 {
            return None;
        }
        let d = d / distance_squared.sqrt();
        let f_z = at_z.eval(z.wo, -d, TransportMode::Radiance);
        if f_z.is_zero() {
            return None;
        }
        let f_y = at_y.eval(y.wo, d, TransportMode::Importance);
        let cos_y = fault!("connection_cosine_dropped", d.dot(at_y.ns()).abs(), 1.0);
        let geometry = cos_y * d.dot(at_z.ns()).abs() / distance_squared;
        let value = y.beta * f_y * f_z * z.beta * geometry;
        (!value.is_zero()).then_some(value)
    }

    fn connect_surfaces(&mut self, (path, s, t): (usize, usize, usize), value: Spectrum, sampler: &mut Sampler) {
        let LightPath { vertices, next_event } = &self.paths[path];
        let (light, camera) = (&self.light[vertices.start..vertices.start + s], &self.camera[..t]);
        let ray = light[s - 1].at.segment_to(&camera[t - 1].at);
        let (raster, first, next_event) = (self.raster, vertices.start, *next_event);
        self.connect(Connection { raster, first, light, camera, next_event, value, ray }, sampler);
    }

    /// Traces a connection's ray, unless roulette is played and lost, and adds what arrives.
    #[inline]
    fn connect(&mut self, connection: Connection, sampler: &mut Sampler) {
        let &Connection { value, ref ray, .. } = &connection;
        if self.settings.connections != Connections::Roulette {
            if !self.is_blocked(ray) {
                let weight = self.weight(&connection);
                self.add_connected(&connection, value, weight);
            }
            return;
        }
        let weight = self.weight(&connection);
        let survival = value.luminance() * weight.abs() as f32 / self.settings.threshold;
        // The comparison lets pass what is no number, so that it is counted.
        if survival < 1.0 && sampler.get_1d(Purpose::ConnectionRoulette) >= survival || self.is_blocked(ray) {
            return;
        }
        let survival = fault!("connection_roulette_not_compensated", survival.min(1.0), 1.0);
        self.add_connected(&connection, value / survival, weight);
    }

    /// A connection's MIS weight.
    #[inline]
    fn weight(&self, &Connection { raster, light, camera, next_event, value, .. }: &Connection) -> f64 {
        let raster = fault!("factors_of_the_samples_pixel", raster, self.raster);
        match self.learnt(raster, light.len() + camera.len() - 2) {
            Some(learnt) => {
                let densities = self.strategies.densities_connected(self.scene, light, camera, next_event);
                self.weight_by(learnt, &densities, value)
            }
            None => self.strategies.weight_connected(self.scene, light, camera, next_event),
        }
    }

    /// What is known of an order's strategies where their path meets the film, if anything is.
    #[inline]
    fn learnt(&self, raster: Vec2, order: usize) -> Option<&'a [f32]> {
        self.settings.learnt.as_ref()?.0.of(raster, order)
    }

    /// The weight of a path, by that and its densities.
    #[inline]
    fn weight_by(&self, learnt: &[f32], densities: &Densities, value: Spectrum) -> f64 {
        match self.settings.mis {
            Weighting::Optimal => densities.weight_by_controls(learnt, f64::from(value.luminance())),
            _ => densities.weight_by_factors(learnt),
        }
    }

    fn is_blocked(&mut self, ray: &Ray) -> bool {
        self.counters.shadow += 1;
        self.scene.occluded(ray)
    }

    fn add_connected(&mut self, connection: &Connection, value: Spectrum, weight: f64) {
        let &Connection { raster, light, camera, .. } = connection;
        let Site::Emitter(emitter, _) = &light[0].site else { return };
        if let Some(classifier) = self.classifier() {
            self.classify(classifier, connection, *emitter);
        }
        self.add(raster, (light, camera), *emitter, value, weight);
    }

    /// Hands a path over.
    #[inline]
    fn add(
        &mut self,
        raster: Vec2,
        (light, camera): (&[PathVertex], &[PathVertex]),
        emitter: EmitterId,
        value: Spectrum,
        weight: f64,
    ) {
        let technique = Technique::connect(light.len(), camera.len());
        let path = if S::WANTS.vertices { PathView { light, camera } } else { PathView::default() };
        let classes = if self.classifier().is_some() { &self.trails.classes[..] } else { &[] };
        self.out.add(Contribution { raster, technique, value, weight, path, emitter: Some(emitter), classes });
    }
}
