//! Disks and cylinders, and surfaces whose emission varies: closed forms, and agreement with what is known.
//!
//! False-alarm rate: 0.1 % for each statistical test (Šidák over its methods, orders and blocks). The others are of fixed seeds
//! and of what may never happen.

use crate::support::{
    ALL, Budget, COLUMNS, Entry, Family, Truth, agree, camera, lambert, measure, method, plain, room, shining,
};
use glam::{DAffine3, DVec3, dvec3};
use sampling::math::{Frame, Spectrum};
use sampling::rng::Stream;
use sampling::{Vec2, Vec3, vec2, warp};
use scenes::texture::{Channel, Image, ImageTexture, UvMap, Wrap};
use scenes::{Emission, MaterialId, MeshData, Ray, Scene, SceneBuilder, ShapeId, Skip, Texture};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// A tube between two points closed by two disks, all fronts inside.
fn can(builder: &mut SceneBuilder, from: DVec3, to: DVec3, radius: f64, material: MaterialId) -> [ShapeId; 3] {
    let tube = builder.cylinder(from, to, radius, material);
    builder.flip(tube);
    let (x, y) = (to - from).normalize().any_orthonormal_pair();
    let bottom = builder.disk(from, x * radius, y * radius, material);
    let top = builder.disk(to, y * radius, x * radius, material);
    [tube, bottom, top]
}

