//! Triangles and balls that are thin, flat, doubled, tiny or huge.

use super::{ALBEDO, EMITTED, EQUILIBRIUM, furnace, is_a_furnace, is_in_equilibrium};
use crate::support::{ALL, Budget, Family, block, camera, is_night, lambert, measure, method, plain, shining};
use glam::{DAffine3, DQuat, DVec3, Vec3Swizzles, dvec3};
use sampling::bsdf::{Bsdf, Dielectric, Mirror};
use sampling::math::Spectrum;
use sampling::rng::Stream;
use sampling::{Vec3, vec2, vec3, warp};
use scenes::{EmitterId, MeshData, Ray, Scene, SceneBuilder, Skip};
use std::f64::consts::TAU;

/// An enclosure whose walls are fans of slivers: a thousand triangles each from one corner, along which rays may slip out.
pub(super) fn walls_of_slivers(slivers: u32) -> Scene {
    let mut builder = SceneBuilder::new("slivers");
    let wall = builder.material(lambert(ALBEDO));
    let (x, y, z) = (DVec3::X * 2.0, DVec3::Y * 2.0, DVec3::Z * 2.0);
    let (low, high) = (DVec3::splat(-1.0), DVec3::splat(1.0));
    for (corner, u, v) in [(low, z, x), (low, x, y), (low, y, z), (high, -x, -z), (high, -y, -x), (high, -z, -y)] {
        // From the corner to points along the two sides that do not touch it.
        let along = |i: u32| {
            let t = f64::from(i) / f64::from(slivers / 2);
            if t <= 1.0 { corner + u + v * t } else { corner + v + u * (2.0 - t) }
        };
        let positions = std::iter::once(corner).chain((0..=slivers).map(along)).collect();
        let triangles = (1..=slivers).map(|i| [0, i, i + 1]).collect();
        let mesh = builder.mesh(MeshData { positions, triangles, ..MeshData::default() }, wall);
        builder.emit(mesh, shining(EMITTED));
    }
    builder.camera(camera(dvec3(0.1, 0.2, 0.85), dvec3(0.0, 0.0, -1.0), 70.0, 8));
    builder.build(Skip::Unneeded).unwrap()
}

#[test]
fn walls_of_slivers_are_closed() {
    let mut family = Family::new("slivers");
    is_a_furnace(&mut family, &walls_of_slivers(400), "slivers", &ALL, 16, (ALBEDO, EMITTED));
    family.finish(0.9);
}

/// Every pixel of every order by a method of a room with this mesh in it.
fn image_of(mesh: MeshData, name: &str) -> Vec<[u64; 3]> {
    let mut builder = crate::support::room("mesh in a room");
    let [grey, black] = [0.6, 0.0].map(|albedo| builder.material(lambert(albedo)));
    builder.mesh(mesh, grey);
    let lamp = builder.quad(dvec3(-0.4, 0.95, -0.4), DVec3::X * 0.8, DVec3::Z * 0.8, black);
    builder.emit(lamp, shining(3.0));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let budget = Budget { samples: 4, replicates: 2, ..Budget::samples(1).up_to(4) };
    let measurement = measure(&scene, method(name).as_ref(), name, budget).measurement;
    let layers = 0..measurement.layers.len();
    let places = layers.flat_map(|layer| (0..measurement.pixels()).map(move |pixel| (layer, pixel)));
    places.map(|(layer, pixel)| measurement.mean(layer, pixel).map(f64::to_bits)).collect()
}

/// A wavy sheet over the floor.
fn sheet() -> MeshData {
    const N: u32 = 12;
    let at = |i: u32| -0.8 + 1.6 * f64::from(i) / f64::from(N);
    let height = |x: f64, z: f64| -0.6 + 0.2 * (5.0 * x).sin() * (4.0 * z).cos();
    let grid = (0..=N).flat_map(|i| (0..=N).map(move |j| (at(i), at(j))));
    let positions = grid.map(|(x, z)| dvec3(x, height(x, z), z)).collect();
    let corner = |i: u32, j: u32| i * (N + 1) + j;
    let cells = (0..N).flat_map(|i| (0..N).map(move |j| (i, j)));
    let triangles = cells.flat_map(|(i, j)| {
        let [a, b, c, d] = [corner(i, j), corner(i, j + 1), corner(i + 1, j + 1), corner(i + 1, j)];
        [[a, b, c], [a, c, d]]
    });
    MeshData { positions, triangles: triangles.collect(), ..MeshData::default() }
}

