//! What a ray needs to know of itself to be tested against triangles, boxes and spheres.

use crate::ray::Ray;
use glam::{DVec3, Vec4};

/// A ray prepared for tests: computed once, used by every primitive and node.
#[derive(Clone, Copy)]
pub(super) struct Query {
    /// Origin.
    pub origin: DVec3,
    /// Direction.
    pub direction: DVec3,
    /// Reciprocal of the direction along the dominant axis.
    pub inverse_z: f64,
    /// The same in all lanes.
    pub inverse_z4: Vec4,
    /// The origin along the axes Z + 1, Z + 2 and Z, each in all lanes.
    pub origin4: [Vec4; 3],
    /// Shear along the axes Z + 1 and Z + 2: the direction relative to its dominant component.
    pub shear4: [Vec4; 2],
}

/// The axis along which a direction is largest.
#[inline]
pub(super) fn dominant_axis(ray: &Ray) -> usize {
    let size = ray.d.abs();
    if size.x > size.y {
        if size.x > size.z { 0 } else { 2 }
    } else if size.y > size.z {
        1
    } else {
        2
    }
}

impl Query {
    /// Prepares a ray whose dominant axis is `Z`.
    #[inline(always)]
    pub fn new<const Z: usize>(ray: &Ray) -> Self {
        let (o, d) = (ray.o, ray.d);
        let (x, y) = ((Z + 1) % 3, (Z + 2) % 3);
        let inverse_z = d[Z].recip();
        Query {
            origin: o.as_dvec3(),
            direction: d.as_dvec3(),
            inverse_z: f64::from(d[Z]).recip(),
            inverse_z4: Vec4::splat(inverse_z),
            origin4: [Vec4::splat(o[x]), Vec4::splat(o[y]), Vec4::splat(o[Z])],
            shear4: [Vec4::splat(d[x] * inverse_z), Vec4::splat(d[y] * inverse_z)],
        }
    }
}
