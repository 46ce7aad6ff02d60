//! Bidirectional path tracing [Veach97, ch. 10; Lafortune93].
//!
//! A light subpath and a camera subpath are traced, and every pair of their vertices is connected: strategy `(s, t)` joins
//! `s` light vertices to `t` camera vertices and estimates order `s + t − 2`. `s = 0` are emitters that the camera subpath
//! met; at `s = 1` the emitter's point is sampled anew as seen from the camera vertex, at `t = 1` the camera's as seen from
//! the light vertex, and the contribution is splatted. MIS weights the strategies that could have made the same path.

use crate::connect::EmitterEnd;
use crate::contribution::{Contribution, PathView, Sink, Technique};
use crate::method::{Estimator, Pixel};
use crate::next_event::{camera_response, sample_next_event};
use crate::request::Request;
use crate::roulette::{LocalRoulette, MAX_SURVIVAL};
use crate::scratch::Scratch;
use crate::start::{CameraStart, start_camera, start_light};
use crate::vertex::{PathVertex, Site};
use crate::walk::{Departure, WalkRules, walk};
use sampling::bsdf::TransportMode;
use sampling::fault;
use sampling::math::Spectrum;
use sampling::mis::Heuristic;
use sampling::sampler::{Purpose, Sampler, Subpath};
use sampling::{Vec2, Vec3};
use scenes::{LeSample, Needs, Rays, Scene, SurfacePoint, WeSample};
use serde::{Deserialize, Serialize};

/// A bidirectional path tracer's settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Bdpt {
    /// How strategies are weighted.
    pub mis: Heuristic,
    /// How walks end.
    pub roulette: LocalRoulette,
    /// Whether emitters are connected straight to the camera, strategy (1, 1): less noise at the edges of what shines
    /// against a few splats everywhere on it.
    pub emitter_to_camera: bool,
}

impl Default for Bdpt {
    fn default() -> Self {
        Self { mis: Heuristic::Power, roulette: LocalRoulette::Local, emitter_to_camera: true }
    }
}

impl Bdpt {
    /// How the two subpaths of a request are traced: the camera's, the light's.
    pub fn rules(&self, request: &Request, needs: &Needs) -> (WalkRules, WalkRules) {
        let cap = if request.tail() { MAX_SURVIVAL } else { 1.0 };
        let last = request.last_order();
        let rules = |subpath, max_vertices| WalkRules { subpath, roulette: self.roulette, cap, max_vertices };
        // Order k takes at most k + 2 camera vertices (one less where walks cannot meet an emitter) and k + 1 light vertices.
        let camera = last.map(|k| k + 1 + needs.hittable_emitters as usize);
        // Where nothing can be connected, a light subpath serves no strategy.
        let light = if needs.non_delta_lobes { last.map(|k| k + 1) } else { Some(1) };
        (rules(Subpath::Camera, camera), rules(Subpath::Light, light))
    }

    /// Whether strategy (1, 1) is used: no sampled point of an emitter lies in the one direction of parallel rays.
    pub fn connects_emitters(&self, scene: &Scene) -> bool {
        self.emitter_to_camera && scene.camera.rays() != Rays::Parallel
    }
}

impl Estimator for Bdpt {
    fn unsupported_request(&self, request: &Request) -> Option<String> {
        let endless = request.tail() && self.roulette == LocalRoulette::None;
        endless.then(|| {
            "without roulette its walks have no end beyond max_order; set roulette=local or leave out the tail".into()
        })
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        let lost = needs.delta_emitters && needs.delta_lobes;
        let class = "LS.*E from points, spots and directional emitters, where no two neighbouring vertices before the camera scatter by other than delta lobes";
        if lost { vec![class.to_owned()] } else { Vec::new() }
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
        let rules = self.rules(request, &scene.needs);
        let CameraStart { raster, sample } = start_camera(scene, pixel, sampler, &mut scratch.counters);
        trace_camera(scene, &rules.0, &sample, sampler, scratch);
        trace_light(scene, &rules.1, sampler, scratch);
        scratch.densities.emitter_to_camera = self.connects_emitters(scene);
        let light = std::mem::take(&mut scratch.light);
        let camera = std::mem::take(&mut scratch.camera);
        let mut join =
            Join { scene, request, settings: self, rules, raster, light: &light, camera: &camera, scratch, out };
        join.run(sampler);
        scratch.light = light;
        scratch.camera = camera;
    }
}

fn camera_vertex(scene: &Scene, at: SurfacePoint, beta: f32) -> PathVertex {
    let (site, beta) = (Site::Camera(scene.camera.rays()), Spectrum::splat(beta));
    PathVertex { site, at, wo: Vec3::ZERO, beta, pdf_fwd: 1.0, pdf_rev: 0.0, delta: false }
}