/// Triangles without area are not there, and what is there twice, in whatever order, is there once.
#[test]
fn flat_and_doubled_triangles_change_no_bit() {
    let mut odd = sheet();
    let count = odd.triangles.len();
    for i in (0..count).step_by(3) {
        let [a, b, c] = odd.triangles[i];
        odd.triangles.extend([[a, a, b], [c, c, c], [a, b, a]]);
        // A point on an edge: three corners on a line.
        let middle = (odd.positions[a as usize] + odd.positions[b as usize]) * 0.5;
        odd.positions.push(middle);
        odd.triangles.push([a, odd.positions.len() as u32 - 1, b]);
    }
    let mut doubled = sheet();
    doubled.triangles.extend(sheet().triangles.iter().rev().copied());
    for name in ALL {
        let plain = image_of(sheet(), name);
        assert!(plain == image_of(odd.clone(), name), "{name}: triangles without area");
        assert!(plain == image_of(doubled.clone(), name), "{name}: triangles that are there twice");
    }
}

/// Vertex normals that point the other way than the front do not turn a surface inside out.
#[test]
fn normals_opposite_to_the_winding() {
    let mesh = |sign: f32| {
        let mut mesh = sheet();
        let normal = |p: &DVec3| {
            let (x, z) = (p.x, p.z);
            let slope_x = (5.0 * x).cos() * (4.0 * z).cos();
            let slope_z = -0.8 * (5.0 * x).sin() * (4.0 * z).sin();
            dvec3(-slope_x, 1.0, -slope_z).normalize().as_vec3() * sign
        };
        mesh.normals = mesh.positions.iter().map(normal).collect();
        mesh
    };
    for name in ALL {
        assert!(image_of(mesh(1.0), name) == image_of(mesh(-1.0), name), "{name}");
    }
}

/// A ball of this radius, seen from so far outside its surface, or inside, in a ball `around` which shines alike; where it is made of what the
/// walls are, it shines as they do.
pub(super) fn ball_in_a_furnace(radius: f64, distance: f64, around: f64, material: Option<Bsdf>) -> Scene {
    let mut builder = SceneBuilder::new("ball");
    let wall = builder.material(lambert(ALBEDO));
    let centre = dvec3(0.0, 0.0, -(radius + distance));
    let around = builder.sphere(centre, around, wall);
    builder.flip(around);
    builder.emit(around, shining(EMITTED));
    let surface = material.map_or(wall, |bsdf| builder.material(bsdf));
    let ball = builder.sphere(centre, radius, surface);
    if material.is_none() {
        builder.emit(ball, scenes::Emission { two_sided: true, ..shining(EMITTED) });
    }
    builder.camera(camera(DVec3::ZERO, dvec3(0.02, 0.01, -1.0) * radius, 90.0, 8));
    builder.build(Skip::Unneeded).unwrap()
}

/// Balls from a millionth to a million times the distance of who looks at them, from outside, from inside and from their surface, in an
/// enclosure that shines alike: matte ones that shine as it does, and mirrors and glass, which show it.
#[test]
fn balls_of_every_size() {
    let mut family = Family::new("balls");
    for exponent in [-6, -3, 0, 3, 6] {
        let radius = 10f64.powi(exponent);
        for (place, distance) in [("far outside", 1.0), ("at its surface", 1e-5), ("inside", -0.3 * radius)] {
            let scene = ball_in_a_furnace(radius, distance, 2.0 * (radius + distance.abs()) + 1.0, None);
            let label = format!("ball of 1e{exponent}, {place}");
            is_a_furnace(&mut family, &scene, &label, &["direct", "path", "bdpt"], 4, (ALBEDO, EMITTED));
        }
    }
    for exponent in [-3, 0, 3] {
        let radius = 10f64.powi(exponent);
        let mirror = Bsdf::from(Mirror { reflectance: Spectrum::ONE });
        let glass = Bsdf::from(Dielectric { eta: 1.5 });
        for (name, material, inside) in [("mirror", mirror, false), ("glass", glass, false), ("glass", glass, true)] {
            let distance = if inside { -0.3 * radius } else { 0.3 * radius };
            let scene = ball_in_a_furnace(radius, distance, 3.0 * radius, Some(material));
            // Radiance in glass is n² times as large.
            let exact = if inside { 2.25 * EQUILIBRIUM } else { EQUILIBRIUM };
            is_in_equilibrium(&mut family, &scene, &format!("{name} of 1e{exponent}, inside: {inside}"), 32, exact);
        }
    }
    family.finish(0.9);
}

