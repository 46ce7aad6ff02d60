use super::*;
use crate::needs::Skip;
use crate::ray::Ray;
use crate::shape::{Cylinder, Disk, Sphere};
use crate::test_support::{Random, add_room, built, bumpy_ball, grey_builder};
use glam::{DVec3, dvec3};
use sampling::vec3;

pub(super) fn random_triangles(random: &mut Random, count: usize, size: f32) -> Vec<Triangle> {
    (0..count)
        .map(|_| {
            let at = random.direction() * random.next_1d();
            Triangle(std::array::from_fn(|_| at + random.direction() * size))
        })
        .collect()
}

/// A sphere, a disk or a cylinder, in turn.
fn random_analytic(random: &mut Random, kind: usize) -> Analytic {
    let mut vector = |length: f32| (random.direction() * length).as_dvec3();
    let (place, along, across) = (vector(1.0), vector(0.4), vector(0.3));
    let radius = 0.1 + 0.3 * random.next_1d();
    let (x, y) = along.normalize().any_orthonormal_pair();
    match kind % 3 {
        0 => Analytic::Sphere(Sphere { center: place.as_vec3(), radius, flipped: kind.is_multiple_of(2) }),
        1 => Analytic::Disk(Box::new(Disk::new(place, along, across, kind.is_multiple_of(2)).unwrap())),
        _ => Analytic::Cylinder(Box::new(Cylinder {
            from: place,
            axes: [x, y, along.normalize()],
            length: 0.4,
            radius: f64::from(radius),
            flipped: kind.is_multiple_of(2),
        })),
    }
}

fn same(a: &Option<Hit>, b: &Option<Hit>) -> bool {
    match (a, b) {
        (None, None) => true,
        (Some(Hit::Triangle { t, id, p, .. }), Some(Hit::Triangle { t: t2, id: id2, p: p2, .. })) => {
            (t, id, p) == (t2, id2, p2)
        }
        (Some(Hit::Analytic { t, id, at }), Some(Hit::Analytic { t: t2, id: id2, at: at2 })) => {
            (t, id, at.p) == (t2, id2, at2.p)
        }
        _ => false,
    }
}

#[test]
fn a_list_and_a_tree_find_the_same_hits() {
    let mut random = Random::new(1);
    let alone = [(0, 3), (0, 12), (1, 0), (5, 0), (4, 4), (8, 0), (32, 0), (16, 2), (40, 20)].map(|case| (case, false));
    let halves = [(24, 0), (24, 1), (32, 0)].map(|case| (case, true));
    for ((count, balls), is_half) in alone.into_iter().chain(halves) {
        let mut triangles = random_triangles(&mut random, count, 0.4);
        if is_half {
            // With another that makes a parallelogram of each.
            let other = |&Triangle([a, b, c]): &Triangle| Triangle([a, c, a + (c - b)]);
            triangles = triangles.iter().flat_map(|triangle| [*triangle, other(triangle)]).collect();
        }
        let analytic: Vec<Analytic> = (0..balls).map(|i| random_analytic(&mut random, i)).collect();
        let list = Accel::build(&triangles, analytic.clone(), Skip::Unneeded);
        let tree = Accel::build(&triangles, analytic, Skip::Nothing);
        assert!(list.nodes.is_empty() == (count + 8 * balls <= 32) && !tree.nodes.is_empty());
        assert_eq!(list.nodes.is_empty(), are_few(&triangles, balls));
        for i in 0..30_000 {
            let o = random.direction() * 2.0 * random.next_1d();
            let mut ray = Ray::new(o, random.direction());
            if i % 3 == 0 && count > 0 {
                // Along an axis, in a plane through a vertex, or through it.
                let p = triangles[i % count].0[i % 7 % 3];
                ray.d = Vec3::AXES[i % 5 % 3] * [2.0, -2.0][i % 2];
                ray.o = p - ray.d;
                ray.o[i % 11 % 3] += random.next_1d() - 0.5;
            }
            let (a, b) = (list.closest(&ray), tree.closest(&ray));
            assert!(same(&a, &b), "{count} triangles, {ray:?}: {a:?} {b:?}");
            assert_eq!(list.any(&ray), a.is_some());
            ray.t_max = random.next_1d();
            assert_eq!(list.any(&ray), tree.any(&ray), "{ray:?}");
            assert_eq!(list.any(&ray), list.closest(&ray).is_some(), "{ray:?}");
        }
    }
}

