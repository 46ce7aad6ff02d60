//! Every method against the closed forms of enclosures, order by order.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over its methods, orders and blocks).

use crate::support::{
    ALL, ALL_AND_RUNS, Budget, COLUMNS, Family, Truth, builtin, camera, exact, grey, lambert, method, plain, shining,
};
use glam::{DVec3, dvec3};
use integrators::Integrator;
use sampling::bsdf::{Bsdf, Mirror};
use sampling::math::Spectrum;
use sampling::vec3;
use scenes::{Emission, MeshData, Scene, SceneBuilder, Skip, Texture};

/// Width and height of the images.
const SIZE: u32 = 8;

/// The orders 0 to 8 of a built-in scene with a closed form.
fn exact_orders(scene: &Scene) -> Truth<'_> {
    Truth::new(scene, |hit, ray| (0..=8).map(|order| grey(exact(scene, order, hit.point.p, ray.d))).collect())
}

/// Compares methods with so many samples per pixel and replicate; light tracing spreads them over the room, and gets more.
fn compare(truth: &Truth, methods: &[&str], make: fn(&str) -> Box<dyn Integrator>, samples: u32) {
    let mut family = Family::new(truth.name());
    for &name in methods {
        let budget = Budget::samples(if name == "light" { 4 * samples } else { samples });
        truth.compare(&mut family, name, make(name).as_ref(), budget, COLUMNS);
    }
    family.finish(0.9);
}

#[test]
fn furnace() {
    let scene = builtin("furnace", SIZE);
    compare(&exact_orders(&scene), &ALL, method, 64);
}

#[test]
fn furnace_by_runs() {
    let scene = builtin("furnace", SIZE);
    compare(&exact_orders(&scene), &["composite"], plain, 64);
}

#[test]
fn integrating_sphere() {
    let scene = builtin("integrating_sphere", SIZE);
    compare(&exact_orders(&scene), &ALL_AND_RUNS, plain, 32);
}

/// A closed tetrahedron whose faces, and a ball of a mirror's material within, all reflect and emit alike. Light tracing loses
/// what the ball sends to the camera, and is not held to this.
#[test]
fn uniform_tetrahedron_with_a_mirror_ball() {
    let (albedo, emitted) = (0.6, 0.8);
    let scene = tetrahedron(albedo, emitted);
    let truth = Truth::new(&scene, |_, _| (0..=8).map(|order| (emitted * albedo.powi(order)) as f64).collect());
    compare(&truth, &["direct", "path", "bdpt", "composite"], plain, 64);
}

fn tetrahedron(albedo: f32, emitted: f32) -> Scene {
    let mut builder = SceneBuilder::new("tetrahedron");
    let wall = builder.material(lambert(albedo));
    let mirror = builder.material(Bsdf::from(Mirror { reflectance: Spectrum::splat(albedo) }));
    let corners = [dvec3(2., 2., 2.), dvec3(2., -2., -2.), dvec3(-2., 2., -2.), dvec3(-2., -2., 2.)];
    // The fronts look inwards.
    let triangles = vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    let mesh = MeshData { positions: corners.to_vec(), triangles, ..MeshData::default() };
    let inwards = (corners[2] - corners[0]).cross(corners[1] - corners[0]).dot(-corners[0]);
    assert!(inwards > 0.0);
    let walls = builder.mesh(mesh, wall);
    let ball = builder.sphere(dvec3(0.1, 0.0, 0.2), 0.3, mirror);
    builder.emit(walls, shining(emitted));
    builder.emit(ball, shining(emitted));
    builder.camera(camera(dvec3(0.5, 0.5, 0.8), DVec3::ZERO, 50.0, SIZE));
    builder.build(Skip::Unneeded).unwrap()
}

/// A sphere that shines on both sides, seen from within: rounding puts points of its wall on either side of it.
#[test]
fn two_sided_sphere_from_within() {
    let (albedo, emitted) = (0.6f32, 0.8f32);
    let mut builder = SceneBuilder::new("two-sided sphere");
    let wall = builder.material(lambert(albedo));
    let sphere = builder.sphere(dvec3(3.0, 1.0, -2.0), 1.0, wall);
    builder.emit(sphere, Emission { two_sided: true, ..shining(emitted) });
    builder.camera(camera(dvec3(3.4, 1.3, -1.4), dvec3(3.1, 1.0, -3.0), 80.0, SIZE));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let truth = Truth::new(&scene, |_, _| (0..=4).map(|order| f64::from(emitted * albedo.powi(order))).collect());
    compare(&truth, &ALL_AND_RUNS, plain, 32);
}

/// A sphere with a point emitter at its centre: L_k = ρ(x) ρ̄^(k−1) I / (πR²) for k ≥ 1.
#[test]
fn sphere_with_a_point_emitter_at_its_centre() {
    let (radius, intensity, base, slope) = (1.5, 3.0, 0.5, 0.3);
    let mut builder = SceneBuilder::new("point in sphere");
    let albedo = Texture::Ramp {
        base: Spectrum::splat(base),
        slope: Spectrum::splat(slope),
        axis: vec3(0.0, 0.0, 1.0),
        origin: DVec3::ZERO,
        scale: radius as f32,
    };
    let wall = builder.material(scenes::Material::lambert(albedo));
    let sphere = builder.sphere(DVec3::ZERO, radius, wall);
    builder.flip(sphere);
    builder.point_emitter(DVec3::ZERO, Spectrum::splat(intensity));
    builder.camera(camera(dvec3(0.4, 0.3, 0.9), dvec3(0.1, 0.0, -1.0), 60.0, SIZE));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let truth = Truth::new(&scene, |hit, _| {
        let z = hit.point.p.as_dvec3().z + scene.origin.z;
        let albedo = base as f64 + slope as f64 * z / radius;
        let first = intensity as f64 / (std::f64::consts::PI * radius * radius);
        std::iter::once(0.0).chain((0..8).map(|k| albedo * (base as f64).powi(k) * first)).collect()
    });
    compare(&truth, &ALL_AND_RUNS, plain, 64);
}
