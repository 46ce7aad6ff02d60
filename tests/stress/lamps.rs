//! Lamps that are small, bright, many, close to walls or behind glass, and cameras where hardly any should stand.

use super::{ALBEDO, EMITTED, EQUILIBRIUM, enclosure, furnace, is_a_furnace, is_in_equilibrium, methods};
use crate::irradiance::lambert_irradiance;
use crate::support::{ALL, Budget, COLUMNS, Family, Truth, camera, lambert, measure, plain, shining};
use glam::{DVec3, dvec3};
use sampling::bsdf::{Bsdf, Dielectric};
use scenes::{Emission, Scene, SceneBuilder, Skip};
use std::f64::consts::PI;

/// A floor of ±1 seen from above, where no lamp is in the picture.
fn floor(name: &str) -> SceneBuilder {
    let mut builder = SceneBuilder::new(name);
    let grey = builder.material(lambert(ALBEDO));
    builder.quad(dvec3(-1.0, 0.0, 1.0), DVec3::X * 2.0, DVec3::Z * -2.0, grey);
    builder.camera(camera(dvec3(0.0, 1.5, 0.0), DVec3::ZERO, 50.0, 8));
    builder
}

/// A ball that is wholly above the horizon of a floor gives it E = π L r² cos θ/d² exactly, whatever its radius.
#[test]
fn balls_of_any_size_give_the_same_light() {
    let (centre, intensity) = (dvec3(0.9, 1.2, 0.4), 2.0);
    let mut family = Family::new("balls over a floor");
    for exponent in [-6, -5, -4, -3, -1] {
        let radius = 10f64.powi(exponent);
        let mut builder = floor(&format!("ball of 1e{exponent}"));
        let black = builder.material(lambert(0.0));
        let ball = builder.sphere(centre, radius, black);
        builder.emit(ball, shining((intensity / (PI * radius * radius)) as f32));
        let scene = builder.build(Skip::Unneeded).unwrap();
        let truth = Truth::new(&scene, |hit, _| {
            let d = centre - (hit.point.p.as_dvec3() + scene.origin);
            vec![0.0, f64::from(ALBEDO) / PI * intensity * d.y / d.length().powi(3)]
        });
        for (name, method) in methods() {
            let samples = if name == "light" { 128 } else { 16 };
            truth.compare(&mut family, name, method.as_ref(), Budget::samples(samples), COLUMNS);
        }
    }
    family.finish(0.9);
}

/// One lamp is as good as a hundred thousand that tile it.
#[test]
fn a_lamp_in_a_hundred_thousand_pieces() {
    let lamp_of = |pieces: usize| -> Scene {
        let mut builder = crate::support::room("tiled lamp");
        let black = builder.material(lambert(0.0));
        let side = 1.2 / pieces as f64;
        for i in 0..pieces * pieces {
            let corner = dvec3(-0.6 + side * (i % pieces) as f64, 0.95, -0.6 + side * (i / pieces) as f64);
            let tile = builder.quad(corner, DVec3::X * side, DVec3::Z * side, black);
            builder.emit(tile, shining(1.0));
        }
        builder.build(Skip::Unneeded).unwrap()
    };
    let mut family = Family::new("a lamp in pieces");
    let [whole, tiled] = [lamp_of(1), lamp_of(316)];
    for (name, method) in methods() {
        let [a, b] = [("", &whole), (" tiled", &tiled)].map(|(suffix, scene)| {
            measure(scene, method.as_ref(), &format!("{name}{suffix}"), Budget::samples(2).up_to(3))
        });
        for layer in 0..a.measurement.layers.len() {
            family.image(format!("{name}, order {layer}"), a.image(layer), b.image(layer));
        }
    }
    family.finish(0.9);
}

