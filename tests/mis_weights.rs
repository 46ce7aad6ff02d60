//! The MIS weights of all strategies that could have made a path sum to one, and the weight a path was given is its share.
//!
//! Paths are taken from the bidirectional path tracer; every one is then divided anew at every edge, its densities computed
//! from its vertices alone, and weighed by the same code as if that strategy had made it. No randomness is left by then, so
//! the tolerance is that of `f32` densities.

mod learnt;
mod merges;

use crate::support::{PathDensities, builtin, bumps, contributions, in_relief, lambert, room, shining, sky};
use glam::{DVec3, dvec2, dvec3};
use integrators::bdpt::{Bdpt, Weighting};
use integrators::connect::{EmitterEnd, PerStrategy, Strategies};
use integrators::roulette::SubpathRoulette;
use integrators::vertex::{PathVertex, Site, density_at};
use integrators::{Contribution, Orders, Request, Sink, Technique, Wants};
use sampling::bsdf::{Bsdf, RoughConductor, RoughDielectric, TransportMode, fresnel_dielectric};
use sampling::math::Spectrum;
use sampling::mis::Heuristic;
use sampling::sampler::{Role, StreamKey};
use sampling::{Vec2, Vec3, vec3};
use scenes::interaction::Normals;
use scenes::{
    CameraSettings, EmitterId, Endpoint, Falloff, Interaction, Mapping, Projection, Rays, Remedies, Scene,
    SceneBuilder, Skip, Spot, Tilt,
};
use std::num::NonZeroU16;

const TOLERANCE: f64 = 2e-3;

/// A path as it was found, its vertices from the emitter to the camera.
struct Found {
    vertices: Vec<PathVertex>,
    technique: Technique,
    weight: f64,
    /// Of what the strategy contributes alone.
    luminance: f64,
    /// What is learnt of the order's strategies, where the path meets the film; 1 where nothing is.
    learnt: Vec<f32>,
}

#[derive(Default)]
struct Collect<'a> {
    found: Vec<Found>,
    learnt: Option<&'a PerStrategy>,
}

impl Sink for Collect<'_> {
    const WANTS: Wants = Wants { vertices: true, ..Wants::NOTHING };

    fn add(&mut self, c: Contribution) {
        let vertices = c.path.light.iter().chain(c.path.camera.iter().rev()).copied().collect();
        let order = c.technique.order();
        let learnt = self.learnt.and_then(|learnt| learnt.of(c.raster, order));
        let learnt = learnt.map_or_else(|| vec![1.0; order + 2], <[f32]>::to_vec);
        let luminance = f64::from(c.value.luminance());
        self.found.push(Found { vertices, technique: c.technique, weight: c.weight, luminance, learnt });
    }
}

/// Every path of some samples all over the image.
fn paths(scene: &Scene, settings: &Bdpt, samples: u32) -> Vec<Found> {
    let learnt = settings.learnt.as_ref().map(|learnt| &learnt.0);
    let mut collect = Collect { found: Vec::new(), learnt };
    contributions(scene, settings, 6, (StreamKey::new(11, "weights", Role::Estimate, 0), samples), &mut collect);
    collect.found
}

/// A path taken apart: what is needed to divide it anew.
struct Whole<'a> {
    scene: &'a Scene,
    vertices: &'a [PathVertex],
    emitter: EmitterId,
    endpoint: Endpoint,
    factors: &'a [f32],
    settings: &'a Bdpt,
    strategies: Strategies,
}

impl<'a> Whole<'a> {
    fn new(scene: &'a Scene, found: &'a Found, settings: &'a Bdpt) -> Self {
        let vertices = &found.vertices[..];
        let factors = if settings.mis == Weighting::VarianceAware { &found.learnt[..] } else { &[] };
        let (emitter, endpoint) = match &vertices[0].site {
            Site::Emitter(emitter, endpoint) => (*emitter, *endpoint),
            Site::Surface(hit) => (hit.emitter.unwrap(), scene.endpoint_of(hit)),
            Site::Camera(_) => panic!("a path starts at an emitter"),
        };
        let strategies = settings.strategies(scene, &Request::new(Orders::up_to(6), false));
        Self { scene, vertices, emitter, endpoint, factors, settings, strategies }
    }

