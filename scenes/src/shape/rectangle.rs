//! Rectangles as areas to sample as they are seen from a point.

use super::Parallelogram;
use glam::DVec3;
use sampling::Vec3;
use sampling::warp::SphericalRectangle;

/// A parallelogram whose angles are right, to rounding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// The parallelogram, as it is traced.
    pub quad: Parallelogram,
    middle: DVec3,
    /// Unit vectors along its sides, and the normal of its front.
    axes: [DVec3; 3],
    /// Halves of its sides \[m\].
    half: [f64; 2],
    /// The square of the distance from its middle up to which points are near \[m²\].
    reach2: f64,
    /// The height above its plane from which on it is what it is taken for \[m\].
    least_height: f64,
}

impl Rectangle {
    /// Points within so many of its half diagonals are near. From there on, the solid angle that a part of its area fills differs
    /// by less than 30 % between its middle and the corners, where it is not seen along its plane: too little to pay for the angles.
    pub const NEAR: f64 = 2.0;
    /// The thinnest that are sampled by their solid angle: ratio of the sides.
    const THINNEST: f64 = 1.0 / 64.0;
    /// The least height above its plane, in half diagonals, and in distances that its corners are off a rectangle's: where densities are
    /// right to 10⁻⁶, and to 10⁻⁴.
    const SLANT: (f64, f64) = (1e-3, 1e4);
    /// How far corners may be off, in half diagonals: more is no rectangle.
    const CROOKED: f64 = 1e-5;

