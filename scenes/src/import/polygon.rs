//! Polygons to triangles.

mod grid;

use std::collections::VecDeque;

use glam::{DVec2, DVec3};

use grid::Grid;

/// Up to so many corners a convex polygon becomes a fan. Larger fans would be needles all through one another.
const FAN: usize = 16;
/// For each corner of a polygon at most so many others are looked at.
const PATIENCE: usize = 4096;

/// Cuts a polygon into triangles of corner indices that keep its orientation.
///
/// Small convex polygons become the fan of their first corner; other simple polygons have their ears clipped (Meisters 1975),
/// in the plane of the polygon's mean normal. Of a polygon that isn't simple, or spans no area, the triangles that are left when no ear
/// is may lie over one another.
pub fn triangulate(points: &[DVec3]) -> impl Iterator<Item = [usize; 3]> + use<> {
    let triangles = match points.len() {
        0..=2 => Vec::new(),
        3 => vec![[0, 1, 2]],
        n => {
            let flat = project(points);
            match is_convex(&flat) {
                true if n <= FAN => (1..n - 1).map(|i| [0, i, i + 1]).collect(),
                convex => clip_ears(&flat, convex),
            }
        }
    };
    triangles.into_iter()
}

/// The polygon seen along an axis, near its mean normal (Newell's), so that it runs counter-clockwise and no coordinate is rounded.
fn project(points: &[DVec3]) -> Vec<DVec2> {
    let pairs = points.iter().zip(points.iter().cycle().skip(1));
    let normal: DVec3 = pairs.map(|(a, b)| (*a - points[0]).cross(*b - points[0])).sum();
    let axis = normal.abs().max_position();
    let (x, y) = ((axis + 1) % 3, (axis + 2) % 3);
    let (x, y) = if normal[axis] < 0.0 { (y, x) } else { (x, y) };
    points.iter().map(|p| DVec2::new(p[x], p[y])).collect()
}

fn turn(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    (b - a).perp_dot(c - b)
}

fn is_convex(p: &[DVec2]) -> bool {
    let n = p.len();
    let turns = |i: usize| turn(p[i], p[(i + 1) % n], p[(i + 2) % n]);
    // A star polygon turns left everywhere too, but more than once around; what it is cut into is as good as anything.
    (0..n).all(|i| turns(i) >= 0.0)
}

/// Cuts off ears until a triangle is left.
///
/// To cut one off changes only what its neighbours are (O'Rourke 1998, §1.3), so that each corner is looked at again only when it gets
/// another neighbour. Then it waits for its turn behind all others: the ears grow evenly all around.
fn clip_ears(p: &[DVec2], convex: bool) -> Vec<[usize; 3]> {
    let n = p.len();
    let mut before: Vec<usize> = (0..n).map(|i| (i + n - 1) % n).collect();
    let mut after: Vec<usize> = (0..n).map(|i| (i + 1) % n).collect();
    let turns_right = |&i: &usize| turn(p[before[i]], p[i], p[after[i]]) <= 0.0;
    let grid = Grid::new(p, if convex { Vec::new() } else { (0..n).filter(turns_right).collect() });
    // How often a corner got another neighbour, or that it is gone.
    const GONE: u32 = u32::MAX;
    let mut version = vec![0u32; n];
    let mut queue: VecDeque<(usize, u32)> = (0..n).map(|i| (i, 0)).collect();
    let mut triangles = Vec::with_capacity(n - 2);
    let mut patience = PATIENCE.saturating_mul(n);
    let mut take_any = false;
    while triangles.len() < n - 3 {
        let Some((corner, seen)) = queue.pop_front() else {
            // A simple polygon has two ears at the least.
            take_any = true;
            queue.extend((0..n).filter(|&i| version[i] != GONE).map(|i| (i, version[i])));
            continue;
        };
        let ear = [before[corner], corner, after[corner]];
        if version[corner] != seen || !(take_any || is_ear(p, ear, &grid, |i| version[i] != GONE, &mut patience)) {
            continue;
        }
        take_any |= patience == 0;
        triangles.push(ear);
        let [a, _, c] = ear;
        (after[a], before[c], version[corner]) = (c, a, GONE);
        for neighbour in [a, c] {
            version[neighbour] += 1;
            queue.push_back((neighbour, version[neighbour]));
        }
    }
    let left = triangles[n - 4][0];
    triangles.push([before[left], left, after[left]]);
    triangles
}