/// An upright lamp whose lower edge lies on the floor: Lambert's formula, up to points that touch it. Its light has no bound for
/// connections of unit geometry, 1/r².
#[test]
fn a_lamp_that_touches_the_floor() {
    let (radiance, x) = (3.0, -0.3);
    let corners = [dvec3(x, 0.0, 0.5), dvec3(x, 0.0, -0.5), dvec3(x, 0.8, -0.5), dvec3(x, 0.8, 0.5)];
    let mut builder = SceneBuilder::new("lamp on the floor");
    let grey = builder.material(lambert(ALBEDO));
    builder.quad(dvec3(x, 0.0, 0.5), DVec3::X * 0.6, DVec3::Z * -1.0, grey);
    let black = builder.material(lambert(0.0));
    let lamp = builder.quad(corners[0], corners[1] - corners[0], corners[3] - corners[0], black);
    builder.emit(lamp, shining(radiance));
    // It sees the floor alone, from the lamp's foot on.
    builder.camera(camera(dvec3(0.0, 1.0, 0.0), DVec3::ZERO, 33.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let truth = Truth::new(&scene, |hit, _| {
        let p = hit.point.p.as_dvec3() + scene.origin;
        vec![0.0, f64::from(ALBEDO) / PI * f64::from(radiance) * lambert_irradiance(p, DVec3::Y, &corners)]
    });
    let mut family = Family::new("a lamp that touches the floor");
    for (name, method) in methods() {
        truth.compare(&mut family, name, method.as_ref(), Budget::samples(64), COLUMNS);
    }
    family.finish(0.9);
}

/// A lamp in the plane of the floor that it borders on lights nothing of it, however the plane is turned: connections are parallel to the surfaces
/// at both of their ends, at distances down to nothing.
#[test]
fn lamps_in_the_plane_of_the_floor() {
    for (i, axis) in [DVec3::Y, dvec3(0.3, 1.0, -0.2), dvec3(-0.7, 0.6, 0.5), dvec3(1e-4, 1.0, 1e-7)].iter().enumerate()
    {
        let up = axis.normalize();
        let u = up.any_orthonormal_vector();
        let v = up.cross(u);
        let mut builder = SceneBuilder::new("one plane");
        let grey = builder.material(lambert(ALBEDO));
        builder.quad(-u - v, u, v * 2.0, grey);
        let lamp = builder.quad(-v, u, v * 2.0, grey);
        builder.emit(lamp, Emission { two_sided: i % 2 == 0, ..shining(3.0) });
        builder.camera(camera(up * 1.5 - u * 0.3, u * -0.3, 50.0, 8));
        let scene = builder.build(Skip::Unneeded).unwrap();
        for (name, method) in methods() {
            let rendered = measure(&scene, method.as_ref(), name, Budget::samples(64).up_to(3));
            assert!(rendered.image(0).mean > 0.1, "{name}, turned {i}: the lamp is in the picture");
            for order in 1..rendered.measurement.layers.len() {
                let mean = rendered.image(order).mean;
                // What rounding tilts a direction by: a ten millionth of what a lamp overhead would bring.
                assert!(mean.abs() < 1.5e-7, "{name}, turned {i}, order {order}: {mean:e}");
            }
        }
    }
}

/// A ball of glass around a ball that shines, in equilibrium with the enclosure around both: n² times as bright, where radiance
/// is, so that nothing can be told apart. All the lamp's light goes through the glass.
fn glass_in_equilibrium(eye: DVec3, eta: f32) -> Scene {
    let mut builder = SceneBuilder::new("lamp in glass");
    let wall = builder.material(lambert(ALBEDO));
    enclosure(&mut builder, wall, EMITTED);
    let glass = builder.material(Bsdf::from(Dielectric { eta }));
    builder.sphere(dvec3(0.0, 0.0, -0.2), 0.6, glass);
    let inner = builder.sphere(dvec3(0.1, 0.0, -0.3), 0.2, wall);
    builder.emit(inner, shining(EMITTED * eta * eta));
    builder.camera(camera(eye, dvec3(0.1, 0.0, -0.3), 50.0, 8));
    builder.build(Skip::Unneeded).unwrap()
}

#[test]
fn a_lamp_and_a_camera_inside_glass() {
    let mut family = Family::new("lamp in glass");
    for eta in [1.5, 1.0 / 1.5] {
        let scene = glass_in_equilibrium(dvec3(0.0, 0.1, 0.9), eta);
        is_in_equilibrium(&mut family, &scene, &format!("index {eta}, from outside"), 64, EQUILIBRIUM);
        let scene = glass_in_equilibrium(dvec3(0.0, 0.1, 0.3), eta);
        let inside = EQUILIBRIUM * f64::from(eta * eta);
        is_in_equilibrium(&mut family, &scene, &format!("index {eta}, from inside"), 64, inside);
    }
    family.finish(0.9);
}

/// A furnace seen from this far from a wall, or from a corner.
pub(super) fn seen_from_a_wall(distance: f64, corner: bool) -> Scene {
    let eye = if corner { DVec3::splat(1.0 - distance) } else { dvec3(0.6, 0.5, 1.0 - distance) };
    let mut builder = furnace("camera at a wall", 8);
    // Away from the corner, where no ray looks beyond the walls.
    builder.camera(camera(eye, eye - DVec3::ONE, 40.0, 8));
    builder.build(Skip::Unneeded).unwrap()
}

/// A camera a millionth of the room from a wall, on it, and in a corner.
#[test]
fn a_camera_at_a_wall() {
    let mut family = Family::new("camera at a wall");
    for distance in [1e-3, 1e-6, 0.0] {
        for (name, corner) in [("wall", false), ("corner", true)] {
            let label = format!("{name} at {distance:e}");
            let scene = seen_from_a_wall(distance, corner);
            is_a_furnace(&mut family, &scene, &label, &ALL, 16, (ALBEDO, EMITTED));
        }
    }
    family.finish(0.9);
}

/// A point at a vanishing distance from three walls lights the others as if they were not there.
#[test]
fn a_point_in_a_corner() {
    let mut family = Family::new("point in a corner");
    let intensity = 2.0_f32;
    for distance in [1e-2, 1e-4, 1e-6] {
        let mut builder = SceneBuilder::new("point in a corner");
        let wall = builder.material(lambert(ALBEDO));
        enclosure(&mut builder, wall, 0.0);
        builder.point_emitter(DVec3::splat(1.0 - distance), sampling::math::Spectrum::splat(intensity));
        builder.camera(camera(DVec3::splat(0.5), DVec3::splat(-1.0), 50.0, 8));
        let scene = builder.build(Skip::Unneeded).unwrap();
        let lamp = DVec3::splat(1.0 - distance);
        let truth = Truth::new(&scene, |hit, _| {
            let p = hit.point.p.as_dvec3() + scene.origin;
            let d = lamp - p;
            let cosine = hit.point.ng.as_dvec3().dot(d.normalize());
            vec![0.0, f64::from(ALBEDO * intensity) / PI * cosine / d.length_squared()]
        });
        for name in ["direct", "path", "bdpt"] {
            truth.compare(&mut family, name, plain(name).as_ref(), Budget::samples(16), COLUMNS);
        }
    }
    family.finish(0.9);
}
