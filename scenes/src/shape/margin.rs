//! How far the points that rays leave from keep off the edges of their triangle.
//!
//! A point is rounded to `f32`, and moved off its triangle to the side that a ray leaves to. Close to an edge where another triangle adjoins
//! at less than a straight angle it may be on that one's plane after that, or behind it, and the ray then leaves a closed mesh. With the
//! angle θ between the two, a point at the distance s from the edge, moved by e, is s sin θ − e cos θ ahead of the other's plane; rounding
//! takes away up to 2u‖p‖₁, and e is 3u‖p‖₁ (u is the unit roundoff). So s = [`OFF`]·u‖p‖₁ is enough for all angles from 34 degrees on.

use crate::ray::UNIT_ROUNDOFF;
use glam::DVec3;
use sampling::fault;

/// The distance from edges, in roundings of the sum of a corner's coordinates.
const OFF: f64 = 8.0 * UNIT_ROUNDOFF as f64;
/// No point is moved farther than so many times that: where edges meet at a very sharp angle there is no place away from both.
const FARTHEST: f64 = 6.0;

/// How far from its edges points of a triangle keep, if it is large enough \[m\].
fn distance(corners: &[DVec3; 3]) -> f64 {
    let sum = |p: &DVec3| p.x.abs() + p.y.abs() + p.z.abs();
    OFF * corners.iter().map(sum).fold(0.0, f64::max)
}

/// The least barycentric coordinates of the three corners, at most a third.
fn least([a, b, c]: &[DVec3; 3], distance: f64) -> [f64; 3] {
    let double_area = (b - a).cross(c - a).length();
    // Those of a triangle without area are a third, NaN or not.
    [c - b, a - c, b - a].map(|opposite| (distance * opposite.length() / double_area).min(1.0 / 3.0))
}

/// The greatest of the least barycentric coordinates of points off the edges: a point of which none is less is off them.
pub(crate) fn greatest_least(corners: &[DVec3; 3]) -> f64 {
    least(corners, distance(corners)).into_iter().fold(0.0, f64::max)
}

/// Barycentric coordinates of the corners 1 and 2, moved off the edges.
#[inline]
pub(crate) fn off_edges(corners: &[DVec3; 3], b: [f64; 2]) -> [f64; 2] {
    let distance = distance(corners);
    let least = b[0].min(b[1]).min(1.0 - b[0] - b[1]).max(0.0);
    let [u, v] = [corners[1] - corners[0], corners[2] - corners[0]];
    let longest = u.length_squared().max(v.length_squared()).max((v - u).length_squared());
    let is_off = least * least * u.cross(v).length_squared() >= distance * distance * longest;
    if fault!("points_on_edges", is_off, true) { b } else { moved(corners, b) }
}

#[cold]
#[inline(never)]
fn moved(corners: &[DVec3; 3], b: [f64; 2]) -> [f64; 2] {
    let distance = distance(corners);
    let [m0, m1, m2] = least(corners, distance);
    let b1 = b[0].min(1.0 - m0 - m2).max(m1);
    let b2 = b[1].min(1.0 - m0 - b1).max(m2);
    let [first, second] = [b1 - b[0], b2 - b[1]];
    let way = point(corners, [first, second]) - corners[0];
    let share = (FARTHEST * distance / way.length()).min(1.0);
    if share < 1.0 { [b[0] + first * share, b[1] + second * share] } else { [b1, b2] }
}

/// The point of these barycentric coordinates.
pub(crate) fn point(corners: &[DVec3; 3], [b1, b2]: [f64; 2]) -> DVec3 {
    corners[0] + (corners[1] - corners[0]) * b1 + (corners[2] - corners[0]) * b2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_support::Random;

    /// The distances of a point from the lines of a triangle's edges.
    fn distances(corners: &[DVec3; 3], p: DVec3) -> [f64; 3] {
        [(1, 2), (2, 0), (0, 1)].map(|(from, to)| {
            let edge = (corners[to] - corners[from]).normalize();
            (p - corners[from]).cross(edge).length()
        })
    }

    #[test]
    fn points_are_moved_off_the_edges_and_not_far() {
        let mut random = Random::new(5);
        for scale in [1e-4, 1e-2, 1.0, 1e6] {
            for _ in 0..1000 {
                let corners = [0; 3].map(|_| random.direction().as_dvec3() * scale + DVec3::splat(1.0));
                let s = distance(&corners);
                let at = |b| point(&corners, b);
                let b = match (random.next_1d() * 4.0) as u32 {
                    0 => [0.0, f64::from(random.next_1d())],
                    1 => [1.0, 0.0],
                    2 => [0.5, 0.5],
                    _ => [0.3, 0.3],
                };
                let moved = off_edges(&corners, b);
                assert!(at(b).distance(at(moved)) <= FARTHEST * s * (1.0 + 1e-6));
                let [b1, b2] = moved;
                assert!(b1 >= 0.0 && b2 >= 0.0 && b1 + b2 <= 1.0);
                let is_off = |b: [f64; 2]| distances(&corners, at(b)).iter().all(|d| *d >= s * (1.0 - 1e-6));
                let inner = [b[0], b[1], 1.0 - b[0] - b[1]].iter().all(|b| *b >= greatest_least(&corners));
                assert!(!inner || moved == b);
                let sharp = least(&corners, s).iter().sum::<f64>() > 0.1;
                let far = at(b).distance(at(moved)) > 0.99 * FARTHEST * s;
                assert!(is_off(moved) || sharp || far, "{corners:?} {b:?} {moved:?}");
            }
        }
    }

    #[test]
    fn a_triangle_smaller_than_that_has_its_middle() {
        let corners = [DVec3::ONE, DVec3::ONE + DVec3::X * 1e-9, DVec3::ONE + DVec3::Y * 1e-9];
        let [b1, b2] = off_edges(&corners, [0.0, 0.0]);
        assert!((b1 - 1.0 / 3.0).abs() < 1e-12 && (b2 - 1.0 / 3.0).abs() < 1e-12);
        let point = [DVec3::ONE; 3];
        assert!(off_edges(&point, [0.2, 0.3]).iter().all(|b| b.is_finite()));
    }
}
