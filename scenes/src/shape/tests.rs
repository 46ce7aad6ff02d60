//! Disks and cylinders: where rays meet them, which side is the front, and their texture coordinates.

use crate::builder::SceneBuilder;
use crate::material::MaterialId;
use crate::needs::Skip;
use crate::ray::Ray;
use crate::scene::Scene;
use crate::shape::{Cylinder, Disk, ShapeId};
use crate::test_support::{Random, built, grey_builder};
use glam::{DAffine3, DMat3, DQuat, DVec3, dvec3};
use sampling::{Vec2, Vec3, vec2};
use std::f64::consts::TAU;

fn one(add: impl Fn(&mut SceneBuilder, MaterialId) -> ShapeId) -> Scene {
    let (mut builder, grey) = grey_builder("one shape");
    add(&mut builder, grey);
    built(builder, Skip::Unneeded)
}

const FROM: DVec3 = dvec3(0.2, -0.3, 0.1);
const ALONG: DVec3 = dvec3(0.4, 0.9, -0.3);
const RADIUS: f64 = 0.35;
const EDGES: [DVec3; 2] = [dvec3(0.7, 0.2, 0.1), dvec3(-0.3, 0.4, 0.5)];

/// The shape's equation along many rays: outside of it nothing is met, inside of it something is.
#[test]
fn rays_meet_what_the_equations_say() {
    let disk = one(|b, m| b.disk(FROM, EDGES[0], EDGES[1], m));
    let tube = one(|b, m| b.cylinder(FROM, FROM + ALONG, RADIUS, m));
    let basis = DMat3::from_cols(EDGES[0], EDGES[1], EDGES[0].cross(EDGES[1])).inverse();
    let mut random = Random::new(1);
    let mut met = [0, 0];
    for _ in 0..50_000 {
        let o = random.direction() * 2.0;
        let target = random.direction() * random.next_1d();
        let ray = Ray::new(o, (target - o).normalize());
        // The disk: in the basis of its edges it is the unit circle in the plane z = 0.
        let [o, d] = [basis * (ray.o.as_dvec3() - FROM), basis * ray.d.as_dvec3()];
        let t = -o.z / d.z;
        let radius = (o + d * t).truncate().length();
        if (radius - 1.0).abs() > 1e-5 {
            let hit = disk.intersect(&ray);
            assert_eq!(hit.is_some(), t > 0.0 && radius < 1.0, "{ray:?}");
            assert_eq!(disk.occluded(&ray), hit.is_some());
            if let Some(hit) = hit {
                assert!((f64::from(hit.t) - t).abs() < 1e-6 && hit.point.p.distance(ray.at(hit.t)) < 1e-6);
                met[0] += 1;
            }
        }
        // The tube: steps along the ray until the distance to the axis passes the radius within its length.
        let axis = ALONG.normalize();
        let at = |t: f64| {
            let offset = ray.o.as_dvec3() + ray.d.as_dvec3() * t - FROM;
            (offset.cross(axis).length() - RADIUS, offset.dot(axis))
        };
        let mut first = None;
        let mut unsure = false;
        let step = 2e-3;
        for i in 0..2000 {
            let t = f64::from(i) * step;
            let ((before, height), (after, _)) = (at(t), at(t + step));
            unsure |= before.abs() < 1e-4 && before.signum() == after.signum();
            if before.signum() != after.signum() {
                unsure |= height.abs() < 4.0 * step || (height - ALONG.length()).abs() < 4.0 * step;
                if (0.0..ALONG.length()).contains(&height) {
                    first = Some(t);
                    break;
                }
            }
        }
        if !unsure && met[1] < 2000 {
            let hit = tube.intersect(&ray);
            assert_eq!(hit.is_some(), first.is_some(), "{ray:?}");
            if let (Some(hit), Some(t)) = (hit, first) {
                assert!(f64::from(hit.t) > t - 1e-5 && f64::from(hit.t) < t + step + 1e-5, "{ray:?}");
                assert!(hit.point.ng.as_dvec3().dot(ALONG).abs() < 1e-6);
                met[1] += 1;
            }
        }
    }
    assert!(met[0] > 5000 && met[1] == 2000, "{met:?}");
}

#[test]
fn fronts_are_the_images_of_fronts() {
    let turn = DAffine3::from_scale_rotation_translation(
        DVec3::splat(2.0),
        DQuat::from_axis_angle(DVec3::ONE.normalize(), 0.7),
        dvec3(0.3, 0.1, -0.2),
    );
    let mirror = DAffine3::from_scale(dvec3(1.0, -1.0, 1.0));
    let skew = DAffine3::from_mat3(DMat3::from_cols(DVec3::X, dvec3(0.5, -1.0, 0.2), dvec3(0.1, 0.0, 3.0)));
    for (name, transform) in
        [("turned", turn), ("mirrored", turn * mirror), ("skewed", skew), ("plain", DAffine3::IDENTITY)]
    {
        for flip in [false, true] {
            let sign = if flip { -1.0 } else { 1.0 };
            let context = format!("{name}, flipped {flip}");
            let place = |builder: &mut SceneBuilder, shape: ShapeId| {
                builder.transform(shape, transform);
                if flip {
                    builder.flip(shape);
                }
                shape
            };
            let disk = one(|b, m| {
                let shape = b.disk(DVec3::ZERO, DVec3::X, DVec3::Y, m);
                place(b, shape)
            });
            // From a point before the image of the front.
            let [eye, target] = [dvec3(0.2, 0.1, 1.0), dvec3(0.2, 0.1, 0.0)].map(|p| transform.transform_point3(p));
            let o = (eye - disk.origin).as_vec3();
            let hit = disk.intersect(&Ray::new(o, (target - eye).as_vec3())).expect("the disk is there");
            assert!(f64::from((o - hit.point.p).dot(hit.point.ng)) * sign > 0.0, "disk {context}");
            assert!((hit.t - 1.0).abs() < 1e-5);
            if name == "skewed" {
                continue;
            }
            let tube = one(|b, m| {
                let shape = b.cylinder(DVec3::ZERO, DVec3::Z, 0.5, m);
                place(b, shape)
            });
            let [eye, target] = [dvec3(2.0, 0.1, 0.5), dvec3(0.0, 0.1, 0.5)].map(|p| transform.transform_point3(p));
            let o = (eye - tube.origin).as_vec3();
            let hit = tube.intersect(&Ray::new(o, (target - eye).as_vec3())).expect("the tube is there");
            assert!(f64::from((o - hit.point.p).dot(hit.point.ng)) * sign > 0.0, "tube {context}");
        }
    }
}

