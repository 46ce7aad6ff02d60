//! Emitters as they are seen from points near them.

use std::f64::consts::PI;

use glam::{DVec3, vec2};
use sampling::warp::{SphericalRectangle, SphericalTriangle};

use super::{Dice, TRIES, Worst, double, single};

/// The solid angle of a polygon by the angles at its corners (Girard), each that between the planes of two edges.
fn by_angles(corners: &[DVec3]) -> f64 {
    let count = corners.len();
    let angle = |i: usize| {
        let [before, at, after] = [i + count - 1, i, i + 1].map(|i| corners[i % count].normalize());
        let (x, y) = (at.cross(before), at.cross(after));
        x.cross(y).length().atan2(x.dot(y))
    };
    (0..count).map(angle).sum::<f64>() - (count - 2) as f64 * PI
}

/// A triangle that is not thin, and a point within two of its sizes and off its plane by a thousandth at least, as the origin.
fn triangle(dice: &mut Dice) -> Option<[DVec3; 3]> {
    let size = dice.magnitude(1e-6, 1e6);
    let (u, v) = (dice.anywhere(), dice.anywhere());
    let (u, v) = (u, (v * dice.magnitude(0.05, 1.0) + u * dice.unit()));
    let normal = u.cross(v);
    let height = dice.magnitude(2e-3, 2.0) * if dice.unit() < 0.5 { 1.0 } else { -1.0 };
    let beside = u * (3.0 * dice.unit() - 1.5) + v * (3.0 * dice.unit() - 1.5);
    let origin = beside + normal.normalize() * height;
    let is_compact = normal.length() > u.length().max(v.length()).powi(2) / 32.0;
    is_compact.then(|| [DVec3::ZERO, u, v].map(|corner| (corner - origin) * size))
}

fn seen([p, q, r]: [DVec3; 3]) -> SphericalTriangle {
    SphericalTriangle::new([p, q, r], (q - p).cross(r - p))
}

/// Solid angles, and the share of them that lies on either side of where two numbers lead.
#[test]
fn spherical_triangles() {
    let mut dice = Dice::new(16);
    let [mut whole, mut across, mut along] =
        ["solid angle of a triangle", "its share across", "its share along"].map(Worst::of);
    for _ in 0..TRIES {
        let Some(corners) = triangle(&mut dice) else { continue };
        let [p, q, r] = corners;
        let found = seen(corners);
        let at = || format!("{corners:?}");
        let exact = by_angles(&corners);
        // Directions are rounded, and count the more the more they lie along the plane.
        let height = p.dot((q - p).cross(r - p).normalize()).abs();
        let slant = corners.map(DVec3::length).into_iter().fold(0.0, f64::max) / height;
        whole.add_in(found.solid_angle(), exact, double(1.0) * (1.0 + slant), at);
        let u = vec2(dice.number(), dice.number());
        let b = found.sample(u).as_dvec2();
        let met = p * (1.0 - b.x - b.y) + q * b.x + r * b.y;
        // Coordinates are rounded to 2⁻²⁴ of the edges, which are seen under an angle that is the larger the nearer they are.
        let step = single(1.0) * (q - p).length().max((r - p).length()) / met.length();
        let beyond = far_side(corners, met);
        let versine = |d: DVec3| (d.normalize() - q.normalize()).length_squared();
        let most = versine(beyond);
        let unit = single(1.0) + 2.0 * step * (versine(met) / most / most).sqrt();
        along.add_in(versine(met) / most.max(f64::MIN_POSITIVE), f64::from(u.y), unit, || format!("{u}, {}", at()));
        // Near the second corner no coordinate tells which way it was left.
        let off = q.normalize().cross(met.normalize()).length();
        if off > 10.0 * step {
            // By the angles nothing is known of a part so thin as this may be.
            let share = seen([p, q, beyond]).solid_angle() / exact;
            // Between two arcs from it lies twice the versine over the angle.
            let unit = single(1.0) + 2.0 * step / off / exact;
            across.add_in(share, f64::from(u.x), unit, || format!("{u}, {}", at()));
        }
    }
    whole.finish(30.0);
    across.finish(0.5);
    along.finish(0.5);
}

/// Where the plane through the second corner and a place meets the opposite edge.
fn far_side([p, q, r]: [DVec3; 3], met: DVec3) -> DVec3 {
    let plane = q.cross(met).normalize();
    let (before, after) = (plane.dot(p).abs(), plane.dot(r).abs());
    (p * after + r * before) / (before + after)
}

/// Rectangles fill what their angles say.
#[test]
fn spherical_rectangles() {
    let mut dice = Dice::new(17);
    let mut worst = Worst::of("solid angle of a rectangle");
    for _ in 0..TRIES {
        let size = dice.magnitude(1e-6, 1e6);
        let mut side = |half: f64| {
            let middle = 3.0 * dice.unit() - 1.5;
            [(middle - half) * size, (middle + half) * size]
        };
        let (x, y) = (side(0.5), side(0.25));
        let z = dice.magnitude(2e-3, 2.0) * size;
        let corners = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, j)| DVec3::new(x[i], y[j], z));
        let exact = by_angles(&corners);
        let found = SphericalRectangle::new(x, y, z).solid_angle();
        let slant = corners.map(DVec3::length).into_iter().fold(0.0, f64::max) / z;
        worst.add_in(found, exact, double(1.0) * (1.0 + slant), || format!("{corners:?}"));
    }
    worst.finish(8.0);
}
