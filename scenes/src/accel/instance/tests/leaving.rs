//! Rays that leave instances, at all sizes, places and stretches.

use super::*;

/// A closed convex surface of the group, its vertices as they are kept.
fn convex() -> MeshData {
    let mut ball = bumpy_ball(7);
    ball.positions.iter_mut().for_each(|p| *p = p.normalize().as_vec3().as_dvec3());
    ball
}

/// How far a point of the group's coordinates is outside a convex mesh: the greatest distance to the plane of a triangle.
fn outside(mesh: &MeshData, p: DVec3) -> f64 {
    let of = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|vertex| mesh.positions[vertex as usize]);
        let normal = (b - a).cross(c - a);
        let normal = if normal.dot(a) < 0.0 { -normal } else { normal };
        (p - a).dot(normal.normalize())
    };
    mesh.triangles.iter().map(of).fold(f64::NEG_INFINITY, f64::max)
}

/// Sizes from 10⁻⁶ to 10⁶ m, up to 10⁵ times as far from the origin, stretched up to 1000 : 1, mirrored and sheared.
fn hard_maps(random: &mut Random) -> Vec<DAffine3> {
    let mut maps = Vec::new();
    for scale in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        for (offset, stretch) in [(0.0, 1.0), (3.0, 1e3), (100.0, 1.0), (100.0, 100.0), (1e4, 3.0), (1e5, 1.0)] {
            for mirror in [1.0, -1.0] {
                let shear = DMat3::from_cols(dvec3(1.0, 0.0, 0.0), dvec3(0.4, 1.0, 0.0), dvec3(0.0, -0.3, 1.0));
                let axis = random.direction().as_dvec3().normalize();
                let turn = DMat3::from_axis_angle(axis, 1.0 + f64::from(random.next_1d()));
                let size = DMat3::from_diagonal(dvec3(mirror, 1.0 / stretch, 1.0)) * scale;
                let at = random.direction().as_dvec3() * offset * scale;
                maps.push(DAffine3::from_mat3_translation(turn * size * shear * turn, at));
            }
        }
    }
    maps
}

/// A scene of one instance; a speck at the origin keeps it from being recentred.
fn alone(map: DAffine3, add: impl Fn(&mut SceneBuilder, MaterialId)) -> Scene {
    let (mut builder, grey) = grey_builder("alone");
    let group = builder.begin_group("one");
    add(&mut builder, grey);
    builder.end_group();
    builder.instance(group, map);
    let at = map.translation;
    builder.sphere(-at * 3.0, (at.length() * 1e-3).max(1e-12), grey);
    let scene = built(builder, Skip::Unneeded);
    assert_eq!(scene.origin, DVec3::ZERO);
    scene
}

/// A direction on the side of a normal, often nearly along the surface.
fn away(random: &mut Random, ng: DVec3, grazing: bool) -> Vec3 {
    let d = random.direction().as_dvec3();
    let along = d - ng * d.dot(ng);
    let d = if grazing { along.normalize() + ng * 10f64.powf(-6.0 * f64::from(random.next_1d())) } else { d };
    (if d.dot(ng) < 0.0 { d - ng * (2.0 * d.dot(ng)) } else { d }).normalize().as_vec3()
}

/// What was seen of rays that leave a surface.
#[derive(Default)]
struct Left {
    tried: usize,
    /// Those for which there was no inside to begin from.
    inherent: usize,
    escaped: usize,
    /// Those which would have begun inside, had they not been moved.
    bare: usize,
}

