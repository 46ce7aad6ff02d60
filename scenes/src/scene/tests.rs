use super::*;
use crate::builder::{Emission, MeshData};
use crate::interaction::Normals;
use crate::needs::Skip;
use crate::test_support::{Random, add_room, built, bumpy_ball, grey_builder};
use crate::texture::{Texture, UvMap};
use glam::{DAffine3, dvec3};
use sampling::bsdf::Bsdf;
use sampling::warp::cosine_hemisphere;
use sampling::{vec2, vec3};

/// A room with a ball in it, at a scale and a place.
fn room_and_ball(scale: f64, place: DVec3) -> Scene {
    let (mut builder, grey) = grey_builder("room");
    add_room(&mut builder, place - scale, place + scale, grey);
    builder.sphere(place + dvec3(0.3, -0.2, 0.1) * scale, 0.4 * scale, grey);
    built(builder, Skip::Unneeded)
}

#[test]
fn rays_leave_their_surface_at_every_scale() {
    for exponent in -6..=6 {
        for place in [DVec3::ZERO, dvec3(1.0, 0.5, -2.0), dvec3(1e5, 0.0, 0.0)] {
            let scale = 10f64.powi(exponent);
            let place = place * scale;
            let scene = room_and_ball(scale, place);
            let mut random = Random::new(1);
            let center = (place - scene.origin).as_vec3();
            let mut ray = Ray::new(center - vec3(0.7, 0.0, 0.0) * scale as f32, random.direction());
            let mut grazing = 0;
            for step in 0..20_000 {
                let context = || format!("scale {scale}, at {place}, step {step}, {ray:?}");
                let it = scene.intersect(&ray).unwrap_or_else(|| panic!("escaped: {}", context()));
                let on_ball = (it.point.p - center).length() < 0.999 * scale as f32
                    && !it.point.ng.abs().to_array().contains(&1.0);
                let front = it.point.ng.dot(ray.d) < 0.0;
                assert!(front, "met from behind: {}", context());
                // Often nearly along the surface.
                let mut local = cosine_hemisphere(random.next_2d());
                if random.next_1d() < 0.3 {
                    local.z *= 1e-4;
                    local = local.normalize();
                    grazing += 1;
                }
                let d = it.frame.to_world(local);
                let next = it.point.spawn(d);
                if let Some(hit) = scene.intersect(&next) {
                    let same_plane = !on_ball && hit.point.ng == it.point.ng;
                    assert!(!same_plane, "met its own wall: {}", context());
                    let still_there = hit.point.p == it.point.p && hit.point.ng.dot(it.point.ng) > 0.9;
                    assert!(!still_there, "met itself: {}", context());
                }
                ray = next;
            }
            assert!(grazing > 1000);
        }
    }
}

