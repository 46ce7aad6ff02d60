//! Emitters over a plane whose irradiance has a closed form: order 1 of every method, and order 0 of what a meter on it measures.
//!
//! False-alarm rate: 0.1 % for each test (Šidák over its methods, orders and blocks).

use crate::support::{
    ALL_AND_RUNS, Budget, COLUMNS, Estimate, Family, GAUSS, Truth, camera, exact, grey, lambert, measure, plain,
    shining, sky,
};
use glam::{DVec3, dvec3};
use sampling::math::Spectrum;
use sampling::vec3;
use scenes::camera::Receiver;
use scenes::{CameraSettings, Falloff, Interaction, Mapping, Projection, Scene, SceneBuilder, Skip, Spot};
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
    for name in ALL_AND_RUNS {
        let budget = Budget::samples(if name == "light" { 8 * samples } else { samples });
        truth.compare(&mut family, name, plain(name).as_ref(), budget, COLUMNS);
    }
    family.finish(0.99);
}

/// Irradiance at `p` with normal `n` from a polygon of radiance 1, all above the horizon, by Lambert's formula.
pub fn lambert_irradiance(p: DVec3, n: DVec3, polygon: &[DVec3]) -> f64 {
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

/// The beam is narrow and the cutoff wide, so that the kinks at their edges are far below what is resolved.
#[test]
fn spot() {
    let (intensity, position, target) = (2.0, dvec3(0.2, 0.7, -0.1), dvec3(0.4, 0.0, 0.4));
    for falloff in Falloff::ALL {
        let (cutoff, beam) = (f64::to_radians(80.0), f64::to_radians(2.0));
        let mut builder = floor(&format!("{falloff:?} spot over a plane"));
        builder.spot(Spot { position, target, intensity: Spectrum::splat(intensity), cutoff, beam, falloff });
        let scene = builder.build(Skip::Unneeded).unwrap();
        let axis = (target - position).normalize();
        compare(&scene, 128, |p| {
            let d = position - p;
            let cosine = (-d).normalize().dot(axis);
            let share = match falloff {
                Falloff::Linear => ((cutoff - cosine.acos()) / (cutoff - beam)).clamp(0.0, 1.0),
                Falloff::Smooth => {
                    let x = ((cosine - cutoff.cos()) / (beam.cos() - cutoff.cos())).clamp(0.0, 1.0);
                    x * x * (3.0 - 2.0 * x)
                }
            };
            share * intensity as f64 * d.y / d.length().powi(3)
        });
    }
}

#[test]
fn directional() {
    let (irradiance, direction) = (3.0, dvec3(0.4, -1.0, -0.3));
    let mut builder = floor("parallel light on a plane");
    builder.directional_emitter(direction, Spectrum::splat(irradiance));
    let scene = builder.build(Skip::Unneeded).unwrap();
    compare(&scene, 64, |_| -(irradiance as f64) * direction.normalize().y);
}

/// The sum of what two emitters that are certain make of a plane, the stronger chosen more often.
#[test]
fn spot_and_directional() {
    let (intensity, position, irradiance, direction) = (0.2, dvec3(0.4, 0.6, 0.3), 1.0, dvec3(0.0, -1.0, 0.5));
    let mut builder = floor("spot and parallel light on a plane");
    let (cutoff, falloff) = (PI, Falloff::Linear);
    let target = position - DVec3::Y;
    builder.spot(Spot { position, target, intensity: Spectrum::splat(intensity), cutoff, beam: cutoff, falloff });
    builder.directional_emitter(direction, Spectrum::splat(irradiance));
    let scene = builder.build(Skip::Unneeded).unwrap();
    compare(&scene, 128, |p| {
        let d = position - p;
        intensity as f64 * d.y / d.length().powi(3) - irradiance as f64 * direction.normalize().y
    });
}

/// The irradiance of a plane is the same all over it: that of the upper half of the sky, by quadrature of its radiance.
#[test]
fn environment_image() {
    for mapping in Mapping::ALL {
        let mut builder = floor(&format!("{mapping:?} sky over a plane"));
        builder.environment_image(sky(mapping, 20.0));
        let scene = builder.build(Skip::Unneeded).unwrap();
        let (rows, columns) = (600, 1200);
        let mut irradiance = 0.0;
        for i in 0..rows {
            // Rows of equal projected solid angle: sin²θ uniform.
            let sine = ((i as f64 + 0.5) / rows as f64).sqrt();
            for j in 0..columns {
                let (s, c) = (2.0 * PI * (j as f64 + 0.5) / columns as f64).sin_cos();
                let d = vec3((sine * c) as f32, (1.0 - sine * sine).sqrt() as f32, (sine * s) as f32);
                irradiance += scene.environment_le(d).mean() as f64 * PI / (rows * columns) as f64;
            }
        }
        // The sun of this one stands where it is seen less.
        let samples = if mapping == Mapping::EquirectangularToPoles { 192 } else { 128 };
        compare(&scene, samples, |_| irradiance);
    }
}

/// What meters of every shape measure of all orders in a furnace, π times the radiance there; and of a disk and a rectangle
/// overhead, which they see as order 0: one lies on the floor itself.
#[test]
fn meters_measure_what_falls_on_them() {
    let mut family = Family::new("irradiance meters");
    let receivers = [Receiver::Point, Receiver::Rectangle([0.3, 0.2]), Receiver::Disk(0.15), Receiver::Sphere(0.2)];
    let mut check = |scene: &Scene, label: &str, samples: u32, exact: &[f64]| {
        for name in ALL_AND_RUNS {
            // Of the composite's samples, light paths have two ninths alone, and each order of theirs is rare.
            let samples = if name == "composite" { 8 * samples } else { samples };
            let budget = Budget::samples(samples).up_to(exact.len() - 1);
            let rendered = measure(scene, plain(name).as_ref(), &format!("{label} {name}"), budget);
            for (layer, exact) in exact.iter().enumerate().take(rendered.measurement.layers.len()) {
                family.image(format!("{label}, {name}, order {layer}"), rendered.image(layer), Estimate::exact(*exact));
            }
        }
    };
    let meter = |receiver, position: DVec3, target: DVec3| CameraSettings {
        projection: Projection::Irradiance(receiver),
        up: dvec3(0.3, 0.0, 1.0),
        ..CameraSettings::pinhole(position, target, 40.0, (1, 1))
    };
    for receiver in receivers {
        let mut builder = scenes::load::open("furnace", None).unwrap();
        builder.camera(meter(receiver, dvec3(-0.1, 0.2, 0.3), dvec3(0.1, -0.1, -0.5)));
        let scene = builder.build(Skip::Unneeded).unwrap();
        let radiance = |order| grey(exact(&scene, order, vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0)));
        let known: Vec<f64> = (0..4).map(|order| PI * radiance(order)).collect();
        check(&scene, &format!("furnace, {receiver:?}"), 512, &known);
    }
    // A disk of radius R at the height h over a point that faces it: E = π L R² / (R² + h²).
    let (radius, height, radiance) = (0.4, 0.6, 3.0);
    let mut builder = floor("disk over a meter");
    let black = builder.material(lambert(0.0));
    let at = dvec3(0.1, 0.0, -0.2);
    let lamp = builder.disk(at + DVec3::Y * height, DVec3::X * radius, DVec3::Z * radius, black);
    builder.emit(lamp, shining(radiance as f32));
    builder.camera(meter(Receiver::Point, at, at + DVec3::Y));
    let scene = builder.build(Skip::Unneeded).unwrap();
    check(&scene, "disk", 512, &[PI * radiance * radius * radius / (radius * radius + height * height)]);
    // A quad over a rectangle on the floor: the mean of Lambert's formula over the rectangle, by Gauss's rule.
    let corners = [dvec3(-0.3, 0.6, -0.2), dvec3(0.5, 0.6, -0.2), dvec3(0.5, 0.9, 0.4), dvec3(-0.3, 0.9, 0.4)];
    let mut builder = floor("quad over a meter");
    let black = builder.material(lambert(0.0));
    let lamp = builder.quad(corners[0], corners[1] - corners[0], corners[3] - corners[0], black);
    builder.emit(lamp, shining(radiance as f32));
    let sides = [0.5, 0.3];
    let settings = CameraSettings { up: DVec3::Z, ..meter(Receiver::Rectangle(sides), at, at + DVec3::Y) };
    builder.camera(settings);
    let scene = builder.build(Skip::Unneeded).unwrap();
    let mut mean = 0.0;
    for (x, a) in GAUSS {
        for (z, b) in GAUSS {
            let p = at + dvec3((x - 0.5) * sides[0], 0.0, (z - 0.5) * sides[1]);
            mean += a * b * radiance * lambert_irradiance(p, DVec3::Y, &corners);
        }
    }
    check(&scene, "quad", 512, &[mean]);
    family.finish(0.9);
}