/// Traces the camera subpath into the scratch.
fn trace_camera(scene: &Scene, rules: &WalkRules, start: &WeSample, sampler: &mut Sampler, scratch: &mut Scratch) {
    scratch.camera.clear();
    scratch.camera.push(camera_vertex(scene, start.at, start.weight));
    let departure = Departure { ray: start.ray, beta: Spectrum::splat(start.weight), pdf: start.pdf_d };
    walk(scene, rules, departure, sampler, &mut scratch.counters, &mut scratch.camera);
}

/// Traces the light subpath into the scratch; leaves it empty where nothing shines.
fn trace_light(scene: &Scene, rules: &WalkRules, sampler: &mut Sampler, scratch: &mut Scratch) {
    scratch.light.clear();
    if !rules.has_room(1) {
        return;
    }
    let Some(start) = start_light(scene, sampler, &mut scratch.counters) else { return };
    let LeSample { endpoint, ray, pdf_p, pdf_d, .. } = start.sample;
    scratch.light.push(PathVertex {
        site: Site::Emitter(start.emitter, endpoint),
        at: endpoint.at,
        wo: Vec3::ZERO,
        beta: Spectrum::ONE,
        pdf_fwd: (pdf_p * start.pmf) as f64,
        pdf_rev: 0.0,
        delta: false,
    });
    let departure = Departure { ray, beta: start.beta(), pdf: pdf_d };
    walk(scene, rules, departure, sampler, &mut scratch.counters, &mut scratch.light);
}

/// Two subpaths being connected.
struct Join<'a, S> {
    scene: &'a Scene,
    request: &'a Request,
    settings: &'a Bdpt,
    rules: (WalkRules, WalkRules),
    raster: Vec2,
    light: &'a [PathVertex],
    camera: &'a [PathVertex],
    scratch: &'a mut Scratch,
    out: &'a mut S,
}

