use super::super::block::LANES;
use super::super::lanes::Portable;
use super::super::tests::random_triangles;
use super::super::{Accel, Best, Hit, Kernel};
use super::*;
use crate::needs::Skip;
use crate::shape::Triangle;
use crate::test_support::Random;
use sampling::{Vec3, vec3};

/// The two triangles of a quadrilateral, listed so that they make a pair.
fn halves([a, b, c, d]: [Vec3; 4]) -> [Triangle; 2] {
    [Triangle([a, b, c]), Triangle([a, c, d])]
}

/// Quadrilaterals from squares to what is none: a parallelogram, a trapezoid, one that is bent by as much as rounding or by far, a dart
/// that is not convex, and one with a corner next to the diagonal.
fn quadrilaterals(random: &mut Random) -> Vec<Triangle> {
    let shapes = [
        [vec3(0., 0., 0.), vec3(1., 0., 0.), vec3(1., 1., 0.), vec3(0., 1., 0.)],
        [vec3(0., 0., 0.), vec3(1., 0.2, 0.), vec3(1.4, 1., 0.), vec3(0.4, 0.8, 0.)],
        [vec3(0., 0., 0.), vec3(2., 0., 0.), vec3(1.2, 1., 0.), vec3(0.5, 1., 0.)],
        [vec3(0., 0., 0.), vec3(1., 0., 0.), vec3(1., 1., 0.), vec3(0., 1., 3e-7)],
        [vec3(0., 0., 0.), vec3(1., 0., 0.), vec3(1., 1., 0.), vec3(0., 1., 0.2)],
        [vec3(0., 0., 0.), vec3(1., 0., 0.), vec3(0.2, 0.2, 0.), vec3(0., 1., 0.)],
        [vec3(0., 0., 0.), vec3(1., 0., 0.), vec3(1., 1., 0.), vec3(0.6, 0.6 + 1e-4, 0.)],
    ];
    shapes
        .into_iter()
        .flat_map(|shape| {
            let (x, at) = (random.direction(), random.direction() * 0.5);
            let y = x.cross(random.direction()).normalize();
            halves(shape.map(|p| at + x * p.x + y * p.y + x.cross(y) * p.z))
        })
        .collect()
}

/// A ray at a corner, along a side or a diagonal, or at the inside of a triangle; from somewhere, from the plane of another, from next to
/// where it goes, or nearly along the plane.
fn delicate_ray(random: &mut Random, triangles: &[Triangle]) -> Ray {
    let mut pick = |count: usize| (random.next_1d() * count as f32) as usize;
    let (which, other, corner, place, start, end) =
        (pick(triangles.len()), pick(triangles.len()), pick(3), pick(4), pick(4), pick(4));
    let [a, b, c] = [0, 1, 2].map(|v| triangles[which].0[(corner + v) % 3]);
    let mut share = || random.next_1d();
    let target = [a, a + (b - a) * share(), (a + b + c) / 3.0, a + (b - a) * share() + (c - a) * 1e-6][place];
    let leaving = triangles[other].0;
    let away = [
        leaving[0] + (leaving[1] - leaving[0]) * (0.5 * share()) + (leaving[2] - leaving[0]) * (0.5 * share()),
        target + (c - b) * share() + random.direction() * 1e-6,
        random.direction() * 2.0,
        target + random.direction() * 1e-6,
    ][start];
    Ray { o: away, d: target - away, t_max: [f32::INFINITY, 1.0, 1.0 + 1e-7, 2.0 * random.next_1d()][end] }
}

/// A hit with all its bits.
fn bits(hit: &Option<Hit>) -> Option<(u32, [u32; 6])> {
    match hit {
        Some(Hit::Triangle { t, id, p, b }) => Some((*id, [*t, p.x, p.y, p.z, b.x, b.y].map(f32::to_bits))),
        Some(_) => unreachable!("there are triangles only"),
        None => None,
    }
}