/// A ray at a corner, an edge or the inside of a triangle, or along it; from somewhere, from next to it, or along an axis.
fn delicate_ray(random: &mut Random, triangle: &Triangle) -> Ray {
    let mut pick = |count: usize| (random.next_1d() * count as f32) as usize;
    let (corner, place, start, axis) = (pick(3), pick(4), pick(4), pick(3));
    let [a, b, c] = [0, 1, 2].map(|v| triangle.0[(corner + v) % 3]);
    let target = [a, (a + b) * 0.5, a + (b - a) * random.next_1d(), (a + b + c) / 3.0][place];
    let o = match start {
        0 => target + random.direction() * 1e-6,
        1 => c + (c - target) * random.next_1d(),
        2 => {
            let mut o = target;
            o[axis] += 1.0 + random.next_1d();
            o
        }
        _ => random.direction() * 2.0,
    };
    let t_max = [f32::INFINITY, 1.0, 1.0 + 1e-7, 2.0 * random.next_1d()][(random.next_1d() * 4.0) as usize];
    Ray { o, d: target - o, t_max }
}

#[test]
fn all_kernels_find_the_same_hits() {
    let mut random = Random::new(12);
    let (mut compared, mut met) = (0, 0);
    for (count, size, balls) in
        [(1, 0.5, 0), (9, 0.5, 2), (50, 0.4, 9), (300, 0.3, 20), (3000, 0.08, 0), (4000, 1e-3, 40)]
    {
        let mut triangles = random_triangles(&mut random, count, size);
        let needle = triangles[0].0;
        triangles.push(Triangle([needle[0], needle[1], needle[0] + (needle[1] - needle[0]) * 0.5]));
        triangles.push(Triangle([needle[0]; 3]));
        // A strip with shared edges.
        let along = [random.direction(), random.direction()];
        let at = |i: usize| along[0] * (i as f32 * 0.05) + along[1] * (0.2 * (i % 2) as f32);
        triangles.extend(
            (0..40).map(|i| {
                Triangle(if i % 2 == 0 { [at(i), at(i + 1), at(i + 2)] } else { [at(i + 1), at(i), at(i + 2)] })
            }),
        );
        let analytic: Vec<Analytic> = (0..balls).map(|i| random_analytic(&mut random, i)).collect();
        for skip in [Skip::Unneeded, Skip::Nothing] {
            let mut portable = Accel::build(&triangles, analytic.clone(), skip);
            portable.set_kernel(Kernel::PORTABLE);
            for kernel in Kernel::available() {
                let mut other = portable.clone();
                other.set_kernel(kernel);
                for i in 0..80_000 {
                    let triangle = &triangles[(random.next_1d() * triangles.len() as f32) as usize];
                    let ray = match i % 4 {
                        0 => Ray::new(random.direction() * 2.0 * random.next_1d(), random.direction()),
                        _ => delicate_ray(&mut random, triangle),
                    };
                    if ray.d == Vec3::ZERO {
                        continue;
                    }
                    let (a, b) = (portable.closest(&ray), other.closest(&ray));
                    assert!(same(&a, &b), "{kernel}, {count} triangles, {ray:?}: {a:?} {b:?}");
                    assert_eq!(portable.any(&ray), other.any(&ray), "{kernel}, {count} triangles, {ray:?}");
                    assert_eq!(other.any(&ray), b.is_some(), "{kernel}, {count} triangles, {ray:?}: {b:?}");
                    met += usize::from(a.is_some());
                    compared += 1;
                }
            }
        }
    }
    assert!(compared > 500_000 && met > compared / 4, "{met} of {compared}");
}

