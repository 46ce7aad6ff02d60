//! Bidirectional path tracing [Veach97, ch. 10; Lafortune93].
//!
//! A light subpath and a camera subpath are traced, and every pair of their vertices is connected: strategy `(s, t)` joins
//! `s` light vertices to `t` camera vertices and estimates order `s + t − 2`. `s = 0` are emitters that the camera subpath
//! met; at `s = 1` the emitter's point is sampled anew as seen from the camera vertex, at `t = 1` the camera's as seen from
//! the light vertex, and the contribution is splatted. MIS weights the strategies that could have made the same path. Without those of
//! `t = 1` nothing lands in other pixels than the sample's own, and a light subpath may serve samples of many pixels.
//!
//! What is left to settings moves no mean: how strategies are weighted, where walks end, how many light subpaths there are to a
//! camera subpath, and which connections a ray is traced for.

mod classes;
mod controls;
mod join;
mod lattice;
mod merge;
mod pilot;
mod strategy;
mod variances;
mod weighting;

pub use weighting::Weighting;

use crate::connect::{EmitterEnd, PerStrategy, Strategies};
use crate::contribution::{Sink, Technique};
use crate::integrator::{Estimator, Pixel, Replicate};
use crate::measurement::Counters;
use crate::next_event::FURTHER;
use crate::photons::Photons;
use crate::request::Request;
use crate::roulette::{MAX_SURVIVAL, SubpathRoulette};
use crate::scratch::{LightPath, Scratch};
use crate::start::{CameraStart, start_camera, start_light};
use crate::vertex::{PathVertex, Site};
use crate::walk::{Departure, Stop, WalkRules, walk};
use join::Join;
use lattice::Pilot;
use sampling::math::Spectrum;
use sampling::mis::Heuristic;
use sampling::sampler::{Sampler, Subpath};
use scenes::{LeSample, Needs, Rays, Scene, WeSample};
use serde::{Deserialize, Serialize};
use std::num::NonZeroU16;
use std::sync::Arc;

/// Which connections between the vertices of two subpaths a ray is traced for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Connections {
    /// All that would contribute.
    #[default]
    All,
    /// All of much, some of little: roulette by the weighted contribution, whose threshold a pilot finds [Veach97, §10.4].
    Roulette,
    /// For each camera vertex one of its connections to vertices of light subpaths, in proportion to what they would contribute.
    Resampled,
}

/// A bidirectional path tracer's settings.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Bdpt {
    /// How strategies are weighted.
    pub mis: Weighting,
    /// How walks end.
    pub roulette: SubpathRoulette,
    /// The number of scatterings from which roulette by throughput is played.
    pub roulette_start: usize,
    /// Whether light vertices are connected to the camera, strategies (s, 1), which alone find caustics well, and splat them.
    pub camera_connections: bool,
    /// Whether emitters are, strategy (1, 1), if any light vertices are: less noise at the edges of what shines against a few splats
    /// everywhere on it.
    pub emitter_to_camera: bool,
    /// Light subpaths for each camera subpath.
    pub light_paths: NonZeroU16,
    /// Emitter points from which next-event estimation chooses one, in proportion to what they would contribute unshadowed.
    pub next_event_candidates: NonZeroU16,
    /// Which connections a ray is traced for.
    pub connections: Connections,
    /// The weighted contribution from which a connection always has its ray; no setting, but found by a pilot.
    #[serde(skip)]
    pub threshold: f32,
    /// What weights take of every strategy beside its densities, and the work of finding that; no setting, but what a pilot finds.
    #[serde(skip)]
    pub learnt: Option<Arc<(PerStrategy, Counters)>>,
    /// What the camera's vertices are merged with; no setting, but what [`vcm`](crate::vcm) adds.
    #[serde(skip)]
    pub photons: Option<Photons>,
}

