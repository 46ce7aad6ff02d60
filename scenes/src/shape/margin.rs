//! How far the points that rays leave from keep off the edges of their triangle.
//!
//! A point is rounded to `f32`, and moved off its triangle to the side that a ray leaves to. Close to an edge where another triangle adjoins
//! at less than a straight angle it may be on that one's plane after that, or behind it, and the ray then leaves a closed mesh. With the
//! angle θ between the two, a point at the distance s from the edge, moved by e, is s sin θ − e cos θ ahead of the other's plane; rounding
//! takes away up to 2u‖p‖₁, and e is 3u‖p‖₁ (u is the unit roundoff). So s = [`OFF`]·u‖p‖₁ is enough for all angles from 35 degrees on.
//! In an instance e is the sum of that in the scene and in the group, and so is s.

use crate::ray::UNIT_ROUNDOFF;
use glam::DVec3;
use sampling::fault;

/// The distance from edges, in roundings of the sum of a corner's coordinates.
const OFF: f64 = 8.0 * UNIT_ROUNDOFF as f64;
/// No point is moved farther than so many times that. Only where edges meet at less than 4 degrees is there no place away from both so near;
/// down to 1 degree there is one that is far enough from walls at right angles.
const FARTHEST: f64 = 32.0;
/// No barycentric coordinate need be more.
const THIRD: f64 = 1.0 / 3.0;

/// How far from its edges points of a triangle keep, if it is large enough \[m\].
fn distance(corners: &[DVec3; 3]) -> f64 {
    let sum = |p: &DVec3| p.x.abs() + p.y.abs() + p.z.abs();
    OFF * corners.iter().map(sum).fold(0.0, f64::max)
}

/// The edges across from the corners, and twice the area.
fn edges([a, b, c]: &[DVec3; 3]) -> ([DVec3; 3], f64) {
    ([c - b, a - c, b - a], (b - a).cross(c - a).length())
}

/// The least barycentric coordinates of the three corners.
fn least(corners: &[DVec3; 3]) -> [f64; 3] {
    let (distance, (edges, double_area)) = (distance(corners), edges(corners));
    // Those of a triangle without area are a third, NaN or not.
    edges.map(|edge| (distance * edge.length() / double_area).min(THIRD))
}

/// The greatest of the least barycentric coordinates: a point of which none is less is off the edges.
pub(crate) fn greatest_least(corners: &[DVec3; 3]) -> f64 {
    least(corners).into_iter().fold(0.0, f64::max)
}

/// Whether a point is so many times as far from the edges as it need be, for certain.
#[inline]
fn is_off(corners: &[DVec3; 3], b: [f64; 2], times: f64) -> bool {
    let (distance, least) = (times * distance(corners), b[0].min(b[1]).min(1.0 - b[0] - b[1]).max(0.0));
    let [u, v] = [corners[1] - corners[0], corners[2] - corners[0]];
    let longest = u.length_squared().max(v.length_squared()).max((v - u).length_squared());
    let is_off = least * least * u.cross(v).length_squared() >= distance * distance * longest;
    fault!("points_on_edges", is_off, true)
}

/// Barycentric coordinates of the corners 1 and 2, moved off the edges.
#[inline]
pub(crate) fn off_edges(corners: &[DVec3; 3], b: [f64; 2]) -> [f64; 2] {
    if is_off(corners, b, 1.0) { b } else { moved(corners, least(corners), b) }
}

/// The same of a triangle that has these corners in the scene, and others in the group that it is kept in.
#[inline]
pub(crate) fn off_placed_edges(placed: &[DVec3; 3], local: &[DVec3; 3], b: [f64; 2]) -> [f64; 2] {
    if is_off(placed, b, 2.0) && is_off(local, b, 2.0) {
        return b;
    }
    let (there, here) = (least(placed), least(local));
    moved(placed, [0, 1, 2].map(|i| (there[i] + here[i]).min(THIRD)), b)
}