/// Places of known texture coordinates have them, and move as the derivatives say.
#[test]
fn texture_coordinates_are_the_documented_ones() {
    let disk = Disk::new(FROM, EDGES[0], EDGES[1], false).unwrap();
    let z = ALONG.normalize();
    let (x, y) = z.any_orthonormal_pair();
    let tube = Cylinder { from: FROM, axes: [x, y, z], length: ALONG.length(), radius: RADIUS, flipped: true };
    let on_disk = |u: f64, v: f64| {
        let (sin, cos) = (TAU * v).sin_cos();
        FROM + (EDGES[0] * cos + EDGES[1] * sin) * u
    };
    let on_tube = |u: f64, v: f64| {
        let (sin, cos) = (TAU * u).sin_cos();
        FROM + (x * cos + y * sin) * RADIUS + ALONG * v
    };
    let check = |name: &str, place: &dyn Fn(f64, f64) -> DVec3, uv: Vec2, d: [Vec3; 2], expected: (f64, f64)| {
        let (u, v) = expected;
        assert!((uv - vec2(u as f32, v as f32)).length() < 1e-5, "{name}: {uv} instead of {u} {v}");
        let h = 1e-5;
        let slopes = [place(u + h, v) - place(u - h, v), place(u, v + h) - place(u, v - h)].map(|d| d / (2.0 * h));
        for (given, slope) in d.into_iter().zip(slopes) {
            assert!(given.as_dvec3().distance(slope) < 1e-4, "{name}: {given} {slope}");
        }
    };
    let mut random = Random::new(3);
    for _ in 0..1000 {
        let (u, v) = (f64::from(random.next_1d()) * 0.98 + 0.01, f64::from(random.next_1d()) * 0.98 + 0.01);
        let p = on_disk(u, v).as_vec3();
        let derivatives = disk.derivatives(p);
        check("disk", &on_disk, disk.uv(p), [derivatives.dpdu, derivatives.dpdv], (u, v));
        let p = on_tube(u, v).as_vec3();
        let derivatives = tube.derivatives(p);
        check("tube", &on_tube, tube.uv(p), [derivatives.dpdu, derivatives.dpdv], (u, v));
    }
    assert!(disk.uv(FROM.as_vec3()).x < 1e-6);
    // Along z the angle is counted from x.
    let upright = one(|b, m| b.cylinder(DVec3::ZERO, DVec3::Z, 1.0, m));
    let crate::surface::Chart::Cylinder(upright) = &upright.analytic[0].chart else { panic!("no cylinder") };
    assert_eq!(upright.axes, DVec3::AXES);
}

/// Areas, bounds and samples of an ellipse and a tube against their equations.
#[test]
fn samples_lie_on_the_shape_within_its_bounds() {
    let disk = Disk::new(FROM, EDGES[0], EDGES[1], false).unwrap();
    let longest = (0..10_000)
        .map(|i| {
            let (sin, cos) = (TAU * f64::from(i) / 1e4).sin_cos();
            (EDGES[0] * cos + EDGES[1] * sin).length()
        })
        .fold(0.0, f64::max);
    assert!((disk.longest() - longest).abs() < 1e-6 * longest);
    let mut random = Random::new(4);
    let scenes =
        [one(|b, m| b.disk(FROM, EDGES[0], EDGES[1], m)), one(|b, m| b.cylinder(FROM, FROM + ALONG, RADIUS, m))];
    for scene in &scenes {
        for _ in 0..2000 {
            let eye = scene.bounds.center + random.direction() * 3.0;
            let target = scene.bounds.center + random.direction() * random.next_1d();
            if let Some(hit) = scene.intersect(&Ray::new(eye, target - eye)) {
                let distance = hit.point.p.distance(scene.bounds.center);
                assert!(distance <= scene.bounds.radius, "{distance} in {:?}", scene.bounds);
            }
        }
    }
    assert!(scenes[0].bounds.radius < 1.3 * longest as f32);
    for _ in 0..2000 {
        let at = disk.sample(random.next_2d());
        let offset = at.p.as_dvec3() - FROM;
        assert!(offset.dot(at.ng.as_dvec3()).abs() < 1e-6 && disk.uv(at.p).x <= 1.0);
    }
}