impl Default for Bdpt {
    fn default() -> Self {
        Self {
            mis: Heuristic::POWER.into(),
            roulette: SubpathRoulette::Local,
            roulette_start: 3,
            camera_connections: true,
            emitter_to_camera: true,
            light_paths: NonZeroU16::MIN,
            next_event_candidates: NonZeroU16::MIN,
            connections: Connections::All,
            threshold: 0.0,
            learnt: None,
            photons: None,
        }
    }
}

impl Bdpt {
    /// The strategies of a request, and how the two subpaths are traced.
    pub fn strategies(&self, scene: &Scene, request: &Request) -> Strategies {
        let needs: &Needs = &scene.needs;
        let cap = if request.tail() { MAX_SURVIVAL } else { 1.0 };
        let last = request.last_order();
        let (roulette, roulette_start) = (self.roulette, self.roulette_start);
        let rules = |subpath, max_vertices| WalkRules {
            subpath,
            roulette,
            roulette_start,
            cap,
            max_vertices,
            first_number: 0,
            stop: Stop::Nowhere,
        };
        // Order k takes at most k + 2 camera vertices (one less where walks cannot meet an emitter) and k + 1 light vertices (one less
        // where these are not connected to the camera).
        let camera = last.map(|k| k + 1 + needs.hittable_emitters as usize);
        // Where nothing can be connected, a light subpath serves no strategy.
        let light = if needs.non_delta_lobes { last.map(|k| k + self.camera_connections as usize) } else { Some(1) };
        Strategies {
            mis: self.mis.heuristic(),
            // No sampled point of an emitter lies in the one direction of parallel rays.
            emitter_to_camera: self.emitter_to_camera
                && self.camera_connections
                && scene.camera.rays() != Rays::Parallel,
            camera_connections: self.camera_connections,
            light_paths: f64::from(self.light_paths.get()),
            merging: self.photons.as_ref().map_or(0.0, Photons::merging),
            light: rules(Subpath::Light, light),
            camera: rules(Subpath::Camera, camera),
        }
    }

    /// A setting by which paths are chosen with a chance that no density knows.
    fn unknown_to_densities(&self) -> Option<&'static str> {
        if self.roulette == SubpathRoulette::Throughput {
            Some("roulette=throughput")
        } else if self.connections == Connections::Resampled {
            Some("connections=resampled")
        } else if self.next_event_candidates != NonZeroU16::MIN {
            Some("next_event_candidates above 1")
        } else {
            None
        }
    }
}

impl Estimator for Bdpt {
    const CLASSIFIES: bool = true;

    fn makes(&self, technique: Technique) -> bool {
        match technique {
            Technique::Connect { s: 1, t: 1 } => self.camera_connections && self.emitter_to_camera,
            Technique::Connect { t: 1, .. } => self.camera_connections,
            Technique::Connect { .. } => true,
            _ => false,
        }
    }

    fn splats(&self) -> bool {
        self.camera_connections
    }

    fn unsupported_request(&self, request: &Request) -> Option<String> {
        if self.mis == Weighting::Optimal
            && let Some(setting) = self.unknown_to_densities()
        {
            return Some(format!(
                "its optimal weights need densities that say all, without {setting}; set mis=balance or leave that out"
            ));
        }
        let endless = request.tail() && self.roulette == SubpathRoulette::None;
        endless.then(|| {
            "without roulette its walks have no end beyond max_order; set roulette=local or leave out the tail".into()
        })
    }

    fn missing_light(&self, needs: &Needs) -> Vec<String> {
        let lost = needs.delta_emitters && needs.delta_lobes;
        let among = if self.camera_connections { "the camera among them" } else { "all before the camera" };
        let class = format!(
            "LS.*E from points, spots and directional emitters, where no two neighbouring vertices, {among}, scatter by other than delta lobes"
        );
        if lost { vec![class] } else { Vec::new() }
    }

