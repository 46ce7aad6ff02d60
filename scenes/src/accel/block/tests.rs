use super::super::lanes::Portable;
use super::super::traverse::FAR;
use super::*;
use crate::ray::Ray;
use crate::test_support::Random;

/// A block of one triangle; none if that has no area, since meshes leave out what has none.
fn block_of(corners: [Vec3; 3]) -> Option<Block> {
    let triangle = Triangle(corners);
    triangle.normal().map(|_| Block::new(&[Pair::of([0, u32::MAX], &[triangle])]))
}

/// Triangles from plump ones to needles, from next to where the line begins to a thousand million times their size away, and lines at points
/// on their edges, at their corners and off these by some roundings.
#[test]
fn what_is_not_open_is_as_f64_has_it() {
    let mut random = Random::new(31);
    let (mut sure, mut open) = ([0, 0], 0);
    for i in 0..300_000u32 {
        let size = 10f32.powi(i as i32 % 7 - 3);
        let far = size * 10f32.powf(9.0 * random.next_1d().powi(3));
        let d = random.direction() * [1.0, far][(i % 2) as usize];
        let at = random.direction() * size + d.normalize() * far;
        let width = [1.0, 1e-2, 1e-5][(i % 3) as usize];
        let (along, across) = (random.direction(), random.direction());
        let [a, b] = [at, at + along * size];
        let c = at + (along * random.next_1d() + across * width) * size;
        let Some(block) = block_of([a, b, c]) else { continue };
        let share = random.next_1d();
        let off = far * UNIT_ROUNDOFF * 10f32.powf(6.0 * random.next_1d()) * (random.next_1d() - 0.5);
        let target = [a, a + (b - a) * share, c + (a - c) * share, (a + b + c) / 3.0][(i / 3 % 4) as usize];
        // The line begins where it passes the target, to rounding.
        let o = target - d.normalize() * far + random.direction() * off;
        let ray = Ray { o, d, t_max: f32::INFINITY };
        let query = Query::new(&ray);
        let candidates = block.candidates::<Portable>((), &query, block.size(), f32::INFINITY);
        for lane in (0..LANES).filter(|&lane| block.is_occupied(lane)) {
            let inside = candidates.inside >> lane & 1 != 0;
            if candidates.open >> lane & 1 != 0 {
                assert!(inside);
                open += 1;
            } else {
                assert_eq!(inside, block.is_inside_exactly(lane, &query), "{i}: {ray:?} {a} {b} {c}");
                sure[usize::from(inside)] += 1;
            }
        }
    }
    assert!(sure[0] > 50_000 && sure[1] > 30_000 && open > 50_000, "{sure:?} {open}");
}

/// Lines that begin next to the plane of a triangle, on it, or far from it, and end as close to it, seen from above to edge-on.
#[test]
fn what_is_met_or_left_out_for_certain_is_so_by_f64() {
    let mut random = Random::new(32);
    let (mut sure, mut asked, mut left_out) = (0, 0, 0);
    for i in 0..300_000u32 {
        let size = 10f32.powi(i as i32 % 7 - 3);
        let place = random.direction() * [0.0, 1.0, 1e4][(i % 3) as usize];
        let (along, across) = (random.direction() * size, random.direction() * size);
        let (a, b, c) = (place, place + along, place + across);
        let Some(block) = block_of([a, b, c]) else { continue };
        let target = (a + b + c) / 3.0;
        let normal = along.cross(across).normalize();
        let steep = 10f32.powf(-6.0 * random.next_1d());
        let d = (along.normalize() + normal * steep) * [1.0, -1.0][(i / 3 % 2) as usize];
        let far = size * 10f32.powf(8.0 * random.next_1d() - 7.0);
        let o = target - d * far;
        let near = 1.0 + (random.next_1d() - 0.5) * 10f32.powf(-7.0 * random.next_1d());
        let ray = Ray { o, d, t_max: [f32::INFINITY, far * near, far * 0.5][(i / 6 % 3) as usize] };
        let query = Query::new(&ray);
        let mut candidates = block.candidates::<Portable>((), &query, block.size(), ray.t_max * FAR);
        let (certain, met) = (candidates.sure, candidates.inside);
        while let Some(candidate) = candidates.take() {
            let t = block.crossing(candidate, &query).t;
            asked += 1;
            if certain >> candidate.0 & 1 != 0 {
                assert!(t > 0.0 && t < f64::from(ray.t_max), "{i}: {ray:?} {a} {b} {c} {t}");
                let ([a, b, c], along) = ([a, b, c].map(Vec3::as_dvec3), d.as_dvec3());
                let normal = (b - a).cross(c - a);
                assert!(along.dot(normal).powi(2) > GRAZING * along.length_squared() * normal.length_squared());
                sure += 1;
            }
        }
        for lane in (0..LANES).filter(|&lane| block.is_occupied(lane) && met >> lane & 1 == 0) {
            let t = block.crossing((lane, true), &query).t;
            assert!(!(t > 0.0 && t < f64::from(ray.t_max)), "{i}: {ray:?} {a} {b} {c} {t}");
            left_out += 1;
        }
    }
    assert!(sure > 30_000 && asked > sure + 100_000 && left_out > 20_000, "{sure} {asked} {left_out}");
}