    fn len(&self) -> usize {
        self.vertices.len()
    }

    fn is_infinite(&self, i: usize) -> bool {
        let camera = i == self.len() - 1 && self.scene.camera.rays() == Rays::Parallel;
        camera || i == 0 && self.endpoint.kind.is_infinite()
    }

    /// Unit direction of flight from a vertex that is infinitely far.
    fn flight(&self, i: usize) -> Vec3 {
        if i == 0 { self.endpoint.at.ng } else { self.scene.camera.sample_we(Vec2::ZERO, Vec2::ZERO).ray.d }
    }

    /// Unit direction from vertex `i` to its neighbour `j`.
    fn direction(&self, i: usize, j: usize) -> Vec3 {
        if self.is_infinite(j) {
            return -self.flight(j);
        }
        if self.is_infinite(i) {
            return self.flight(i);
        }
        (self.vertices[j].at.p - self.vertices[i].at.p).normalize()
    }

    /// Density per solid angle at vertex `i` of going on to `to`, having come from `from`.
    fn scattering(&self, i: usize, from: usize, to: usize, mode: TransportMode) -> f32 {
        let vertex = &self.vertices[i];
        let Site::Surface(hit) = &vertex.site else { panic!("vertex {i} scatters") };
        let (wo, wi) = (self.direction(i, from), self.direction(i, to));
        let pdf = if vertex.delta { delta_density(hit, wo, wi, mode) } else { hit.pdf(wo, wi, mode) };
        pdf * self.strategies.camera.survival(hit)
    }

    fn density(&self, i: usize, pdf: f32, from: usize) -> f64 {
        if self.is_infinite(i) {
            return pdf as f64;
        }
        if self.is_infinite(from) {
            return (pdf * self.vertices[i].at.ng.dot(self.flight(from)).abs()) as f64;
        }
        density_at(&self.vertices[i].at, pdf, self.vertices[from].at.p)
    }

    /// Density of vertex `i` from the light's end.
    fn light_density(&self, i: usize) -> f64 {
        match i {
            0 => {
                let (pdf_p, _) = self.scene.pdf_le(self.emitter, &self.endpoint, self.direction(0, 1));
                (pdf_p * self.scene.emitter_pmf(self.emitter)) as f64
            }
            1 => {
                let (_, pdf_d) = self.scene.pdf_le(self.emitter, &self.endpoint, self.direction(0, 1));
                self.density(1, pdf_d, 0)
            }
            _ => self.density(i, self.scattering(i - 1, i - 2, i, TransportMode::Importance), i - 1),
        }
    }

    /// Density of vertex `i` from the camera's end.
    fn camera_density(&self, i: usize) -> f64 {
        let last = self.len() - 1;
        if i == last {
            return 1.0;
        }
        if i == last - 1 {
            let (_, pdf) = self.scene.camera.pdf_we(&self.vertices[last].at, self.direction(last, i));
            return self.density(i, pdf, last);
        }
        self.density(i, self.scattering(i + 1, i + 2, i, TransportMode::Radiance), i + 1)
    }

    /// The path as strategy `s` would have stored it.
    fn divide(&self, s: usize) -> (Vec<PathVertex>, Vec<PathVertex>) {
        let vertex = |i: usize, from: Option<usize>, fwd: f64, rev: f64| {
            let mut vertex = self.vertices[i];
            if i == 0 && s > 0 {
                vertex.site = Site::Emitter(self.emitter, self.endpoint);
                vertex.at = self.endpoint.at;
            }
            vertex.wo = from.map_or(Vec3::ZERO, |from| self.direction(i, from));
            (vertex.pdf_fwd, vertex.pdf_rev) = (fwd, rev);
            vertex.delta &= i > 0;
            vertex
        };
        let light = |i: usize| {
            let rev = if i + 2 < s { self.camera_density(i) } else { f64::NAN };
            vertex(i, i.checked_sub(1), self.light_density(i), rev)
        };
        let camera = |i: usize| {
            let rev = if i > s + 1 && i + 1 < self.len() { self.light_density(i) } else { f64::NAN };
            vertex(i, Some(i + 1).filter(|&j| j < self.len()), self.camera_density(i), rev)
        };
        ((0..s).map(light).collect(), (s..self.len()).rev().map(camera).collect())
    }

