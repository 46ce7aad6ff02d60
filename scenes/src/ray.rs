//! Rays, and points that rays can leave without meeting their own surface again.

use sampling::Vec3;
use sampling::fault;

/// The unit roundoff of `f32`, 2⁻²⁴: a rounded result is within this of the exact one, relatively.
pub const UNIT_ROUNDOFF: f32 = f32::EPSILON * 0.5;

/// The part of a ray's line that is looked at: the points `o + t·d` for `t` in the open interval (0, `t_max`).
#[derive(Clone, Copy, Debug)]
pub struct Ray {
    /// Origin \[m\].
    pub o: Vec3,
    /// Direction: unit for walks; the unnormalised difference of the ends for segments.
    pub d: Vec3,
    /// End of the interval, in units of `d`; infinite for walks, [`SEGMENT_END`] for segments.
    pub t_max: f32,
}

/// Where a segment's interval ends: eight roundings short of the far end, so that no surface which that end happens to lie on hides it,
/// as a wall does whose distance is rounded. It matters to ends that no normal leads off a surface: a camera or a point emitter at a wall.
pub const SEGMENT_END: f32 = 1.0 - 8.0 * UNIT_ROUNDOFF;

impl Ray {
    /// The unbounded ray from `o` along `d`.
    #[inline]
    pub fn new(o: Vec3, d: Vec3) -> Self {
        Ray { o, d, t_max: f32::INFINITY }
    }

    /// The point at parameter `t`, to rounding.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.o + self.d * t
    }
}

/// A point on (or off) a surface that rays can leave without hitting it again.
///
/// `p` is known to lie within `p_error` of the surface with room for the rounding of one addition, so that `p ± p_error·ng`
/// is on the intended side however large or small the scene is \[PBRT4, 6.8\]: there is no global epsilon.
#[derive(Clone, Copy, Debug)]
pub struct SurfacePoint {
    /// Position \[m\].
    pub p: Vec3,
    /// Unit geometric normal of the surface's own front; zero off surfaces.
    pub ng: Vec3,
    /// How far an origin must be moved along the normal to be off the surface for certain \[m\].
    pub p_error: f32,
}

impl SurfacePoint {
    /// A point that lies on no surface: a pinhole, a point emitter.
    #[inline]
    pub fn free(p: Vec3) -> Self {
        SurfacePoint { p, ng: Vec3::ZERO, p_error: 0.0 }
    }

    /// A point on a surface, rounded to `f32` after an evaluation whose own error is at most `residual` \[m\].
    #[inline]
    pub fn on_surface(p: Vec3, ng: Vec3, residual: f32) -> Self {
        SurfacePoint { p, ng, p_error: rounding(p) + residual }
    }

    /// The position moved off the surface to the side that `d` points to.
    #[inline]
    pub fn offset_toward(&self, d: Vec3) -> Vec3 {
        self.moved_toward(d, self.p_error)
    }

    /// The ray that leaves in direction `d` (unit).
    #[inline]
    pub fn spawn(&self, d: Vec3) -> Ray {
        Ray { o: fault!("start_not_moved", self.offset_toward(d), self.p), d, t_max: f32::INFINITY }
    }

    /// The segment between two points, both ends moved off their surfaces towards one another; `t` in (0, 1) lies between.
    #[inline]
    pub fn segment_to(&self, other: &SurfacePoint) -> Ray {
        let towards = other.p - self.p;
        let o = self.offset_toward(towards);
        // The far end is reached only to the rounding of `d`, which is charged to its error.
        let end = other.moved_toward(-towards, other.p_error + rounding(towards));
        Ray { o, d: end - o, t_max: fault!("segment_meets_its_end", SEGMENT_END, 1.01) }
    }

    #[inline]
    fn moved_toward(&self, d: Vec3, distance: f32) -> Vec3 {
        self.p + self.ng * distance.copysign(self.ng.dot(d))
    }
}

/// Bounds twice the rounding of a vector's components, measured along any direction, with a half of it to spare.
#[inline]
pub(crate) fn rounding(v: Vec3) -> f32 {
    3.0 * UNIT_ROUNDOFF * (v.x.abs() + v.y.abs() + v.z.abs())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::vec3;

    #[test]
    fn offsets_go_to_the_side_of_the_direction() {
        let point = SurfacePoint::on_surface(vec3(1.0, 2.0, 3.0), Vec3::Z, 0.0);
        assert!(point.offset_toward(vec3(0.3, 0.0, 0.1)).z > 3.0);
        assert!(point.offset_toward(vec3(0.3, 0.0, -0.1)).z < 3.0);
        let free = SurfacePoint::free(vec3(1.0, 2.0, 3.0));
        assert_eq!(free.spawn(Vec3::X).o, free.p);
    }

    #[test]
    fn segments_stop_short_of_their_end_at_any_scale() {
        for exponent in -6..=6 {
            let scale = 10f32.powi(exponent);
            let a = SurfacePoint::on_surface(vec3(0.3, 0.7, 0.0) * scale, Vec3::Z, 0.0);
            let b = SurfacePoint::on_surface(vec3(-0.2, 0.1, 1.3) * scale, -Vec3::Z, 0.0);
            let ray = a.segment_to(&b);
            assert!(ray.o.z > 0.0 && ray.o.z + ray.d.z < b.p.z, "scale {scale}");
            assert!(ray.d.z > b.p.z * 0.999_99, "scale {scale}");
        }
    }
}