/// A closed can that shines inside alike everywhere: order k is ρᵏ e.
#[test]
fn a_can_is_a_furnace() {
    let (albedo, emitted) = (0.6f32, 0.8f32);
    let mut builder = SceneBuilder::new("can");
    let wall = builder.material(lambert(albedo));
    for shape in can(&mut builder, dvec3(0.3, -0.9, 0.2), dvec3(-0.2, 0.9, -0.3), 0.7, wall) {
        builder.emit(shape, shining(emitted));
    }
    builder.camera(camera(dvec3(0.2, 0.1, 0.3), dvec3(-0.3, -0.6, -0.2), 80.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let truth = Truth::new(&scene, |_, _| (0..=8).map(|order| f64::from(emitted * albedo.powi(order))).collect());
    let mut family = Family::new(truth.name());
    for name in ALL {
        let budget = Budget::samples(if name == "light" { 128 } else { 32 });
        truth.compare(&mut family, name, plain(name).as_ref(), budget, COLUMNS);
    }
    family.finish(0.9);
}

/// A floor under a disk of radius r at height h: at distance a from its axis E = πL ½ (1 − (h² + a² − r²) / √((h² + a² + r²)² −
/// 4a²r²)), which is πL sin²θ on the axis (Hamilton & Morgan 1952).
#[test]
fn a_floor_under_a_disk() {
    let (albedo, emitted, height, radius) = (0.7, 3.0, 0.9, 0.5);
    let mut builder = SceneBuilder::new("floor under a disk");
    let grey = builder.material(lambert(albedo));
    builder.quad(dvec3(-3.0, 0.0, 3.0), dvec3(6.0, 0.0, 0.0), dvec3(0.0, 0.0, -6.0), grey);
    let black = builder.material(lambert(0.0));
    let lamp = builder.disk(dvec3(0.0, height, 0.0), DVec3::X * radius, DVec3::Z * radius, black);
    builder.emit(lamp, shining(emitted));
    builder.camera(camera(dvec3(0.4, 1.3, 1.6), dvec3(0.2, 0.0, 0.1), 30.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let truth = Truth::new(&scene, |hit, _| {
        let p = hit.point.p.as_dvec3() + scene.origin;
        assert!(p.y.abs() < 1e-6, "the lamp is not in the picture");
        let (a2, h2, r2) = (p.x * p.x + p.z * p.z, height * height, radius * radius);
        let root = ((h2 + a2 + r2).powi(2) - 4.0 * a2 * r2).sqrt();
        let irradiance = PI * f64::from(emitted) * 0.5 * (1.0 - (h2 + a2 - r2) / root);
        vec![0.0, f64::from(albedo) / PI * irradiance]
    });
    let mut family = Family::new(truth.name());
    for name in ALL {
        let budget = Budget::samples(if name == "light" { 256 } else { 32 });
        truth.compare(&mut family, name, method(name).as_ref(), budget, COLUMNS);
    }
    family.finish(0.9);
}

/// How the lamps of a room are made.
#[derive(Clone, Copy, PartialEq)]
enum Made {
    Analytic,
    /// Of so many flat pieces around that areas differ by 4·10⁻⁵.
    Tessellated,
}

const PIECES: u32 = 400;

/// A fan of triangles that is an ellipse, and a band that is a tube.
fn tessellated_disk(center: DVec3, edge_u: DVec3, edge_v: DVec3) -> MeshData {
    let rim = (0..PIECES).map(|i| {
        let (sin, cos) = (TAU * f64::from(i) / f64::from(PIECES)).sin_cos();
        center + edge_u * cos + edge_v * sin
    });
    let positions = std::iter::once(center).chain(rim).collect();
    let triangles = (0..PIECES).map(|i| [0, 1 + i, 1 + (i + 1) % PIECES]).collect();
    MeshData { positions, triangles, ..MeshData::default() }
}

fn tessellated_tube(from: DVec3, to: DVec3, radius: f64) -> MeshData {
    let (x, y) = (to - from).normalize().any_orthonormal_pair();
    let around = |end: DVec3| {
        (0..PIECES).map(move |i| {
            let (sin, cos) = (TAU * f64::from(i) / f64::from(PIECES)).sin_cos();
            end + (x * cos + y * sin) * radius
        })
    };
    let positions = around(from).chain(around(to)).collect();
    let quad = |i: u32| {
        let j = (i + 1) % PIECES;
        [[i, j, PIECES + j], [i, PIECES + j, PIECES + i]]
    };
    MeshData { positions, triangles: (0..PIECES).flat_map(quad).collect(), ..MeshData::default() }
}

/// A room with an elliptic lamp and a tube that shines on both sides, and a plain tube and a plain disk in their light.
fn furnished(made: Made) -> Scene {
    let mut builder = room(if made == Made::Analytic { "analytic room" } else { "tessellated room" });
    let grey = builder.material(lambert(0.5));
    let disk = |builder: &mut SceneBuilder, center: DVec3, u: DVec3, v: DVec3| match made {
        Made::Analytic => builder.disk(center, u, v, grey),
        Made::Tessellated => builder.mesh(tessellated_disk(center, u, v), grey),
    };
    let tube = |builder: &mut SceneBuilder, from: DVec3, to: DVec3, radius: f64| match made {
        Made::Analytic => builder.cylinder(from, to, radius, grey),
        Made::Tessellated => builder.mesh(tessellated_tube(from, to, radius), grey),
    };
    let lamp = disk(&mut builder, dvec3(0.1, 0.85, 0.0), dvec3(0.6, 0.05, 0.0), dvec3(0.1, 0.0, 0.3));
    builder.emit(lamp, shining(5.0));
    let ring = tube(&mut builder, dvec3(0.5, -0.6, 0.1), dvec3(0.7, -0.3, 0.4), 0.2);
    builder.emit(ring, Emission { radiance: Texture::Constant(Spectrum::splat(1.5)), two_sided: true });
    tube(&mut builder, dvec3(-0.6, -1.0, -0.2), dvec3(-0.5, 0.2, 0.0), 0.25);
    disk(&mut builder, dvec3(-0.1, -0.4, 0.3), dvec3(0.3, 0.1, 0.0), dvec3(0.0, 0.2, 0.4));
    builder.build(Skip::Unneeded).unwrap()
}

#[test]
fn analytic_shapes_are_what_fine_meshes_approach() {
    let mut family = Family::new("analytic and tessellated");
    let budget = Budget::samples(32).up_to(3);
    let meshes = measure(&furnished(Made::Tessellated), method("path").as_ref(), "tessellated", budget);
    let scene = furnished(Made::Analytic);
    for (name, samples) in [("direct", 32), ("path", 32), ("light", 64), ("bdpt", 12)] {
        let method = method(name);
        let budget = Budget::samples(samples).up_to(3);
        let rendered = measure(&scene, method.as_ref(), &format!("analytic {name}"), budget);
        for order in method.orders(3) {
            let label = format!("{name} order {order}");
            family.image(&label, rendered.image(order), meshes.image(order));
            for (i, block) in rendered.blocks(COLUMNS).iter().enumerate() {
                family.block(format!("{label} block {i}"), rendered.over(order, block), meshes.over(order, block));
            }
        }
    }
    family.finish(0.8);
}

/// An image of one column with these greys from top to bottom, linear between the centres of its texels.
fn column(greys: &[f32]) -> Texture {
    let texels = greys.iter().map(|&grey| [grey, grey, grey, 1.0]).collect();
    let image = Arc::new(Image::from_linear(1, greys.len() as u32, texels).unwrap());
    let (map, channel) = (UvMap::default(), Channel::Colour);
    Texture::Image(ImageTexture { image, wrap: Wrap::Clamp, map, channel, scale: Spectrum::ONE })
}

/// A sphere that shines inside by an image over its latitude: L₀ = e(x), L_k = ρᵏ ē, with ē the mean over the area.
#[test]
fn an_integrating_sphere_with_an_emission_map() {
    let (radius, albedo) = (1.5, 0.6f32);
    let greys = [0.2f32, 1.5, 0.5, 0.1];
    let emitted = |latitude: f64| {
        // Row 0 is at the north, where the latitude is 1.
        let place = (4.0 * (1.0 - latitude) - 0.5).clamp(0.0, 3.0);
        let row = (place.floor() as usize).min(2);
        f64::from(greys[row]) + f64::from(greys[row + 1] - greys[row]) * (place - row as f64)
    };
    let mut builder = SceneBuilder::new("emission map");
    let wall = builder.material(lambert(albedo));
    let sphere = builder.sphere(DVec3::ZERO, radius, wall);
    builder.flip(sphere);
    builder.emit(sphere, Emission { radiance: column(&greys), two_sided: false });
    builder.camera(camera(dvec3(0.4, 0.1, 0.05), dvec3(-1.0, 0.3, 0.0), 24.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    // The midpoint rule over the latitude; the area goes with its sine.
    let steps = 100_000;
    let angle = |i: u32| PI * (f64::from(i) + 0.5) / f64::from(steps);
    let mean =
        (0..steps).map(|i| emitted(1.0 - angle(i) / PI) * angle(i).sin()).sum::<f64>() * 0.5 * PI / f64::from(steps);
    let truth = Truth::new(&scene, |hit, _| {
        let latitude = 1.0 - (hit.point.p.as_dvec3().z / radius).acos() / PI;
        assert!((0.375..=0.625).contains(&latitude), "the view stays where the image is linear: {latitude}");
        let higher = (1..=6).map(|k| f64::from(albedo).powi(k) * mean);
        std::iter::once(emitted(latitude)).chain(higher).collect()
    });
    let mut family = Family::new(truth.name());
    for name in ALL {
        let budget = Budget::samples(if name == "light" { 256 } else { 32 });
        truth.compare(&mut family, name, plain(name).as_ref(), budget, COLUMNS);
    }
    family.finish(0.9);
}

/// Pictures that shine, on a mirrored quad and a tube, seen by the camera and lighting a room: all methods agree.
#[test]
fn emission_maps_in_a_room() {
    let mut builder = room("emission maps in a room");
    let grey = builder.material(lambert(0.3));
    let board = |scale: Vec2| Texture::Checkerboard {
        values: [Spectrum::new(6.0, 3.0, 1.0), Spectrum::splat(0.2)],
        map: UvMap { scale, offset: vec2(0.1, 0.0) },
    };
    // It stands upright before the camera.
    let screen = builder.quad(dvec3(-0.7, -0.5, 0.1), dvec3(0.1, 0.9, 0.0), dvec3(0.5, 0.0, 0.3), grey);
    builder.transform(screen, DAffine3::from_scale(dvec3(1.0, 1.0, -1.0)));
    builder.emit(screen, Emission { radiance: board(vec2(1.0, 0.5)), two_sided: true });
    let tube = builder.cylinder(dvec3(0.5, -0.7, 0.0), dvec3(0.6, 0.2, 0.2), 0.2, grey);
    builder.emit(tube, Emission { radiance: board(vec2(1.0, 2.0)), two_sided: false });
    let scene = builder.build(Skip::Unneeded).unwrap();
    assert!(scene.needs.textures);
    let entries = [
        Entry::new("direct", 32).by_night(2),
        Entry::new("path", 32).without_roulette().by_night(2),
        Entry::new("light", 64).without_roulette().by_night(2),
        Entry::new("bdpt", 12).without_roulette().by_night(2),
    ];
    agree("emission maps in a room", &scene, 4, &entries, 0.9);
}

/// Random numbers.
struct Random(Stream);

impl Random {
    fn pair(&mut self) -> Vec2 {
        let x = self.0.next_f32();
        vec2(x, self.0.next_f32())
    }

    fn direction(&mut self) -> Vec3 {
        warp::uniform_sphere(self.pair())
    }

    /// A direction above a surface, often nearly along it.
    fn leaving(&mut self, normal: Vec3) -> Vec3 {
        let mut local = warp::cosine_hemisphere(self.pair());
        if self.0.next_f32() < 0.4 {
            local.z *= 1e-4;
        }
        Frame::from_z(normal).to_world(local.normalize())
    }
}

/// Scales from 10⁻⁶ to 10⁶, each at the origin, beside it and far from it.
fn places() -> impl Iterator<Item = (f64, DVec3)> {
    let at = [DVec3::ZERO, dvec3(1.0, 0.5, -2.0), dvec3(1e5, 0.0, 0.0)];
    (-6..=6).flat_map(move |exponent| at.map(|place| (10f64.powi(exponent), place * 10f64.powi(exponent))))
}

/// A scene of one thing, and the place that was the origin.
fn alone(add: impl Fn(&mut SceneBuilder, MaterialId), place: DVec3) -> (Scene, Vec3) {
    let mut builder = SceneBuilder::new("alone");
    let grey = builder.material(lambert(0.5));
    add(&mut builder, grey);
    builder.camera(camera(place + DVec3::Z, place, 40.0, 4));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let center = (place - scene.origin).as_vec3();
    (scene, center)
}

/// A million rays from within a can, at any scale.
#[test]
fn nothing_escapes_from_a_can() {
    let mut random = Random(Stream::new(1, 1));
    let (from, to) = (dvec3(-0.3, -0.5, 0.1), dvec3(0.3, 0.5, -0.1));
    for (scale, place) in places() {
        let build = |b: &mut SceneBuilder, m: MaterialId| {
            can(b, place + from * scale, place + to * scale, 0.6 * scale, m);
        };
        let (scene, center) = alone(build, place);
        for _ in 0..26_000 {
            let o = center + random.direction() * (0.45 * scale as f32 * random.0.next_f32());
            let ray = Ray::new(o, random.direction());
            let hit = scene.intersect(&ray).unwrap_or_else(|| panic!("scale {scale}, at {place}: {ray:?} escaped"));
            assert!(hit.point.ng.dot(ray.d) < 0.0, "scale {scale}, at {place}: {ray:?} met a back");
            assert!(scene.occluded(&ray), "scale {scale}, at {place}: {ray:?} is not occluded");
        }
    }
}

/// What leaves a disk on either side meets nothing; nor does what leaves a tube outwards; what leaves it inwards meets it no sooner
/// than its far side.
#[test]
fn rays_that_leave_a_surface_do_not_meet_it_again() {
    let mut random = Random(Stream::new(2, 1));
    let (from, along, radius) = (dvec3(-0.3, -0.5, 0.1), dvec3(0.5, 0.9, -0.3), 0.4);
    for (scale, place) in places() {
        let disk = |u: DVec3, v: DVec3| alone(|b, m| _ = b.disk(place + from * scale, u * scale, v * scale, m), place);
        let tube = |b: &mut SceneBuilder, m: MaterialId| {
            let from = place + from * scale;
            b.cylinder(from, from + along * scale, radius * scale, m);
        };
        let scenes = [
            ("disk", disk(dvec3(0.6, 0.0, 0.8), dvec3(0.8, 0.0, -0.6))),
            ("ellipse", disk(dvec3(0.9, 0.3, -0.2), dvec3(0.0, 0.02, 0.1))),
            ("tube", alone(tube, place)),
        ];
        for (kind, (scene, center)) in &scenes {
            let (mut met, mut chords) = (0, 0);
            for _ in 0..4000 {
                let context = format!("{kind} at scale {scale}, at {place}");
                let target = *center + random.direction() * (scale as f32 * random.0.next_f32());
                let o = *center + random.direction() * (3.0 * scale as f32);
                let Some(hit) = scene.intersect(&Ray::new(o, (target - o).normalize())) else { continue };
                met += 1;
                for side in [1.0, -1.0] {
                    let normal = hit.point.ng * side;
                    let d = random.leaving(normal);
                    let again = scene.intersect(&hit.point.spawn(d));
                    let shaded = scene.occluded(&hit.point.spawn(d));
                    assert_eq!(again.is_some(), shaded, "{context}");
                    let Some(again) = again else { continue };
                    assert!(*kind == "tube" && side < 0.0, "{context}: {d} from {:?} met {:?}", hit.point, again.point);
                    let axis = along.normalize().as_vec3();
                    let across = (d - axis * d.dot(axis)).length_squared();
                    let chord = 2.0 * (radius * scale) as f32 * normal.dot(d) / across;
                    assert!(again.t > 0.9 * chord, "{context}: {d} met at {} of {chord}", again.t);
                    chords += 1;
                }
            }
            assert!(met > 100 && (*kind != "tube" || chords > 100), "{kind}: {met} {chords}");
        }
    }
}

/// An octahedron whose faces are cut in four, twice, with all corners on a sphere.
fn ball_of_triangles(center: DVec3, radius: f64) -> MeshData {
    let mut faces: Vec<[DVec3; 3]> = Vec::new();
    for i in 0..8 {
        let sign = |bit: usize| if i >> bit & 1 == 0 { 1.0 } else { -1.0 };
        let [x, y, z] = [DVec3::X * sign(0), DVec3::Y * sign(1), DVec3::Z * sign(2)];
        faces.push(if sign(0) * sign(1) * sign(2) > 0.0 { [x, y, z] } else { [x, z, y] });
    }
    for _ in 0..2 {
        let quarters = |[a, b, c]: [DVec3; 3]| {
            let [ab, bc, ca] = [a + b, b + c, c + a].map(DVec3::normalize);
            [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
        };
        faces = faces.into_iter().flat_map(quarters).collect();
    }
    let positions: Vec<DVec3> = faces.iter().flatten().map(|corner| center + *corner * radius).collect();
    let triangles = (0..faces.len() as u32).map(|face| [0, 1, 2].map(|corner| 3 * face + corner)).collect();
    MeshData { positions, triangles, ..MeshData::default() }
}

/// What leaves a convex body of triangles, searched by its tree, meets nothing outwards, and the body inwards.
#[test]
fn rays_that_leave_a_ball_of_triangles_meet_it_inwards_only() {
    let mut random = Random(Stream::new(3, 1));
    for (scale, place) in places() {
        let (scene, center) = alone(|b, m| _ = b.mesh(ball_of_triangles(place, scale), m), place);
        assert!(!scene.needs.few_primitives);
        for _ in 0..4000 {
            let context = format!("at scale {scale}, at {place}");
            let o = center + random.direction() * (3.0 * scale as f32);
            let target = center + random.direction() * (0.9 * scale as f32);
            let Some(hit) = scene.intersect(&Ray::new(o, (target - o).normalize())) else {
                panic!("{context}: the ball is missed from {o} to {target}")
            };
            let outwards = hit.point.ng * hit.point.ng.dot(hit.point.p - center).signum();
            for (normal, within) in [(outwards, false), (-outwards, true)] {
                let d = random.leaving(normal);
                let ray = hit.point.spawn(d);
                assert_eq!(scene.intersect(&ray).is_some(), within, "{context}: {d} from {:?}", hit.point);
                assert_eq!(scene.occluded(&ray), within, "{context}: {d} from {:?}", hit.point);
            }
        }
    }
}