    /// Whether by the balance heuristic the best of the others has nearly the weight of strategy `s`, or that nearly the best's.
    fn nearly_tied(&self, s: usize) -> bool {
        let weights: Vec<f64> = (0..self.len()).map(|i| self.weight_by(i, Heuristic::Balance).unwrap_or(0.0)).collect();
        let best = (0..self.len()).filter(|&i| i != s).map(|i| weights[i]).fold(0.0, f64::max);
        (best / weights[s]).ln().abs() < 0.05
    }

    /// The weight that strategy `s` would have, if it is possible.
    fn weight(&self, s: usize) -> Option<f64> {
        self.weight_by(s, self.settings.mis.heuristic())
    }

    fn weight_by(&self, s: usize, mis: Heuristic) -> Option<f64> {
        let Strategies {
            camera_connections,
            emitter_to_camera,
            light_paths,
            light: light_rules,
            camera: camera_rules,
            ..
        } = self.strategies;
        let (light, camera) = self.divide(s);
        let factors = self.factors.iter().copied().map(f64::from).collect();
        let mut densities =
            PathDensities { camera_connections, emitter_to_camera, light_paths, factors, ..PathDensities::default() };
        let end = EmitterEnd { emitter: self.emitter, endpoint: self.endpoint };
        if s == 0 {
            densities.set_emission(self.scene, &camera, &end);
        } else {
            let next_event = end.next_event_density(self.scene, &self.vertices[1].at);
            densities.set_connected(self.scene, (&light_rules, &camera_rules), &light, &camera, next_event);
        }
        let hittable = !self.endpoint.kind.is_delta();
        let connectable = |i: usize| !self.vertices[i].delta;
        let possible = match s {
            0 => hittable,
            1 if self.len() == 2 => emitter_to_camera && hittable,
            s if s == self.len() - 1 && !camera_connections => false,
            _ => connectable(s - 1) && connectable(s),
        };
        possible.then(|| densities.weight(s, mis))
    }
}

/// A delta lobe's density in the measure that scattering preserves, from the equations alone.
fn delta_density(hit: &Interaction, wo: Vec3, wi: Vec3, mode: TransportMode) -> f32 {
    let (normal, probability) = face(hit, wo, wi, mode);
    let (cos_o, cos_i) = (wo.dot(normal), wi.dot(normal));
    let density = match hit.bsdf {
        Bsdf::Mirror(_) => cos_i.abs(),
        Bsdf::Dielectric(glass) => {
            let eta = if cos_o > 0.0 { glass.eta } else { 1.0 / glass.eta };
            let reflected = fresnel_dielectric(cos_o.abs(), eta).reflected;
            if cos_o * cos_i > 0.0 { reflected * cos_i.abs() } else { (1.0 - reflected) * eta * eta * cos_i.abs() }
        }
        other => panic!("{} has no delta lobe", other.name()),
    };
    density * probability
}

/// The normal that light scatters about, and the probability with which a walk in this mode takes it.
fn face(hit: &Interaction, wo: Vec3, wi: Vec3, mode: TransportMode) -> (Vec3, f32) {
    let Normals::Tilted(Tilt { normal, remedies }) = hit.normals else { return (hit.ns(), 1.0) };
    let mapped = hit.frame.to_world(normal);
    let turned = hit.frame.to_world(vec3(-normal.x, -normal.y, normal.z));
    let level = |w: Vec3, n: Vec3| w.dot(n) * w.dot(hit.ns()) > 0.0;
    let viewer = if mode == TransportMode::Radiance { wo } else { wi };
    let is_mapped = !remedies.turning || level(viewer, mapped);
    let share = match (level(wo, mapped), level(wo, turned)) {
        _ if mode == TransportMode::Radiance || !remedies.turning => 1.0,
        (true, true) => {
            let [one, two] = [1.0 + normal.z, (1.0 - normal.z) * (1.0 + 2.0 * normal.z)];
            (if is_mapped { one } else { two }) / (one + two)
        }
        _ => 1.0,
    };
    (if is_mapped { mapped } else { turned }, share)
}