#[test]
fn faces_are_met_where_their_blocks_have_them() {
    let mut random = Random::new(21);
    let (mut met, mut told) = (0, 0);
    for round in 0..60 {
        let scale = [1.0, 1e-6, 1e6, 1e-20, 1e18][round % 5];
        let mut triangles = quadrilaterals(&mut random);
        triangles.extend(random_triangles(&mut random, 8, 0.4));
        if round % 4 == 0 {
            // More than two blocks with a needle are put in a tree.
            triangles.truncate(2 * LANES - 3);
        }
        triangles.push(triangles[2]);
        triangles.push(Triangle([triangles[0].0[0]; 3]));
        if round % 4 == 0 {
            // What has a needle leaves all rays to the blocks.
            let [a, b, c] = triangles[0].0;
            triangles.push(Triangle([a, b, a + (b - a) * 0.5 + (c - a) * 1e-7]));
        }
        triangles.iter_mut().for_each(|triangle| triangle.0.iter_mut().for_each(|p| *p *= scale));
        let list = Accel::build(&triangles, Vec::new(), Skip::Unneeded);
        assert!(list.is_list());
        for kernel in Kernel::available() {
            let mut list = list.clone();
            list.set_kernel(kernel);
            for i in 0..4000 {
                let mut ray = delicate_ray(&mut random, &triangles);
                ray.o = [ray.o, random.direction() * 2.0 * scale][usize::from(i % 4 == 0)];
                if i % 7 == 0 {
                    // Along an axis, or a plane of two.
                    ray.d[i % 3] = 0.0;
                    ray.d[i / 7 % 3] = -0.0;
                }
                let line = Line { ray: &ray, exact: None };
                let best = list.closest_in_blocks(line, Best::before(f64::from(ray.t_max)));
                let (expected, found) = (list.resolve(line, &best), list.closest(&ray));
                assert_eq!(bits(&found), bits(&expected), "{kernel}, {scale}, {ray:?}");
                assert_eq!(list.any(&ray), expected.is_some(), "{kernel}, {scale}, {ray:?}");
                met += usize::from(found.is_some());
                // A line that is known better than it is rounded.
                let off = |v: Vec3| v.as_dvec3() * (1.0 + 5e-8 * f64::from(random.next_1d()));
                let exact = [ray.o, ray.d].map(off);
                let line = Line { ray: &ray, exact: Some(&exact) };
                let (mut nearest, before) = (Best::before(f64::INFINITY), Best::before(f64::INFINITY));
                list.search(line, &mut nearest);
                let best = list.closest_in_blocks(line, before);
                // Blocks leave out by the rounded line what this meets within a rounding of its origin.
                if nearest.t.min(best.t) > 1e-6 {
                    assert_eq!((nearest.t, nearest.slot), (best.t, best.slot), "{kernel}, {scale}, {ray:?}, {exact:?}");
                    assert_eq!(list.meets(line, f64::INFINITY), best.is_hit(), "{kernel}, {scale}, {ray:?}, {exact:?}");
                }
                told += usize::from(list.faces.visit::<Portable>((), line, f32::INFINITY, |_| ()));
            }
        }
    }

    assert!(met > 100_000 && told > 50_000, "{met}, {told}");
}

/// What is always left to the blocks would be found all the same, but not fast.
#[test]
fn hardly_a_ray_is_left_to_the_blocks() {
    let mut random = Random::new(22);
    let corner = |i: usize| vec3((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0;
    let sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
    let triangles: Vec<Triangle> = sides.iter().flat_map(|side| halves(side.map(corner))).collect();
    let list = Accel::build(&triangles, Vec::new(), Skip::Unneeded);
    assert_eq!(list.faces.faces.len(), 6);
    let left = (0..100_000)
        .filter(|_| {
            let o = random.direction() * random.next_1d();
            let leaving = Ray::new(Vec3::new(o.x, o.y, -1.0 + 3e-7), random.direction());
            !list.faces.visit::<Portable>((), Line { ray: &leaving, exact: None }, f32::INFINITY, |_| ())
        })
        .count();
    // A ray in 2500 is nearly along the floor; some others pass near a border.

    assert!(left < 300, "{left}");
}

#[test]
fn more_than_two_blocks_with_a_needle_are_a_tree() {
    let mut triangles = random_triangles(&mut Random::new(41), 20, 0.4);
    assert!(Accel::build(&triangles, Vec::new(), Skip::Unneeded).is_list());
    triangles.push(Triangle([Vec3::ZERO, Vec3::X, vec3(0.5, 1e-8, 0.0)]));
    assert!(!Accel::build(&triangles, Vec::new(), Skip::Unneeded).is_list());
    assert!(Accel::build(&triangles[5..], Vec::new(), Skip::Unneeded).is_list());
}
