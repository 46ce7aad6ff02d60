//! Polygons to triangles.

use glam::{DVec2, DVec3};

/// Clipping an ear looks at all corners, so the work grows with the square of their number at the least.
const MAX_CONCAVE: usize = 2048;

/// Cuts a polygon into triangles of corner indices that keep its orientation.
///
/// Convex polygons become the fan of their first corner; other simple polygons have their ears clipped (Meisters 1975),
/// in the plane of the polygon's mean normal. A polygon that isn't simple, spans no area, or is concave with more than
/// 2048 corners, gives its fan.
pub fn triangulate(points: &[DVec3]) -> impl Iterator<Item = [usize; 3]> + use<> {
    let triangles = match points.len() {
        0..=2 => Vec::new(),
        3 => vec![[0, 1, 2]],
        n => {
            let flat = project(points);
            if is_convex(&flat) { fan(n) } else { clip_ears(&flat).unwrap_or_else(|| fan(n)) }
        }
    };
    triangles.into_iter()
}

fn fan(n: usize) -> Vec<[usize; 3]> {
    (1..n - 1).map(|i| [0, i, i + 1]).collect()
}

/// The polygon along its mean normal (Newell's), in which it runs counter-clockwise.
fn project(points: &[DVec3]) -> Vec<DVec2> {
    let pairs = || points.iter().zip(points.iter().cycle().skip(1));
    let normal: DVec3 = pairs().map(|(a, b)| (*a - points[0]).cross(*b - points[0])).sum();
    let Some(normal) = normal.try_normalize() else { return vec![DVec2::ZERO; points.len()] };
    let (x, y) = normal.any_orthonormal_pair();
    points.iter().map(|p| DVec2::new((*p - points[0]).dot(x), (*p - points[0]).dot(y))).collect()
}

fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

fn is_convex(p: &[DVec2]) -> bool {
    let n = p.len();
    let turns = |i: usize| turn(p[i], p[(i + 1) % n], p[(i + 2) % n]);
    // A star polygon turns left everywhere too, but more than once around; its fan is as good as anything.
    (0..n).all(|i| turns(i) >= 0.0)
}

/// Cuts off ears until a triangle is left; `None` where the polygon is not simple.
fn clip_ears(p: &[DVec2]) -> Option<Vec<[usize; 3]>> {
    if p.len() > MAX_CONCAVE {
        return None;
    }
    let mut rest: Vec<usize> = (0..p.len()).collect();
    let mut triangles = Vec::with_capacity(p.len() - 2);
    while rest.len() > 3 {
        let n = rest.len();
        let ear = (0..n).find(|&i| is_ear(p, &rest, i))?;
        triangles.push([rest[(ear + n - 1) % n], rest[ear], rest[(ear + 1) % n]]);
        rest.remove(ear);
    }
    triangles.push([rest[0], rest[1], rest[2]]);
    Some(triangles)
}

/// Whether the corner turns left and its triangle holds no other corner.
fn is_ear(p: &[DVec2], rest: &[usize], i: usize) -> bool {
    let n = rest.len();
    let corners = [rest[(i + n - 1) % n], rest[i], rest[(i + 1) % n]];
    let [a, b, c] = corners.map(|j| p[j]);
    if turn(a, b, c) <= 0.0 {
        return false;
    }
    let inside = |q: DVec2| turn(a, b, q) >= 0.0 && turn(b, c, q) >= 0.0 && turn(c, a, q) >= 0.0;
    !rest.iter().any(|&j| !corners.contains(&j) && p[j] != a && p[j] != c && inside(p[j]))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn area(points: &[DVec3], triangles: &[[usize; 3]]) -> (f64, f64) {
        let areas = triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| points[i]);
            0.5 * (b - a).cross(c - a).z
        });
        areas.fold((0.0, 0.0), |(signed, total), a| (signed + a, total + a.abs()))
    }

    fn check(corners: &[(f64, f64)], expected: f64) {
        let points: Vec<DVec3> = corners.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect();
        for start in 0..points.len() {
            let mut turned = points.clone();
            turned.rotate_left(start);
            let triangles: Vec<_> = triangulate(&turned).collect();
            assert_eq!(triangles.len(), points.len() - 2, "start {start}");
            let (signed, total) = area(&turned, &triangles);
            assert!((total - expected).abs() < 1e-12, "start {start}: area {total} instead of {expected}");
            assert!((signed - expected).abs() < 1e-12, "start {start}: a triangle is turned over");
        }
    }

    #[test]
    fn convex_and_concave_polygons_are_covered_once() {
        check(&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], 1.0);
        // A dart, an L, and a comb: fans of these leave the polygon.
        check(&[(0.0, 0.0), (2.0, -1.0), (0.5, 0.0), (2.0, 1.0)], 0.5);
        check(&[(0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)], 3.0);
        check(&[(0.0, 0.0), (5.0, 0.0), (5.0, 3.0), (4.0, 1.0), (3.0, 3.0), (2.0, 1.0), (1.0, 3.0), (0.0, 1.0)], 10.0);
    }

    #[test]
    fn nothing_panics_on_odd_input() {
        let nan = DVec3::splat(f64::NAN);
        for points in [vec![], vec![DVec3::ZERO; 2], vec![DVec3::ZERO; 7], vec![nan; 5]] {
            let n = points.len();
            assert_eq!(triangulate(&points).count(), n.saturating_sub(2));
        }
        let bow_tie = [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0), (0.0, 1.0), (-3.0, 0.5)].map(|(x, y)| DVec3::new(x, y, 0.0));
        assert_eq!(triangulate(&bow_tie).count(), 3);
    }
}