    fn prepare(&self, scene: &Scene, request: &Request, replicate: &Replicate) -> Option<Self> {
        let pilot = || Pilot::new(self, scene, request, replicate);
        let learnt = match self.mis {
            Weighting::Heuristic(_) => None,
            Weighting::VarianceAware => Some(variances::factors(&pilot())),
            Weighting::Optimal => Some(controls::controls(&pilot())),
        };
        let plays = self.connections == Connections::Roulette;
        let mut prepared = (learnt.is_some() || plays).then(|| self.clone())?;
        prepared.learnt = learnt.map(Arc::new);
        if plays {
            prepared.threshold = pilot::threshold(&prepared, scene, request, replicate);
        }
        Some(prepared)
    }

    fn pilot(&self) -> Counters {
        self.learnt.as_ref().map_or(Counters::default(), |learnt| learnt.1)
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
        let strategies = self.strategies(scene, request);
        let CameraStart { raster, sample } = start_camera(scene, pixel, sampler, &mut scratch.counters);
        trace_camera(scene, &strategies, &sample, sampler, scratch);
        if !scratch.keeps_light {
            scratch.light.clear();
            scratch.light_paths.clear();
            for number in 0..self.light_paths.get() {
                trace_light(scene, &strategies, number, sampler, scratch);
            }
        }
        let light = std::mem::take(&mut scratch.light);
        let camera = std::mem::take(&mut scratch.camera);
        let paths = std::mem::take(&mut scratch.light_paths);
        Join {
            scene,
            request,
            settings: self,
            strategies,
            raster,
            light: &light,
            paths: &paths,
            camera: &camera,
            counters: &mut scratch.counters,
            trails: &mut scratch.trails,
            out,
        }
        .run(sampler);
        (scratch.light, scratch.camera, scratch.light_paths) = (light, camera, paths);
    }
}

/// Traces the camera subpath into the scratch.
fn trace_camera(
    scene: &Scene,
    strategies: &Strategies,
    start: &WeSample,
    sampler: &mut Sampler,
    scratch: &mut Scratch,
) {
    scratch.camera.clear();
    scratch.camera.push(PathVertex::of_camera(scene, start.at, start.weight));
    let departure = Departure { ray: start.ray, beta: Spectrum::splat(start.weight), pdf: start.pdf_d };
    walk(scene, &strategies.camera, departure, sampler, &mut scratch.counters, &mut scratch.camera, 0);
    strategies.sum_camera(&mut scratch.camera);
}

/// Adds a light subpath to those in the scratch; none where nothing shines.
pub(crate) fn trace_light(
    scene: &Scene,
    strategies: &Strategies,
    number: u16,
    sampler: &mut Sampler,
    scratch: &mut Scratch,
) {
    let rules = WalkRules { first_number: u32::from(number) * FURTHER, ..strategies.light };
    if !rules.has_room(1) {
        return;
    }
    sampler.start_vertex(Subpath::Light, rules.first_number);
    let Some(start) = start_light(scene, sampler, &mut scratch.counters) else { return };
    let LeSample { endpoint, ray, pdf_p, pdf_d, .. } = start.sample;
    let first = scratch.light.len();
    let site = Site::Emitter(start.emitter, endpoint);
    scratch.light.push(PathVertex {
        pdf_fwd: (pdf_p * start.pmf) as f64,
        ..PathVertex::first(site, endpoint.at, Spectrum::ONE)
    });
    let departure = Departure { ray, beta: start.beta() / strategies.light_paths as f32, pdf: pdf_d };
    walk(scene, &rules, departure, sampler, &mut scratch.counters, &mut scratch.light, first);
    let path = &mut scratch.light[first..];
    // As seen from the second vertex, the first has one density for all strategies of s ≥ 2.
    let next_event = match path {
        [_, second, ..] => EmitterEnd { emitter: start.emitter, endpoint }.next_event_density(scene, &second.at),
        _ => 0.0,
    };
    strategies.sum_light(path, next_event);
    let vertices = first..scratch.light.len();
    scratch.light_paths.push(LightPath { vertices, next_event });
}
