//! Orthonormal frames.

use glam::Vec3;

/// A right-handed orthonormal frame in world space; z is the shading normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// First tangent.
    pub x: Vec3,
    /// Second tangent, z × x.
    pub y: Vec3,
    /// Normal.
    pub z: Vec3,
}

impl Frame {
    /// A frame around the unit vector `n`, without a seam except at the sign change of `n.z` `[Duff17]`.
    #[inline]
    pub fn from_z(n: Vec3) -> Self {
        let sign = 1.0_f32.copysign(n.z);
        let a = -1.0 / (sign + n.z);
        let b = n.x * n.y * a;
        Self {
            x: Vec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
            y: Vec3::new(b, sign + n.y * n.y * a, -n.y),
            z: n,
        }
    }

    /// The frame around the unit vector `n` whose x axis is nearest to `tangent`, of length 1 or less; [`from_z`](Self::from_z)
    /// where less than 10⁻⁵ of it is across `n`.
    #[inline]
    pub fn from_z_x(n: Vec3, tangent: Vec3) -> Self {
        let across = tangent - n * n.dot(tangent);
        if across.length_squared() < 1e-10 {
            return Self::from_z(n);
        }
        // Once more, for what rounding has left along the normal.
        let across = across.normalize();
        let x = (across - n * n.dot(across)).normalize();
        Self { x, y: n.cross(x), z: n }
    }

    /// The local coordinates of a world-space vector.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(self.x.dot(v), self.y.dot(v), self.z.dot(v))
    }

    /// The world-space vector with local coordinates `v`.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        v.x * self.x + v.y * self.y + v.z * self.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::warp::uniform_sphere;
    use glam::{vec2, vec3};

    fn normals() -> Vec<Vec3> {
        let mut normals: Vec<Vec3> =
            (0..4096).map(|i| uniform_sphere(vec2((i % 64) as f32 / 64.0, (i / 64) as f32 / 64.0))).collect();
        normals.extend([Vec3::X, Vec3::Y, Vec3::Z, -Vec3::Z, vec3(1.0, 0.0, -0.0), vec3(1.0, 0.0, 0.0)]);
        for tiny in [1e-4, 1e-7, 1e-20] {
            for sign in [1.0, -1.0] {
                normals.push(vec3(tiny, -tiny, sign).normalize());
                normals.push(vec3(1.0, tiny, sign * tiny).normalize());
            }
        }
        normals
    }

    #[test]
    fn frames_are_orthonormal_and_right_handed() {
        for n in normals() {
            let f = Frame::from_z(n);
            for v in [f.x, f.y, f.z] {
                assert!((v.length() - 1.0).abs() < 1e-6, "{n} {v}");
            }
            assert!(f.x.dot(f.y).abs() < 1e-6 && f.y.dot(f.z).abs() < 1e-6 && f.z.dot(f.x).abs() < 1e-6, "{n}");
            assert!((f.x.cross(f.y) - f.z).length() < 1e-6, "{n}");
        }
    }

    #[test]
    fn frames_follow_their_tangent() {
        for n in normals() {
            for tangent in [Vec3::X, vec3(0.3, -2e-3, 1.0), vec3(1e-4, 2e-4, 0.0), n, Vec3::ZERO] {
                let f = Frame::from_z_x(n, tangent);
                for v in [f.x, f.y, f.z] {
                    assert!((v.length() - 1.0).abs() < 1e-6, "{n} {tangent} {v}");
                }
                assert!(f.x.dot(f.y).abs() < 1e-6 && f.x.dot(n).abs() < 2e-6 && (f.x.cross(f.y) - n).length() < 2e-6);
                assert!(
                    f.y.dot(tangent).abs() <= 1e-5 * tangent.length().max(1e-30)
                        || n.dot(tangent.normalize_or_zero()).abs() > 0.999
                );
            }
        }
    }

    #[test]
    fn to_world_inverts_to_local() {
        let v = vec3(0.3, -2.0, 0.7);
        for n in normals() {
            let f = Frame::from_z(n);
            assert!((f.to_world(f.to_local(v)) - v).length() < 3e-6, "{n}");
        }
    }
}