/// What a ray that leaves an instance of a closed convex surface does: outwards it never meets it again, inwards it never escapes.
fn leave(scene: &Scene, map: DAffine3, outside: impl Fn(DVec3) -> f64, seed: u64) -> Left {
    let mut random = Random::new(seed);
    let back = map.inverse();
    let Left { mut tried, mut inherent, mut escaped, mut bare } = Left::default();
    for i in 0..1500 {
        let target = map.transform_point3((random.direction() * 0.9 * random.next_1d()).as_dvec3());
        let o = map.transform_point3(random.direction().as_dvec3() * 2.0).as_vec3();
        let Some(hit) = scene.intersect(&Ray::new(o, (target - o.as_dvec3()).normalize().as_vec3())) else { continue };
        // Those from outside that met the front.
        let local = back.transform_point3(hit.point.p.as_dvec3());
        if local.length() > 1.2 {
            continue;
        }
        tried += 1;
        let ng = hit.point.ng;
        let exact = (map.matrix3.transpose() * ng.as_dvec3()).normalize();
        let normal = (back.matrix3.transpose() * exact).normalize();
        let d = away(&mut random, normal, i % 2 == 0);
        let out = hit.point.spawn(d);
        assert!(outside(back.transform_point3(out.o.as_dvec3())) > 0.0, "{map:?}: {hit:?} is not left");
        assert!(scene.intersect(&out).is_none_or(|hit| back.transform_point3(hit.point.p.as_dvec3()).length() > 1.2));
        bare += usize::from(outside(back.transform_point3(hit.point.p.as_dvec3())) <= 0.0);
        let inwards = hit.point.spawn(-d);
        // Beyond a sharp edge, or a surface thinner than the rounding of its place, there is no inside to begin from.
        if outside(back.transform_point3(inwards.o.as_dvec3())) >= 0.0 {
            inherent += 1;
            continue;
        }
        match scene.intersect(&inwards) {
            Some(end) if back.transform_point3(end.point.p.as_dvec3()).length() < 1.2 => {
                assert!(scene.occluded(&inwards));
                let segment = hit.point.segment_to(&end.point);
                let within = outside(back.transform_point3(segment.o.as_dvec3())) < 0.0
                    && outside(back.transform_point3((segment.o + segment.d).as_dvec3())) < 0.0;
                assert!(!within || !scene.occluded(&segment), "{map:?}: {segment:?} is occluded");
            }
            _ => escaped += 1,
        }
    }
    Left { tried, inherent, escaped, bare }
}

#[test]
fn rays_leave_instances_for_good_and_never_leak() {
    let mut random = Random::new(3);
    let mesh = convex();
    let (mut all, mut stuck, mut within) = (0, 0, 0);
    for (index, map) in hard_maps(&mut random).into_iter().enumerate() {
        let scene = alone(map, |builder, grey| {
            builder.mesh(mesh.clone(), grey);
        });
        let Left { tried, inherent, escaped, bare } = leave(&scene, map, |p| outside(&mesh, p), index as u64);
        assert_eq!(escaped, 0, "{map:?}: of {tried}");
        assert!(tried > 900, "{map:?}: {tried}");
        (all, stuck, within) = (all + tried, stuck + inherent, within + bare);
        let ball = alone(map, |builder, grey| {
            builder.sphere(DVec3::ZERO, 1.0, grey);
        });
        let Left { tried, inherent, escaped, bare } = leave(&ball, map, |p| p.length() - 1.0, index as u64);
        assert_eq!(escaped, 0, "{map:?}: of {tried}");
        (all, stuck, within) = (all + tried, stuck + inherent, within + bare);
    }
    assert!(stuck * 50 < all && within * 3 > all, "of {all} {stuck} have no inside, {within} need their offset");
}

#[test]
fn nothing_leaks_between_neighbours_of_an_instance() {
    let mut random = Random::new(4);
    let mesh = bumpy_ball(9);
    for map in hard_maps(&mut random) {
        let scene = alone(map, |builder, grey| {
            builder.mesh(mesh.clone(), grey);
        });
        for _ in 0..3000 {
            let triangle = mesh.triangles[(random.next_1d() * mesh.triangles.len() as f32) as usize];
            let [a, b, _] = triangle.map(|vertex| mesh.positions[vertex as usize]);
            let share = f64::from([0.0, 0.5, random.next_1d()][(random.next_1d() * 3.0) as usize]);
            let o = map.transform_point3((random.direction() * 0.3 * random.next_1d()).as_dvec3()).as_vec3();
            // Where rounding is larger than the instance is thick, there is no inside.
            if map.inverse().transform_point3(o.as_dvec3()).length() > 0.6 {
                continue;
            }
            let target = map.transform_point3(a + (b - a) * share);
            let d = (target - o.as_dvec3()).normalize().as_vec3();
            let ray = Ray::new(o, d);
            let met = scene.intersect(&ray).map(|hit| map.inverse().transform_point3(hit.point.p.as_dvec3()).length());
            assert!(met.is_some() && scene.occluded(&ray), "{map:?}: {ray:?} escaped");
        }
    }
}