/// Mirrors that overlap in one plane in part, cut in other triangles each, which one a ray meets being open: between them nothing gets lost.
#[test]
fn faces_that_overlap_in_part() {
    let mut family = Family::new("overlapping faces");
    for tilt in [DVec3::ZERO, dvec3(0.1, -0.07, 0.03)] {
        let mut builder = furnace("overlaps", 8);
        let mirror = builder.material(Bsdf::from(Mirror { reflectance: Spectrum::ONE }));
        let (u, v) = (dvec3(0.8, 0.0, 0.0) + tilt, dvec3(0.0, 0.7, 0.0) + tilt.zxy());
        let corner = dvec3(-0.7, -0.4, -0.4);
        builder.quad(corner, u, v, mirror);
        builder.quad(corner + u * 0.4 + v * 0.3, u, v, mirror);
        let positions = [(0.1, 0.2), (1.3, 0.5), (0.6, 1.2)].map(|(x, y)| corner + u * x + v * y).to_vec();
        builder.mesh(MeshData { positions, triangles: vec![[0, 1, 2]], ..MeshData::default() }, mirror);
        let scene = builder.build(Skip::Unneeded).unwrap();
        is_in_equilibrium(&mut family, &scene, &format!("tilted {tilt}"), 32, EQUILIBRIUM);
    }
    family.finish(0.9);
}

/// A floor seen at grazing angles down to 10⁻⁷: every ray meets it or what is behind it, and both shine alike.
#[test]
fn grazing_views() {
    let mut family = Family::new("grazing views");
    for height in [1e-3, 1e-5, 1e-7] {
        let mut builder = furnace("grazing", 8);
        builder.camera(camera(dvec3(0.0, -1.0 + height, 0.9), dvec3(0.0, -1.0, -0.9), 2.0, 8));
        let scene = builder.build(Skip::Unneeded).unwrap();
        is_a_furnace(
            &mut family,
            &scene,
            &format!("from {height:e}"),
            &["direct", "path", "bdpt"],
            16,
            (ALBEDO, EMITTED),
        );
    }
    family.finish(0.9);
}

/// Connections inside corners, whose geometry term has no bound, between mirrors and at the edges of blocks that stand on the floor:
/// order by order what absorbs nothing is in equilibrium.
#[test]
fn corners_and_touching_faces() {
    let mut family = Family::new("corners");
    let mut builder = furnace("corner", 8);
    let mirror = builder.material(Bsdf::from(Mirror { reflectance: Spectrum::ONE }));
    let glass = builder.material(Bsdf::from(Dielectric { eta: 1.5 }));
    // One stands on the floor. The other nearly touches two walls: where glass and a wall are one plane, which comes first is open.
    block(&mut builder, dvec3(-0.6, -1.0, -0.6), dvec3(-0.1, -0.4, 0.0), mirror);
    block(&mut builder, dvec3(0.3, -0.2, -0.9999), dvec3(0.9999, 0.4, -0.5), glass);
    builder.camera(camera(dvec3(-0.9, -0.9, 0.9), dvec3(0.3, 0.0, -1.0), 70.0, 8));
    let scene = builder.build(Skip::Unneeded).unwrap();
    is_in_equilibrium(&mut family, &scene, "corners", 64, EQUILIBRIUM);
    family.finish(0.9);
}

/// Coordinates that cannot be worked with are told; those that are merely odd are not.
#[test]
fn coordinates_beyond_all_bounds() {
    let triangle = |size: f64| {
        let mut builder = crate::support::room("triangle");
        let grey = builder.material(lambert(0.5));
        let lamp = builder.quad(dvec3(-0.4, 0.95, -0.4), DVec3::X * 0.8, DVec3::Z * 0.8, grey);
        builder.emit(lamp, shining(3.0));
        let positions = vec![DVec3::ZERO, DVec3::X * size, DVec3::Y * size];
        builder.mesh(MeshData { positions, triangles: vec![[0, 1, 2]], ..MeshData::default() }, grey);
        builder.build(Skip::Unneeded)
    };
    for size in [1e-40, 1e-30, 1e-12, 1e3] {
        let scene = triangle(size).unwrap_or_else(|error| panic!("{size:e}: {error}"));
        let rendered = measure(&scene, plain("bdpt").as_ref(), "triangle", Budget::samples(1).up_to(2));
        let lit = rendered.image(1).mean;
        assert!(lit.is_finite() && lit > 0.0, "{size:e}: {lit}");
    }
    for size in [1e30, 1e300, f64::INFINITY, f64::NAN] {
        let error =
            triangle(size).err().unwrap_or_else(|| panic!("{size:e}: no such scene can be rendered")).to_string();
        assert!(error.len() > 20 && !error.contains('\n'), "{error}");
    }
}