/// Whether the corner turns left and its triangle holds none of the corners in a grid that are still there.
fn is_ear(p: &[DVec2], ear: [usize; 3], grid: &Grid, is_there: impl Fn(usize) -> bool, patience: &mut usize) -> bool {
    let [a, b, c] = ear.map(|i| p[i]);
    if turn(a, b, c) <= 0.0 {
        return false;
    }
    let inside = |q: DVec2| turn(a, b, q) >= 0.0 && turn(b, c, q) >= 0.0 && turn(c, a, q) >= 0.0;
    !grid.near([a, b, c]).any(|i| {
        *patience = patience.saturating_sub(1);
        let q = p[i];
        is_there(i) && !ear.contains(&i) && q != a && q != c && inside(q)
    })
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

    /// A closed curve of `n` corners, at angles that grow.
    fn around(n: usize, radius: impl Fn(usize) -> f64) -> Vec<DVec3> {
        let at = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
        (0..n).map(|i| radius(i) * DVec3::new(at(i).cos(), at(i).sin(), 0.0)).collect()
    }

    /// A number in [0, 1) that looks random.
    fn scattered(i: usize) -> f64 {
        (i as f64 * 0.754_877_666).fract()
    }

    #[test]
    fn large_polygons_are_covered_once() {
        for n in [400, 3_000, 100_000] {
            let at = |i: usize| i as f64 / n as f64;
            let line = |height: f64| {
                let corner = |i: usize| DVec3::new(at(i), if i + 1 < n { height * scattered(i) } else { 0.0 }, 0.0);
                (0..n).map(corner).chain([DVec3::new(0.5, 1.0, 0.0)]).collect::<Vec<_>>()
            };
            // There along a spiral, and back beside it.
            let spiral = |i: usize| {
                let (along, gap) = if i < n / 2 { (at(i), 0.0) } else { (at(n - 1 - i), 0.01) };
                let angle = 80.0 * along;
                (0.05 + 2.0 * along + gap) * DVec3::new(angle.cos(), angle.sin(), 0.0)
            };
            // An annulus cut open: its two borders meet along one edge.
            let mut annulus = around(n, |_| 1.0);
            annulus.push(annulus[0]);
            annulus.push(DVec3::new(0.5, 0.0, 0.0));
            annulus.extend(around(n, |_| 0.5).into_iter().rev());
            // A plate with a round bite: from each of its far corners a fan of needles.
            let bite = around(2 * n, |_| 0.9).into_iter().take(n).rev();
            let plate = [(1.0, 0.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, 0.0)].map(|(x, y)| DVec3::new(x, y, 0.0));
            let polygons = [
                ("circle", around(n, |_| 1.0)),
                ("line", line(0.0)),
                ("noisy line", line(1e-9)),
                ("comb", line(-1.0)),
                ("star", around(n, |i| 1.0 + 0.5 * (i % 2) as f64)),
                ("burst", around(n, |i| 0.1 + scattered(i))),
                ("spiral", (0..n).map(spiral).collect()),
                ("annulus", annulus),
                ("bite", bite.chain(plate).collect()),
            ];
            for (name, points) in polygons {
                let triangles: Vec<_> = triangulate(&points).collect();
                assert_eq!(triangles.len(), points.len() - 2, "{name} of {n}");
                let pairs = points.iter().zip(points.iter().cycle().skip(1));
                let expected: f64 = pairs.map(|(a, b)| 0.5 * a.cross(*b).z).sum();
                let (signed, total) = area(&points, &triangles);
                assert!((signed - expected).abs() < 1e-9, "{name} of {n}: {signed} instead of {expected}");
                assert!((total - expected.abs()).abs() < 1e-9, "{name} of {n}: triangles of {total} cover {expected}");
            }
        }
    }

    #[test]
    fn large_convex_polygons_are_no_fans() {
        let points = around(4096, |_| 1.0);
        let mut shares = vec![0; points.len()];
        triangulate(&points).flatten().for_each(|i| shares[i] += 1);
        assert!(shares.iter().all(|&share| share <= 30));
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
        let chaos = |i: usize| DVec3::new(scattered(i), scattered(i * i), 0.0);
        let chaos: Vec<DVec3> = (0..20_000).map(chaos).collect();
        assert_eq!(triangulate(&chaos).count(), chaos.len() - 2);
    }
}
