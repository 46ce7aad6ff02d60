use super::*;
use crate::integrator::Integrator;
use crate::measurement::Measurement;
use crate::render::{Render, RenderSettings};
use crate::{Methods, Orders};
use glam::{DVec3, dvec3};
use sampling::bsdf::Lambert;
use sampling::math::Spectrum;
use sampling::sampler::{Role, SamplerKind, StreamKey};
use sampling::vec3;
use scenes::builder::{Falloff, Spot};
use scenes::{CameraSettings, SceneBuilder, Skip};
use serde_json::Value;
use std::f32::consts::PI;

const LIT: DVec3 = dvec3(0.5, 0.5, 1.0);

/// A room of edge 2 about the origin, of whose ceiling a spot lights a disk of radius 0.14 about [`LIT`].
fn room(size: u32) -> Scene {
    let mut builder = SceneBuilder::new("room");
    let wall = builder.material(Lambert { albedo: Spectrum::splat(0.5) });
    let (x, y, z) = (DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z * 2.0);
    let corner = -DVec3::ONE;
    for (u, v, across) in [(x, y, z), (y, z, x), (z, x, y)] {
        builder.quad(corner, u, v, wall);
        builder.quad(corner + across, v, u, wall);
    }
    builder.spot(Spot {
        position: dvec3(0.5, 0.5, 0.0),
        target: LIT,
        intensity: Spectrum::splat(100.0),
        cutoff: 8.0_f64.to_radians(),
        beam: 6.0_f64.to_radians(),
        falloff: Falloff::Linear,
    });
    let camera = CameraSettings::pinhole(dvec3(0.0, -0.9, 0.0), dvec3(0.0, 0.0, -0.5), 60.0, (size, size));
    builder.camera(camera);
    builder.build(Skip::Unneeded).unwrap()
}

fn measured(scene: &Scene, method: &str) -> Measurement {
    let method: Box<dyn Integrator> = Methods::standard().build(method, &Value::Null).unwrap();
    let settings = RenderSettings {
        orders: Orders::up_to(2),
        tail: false,
        samples_per_replicate: 512,
        seed: 3,
        sampler: SamplerKind::Independent,
        instance: method.name().to_owned(),
        role: Role::Estimate,
    };
    let mut render = Render::new(scene, &*method, settings).unwrap();
    (0..4).for_each(|_| render.run_replicate(&|_| {}));
    render.finish()
}

#[test]
fn what_is_learned_points_where_light_comes_from() {
    let scene = room(64);
    let request = Request::new(Orders::up_to(2), false);
    let key = StreamKey::new(1, "", Role::Estimate, 0);
    let replicate = Replicate { number: 0, key, sampler: SamplerKind::Independent, samples: 256 };
    let guided = Guided::default().prepare(&scene, &request, &replicate).unwrap();
    let (tree, counters) = &**guided.learned.as_ref().unwrap();
    assert!(counters.closest > 64 * 64 * 64);
    for p in [vec3(0.2, 0.3, -1.0), vec3(-0.4, 0.6, -1.0), vec3(-0.2, 1.0, -0.5)] {
        let part = tree.part(p);
        let towards = part.density().pdf((LIT.as_vec3() - p).normalize()) * 4.0 * PI;
        assert!(part.share() >= 0.5 && towards > 3.0, "at {p}: share {}, density {towards}", part.share());
    }
}

#[test]
fn a_small_light_that_only_walks_find_has_less_than_half_of_the_variance() {
    let scene = room(48);
    let [guided, path] = ["guided", "path"].map(|method| measured(&scene, method));
    let variance = |m: &Measurement| (0..m.pixels()).flat_map(|pixel| m.variance(2, pixel).unwrap()).sum::<f64>();
    let ratio = variance(&guided) / variance(&path);
    assert!(ratio < 0.5, "{ratio}");
}
