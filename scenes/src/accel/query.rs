//! What a ray needs to know of itself to be tested against triangles, boxes and spheres.

use crate::ray::Ray;
use glam::DVec3;

/// A ray prepared for tests: computed once, used by every primitive and node.
#[derive(Clone, Copy)]
pub(super) struct Query {
    /// The ray.
    pub ray: Ray,
    /// Its origin.
    pub origin: DVec3,
    /// Its direction.
    pub direction: DVec3,
    /// The axes x, y and z of its own: z is that along which its direction is largest, the others follow in turn.
    pub axes: [usize; 3],
    /// Its origin along these axes.
    pub o: [f32; 3],
    /// Its direction along x and y relative to that along z.
    pub shear: [f32; 2],
    /// Up to which parameter rounding leaves it open whether something is ahead of the origin: zero, or infinite where the origin
    /// itself is rounded.
    pub uncertain: f32,
    /// Its origin along z.
    pub depth: f64,
    /// Reciprocal of its direction along z.
    pub inverse_z: f64,
}

impl Query {
    /// 1/|direction|².
    #[inline(always)]
    pub fn inverse_length2(&self) -> f64 {
        self.direction.length_squared().recip()
    }

    /// Prepares a ray.
    #[inline(always)]
    pub fn new(ray: &Ray) -> Self {
        Query { uncertain: 0.0, ..Self::of(ray, ray.o.as_dvec3(), ray.d.as_dvec3()) }
    }

    /// Prepares a ray that is known better than it is rounded.
    #[inline(always)]
    pub fn of(ray: &Ray, origin: DVec3, direction: DVec3) -> Self {
        let (o, d) = (ray.o.to_array(), ray.d.to_array());
        let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][dominant_axis(d)];
        let [x, y, z] = axes;
        let inverse_z = d[z].recip();
        Query {
            ray: *ray,
            origin,
            direction,
            axes,
            o: [o[x], o[y], o[z]],
            shear: [d[x] * inverse_z, d[y] * inverse_z],
            uncertain: f32::INFINITY,
            depth: origin.to_array()[z],
            inverse_z: direction.to_array()[z].recip(),
        }
    }
}

/// The axis along which a direction is largest. Without branches, since no one knows which it is of the next ray.
#[inline]
fn dominant_axis(d: [f32; 3]) -> usize {
    let [x, y, z] = d.map(f32::abs);
    let among_two = usize::from(y >= x);
    if z >= x.max(y) { 2 } else { among_two }
}
