//! The MIS weights of all strategies that could have made a path sum to one, and the weight a path was given is its share.
//!
//! Paths are taken from the bidirectional path tracer; every one is then divided anew at every edge, its densities computed
//! from its vertices alone, and weighed by the same code as if that strategy had made it. No randomness is left by then: what
//! may differ is what `f32` leaves of densities, and what the rounding of its points moves them by.

mod learnt;
mod merges;
mod whole;

use crate::support::{builtin, bumps, contributions, in_relief, lambert, room, seed, shining, sky};
use glam::{DVec3, dvec2, dvec3};
use integrators::bdpt::Bdpt;
use integrators::connect::PerStrategy;
use integrators::roulette::SubpathRoulette;
use integrators::vertex::PathVertex;
use integrators::{Contribution, Sink, Technique, Wants};
use sampling::bsdf::{Bsdf, RoughConductor, RoughDielectric};
use sampling::math::Spectrum;
use sampling::mis::Heuristic;
use sampling::sampler::{Role, StreamKey};
use scenes::{CameraSettings, Falloff, Mapping, Projection, Remedies, Scene, SceneBuilder, Skip, Spot};
use std::num::NonZeroU16;
use whole::Whole;

/// What densities in `f32` may move a weight by, narrow lobes included.
const TOLERANCE: f64 = 2e-4;

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
    // A seed with which the everyday paths are of all lengths.
    let key = StreamKey::new(10 + seed(), "weights", Role::Estimate, 0);
    contributions(scene, settings, 6, (key, samples), &mut collect);
    collect.found
}

/// Looks at paths, with what rounding may move their weights by, which is next to nothing for nearly all of them. Left out are those whose
/// densities may be off by as much as they are, for two points are nearly one or a way grazes.
fn for_every_path(scene: &Scene, settings: &Bdpt, samples: u32, mut look: impl FnMut(&Found, &Whole, f64)) {
    let found = paths(scene, settings, samples);
    let (mut moved, mut left_out) = (0, 0);
    for path in &found {
        let whole = Whole::new(scene, path, settings);
        let rounding = whole.rounding();
        moved += usize::from(rounding > 1e-3);
        // NaN is left out, too.
        if rounding < 1.0 {
            look(path, &whole, rounding);
        } else {
            left_out += 1;
        }
    }
    // A subpath with a narrow corner is part of dozens of paths.
    let count = format!("{}: of {} paths {moved} are moved by rounding, {left_out} left out", scene.name, found.len());
    assert!(10 * moved <= found.len() && 50 * left_out <= found.len(), "{count}");
}

fn check(scene: &Scene, settings: &Bdpt, samples: u32) {
    let mut per_length = vec![0; 16];
    for_every_path(scene, settings, samples, |path, whole, rounding| {
        let Technique::Connect { s, .. } = path.technique else { panic!("bdpt connects") };
        let weights: Vec<Option<f64>> = (0..whole.len()).map(|s| whole.weight(s)).collect();
        let sum: f64 = weights.iter().flatten().sum();
        let share = weights[s as usize].expect("the strategy that made a path can make it");
        // The logarithm of its odds moves a weight w by w (1 − w), a quarter at most, and the power heuristic doubles that logarithm.
        // Which of nearly equal densities is the highest is decided by rounding.
        let own_share = (share - path.weight).abs() < TOLERANCE + rounding
            || settings.mis == Heuristic::Maximum.into() && whole.nearly_tied(s as usize, rounding);
        let ok = (sum - 1.0).abs() < TOLERANCE && own_share;
        assert!(
            ok,
            "{}, {:?}, {settings:?}: weight {}, by strategy {weights:?}, sum {sum}, rounding {rounding}",
            scene.name, path.technique, path.weight
        );
        per_length[whole.len()] += 1;
    });
    // Under other seeds there may be none of the longest.
    let longest = if seed() == 1 { 7 } else { 5 };
    assert!(per_length[3..longest].iter().all(|&n| n > 0), "{}: paths by length {per_length:?}", scene.name);
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
            check(&scene, &Bdpt { camera_connections: false, ..Bdpt::default() }, 2);
        }
    }
}