/// A ball of `2 rings sectors` triangles of radius 1 around the origin, fronts outside, of which those at the poles are flat.
fn ball(rings: u32, sectors: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let vertex = |ring: u32, sector: u32| {
        let (sin, cos) = (TAU * f64::from(ring) / f64::from(2 * rings)).sin_cos();
        let (y, x) = (TAU * f64::from(sector) / f64::from(sectors)).sin_cos();
        // The poles are single points, whatever their sine is rounded to.
        if ring == 0 || ring == rings { dvec3(0.0, cos.signum(), 0.0) } else { dvec3(sin * x, cos, sin * y) }
    };
    let index = |ring: u32, sector: u32| ring * sectors + sector % sectors;
    let cells = (0..rings).flat_map(|r| (0..sectors).map(move |s| (r, s)));
    let triangles = cells.flat_map(|(r, s)| {
        let [a, b, c, d] = [index(r, s), index(r, s + 1), index(r + 1, s + 1), index(r + 1, s)];
        [[a, b, c], [a, c, d]]
    });
    ((0..=rings).flat_map(|r| (0..sectors).map(move |s| vertex(r, s))).collect(), triangles.collect())
}

/// Mirrors of one triangle, a million, and by night ten million, which absorb nothing, are in equilibrium with the enclosure around them.
#[test]
fn one_triangle_and_ten_million() {
    let mut family = Family::new("triangles");
    let one = (vec![dvec3(-0.9, -0.5, 0.0), dvec3(0.8, -0.4, -0.2), dvec3(0.1, 0.8, 0.1)], vec![[0, 1, 2]]);
    let many = if is_night() { (1581, 3163) } else { (500, 1000) };
    for (positions, triangles) in [one, ball(many.0, many.1)] {
        let label = format!("{} triangles", triangles.len());
        let mut builder = furnace(&label, 8);
        let mirror = builder.material(Bsdf::from(Mirror { reflectance: Spectrum::ONE }));
        let positions = positions.iter().map(|p| *p * 0.6 + dvec3(0.0, 0.1, -0.2)).collect();
        builder.mesh(MeshData { positions, triangles, ..MeshData::default() }, mirror);
        is_in_equilibrium(&mut family, &builder.build(Skip::Unneeded).unwrap(), &label, 16, EQUILIBRIUM);
    }
    family.finish(0.9);
}

/// A closed ball of triangles, from within: five million rays, each asked for what it meets first and for whether it meets anything, aimed at
/// vertices, at points of edges, and anywhere, from places near and far from the wall.
#[test]
fn no_ray_leaves_a_closed_mesh() {
    let (positions, triangles) = ball(40, 60);
    let mut builder = SceneBuilder::new("ball of triangles");
    let grey = builder.material(lambert(0.5));
    builder.mesh(MeshData { positions: positions.clone(), triangles: triangles.clone(), ..MeshData::default() }, grey);
    builder.camera(camera(DVec3::ZERO, DVec3::X, 60.0, 1));
    let scene = builder.build(Skip::Unneeded).unwrap();
    let mut stream = Stream::new(crate::support::seed(), 0);
    let mut number = move || f64::from(stream.next_f32());
    let (mut rays, mut lost) = (0, 0);
    for i in 0..5_000_000 {
        let mut unit = || loop {
            let v = dvec3(number(), number(), number()) * 2.0 - 1.0;
            if v.length_squared() > 1e-4 && v.length_squared() <= 1.0 {
                break v.normalize();
            }
        };
        let reach = [0.0, 0.3, 0.9, 0.99][i % 4];
        let origin = (unit() * reach).as_vec3();
        let [a, b, _] = triangles[i % triangles.len()].map(|v| positions[v as usize] - scene.origin);
        let target = match i % 3 {
            0 => a,
            1 => a + (b - a) * number(),
            _ => unit(),
        };
        let d: Vec3 = (target.as_vec3() - origin).normalize();
        rays += 2;
        lost += u32::from(scene.intersect(&Ray::new(origin, d)).is_none());
        lost += u32::from(!scene.occluded(&Ray::new(origin, d)));
    }
    assert_eq!(lost, 0, "of {rays} rays");
}