#[test]
fn points_of_convex_surfaces_see_one_another_at_every_scale() {
    for exponent in -6..=6 {
        let scale = 10f64.powi(exponent);
        let place = dvec3(0.3, -0.7, 2.0) * scale;
        for kind in ["room", "sphere"] {
            let (mut builder, grey) = grey_builder(kind);
            if kind == "room" {
                add_room(&mut builder, place - scale, place + scale, grey);
            } else {
                let shape = builder.sphere(place, scale, grey);
                builder.flip(shape);
            }
            let scene = built(builder, Skip::Unneeded);
            let center = (place - scene.origin).as_vec3();
            let mut random = Random::new(2);
            let mut hit = || scene.intersect(&Ray::new(center, random.direction())).expect("it is closed").point;
            for _ in 0..20_000 {
                let (a, b) = (hit(), hit());
                if a.ng.dot(b.ng) > 0.999 {
                    continue; // In one plane: neither sees the other.
                }
                assert!(!scene.occluded(&a.segment_to(&b)), "{kind} at scale {scale}: {a:?} {b:?}");
                if a.ng.dot(b.ng) > 0.5 {
                    continue; // The straight way past the surface might leave it at once.
                }
                let beyond = SurfacePoint::free(b.p - b.ng * (0.01 * scale) as f32);
                assert!(scene.occluded(&a.segment_to(&beyond)), "{kind} at scale {scale}: {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn a_ball_does_not_shade_itself() {
    for (radius, distance) in [(1.0, 0.0), (1e-3, 1.0), (1e6, 0.0), (1e-6, 1e-3)] {
        let (mut builder, grey) = grey_builder("ball");
        builder.sphere(dvec3(distance, 0.0, 0.0), radius, grey);
        if distance > 0.0 {
            builder.sphere(dvec3(-distance, 0.0, 0.0), radius * 1e-3, grey);
        }
        let scene = built(builder, Skip::Unneeded);
        let center = (dvec3(distance, 0.0, 0.0) - scene.origin).as_vec3();
        let mut random = Random::new(3);
        for _ in 0..20_000 {
            let n = random.direction();
            let o = center + n * (2.0 * radius as f32);
            let Some(it) = scene.intersect(&Ray::new(o, -n)) else { panic!("missed {radius} at {distance}") };
            let mut local = cosine_hemisphere(random.next_2d());
            local.z *= 1e-3;
            let d = it.frame.to_world(local.normalize());
            assert!(!scene.occluded(&it.point.spawn(d)), "{radius} at {distance}");
            let through = scene.intersect(&it.point.spawn(-it.point.ng)).expect("the far side");
            assert!(
                (through.t / (2.0 * radius as f32) - 1.0).abs() < 2e-3,
                "{} through {radius} at {distance}",
                through.t
            );
        }
    }
}

#[test]
fn mirrored_shapes_keep_their_front() {
    let triangle = || MeshData {
        positions: vec![dvec3(0.0, 0.0, 0.0), dvec3(1.0, 0.0, 0.0), dvec3(0.0, 1.0, 0.0)],
        triangles: vec![[0, 1, 2]],
        normals: vec![Vec3::Z; 3],
        ..MeshData::default()
    };
    let mirror_x = DAffine3::from_scale(dvec3(-1.0, 1.0, 1.0));
    let mirror_z = DAffine3::from_scale(dvec3(1.0, 1.0, -1.0));
    for (transform, flip, expected) in [
        (DAffine3::IDENTITY, false, 1.0),
        (DAffine3::IDENTITY, true, -1.0),
        (mirror_x, false, 1.0),
        (mirror_x, true, -1.0),
        (mirror_z, false, -1.0),
        (mirror_z * mirror_x, false, -1.0),
    ] {
        for quad in [false, true] {
            let (mut builder, grey) = grey_builder("mirrored");
            let shape =
                if quad { builder.quad(DVec3::ZERO, DVec3::X, DVec3::Y, grey) } else { builder.mesh(triangle(), grey) };
            builder.emit(shape, Emission { radiance: 1.0.into(), two_sided: false });
            builder.transform(shape, transform);
            if flip {
                builder.flip(shape);
            }
            let scene = built(builder, Skip::Unneeded);
            let target = transform.transform_point3(dvec3(0.2, 0.2, 0.0)).as_vec3();
            for side in [1.0, -1.0] {
                let ray = Ray::new(target + Vec3::Z * side, -Vec3::Z * side);
                let it = scene.intersect(&ray).expect("it is there");
                let context = format!("{transform:?} flipped {flip} quad {quad}");
                assert_eq!(it.point.ng.z, expected, "{context}");
                assert_eq!(it.ns().z, expected, "{context}");
                let emits = !scene.le(&it, -ray.d).is_zero();
                assert_eq!(emits, side == expected, "{context}");
                let connects = scene.sample_li(EmitterId(0), ray.o, vec2(0.3, 0.4)).is_some();
                assert_eq!(connects, emits, "{context}");
            }
            let walk = scene.sample_le(EmitterId(0), vec2(0.3, 0.4), vec2(0.7, 0.2)).expect("it emits");
            assert_eq!(walk.ray.d.z > 0.0, expected > 0.0);
        }
    }
}

#[test]
fn meshes_without_normals_are_flat_and_those_with_are_smooth() {
    let ball = bumpy_ball(12);
    let mut smooth = ball.clone();
    smooth.normals = ball.positions.iter().map(|p| -p.normalize().as_vec3()).collect();
    let scenes = [ball, smooth].map(|mesh| {
        let (mut builder, grey) = grey_builder("ball");
        builder.mesh(mesh, grey);
        built(builder, Skip::Unneeded)
    });
    let mut random = Random::new(4);
    for _ in 0..2000 {
        let ray = Ray::new(Vec3::ZERO, random.direction());
        let [flat, smooth] = [&scenes[0], &scenes[1]].map(|scene| scene.intersect(&ray).expect("it is closed"));
        assert_eq!(flat.ns(), flat.point.ng);
        assert_eq!((flat.normals, smooth.normals), (Normals::Flat, Normals::Smooth));
        assert_eq!(flat.point.p, smooth.point.p);
        // The given normals point inwards, the front is outside: they are turned.
        let radial = smooth.point.p.normalize();
        assert!(smooth.point.ng.dot(smooth.ns()) >= 0.0);
        assert!(smooth.ns().dot(radial).abs() > 0.99);
    }
}

#[test]
fn what_vertices_carry_is_interpolated_in_the_given_order() {
    // Three of the ways to list the two triangles of a unit square, whose uv is its xy, and so is its colour.
    for lists in [[[0, 1, 2], [0, 2, 3]], [[1, 2, 0], [2, 3, 0]], [[2, 0, 1], [3, 0, 2]]] {
        let (mut builder, _) = grey_builder("square");
        let coloured = builder.material(Material::lambert(Texture::VertexColour));
        let values = [Spectrum::ZERO, Spectrum::ONE];
        let board = builder.material(Material::lambert(Texture::Checkerboard { values, map: UvMap::default() }));
        let positions = vec![dvec3(0., 0., 0.), dvec3(1., 0., 0.), dvec3(1., 1., 0.), dvec3(0., 1., 0.)];
        let uvs = positions.iter().map(|p| p.as_vec3().truncate()).collect();
        let colours = positions.iter().map(|p| Spectrum::new(p.x as f32, p.y as f32, 0.0)).collect();
        let mesh = MeshData { positions, triangles: lists.to_vec(), uvs, colours, ..MeshData::default() };
        let second = builder.mesh(mesh.clone(), board);
        builder.transform(second, DAffine3::from_translation(dvec3(0.0, 0.0, -1.0)));
        builder.mesh(mesh, coloured);
        let scene = built(builder, Skip::Unneeded);
        let mut random = Random::new(5);
        for _ in 0..1000 {
            let target = random.next_2d();
            let ray = Ray::new(target.extend(1.0), -Vec3::Z);
            let it = scene.intersect(&ray).expect("it is there");
            let albedo = |it: &Interaction| match it.bsdf {
                Bsdf::Lambert(lambert) => lambert.albedo.to_array(),
                _ => panic!("it is Lambertian"),
            };
            let [x, y, _] = albedo(&it);
            assert!((vec2(x, y) - target).length() < 1e-6, "{x} {y} {target}");
            assert!((it.point.p - target.extend(0.0)).length() < 1e-6);
            let below = scene.intersect(&it.point.spawn(-Vec3::Z)).expect("it is there");
            assert_eq!(albedo(&below)[0], f32::from((target.x < 0.5) != (target.y < 0.5)));
        }
    }
}
