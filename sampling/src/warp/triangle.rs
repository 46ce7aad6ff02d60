//! A triangle as it is seen from a point: places on it, uniform over the solid angle that it fills `[Arvo95]`.

use glam::{DVec3, Vec2};

/// A triangle seen from the origin, off its plane.
///
/// The solid angle Ω of corners in the directions a, b, c is known by `tan(Ω/2) = [a, b, c] / (1 + a·b + b·c + c·a)` `[VanOosterom83, (8)]`.
/// A share of it lies between the arcs from b to a and from b to a place c′ on the arc from a to c. With t the unit vector at a along
/// that arc and φ the angle from a to c′, the same formula, of a, b and `c′ = a cos φ + t sin φ`, is one of `tan(φ/2)` alone:
///
/// `tan(φ/2) = s (1 + a·b) / (k [a, b, t] − s b·t)`, s and k the sine and the cosine of half of the share's solid angle.
///
/// From b to c′ places go in proportion to the versine `[Arvo95]`.
#[derive(Clone, Copy, Debug)]
pub struct SphericalTriangle {
    corners: [DVec3; 3],
    /// Unit vectors towards them.
    directions: [DVec3; 3],
    /// [a, b, c], positive whichever way round the corners are.
    volume: f64,
    /// Half of the solid angle [sr], below π.
    half: f64,
}

impl SphericalTriangle {
    /// The triangle of these corners, in any unit of length; `normal` is the cross product of its edges from the first corner.
    #[inline]
    pub fn new(corners: [DVec3; 3], normal: DVec3) -> Self {
        let lengths = corners.map(DVec3::length);
        let [a, b, c] = [0, 1, 2].map(|i| corners[i] / lengths[i]);
        // Of small triangles the product of the edges is known better than that of the directions.
        let volume = corners[0].dot(normal).abs() / (lengths[0] * lengths[1] * lengths[2]);
        let half = volume.atan2(1.0 + a.dot(b) + b.dot(c) + c.dot(a));
        Self { corners, directions: [a, b, c], volume, half }
    }

    /// The solid angle that it fills \[sr\], below 2π.
    #[inline]
    pub fn solid_angle(&self) -> f64 {
        2.0 * self.half
    }

    /// A place on it, as barycentric coordinates of its second and third corner, whose direction is uniform over the solid angle.
    #[inline]
    pub fn sample(&self, u: Vec2) -> Vec2 {
        let [_, b, _] = self.directions;
        let c = self.on_the_far_side(f64::from(u.x));
        let versine = f64::from(u.y) * 0.5 * (c - b).length_squared();
        let across = (c - b * b.dot(c)).try_normalize().unwrap_or(DVec3::ZERO);
        let d = b * (1.0 - versine) + across * (versine * (2.0 - versine)).sqrt();
        self.met_by(d)
    }

    /// The place on the arc from the first to the third corner up to which, as seen from the second, this share of it lies.
    #[inline]
    fn on_the_far_side(&self, share: f64) -> DVec3 {
        let [a, b, c] = self.directions;
        let (sin, cos) = (share * self.half).sin_cos();
        let along = c - a * a.dot(c);
        let length = along.length();
        // 1 + a·b where a is all but opposite to b.
        let sum = 0.5 * (a + b).length_squared();
        let tan = sin * sum * length / (cos * self.volume - sin * b.dot(along));
        let square = tan * tan;
        (a * (1.0 - square) + along * (2.0 * tan / length)) / (1.0 + square)
    }

    /// The place that this direction meets.
    #[inline]
    fn met_by(&self, d: DVec3) -> Vec2 {
        let [p, q, r] = self.corners;
        let shares = [q.cross(r - q), r.cross(p - r), p.cross(q - p)].map(|edge| d.dot(edge));
        let sum: f64 = shares.iter().sum();
        let [_, second, third] = shares.map(|share| (share / sum).clamp(0.0, 1.0) as f32);
        Vec2::new(second, third.min(1.0 - second))
    }
}

#[cfg(test)]
mod tests;