    /// The rectangle that a parallelogram is; `None` if its angles are not right, or it is too thin.
    pub fn new(quad: &Parallelogram) -> Option<Self> {
        let corners = quad.corners.map(Vec3::as_dvec3);
        let [a, b, c, d] = corners;
        let middle = 0.25 * (a + b + c + d);
        let (along_u, along_v) = (0.5 * (b - a + c - d), 0.5 * (d - a + c - b));
        let u = along_u.try_normalize()?;
        let v = (along_v - u * along_v.dot(u)).try_normalize()?;
        let half = [0.5 * along_u.length(), 0.5 * along_v.length()];
        let diagonal = half[0].hypot(half[1]);
        let ideal = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(i, j)| middle + u * (i * half[0]) + v * (j * half[1]));
        let off = corners.iter().zip(ideal).map(|(corner, ideal)| corner.distance(ideal)).fold(0.0, f64::max);
        let (short, long) = (half[0].min(half[1]), half[0].max(half[1]));
        (off <= Self::CROOKED * diagonal && short >= Self::THINNEST * long).then(|| Rectangle {
            quad: *quad,
            middle,
            axes: [u, v, u.cross(v) * u.cross(v).dot(quad.normals[0].as_dvec3()).signum()],
            half,
            reach2: (Self::NEAR * diagonal).powi(2),
            least_height: (Self::SLANT.0 * diagonal).max(Self::SLANT.1 * off),
        })
    }

    /// Whether a point is behind it, so far off its plane that no rounding brings it to the front.
    #[inline]
    pub fn is_behind(&self, p: Vec3) -> bool {
        (self.middle - p.as_dvec3()).dot(self.axes[2]) > self.least_height
    }

    /// As it is seen from a point; `None` if that is not near, or all but in its plane. Places on it are shares of the sides that
    /// [`Parallelogram::sample`] takes.
    #[inline]
    pub fn seen_from(&self, p_ref: Vec3) -> Option<SphericalRectangle> {
        let to_middle = self.middle - p_ref.as_dvec3();
        let height = to_middle.dot(self.axes[2]).abs();
        if to_middle.length_squared() > self.reach2 || height < self.least_height {
            return None;
        }
        let side = |i: usize| {
            let middle = to_middle.dot(self.axes[i]);
            [middle - self.half[i], middle + self.half[i]]
        };
        Some(SphericalRectangle::new(side(0), side(1), height))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::{vec2, vec3};

    /// With `edge_u` and `edge_v` from a corner, rounded.
    fn quad(corner: DVec3, edge_u: DVec3, edge_v: DVec3) -> Parallelogram {
        let corners =
            [corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v].map(|corner| corner.as_vec3());
        let normal = edge_u.cross(edge_v).normalize().as_vec3();
        Parallelogram { corners, normals: [normal; 2], turned: false }
    }

    #[test]
    fn rectangles_are_those_whose_angles_are_right() {
        let slanting = (DVec3::new(0.6, 0.0, 0.8), DVec3::new(-0.4, 1.5, 0.3));
        for scale in [1e-6, 1.0, 1e6] {
            let (u, v) = (slanting.0 * scale, slanting.1 * scale);
            assert!(Rectangle::new(&quad(DVec3::splat(0.3 * scale), u, v)).is_some(), "{scale}");
            assert!(Rectangle::new(&quad(DVec3::ZERO, u, v + 0.01 * u)).is_none(), "{scale}");
            assert!(Rectangle::new(&quad(DVec3::ZERO, u, 0.001 * v)).is_none(), "{scale}");
        }
        // So far from the origin its corners are anywhere.
        assert!(Rectangle::new(&quad(DVec3::splat(1e5), slanting.0, slanting.1)).is_none());
    }

    #[test]
    fn it_is_seen_from_near_it_and_off_its_plane() {
        let rectangle = Rectangle::new(&quad(DVec3::new(-1.0, -1.0, 0.0), DVec3::X * 2.0, DVec3::Y * 2.0)).unwrap();
        let is_seen = |x: f32, y: f32, z: f32| rectangle.seen_from(vec3(x, y, z)).is_some();
        assert!(is_seen(0.0, 0.0, 2.5) && is_seen(0.0, 0.0, -2.5) && is_seen(2.0, 1.0, 0.1) && is_seen(0.3, 0.2, 0.01));
        assert!(!is_seen(0.0, 0.0, 2.9) && !is_seen(0.0, 0.0, 0.0) && !is_seen(3.0, 0.0, 1e-3));
    }

    #[test]
    fn what_is_behind_it_is_off_its_plane() {
        let quad = quad(DVec3::new(-1.0, -1.0, 0.5), DVec3::X * 2.0, DVec3::Y * 2.0);
        let turned = Parallelogram { normals: quad.normals.map(|n| -n), ..quad };
        let behind = |quad: &Parallelogram, z: f32| Rectangle::new(quad).unwrap().is_behind(vec3(3.0, 0.0, z));
        assert_eq!([0.4, 0.4999, 0.5, 0.6].map(|z| behind(&quad, z)), [true, false, false, false]);
        assert_eq!([0.4, 0.5, 0.5001, 0.6].map(|z| behind(&turned, z)), [false, false, false, true]);
    }

    /// What it looks like from a point is where its places are.
    #[test]
    fn shares_are_those_of_the_parallelogram() {
        let quad = quad(DVec3::new(0.2, -0.7, 0.9), DVec3::new(0.6, 0.0, 0.8), DVec3::new(0.0, 1.5, 0.0));
        let (rectangle, p) = (Rectangle::new(&quad).unwrap(), vec3(0.9, 0.4, 0.3));
        let seen = rectangle.seen_from(p).unwrap();
        // Solid angles of 8 × 8 parts by the areas and slants of smaller ones, and by the share of random numbers that lead there.
        const N: usize = 1024;
        let (mut counts, mut parts) = ([0.0; 64], [0.0; 64]);
        for i in 0..N * N {
            let u = vec2((i % N) as f32 + 0.5, (i / N) as f32 + 0.5) / N as f32;
            let part = |b: sampling::Vec2| (b.y * 8.0) as usize * 8 + (b.x * 8.0) as usize;
            counts[part(seen.sample(u))] += seen.solid_angle() / (N * N) as f64;
            let d = (quad.sample(u).p - p).as_dvec3();
            parts[part(u)] += 1.5 / (N * N) as f64 * d.dot(quad.normals[0].as_dvec3()).abs() / d.length().powi(3);
        }
        for (i, (count, part)) in counts.iter().zip(&parts).enumerate() {
            // Of 128 rows and columns to a part, one may be counted to the next.
            assert!((count / part - 1.0).abs() < 0.03, "{i}: {count} and {part}");
        }
        let (sum, whole) = (parts.iter().sum::<f64>(), seen.solid_angle());
        assert!((sum / whole - 1.0).abs() < 1e-3, "{sum} and {whole}");
    }
}