fn check(scene: &Scene, settings: &Bdpt, samples: u32) {
    let found = paths(scene, settings, samples);
    let mut per_length = vec![0; 16];
    for path in &found {
        let whole = Whole::new(scene, path, settings);
        let Technique::Connect { s, .. } = path.technique else { panic!("bdpt connects") };
        let weights: Vec<Option<f64>> = (0..whole.len()).map(|s| whole.weight(s)).collect();
        let sum: f64 = weights.iter().flatten().sum();
        let share = weights[s as usize].expect("the strategy that made a path can make it");
        // Which of nearly equal densities is the highest is decided by rounding.
        let own_share = (share - path.weight).abs() < TOLERANCE
            || settings.mis == Heuristic::Maximum.into() && whole.nearly_tied(s as usize);
        let ok = (sum - 1.0).abs() < TOLERANCE && own_share;
        assert!(
            ok,
            "{}, {:?}, {settings:?}: weight {}, by strategy {weights:?}, sum {sum}",
            scene.name, path.technique, path.weight
        );
        per_length[whole.len()] += 1;
    }
    assert!(per_length[3..7].iter().all(|&n| n > 0), "{}: paths by length {per_length:?}", scene.name);
}

#[test]
fn weights_of_all_strategies_sum_to_one() {
    for name in ["cornell_box", "furnace", "integrating_sphere", "veach_mis", "glass_caustic", "indirect_lamp"] {
        let scene = builtin(name, 8);
        for mis in [Heuristic::Balance, Heuristic::POWER, Heuristic::Power(1.5), Heuristic::Maximum] {
            for emitter_to_camera in [false, true] {
                for roulette in [SubpathRoulette::None, SubpathRoulette::Local, SubpathRoulette::Throughput] {
                    let mis = mis.into();
                    check(&scene, &Bdpt { mis, roulette, emitter_to_camera, ..Bdpt::default() }, 2);
                }
            }
            let light_paths = NonZeroU16::new(3).unwrap();
            check(&scene, &Bdpt { mis: mis.into(), light_paths, ..Bdpt::default() }, 2);
            check(&scene, &Bdpt { mis: mis.into(), camera_connections: false, ..Bdpt::default() }, 2);
        }
    }
}

/// A room with a glass ball and a mirror, lit by one emitter of each kind that is no surface.
fn rooms() -> Vec<Scene> {
    let room = |name: &str, add: &dyn Fn(&mut SceneBuilder)| {
        let mut builder = room(name);
        let glass = builder.material(Bsdf::from(sampling::bsdf::Dielectric { eta: 1.5 }));
        let mirror = builder.material(Bsdf::from(sampling::bsdf::Mirror { reflectance: Spectrum::splat(0.9) }));
        builder.sphere(dvec3(-0.4, -0.6, 0.2), 0.35, glass);
        builder.sphere(dvec3(0.5, -0.7, -0.1), 0.28, mirror);
        add(&mut builder);
        let mut scene = builder.build(Skip::Unneeded).unwrap();
        scene.camera.set_size(8, 8);
        scene
    };
    let spot = |builder: &mut SceneBuilder| {
        let (position, target, intensity) = (dvec3(0.3, 0.9, 0.5), dvec3(-0.3, -0.7, 0.0), Spectrum::splat(3.0));
        builder.spot(Spot { position, target, intensity, cutoff: 0.7, beam: 0.3, falloff: Falloff::Linear });
    };
    let parallel = |builder: &mut SceneBuilder| {
        builder.directional_emitter(dvec3(-0.2, -0.5, -1.0), Spectrum::splat(2.0));
    };
    let lamp = |builder: &mut SceneBuilder| {
        let black = builder.material(lambert(0.0));
        let quad = builder.quad(dvec3(-0.2, 0.9, -0.2), DVec3::X * 0.4, DVec3::Z * 0.4, black);
        builder.emit(quad, shining(5.0));
    };
    vec![
        room("spot", &spot),
        room("directional", &parallel),
        room("sky", &|builder| builder.environment_image(sky(Mapping::Equirectangular, 3.0))),
        room("sun", &|builder| builder.environment_image(sky(Mapping::EqualArea, 1e3))),
        room("crowd with a tree", &|builder| {
            spot(builder);
            parallel(builder);
            builder.environment_image(sky(Mapping::EqualArea, 10.0));
            let black = builder.material(lambert(0.0));
            for i in 0..12 {
                let corner = dvec3(-0.9 + 0.15 * i as f64, 0.5 - 0.1 * (i % 4) as f64, -0.5 + 0.2 * (i % 3) as f64);
                let quad = builder.quad(corner, DVec3::X * 0.1, DVec3::Z * 0.1, black);
                builder.emit(quad, shining(1.0 + i as f32));
            }
        }),
        room("all", &|builder| {
            spot(builder);
            parallel(builder);
            lamp(builder);
            builder.environment_image(sky(Mapping::EqualArea, 10.0));
        }),
    ]
}