/// A point moved away from each edge that it is too close to, until its coordinates are no less than these, or as far as is allowed.
#[cold]
#[inline(never)]
fn moved(corners: &[DVec3; 3], least: [f64; 3], b: [f64; 2]) -> [f64; 2] {
    let (edges, double_area) = edges(corners);
    let mut weights = [1.0 - b[0] - b[1], b[0], b[1]];
    for i in 0..3 {
        let [j, k] = [(i + 1) % 3, (i + 2) % 3];
        // At a right angle to the edge.
        let foot = -edges[k].dot(edges[i]) / edges[i].length_squared();
        let short = (least[i] - weights[i]).max(0.0);
        weights[i] += short;
        weights[j] -= short * (1.0 - foot);
        weights[k] -= short * foot;
    }
    // Close to a corner that may have led across another edge.
    let b1 = weights[1].min(1.0 - least[0] - least[2]).max(least[1]);
    let b2 = weights[2].min(1.0 - least[0] - b1).max(least[2]);
    let change = [b1 - b[0], b2 - b[1]];
    let way = (point(corners, change) - corners[0]).length();
    let reach = [0, 1, 2].map(|i| least[i] * double_area / edges[i].length()).into_iter().fold(0.0, f64::max);
    let share = (FARTHEST * reach / way).min(1.0);
    if share < 1.0 { [b[0] + change[0] * share, b[1] + change[1] * share] } else { [b1, b2] }
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
        let edge = |from: usize, to: usize| (corners[to] - corners[from]).normalize();
        [(1, 2), (2, 0), (0, 1)].map(|(from, to)| (p - corners[from]).cross(edge(from, to)).length())
    }

    /// Triangles of all sizes, some of them a thousand times as long as they are wide, and points on their edges, at their corners, and inside.
    #[test]
    fn points_are_moved_off_the_edges_and_not_far() {
        let mut random = Random::new(5);
        for (size, width) in [1e-4, 1e-2, 1.0, 1e6].into_iter().flat_map(|size| [1.0, 0.03, 1e-3].map(|w| (size, w))) {
            for i in 0..3000 {
                let (x, at) = (random.direction().as_dvec3(), random.direction().as_dvec3());
                let y = x.cross(random.direction().as_dvec3()).normalize();
                let mut share = || f64::from(random.next_1d());
                let mut corners = [at, at + x * size, at + (x * share() + y * width) * size];
                corners.rotate_left(i % 3);
                let s = distance(&corners);
                let t = 0.1 + 0.8 * share();
                let b = [[0.0, t], [t, 0.0], [t, 1.0 - t], [0.3, 0.3], [0.0, 0.0], [1.0, 0.0], [0.0, 1.0]][i % 7];
                let moved = off_edges(&corners, b);
                let way = point(&corners, b).distance(point(&corners, moved));
                assert!(way <= FARTHEST * s * (1.0 + 1e-6), "{corners:?} {b:?}: {way} {s}");
                assert!(moved[0] >= 0.0 && moved[1] >= 0.0 && moved[0] + moved[1] <= 1.0);
                assert!(is_off(&corners, b, 1.0) == (moved == b) || greatest_least(&corners) >= THIRD);
                // In the middle of an edge the way is at a right angle to it, where the triangle has room.
                let has_room = size * width > 100.0 * s;
                if i % 7 < 3 && has_room {
                    assert!(way < s * (1.0 + 1e-6), "{corners:?} {b:?}: {way} {s}");
                    let least = distances(&corners, point(&corners, moved)).into_iter().fold(f64::INFINITY, f64::min);
                    assert!(least >= s * (1.0 - 1e-6), "{corners:?} {b:?}: {least} {s}");
                }
            }
        }
    }

    #[test]
    fn a_triangle_smaller_than_that_has_its_middle() {
        let corners = [DVec3::ONE, DVec3::ONE + DVec3::X * 1e-9, DVec3::ONE + DVec3::Y * 1e-9];
        assert!(off_edges(&corners, [0.0, 0.0]).iter().all(|b| (b - THIRD).abs() < 1e-12));
        assert!(off_edges(&[DVec3::ONE; 3], [0.2, 0.3]).iter().all(|b| b.is_finite()));
        assert!(off_edges(&[DVec3::ZERO; 3], [0.2, 0.3]).iter().all(|b| b.is_finite()));
    }

    /// Of a placed triangle both margins add up.
    #[test]
    fn a_placed_triangle_has_both_margins() {
        let local = [DVec3::ZERO, DVec3::X, DVec3::Y].map(|p| p + DVec3::ONE);
        for (scale, shift) in [(1.0, 0.0), (1e-3, 0.0), (1.0, 1e4), (1e3, -5.0)] {
            let placed = local.map(|p| p * scale + shift);
            let b = off_placed_edges(&placed, &local, [0.0, 0.4]);
            let off = distances(&placed, point(&placed, b))[1];
            let expected = distance(&placed) + distance(&local) * scale;
            assert!((off / expected - 1.0).abs() < 1e-3 || b[0] == THIRD, "{scale} {shift}: {off} {expected}");
        }
    }
}