/// Coordinates from where products underflow to where they overflow; directions along axes, with components that are zero of either
/// sign, subnormal, or so small that their reciprocals are infinite.
#[test]
fn all_kernels_find_the_same_hits_in_extreme_numbers() {
    let mut random = Random::new(13);
    let mut met = 0;
    for scale in [1e-38f32, 1e-30, 1e-19, 1e-9, 1.0, 1e9, 1e18, 1e30] {
        let mut triangles = random_triangles(&mut random, 60, 0.4);
        triangles.iter_mut().for_each(|triangle| triangle.0.iter_mut().for_each(|p| *p *= scale));
        let mut portable = Accel::build(&triangles, Vec::new(), Skip::Nothing);
        portable.set_kernel(Kernel::PORTABLE);
        for kernel in Kernel::available() {
            let mut other = portable.clone();
            other.set_kernel(kernel);
            for i in 0..20_000 {
                let triangle = &triangles[(random.next_1d() * triangles.len() as f32) as usize];
                let target = triangle.0[0] + (triangle.0[1] - triangle.0[0]) * 0.25 * (i % 3) as f32;
                let mut d = random.direction() * [1.0, scale, 1e-30][i % 3];
                let axis = (random.next_1d() * 3.0) as usize;
                d[axis] = [0.0, -0.0, 1e-42, -1e-39, 1e-25, d[axis]][i % 6];
                let o = target - d * (random.next_1d() * scale / d.abs().max_element().max(f32::MIN_POSITIVE));
                let t_max = [f32::INFINITY, f32::MAX, random.next_1d(), 0.0][i % 4];
                let ray = Ray { o, d, t_max };
                let (a, b) = (portable.closest(&ray), other.closest(&ray));
                let number = |hit: &Option<Hit>| match hit {
                    Some(Hit::Triangle { t, id, p, b }) => {
                        Some((*id, [t.to_bits(), b.x.to_bits(), b.y.to_bits()], p.to_array().map(f32::to_bits)))
                    }
                    _ => None,
                };
                assert_eq!(number(&a), number(&b), "{kernel}, {scale}, {ray:?}");
                assert_eq!(portable.any(&ray), other.any(&ray), "{kernel}, {scale}, {ray:?}");
                met += usize::from(a.is_some());
            }
        }
    }
    assert!(met > 50_000, "{met}");
}

#[test]
fn a_tree_built_in_parts_finds_the_same_hits() {
    let mut random = Random::new(7);
    let scattered = random_triangles(&mut random, 3000, 0.1);
    let mut crowded = random_triangles(&mut random, 1000, 1e-6);
    crowded.extend(random_triangles(&mut random, 20, 0.5));
    let coincident = vec![scattered[0]; 500];
    for triangles in [scattered, crowded, coincident] {
        let analytic: Vec<Analytic> = (0..40).map(|i| random_analytic(&mut random, i)).collect();
        let whole = Accel::build(&triangles, analytic.clone(), Skip::Unneeded);
        let parted = tree::build_in_parts(&triangles, Accel { analytic, ..Accel::default() }, 50);
        let mut met = 0;
        for _ in 0..20_000 {
            let mut ray = Ray::new(random.direction() * 2.0 * random.next_1d(), random.direction());
            let (a, b) = (whole.closest(&ray), parted.closest(&ray));
            assert!(same(&a, &b), "{} triangles, {ray:?}: {a:?} {b:?}", triangles.len());
            met += usize::from(a.is_some());
            ray.t_max = random.next_1d();
            assert_eq!(whole.any(&ray), parted.any(&ray), "{ray:?}");
        }
        assert!(met > 1000);
        assert!(parted.depth <= tree::DEEPEST);
    }
}

/// The slow way, in `f64` and by a different formula: the first hit's parameter, and how near a ray passed to an edge, or began to a triangle.
fn oracle(triangles: &[Triangle], ray: &Ray) -> (f64, f64) {
    let (o, d) = (ray.o.as_dvec3(), ray.d.as_dvec3());
    let (mut first, mut margin) = (f64::INFINITY, f64::INFINITY);
    for triangle in triangles {
        let [a, b, c] = triangle.0.map(|v| v.as_dvec3() - o);
        let volumes = [a.cross(b).dot(d), b.cross(c).dot(d), c.cross(a).dot(d)];
        let total: f64 = volumes.iter().sum();
        let least = volumes.iter().map(|v| v / total).fold(f64::INFINITY, f64::min);
        margin = margin.min(least.abs()).min((least * total).abs());
        let normal = (b - a).cross(c - a);
        let t = a.dot(normal) / d.dot(normal);
        if least >= 0.0 {
            margin = margin.min(t.abs());
            first = if t > 0.0 { first.min(t) } else { first };
        }
    }
    (first, margin)
}