#[test]
fn weights_sum_to_one_whatever_emits() {
    for scene in rooms() {
        for mis in [Heuristic::Balance, Heuristic::POWER] {
            for emitter_to_camera in [false, true] {
                check(&scene, &Bdpt { mis: mis.into(), emitter_to_camera, ..Bdpt::default() }, 6);
            }
        }
    }
}

/// About normals that are tilted far, by what is smooth and what is rough, reflects and transmits.
#[test]
fn weights_sum_to_one_in_relief() {
    for remedies in Remedies::ALL {
        let mut builder = room(&format!("relief, {}", remedies.name()));
        let glass = Bsdf::from(sampling::bsdf::Dielectric { eta: 1.5 });
        let mirror = Bsdf::from(sampling::bsdf::Mirror { reflectance: Spectrum::splat(0.9) });
        let metal = Bsdf::from(RoughConductor::from_reflectance(Spectrum::splat(0.9), 0.4, 0.2));
        let milk = Bsdf::from(RoughDielectric::new(1.3, 0.5, 0.5));
        let balls = [(glass, -0.6, 0.2), (mirror, 0.55, -0.1), (metal, 0.0, 0.5), (milk, 0.0, -0.4)];
        for (seed, (bsdf, x, z)) in balls.into_iter().enumerate() {
            let material = builder.material(in_relief(bsdf, bumps(0.3, 0.2, seed as u64), remedies));
            builder.sphere(dvec3(x, -0.65, z), 0.3, material);
        }
        let floor = builder.material(in_relief(lambert(0.8), bumps(0.3, 0.3, 7), remedies));
        builder.quad(dvec3(-1.0, -0.98, 1.0), DVec3::X * 2.0, DVec3::Z * -2.0, floor);
        let black = builder.material(lambert(0.0));
        let lamp = builder.quad(dvec3(-0.4, 0.9, -0.4), DVec3::X * 0.8, DVec3::Z * 0.8, black);
        builder.emit(lamp, shining(5.0));
        let mut scene = builder.build(Skip::Unneeded).unwrap();
        scene.camera.set_size(8, 8);
        for mis in [Heuristic::Balance, Heuristic::POWER] {
            for emitter_to_camera in [false, true] {
                check(&scene, &Bdpt { mis: mis.into(), emitter_to_camera, ..Bdpt::default() }, 6);
            }
        }
    }
}

/// With a lens, with parallel rays and with a view all around, mirrored and shifted.
#[test]
fn weights_sum_to_one_under_every_camera() {
    let lens = Projection::ThinLens { fov: 60.0, lens_radius: 0.1, focus_distance: Some(0.7) };
    for projection in [lens, Projection::Orthographic { extent: 0.9 }, Projection::Equirectangular] {
        for (name, position) in [("integrating_sphere", dvec3(0.0, 0.1, 0.6)), ("glass_caustic", dvec3(0.1, 0.6, 0.9))]
        {
            let mut builder = scenes::load::open(name, None).unwrap();
            let pinhole = CameraSettings::pinhole(position, dvec3(0.05, 0.2, 0.0), 40.0, (8, 8));
            builder.camera(CameraSettings { projection, mirrored: true, shift: dvec2(0.1, 0.0), ..pinhole });
            let scene = builder.build(Skip::Unneeded).unwrap();
            for emitter_to_camera in [false, true] {
                check(&scene, &Bdpt { emitter_to_camera, ..Bdpt::default() }, 2);
            }
        }
    }
}