impl<S: Sink> Join<'_, S> {
    fn run(&mut self, sampler: &mut Sampler) {
        if self.scratch.densities.emitter_to_camera && self.request.wants(0) {
            self.emitter_to_camera(sampler);
        }
        // As seen from the second vertex, the first has one density for all strategies of s ≥ 2.
        let next_event = self.next_event_density();
        for s in 2..=self.light.len() {
            if self.request.wants(s - 1) {
                self.splat(s, next_event, sampler);
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
            for s in 2..=self.light.len() {
                if self.request.wants(s + t - 2) {
                    self.connect(s, t, next_event);
                }
            }
        }
    }

    fn next_event_density(&self) -> f64 {
        let [first, second, ..] = self.light else { return 0.0 };
        let Site::Emitter(emitter, endpoint) = first.site else { return 0.0 };
        EmitterEnd { emitter, endpoint }.next_event_density(self.scene, &second.at)
    }

    /// `s = 0`: the camera subpath's vertex `t − 1` emits.
    fn emission(&mut self, t: usize) {
        let z = &self.camera[t - 1];
        let (end, le) = match &z.site {
            Site::Surface(interaction) => {
                let Some(emitter) = interaction.emitter else { return };
                let le = self.scene.le(interaction, z.wo);
                (EmitterEnd { emitter, endpoint: self.scene.endpoint_of(interaction) }, le)
            }
            Site::Emitter(emitter, endpoint) => {
                (EmitterEnd { emitter: *emitter, endpoint: *endpoint }, self.scene.environment_le(-z.wo))
            }
            Site::Camera(_) => return,
        };
        let value = z.beta * le;
        if value.is_zero() {
            return;
        }
        let camera = &self.camera[..t];
        self.scratch.densities.set_emission(self.scene, camera, &end);
        self.add(self.raster, &[], camera, value);
    }

    /// `s = 1`: an emitter's point as seen from the camera subpath's vertex `t − 1`.
    fn next_event(&mut self, t: usize, sampler: &mut Sampler) {
        let camera = &self.camera[..t];
        let z = &camera[t - 1];
        let Site::Surface(interaction) = &z.site else { return };
        sampler.start_vertex(Subpath::Camera, t as u32 - 1);
        let Some(event) = sample_next_event(self.scene, &z.at, sampler) else { return };
        self.scratch.counters.connections += 1;
        let f = interaction.eval(z.wo, event.wi, TransportMode::Radiance);
        let value = z.beta * f * event.radiance * event.wi.dot(interaction.ns()).abs();
        if value.is_zero() || self.is_blocked(&event.shadow_ray(&z.at)) {
            return;
        }
        let y = emitter_vertex(event.emitter, event.endpoint);
        let next_event = if event.delta { event.pdf as f64 } else { y.density(event.pdf, z.at.p) };
        let light = [y];
        self.set_connected(&light, camera, next_event);
        self.add(self.raster, &light, camera, value);
    }

    /// `(1, 1)`: an emitter's point as seen from the camera, splatted.
    fn emitter_to_camera(&mut self, sampler: &mut Sampler) {
        let from = self.camera[0].at;
        sampler.start_vertex(Subpath::Camera, 0);
        let Some(event) = sample_next_event(self.scene, &from, sampler) else { return };
        if event.delta {
            return;
        }
        self.scratch.counters.connections += 1;
        let Some((we_cos, raster)) = camera_response(self.scene, &from, event.wi) else { return };
        let value = event.radiance * we_cos;
        if value.is_zero() || self.is_blocked(&event.shadow_ray(&from)) {
            return;
        }
        let y = emitter_vertex(event.emitter, event.endpoint);
        let next_event = y.density(event.pdf, from.p);
        let (light, camera) = ([y], [camera_vertex(self.scene, from, 1.0)]);
        self.set_connected(&light, &camera, next_event);
        self.add(raster, &light, &camera, value);
    }

    /// `t = 1`: the light subpath's vertex `s − 1` as seen by the camera, splatted.
    fn splat(&mut self, s: usize, next_event: f64, sampler: &mut Sampler) {
        let light = &self.light[..s];
        let y = &light[s - 1];
        let Site::Surface(interaction) = &y.site else { return };
        if !interaction.is_connectable() {
            return;
        }
        sampler.start_vertex(Subpath::Light, s as u32 - 1);
        let u = if !self.scene.needs.pinhole { sampler.get_2d(Purpose::NextCamera) } else { Vec2::ZERO };
        let Some(seen) = self.scene.camera.sample_wi(y.at.p, u) else { return };
        self.scratch.counters.connections += 1;
        let f = interaction.eval(y.wo, seen.wi, TransportMode::Importance);
        let value = y.beta * f * (seen.we * seen.wi.dot(interaction.ns()).abs() / seen.pdf);
        if value.is_zero() || self.is_blocked(&y.at.segment_to(&seen.at)) {
            return;
        }
        let camera = [camera_vertex(self.scene, seen.at, 1.0)];
        self.set_connected(light, &camera, next_event);
        self.add(seen.raster, light, &camera, value);
    }

    /// `s, t ≥ 2`: a connection between two surfaces.
    fn connect(&mut self, s: usize, t: usize, next_event: f64) {
        let (light, camera) = (&self.light[..s], &self.camera[..t]);
        let (y, z) = (&light[s - 1], &camera[t - 1]);
        let (Site::Surface(at_y), Site::Surface(at_z)) = (&y.site, &z.site) else { return };
        if !at_y.is_connectable() {
            return;
        }
        self.scratch.counters.connections += 1;
        let d = z.at.p - y.at.p;
        let distance_squared = d.length_squared();
        if distance_squared == 0.0 {
            return;
        }
        let d = d / distance_squared.sqrt();
        let f_z = at_z.eval(z.wo, -d, TransportMode::Radiance);
        if f_z.is_zero() {
            return;
        }
        let f_y = at_y.eval(y.wo, d, TransportMode::Importance);
        let cos_y = fault!("connection_cosine_dropped", d.dot(at_y.ns()).abs(), 1.0);
        let geometry = cos_y * d.dot(at_z.ns()).abs() / distance_squared;
        let value = y.beta * f_y * f_z * z.beta * geometry;
        if value.is_zero() || self.is_blocked(&y.at.segment_to(&z.at)) {
            return;
        }
        self.set_connected(light, camera, next_event);
        self.add(self.raster, light, camera, value);
    }

    fn is_blocked(&mut self, ray: &scenes::Ray) -> bool {
        self.scratch.counters.shadow += 1;
        self.scene.occluded(ray)
    }

    fn set_connected(&mut self, light: &[PathVertex], camera: &[PathVertex], next_event: f64) {
        let rules = (&self.rules.1, &self.rules.0);
        self.scratch.densities.set_connected(self.scene, rules, light, camera, next_event);
    }

    /// Hands the path over with the weight that its densities give.
    fn add(&mut self, raster: Vec2, light: &[PathVertex], camera: &[PathVertex], value: Spectrum) {
        let (s, t) = (light.len(), camera.len());
        let weight = self.scratch.densities.weight(s, self.settings.mis);
        let technique = Technique::connect(s, t);
        let path = if S::WANTS.vertices { PathView { light, camera } } else { PathView::default() };
        self.out.add(Contribution { raster, technique, value, weight, path });
    }
}

fn emitter_vertex(emitter: scenes::EmitterId, endpoint: scenes::Endpoint) -> PathVertex {
    PathVertex {
        site: Site::Emitter(emitter, endpoint),
        at: endpoint.at,
        wo: Vec3::ZERO,
        beta: Spectrum::ONE,
        pdf_fwd: 0.0,
        pdf_rev: 0.0,
        delta: false,
    }
}