#[test]
fn hits_are_those_of_a_slow_oracle() {
    let mut random = Random::new(2);
    let triangles = random_triangles(&mut random, 200, 0.3);
    let accel = Accel::build(&triangles, Vec::new(), Skip::Unneeded);
    let mut compared = 0;
    for _ in 0..100_000 {
        let near = &triangles[(random.next_1d() * 200.0) as usize];
        let ray = if random.next_1d() < 0.5 {
            Ray::new(random.direction() * 1.5, random.direction())
        } else {
            Ray { t_max: f32::INFINITY, ..delicate_ray(&mut random, near) }
        };
        let (t, margin) = oracle(&triangles, &ray);
        if margin < 1e-11 {
            continue;
        }
        compared += 1;
        match accel.closest(&ray) {
            Some(Hit::Triangle { t: found, .. }) => assert!((f64::from(found) - t).abs() < 1e-6 * t, "{ray:?}"),
            _ => assert!(t.is_infinite(), "{ray:?} missed {t}"),
        }
    }
    assert!(compared > 40_000);
}

/// Rays from inside closed surfaces aimed at vertices, at points of edges, and along axes: none may escape.
#[test]
fn nothing_leaks_between_neighbours() {
    let mut random = Random::new(3);
    for offset in [DVec3::ZERO, dvec3(100.0, 200.0, -50.0)] {
        for (skip, mesh) in
            [(Skip::Unneeded, bumpy_ball(4)), (Skip::Nothing, bumpy_ball(4)), (Skip::Unneeded, bumpy_ball(40))]
        {
            let (mut builder, grey) = grey_builder("closed");
            let mut mesh = mesh;
            mesh.positions.iter_mut().for_each(|p| *p += offset);
            // A distant speck keeps the scene from being recentred.
            builder.sphere(DVec3::ZERO, 1e-3, grey);
            let corners: Vec<Vec3> = mesh.positions.iter().map(|p| p.as_vec3()).collect();
            let triangles = mesh.triangles.clone();
            builder.mesh(mesh, grey);
            let scene = built(builder, skip);
            for _ in 0..150_000 {
                let triangle =
                    triangles[(random.next_1d() * triangles.len() as f32) as usize].map(|v| corners[v as usize]);
                let share = [0.0, 0.5, random.next_1d()][(random.next_1d() * 3.0) as usize];
                let target = triangle[0] + (triangle[1] - triangle[0]) * share;
                let mut o = offset.as_vec3() + random.direction() * 0.4 * random.next_1d();
                if random.next_1d() < 0.3 {
                    o[(random.next_1d() * 3.0) as usize] = target[0];
                }
                let inside = (o - offset.as_vec3()).length() < 0.6;
                let ray = Ray::new(o, (target - o).normalize_or_zero());
                assert!(!inside || scene.intersect(&ray).is_some(), "{ray:?} escaped, {skip:?}");
                assert!(!inside || scene.occluded(&ray), "{ray:?} is not occluded, {skip:?}");
            }
        }
    }
}

#[test]
fn nothing_leaks_from_a_box_of_quads() {
    let mut random = Random::new(4);
    for skip in [Skip::Unneeded, Skip::Nothing] {
        let (mut builder, grey) = grey_builder("box");
        add_room(&mut builder, dvec3(-1.0, -1.0, -1.0), dvec3(1.0, 1.3, 0.7), grey);
        let scene = built(builder, skip);
        let corner = |random: &mut Random| {
            let pick = |u: f32, low: f32, high: f32| if u < 0.5 { low } else { high };
            vec3(
                pick(random.next_1d(), -1.0, 1.0),
                pick(random.next_1d(), -1.0, 1.3),
                pick(random.next_1d(), -1.0, 0.7),
            )
        };
        for _ in 0..500_000 {
            let o = vec3(random.next_1d() - 0.5, random.next_1d() - 0.5, random.next_1d() - 0.5);
            // Corners, edges of the box, and diagonals of its faces.
            let (from, to) = (corner(&mut random), corner(&mut random));
            let target = from + (to - from) * [0.0, 0.5, random.next_1d()][(random.next_1d() * 3.0) as usize];
            let ray = Ray::new(o, target - o);
            assert!(scene.intersect(&ray).is_some() && scene.occluded(&ray), "{ray:?} escaped, {skip:?}");
        }
    }
}

