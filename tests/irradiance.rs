//! Emitters over a plane whose irradiance has a closed form: order 1 of every method.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over its methods, orders and blocks).

use crate::support::{ALL, Budget, COLUMNS, Family, Truth, camera, lambert, method, shining};
use glam::{DVec3, dvec3};
use sampling::math::Spectrum;
use scenes::{Interaction, Scene, SceneBuilder, Skip};
use std::f64::consts::PI;

const ALBEDO: f32 = 0.7;

/// A floor that fills the view, which looks down on it from below whatever hangs over it.
fn floor(name: &str) -> SceneBuilder {
    let mut builder = SceneBuilder::new(name);
    let grey = builder.material(lambert(ALBEDO));
    builder.quad(dvec3(-2.0, 0.0, 2.0), dvec3(4.0, 0.0, 0.0), dvec3(0.0, 0.0, -4.0), grey);
    builder.camera(camera(dvec3(0.9, 0.5, 0.9), dvec3(0.35, 0.0, 0.35), 22.0, 8));
    builder
}

/// Compares all methods with the radiance that an irradiance at a floor's point gives. Light tracing's samples seldom come
/// into view, and it gets more.
fn compare(scene: &Scene, samples: u32, irradiance: impl Fn(DVec3) -> f64) {
    let at = |hit: &Interaction| hit.point.p.as_dvec3() + scene.origin;
    let reflected = |hit: &Interaction| ALBEDO as f64 / PI * irradiance(at(hit));
    let truth = Truth::new(scene, |hit, _| vec![0.0, reflected(hit)]);
    let mut family = Family::new(&scene.name);
    for name in ALL {
        let budget = Budget::samples(if name == "light" { 8 * samples } else { samples });
        truth.compare(&mut family, name, method(name).as_ref(), budget, COLUMNS);
    }
    family.finish(0.99);
}

/// Irradiance at `p` with normal `n` from a polygon of radiance 1, all above the horizon, by Lambert's formula.
fn lambert_irradiance(p: DVec3, n: DVec3, polygon: &[DVec3]) -> f64 {
    let edge = |i: usize| {
        let [a, b] = [polygon[i], polygon[(i + 1) % polygon.len()]].map(|corner| (corner - p).normalize());
        a.dot(b).clamp(-1.0, 1.0).acos() * n.dot(a.cross(b).normalize())
    };
    ((0..polygon.len()).map(edge).sum::<f64>() / 2.0).abs()
}

#[test]
fn polygon() {
    let radiance = 5.0;
    let mut builder = floor("polygon over a plane");
    let black = builder.material(lambert(0.0));
    let corners = [dvec3(-0.3, 0.6, -0.2), dvec3(0.5, 0.6, -0.2), dvec3(0.5, 0.9, 0.4), dvec3(-0.3, 0.9, 0.4)];
    let (u, v) = (corners[1] - corners[0], corners[3] - corners[0]);
    assert!(u.cross(v).y < 0.0, "its front looks down");
    let light = builder.quad(corners[0], u, v, black);
    builder.emit(light, shining(radiance));
    let scene = builder.build(Skip::Unneeded).unwrap();
    compare(&scene, 128, |p| radiance as f64 * lambert_irradiance(p, DVec3::Y, &corners));
}

#[test]
fn sphere() {
    let (radiance, centre, radius) = (5.0, dvec3(0.1, 0.8, -0.3), 0.25);
    let mut builder = floor("sphere over a plane");
    let black = builder.material(lambert(0.0));
    let light = builder.sphere(centre, radius, black);
    builder.emit(light, shining(radiance));
    let scene = builder.build(Skip::Unneeded).unwrap();
    compare(&scene, 128, |p| {
        let d = centre - p;
        PI * radiance as f64 * radius * radius * d.y / d.length().powi(3)
    });
}

#[test]
fn point() {
    let (intensity, position) = (2.0, dvec3(0.2, 0.7, -0.1));
    let mut builder = floor("point over a plane");
    builder.point_emitter(position, Spectrum::splat(intensity));
    let scene = builder.build(Skip::Unneeded).unwrap();
    compare(&scene, 128, |p| {
        let d = position - p;
        intensity as f64 * d.y / d.length().powi(3)
    });
}

/// The stronger is chosen nine times as often; each lights the part of the floor below it most.
#[test]
fn two_points() {
    let points = [(2.7, dvec3(0.5, 0.7, 0.1)), (0.3, dvec3(0.1, 0.6, 0.5))];
    let mut builder = floor("two points over a plane");
    for (intensity, position) in points {
        builder.point_emitter(position, Spectrum::splat(intensity));
    }
    let scene = builder.build(Skip::Unneeded).unwrap();
    let of =
        |(intensity, position): (f32, DVec3), p: DVec3| intensity as f64 * position.y / (position - p).length().powi(3);
    compare(&scene, 128, |p| points.iter().map(|&point| of(point, p)).sum());
}