/// Whether a ray meets something, by either question.
fn is_stopped(scene: &Scene, ray: &Ray) -> bool {
    scene.intersect(ray).is_some() && scene.occluded(ray)
}

/// Whether a ray is stopped that goes on from where another one ends, to the side that this came from: in the direction `d`, or the opposite one.
/// What is exactly along the surface leaves to neither side.
fn is_stopped_again(scene: &Scene, ray: &Ray, d: impl FnOnce(Vec3) -> Vec3) -> bool {
    scene.intersect(ray).is_none_or(|hit| {
        let (d, ng) = (d(hit.point.ng), hit.point.ng);
        let back = if d.dot(ng) * ray.d.dot(ng) > 0.0 { -d } else { d };
        back.dot(ng) == 0.0 || is_stopped(scene, &hit.point.spawn(back))
    })
}

/// In a room whose walls shine, a ray at a point of an edge or at a corner, on from where it ends to the side that it came from, and from the
/// edge of a wall as light begins there: none may leave, though what is rounded may have put the point on the wall next to its own.
#[test]
fn rays_go_on_within_from_the_edges_of_a_room() {
    let scene = furnace("room", 1).build(Skip::Unneeded).unwrap();
    let mut stream = Stream::new(crate::support::seed(), 1);
    let mut number = move || stream.next_f32();
    let mut lost = [0; 3];
    for i in 0..500_000u32 {
        let mut sign = || if number() < 0.5 { -1.0 } else { 1.0 };
        let mut target = vec3(sign(), sign(), sign());
        if i % 4 != 0 {
            target[(i % 3) as usize] *= 2.0 * number() - 1.0;
        }
        let origin = warp::uniform_sphere(vec2(number(), number())) * 0.9 * number();
        let ray = Ray::new(origin, (target - origin).normalize());
        lost[0] += u32::from(!is_stopped(&scene, &ray));
        lost[1] += u32::from(!is_stopped_again(&scene, &ray, |_| warp::uniform_sphere(vec2(number(), number()))));
        let end = [0.0, 1.0f32.next_down()][(i % 2) as usize];
        let u_p = if i % 3 == 0 { vec2(end, number()) } else { vec2(number(), end) };
        let light = scene.sample_le(EmitterId(i % 6), u_p, vec2(number(), number()));
        lost[2] += u32::from(light.is_some_and(|light| !is_stopped(&scene, &light.ray)));
    }
    assert_eq!(lost, [0; 3], "rays at edges, on from there, and from where light begins there");
}

/// In a long thin beam around the origin, askew, rays at its edges and on from there, nearly along its sides. A point near the origin is rounded
/// by little, so that rays leave it next to the edge; the corners, a metre away as seen from there, are rounded by more than it is off
/// the edge's other side.
#[test]
fn rays_go_on_within_from_edges_whose_corners_are_far_away() {
    let turn = DQuat::from_axis_angle(dvec3(0.3, 0.8, 0.52).normalize(), 1.1);
    let mut stream = Stream::new(crate::support::seed(), 2);
    let mut number = move || stream.next_f32();
    for skip in [Skip::Unneeded, Skip::Nothing] {
        let mut builder = SceneBuilder::new("beam");
        let grey = builder.material(lambert(ALBEDO));
        let beam = block(&mut builder, dvec3(-0.025, -0.025, -1.0), dvec3(0.025, 0.025, 1.0), grey);
        builder.transform(beam, DAffine3::from_quat(turn));
        builder.camera(camera(DVec3::ZERO, DVec3::Z, 70.0, 1));
        let scene = builder.build(skip).unwrap();
        let mut lost = [0; 2];
        for i in 0..400_000 {
            let side = |bit: usize| if i >> bit & 1 == 0 { 0.025 } else { -0.025 };
            let mut share = |length: f64| length * (f64::from(number()) - 0.5);
            let target = (turn * dvec3(side(0), side(1), share(0.2))).as_vec3();
            let origin = (turn * dvec3(share(0.02), share(0.02), share(0.1))).as_vec3();
            let ray = Ray::new(origin, (target - origin).normalize());
            lost[0] += u32::from(!is_stopped(&scene, &ray));
            let along = warp::uniform_sphere(vec2(number(), number()));
            let rise = 10f32.powf(-7.0 * number());
            let d = |ng: Vec3| (along.reject_from_normalized(ng) + ng * rise).normalize_or(ng);
            lost[1] += u32::from(!is_stopped_again(&scene, &ray, d));
        }
        assert_eq!(lost, [0; 2], "{skip:?}: rays at edges, and on from there");
    }
}