#[test]
fn a_deep_tree_is_still_searched() {
    // Each triangle is half as large as the last and much nearer to the origin.
    let triangles: Vec<Triangle> = (0..120)
        .map(|i| {
            let size = 0.5f32.powi(i % 100);
            Triangle([vec3(size, 0.0, 0.0), vec3(0.0, size, 0.0), vec3(0.0, 0.0, size)])
        })
        .collect();
    let accel = Accel::build(&triangles, Vec::new(), Skip::Unneeded);
    let ray = Ray::new(vec3(2.0, 2.0, 2.0), vec3(-1.0, -1.0, -1.0).normalize());
    assert!(matches!(accel.closest(&ray), Some(Hit::Triangle { id: 0, .. })));
    let coincident = vec![triangles[0]; 5000];
    let accel = Accel::build(&coincident, Vec::new(), Skip::Unneeded);
    assert!(matches!(accel.closest(&ray), Some(Hit::Triangle { id: 0, .. })) && accel.any(&ray));
    assert!(accel.depth <= tree::DEEPEST);
    let balls = vec![Analytic::Sphere(Sphere { center: Vec3::ZERO, radius: 1.0, flipped: false }); 3000];
    let accel = Accel::build(&coincident, balls, Skip::Unneeded);
    assert!(matches!(accel.closest(&ray), Some(Hit::Analytic { id: 0, .. })) && accel.any(&ray));
    assert!(accel.depth <= tree::DEEPEST);
}

/// The builder would need a pass for every two of them.
#[test]
fn a_long_row_of_equal_triangles_is_built_at_once() {
    let at = |i: i32, x: f32, y: f32| vec3(2.0 * i as f32 + x, y, 0.0);
    let triangles: Vec<Triangle> =
        (0..200_000).map(|i| Triangle([at(i, 0.0, 0.0), at(i, 1.0, 0.0), at(i, 0.0, 1.0)])).collect();
    let tree = Accel::build(&triangles, Vec::new(), Skip::Nothing);
    for i in [0, 77_777, 199_999] {
        let ray = Ray::new(at(i, 0.25, 0.25) + Vec3::Z, -Vec3::Z);
        assert!(matches!(tree.closest(&ray), Some(Hit::Triangle { id, .. }) if id == i as u32));
    }
}

#[test]
fn a_triangle_seen_edge_on_is_not_met() {
    let triangles = [Triangle([vec3(0.0, 0.0, 0.0), vec3(1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0)])];
    let accel = Accel::build(&triangles, Vec::new(), Skip::Unneeded);
    for d in [Vec3::X, Vec3::Y, vec3(0.6, 0.8, 0.0)] {
        assert!(accel.closest(&Ray::new(vec3(-1.0, 0.2, 0.0), d)).is_none());
    }
}

#[test]
fn spheres_are_met_from_outside_and_inside_at_any_distance() {
    for (radius, distance) in [(1.0f32, 3.0f32), (1e-3, 100.0), (1e-6, 1.0), (1e5, 2e5)] {
        let spheres = vec![Analytic::Sphere(Sphere { center: vec3(0.0, 0.0, -distance), radius, flipped: false })];
        let accel = Accel::build(&[], spheres, Skip::Unneeded);
        let from_outside = accel.closest(&Ray::new(Vec3::ZERO, -Vec3::Z));
        let Some(Hit::Analytic { t, at, .. }) = from_outside else { panic!("missed {radius} at {distance}") };
        assert!((t - (distance - radius)).abs() <= 4.0 * UNIT * distance && at.ng.dot(Vec3::Z) > 0.999);
        let from_inside = accel.closest(&Ray::new(vec3(0.0, 0.0, -distance), Vec3::X));
        let Some(Hit::Analytic { t, .. }) = from_inside else { panic!("missed from inside") };
        assert!((t - radius).abs() <= 4.0 * UNIT * radius);
        // A tangent just inside hits, one just outside does not.
        for (factor, hits) in [(0.999, true), (1.001, false)] {
            let ray = Ray::new(vec3(radius * factor, 0.0, 0.0), -Vec3::Z);
            assert_eq!(accel.closest(&ray).is_some(), hits, "{radius} at {distance}");
        }
    }
}

const UNIT: f32 = crate::ray::UNIT_ROUNDOFF;

#[test]
fn a_ray_from_nowhere_meets_nothing() {
    let balls: Vec<Analytic> = (0..5).map(|i| random_analytic(&mut Random::new(41), i)).collect();
    for kernel in Kernel::available() {
        let tree = Accel { kernel, ..Accel::build(&[], balls.clone(), Skip::Nothing) };
        let ray = Ray::new(Vec3::NAN, Vec3::X);
        assert!(tree.closest(&ray).is_none() && !tree.any(&ray));
    }
}
