//! What a ray needs to know of itself to be tested against triangles, boxes and spheres.

use crate::ray::{Ray, UNIT_ROUNDOFF};
use glam::DVec3;
use sampling::Vec3;

/// A ray, and its line where that is known better than it is rounded.
#[derive(Clone, Copy)]
pub(super) struct Line<'a> {
    pub ray: &'a Ray,
    /// Its origin and direction.
    pub exact: Option<&'a [DVec3; 2]>,
}

impl Line<'_> {
    /// The origin and the direction.
    #[inline(always)]
    pub fn exact(&self) -> [DVec3; 2] {
        match self.exact {
            None => [self.ray.o.as_dvec3(), self.ray.d.as_dvec3()],
            Some(exact) => *exact,
        }
    }
}

/// A ray prepared for tests: computed once, used by every primitive and node.
#[derive(Clone, Copy)]
pub(super) struct Query<'a> {
    pub line: Line<'a>,
    /// The axes x, y and z of its own: z is that along which its direction is largest, the others follow in turn.
    pub axes: [usize; 3],
    /// Its origin along these axes.
    pub o: [f32; 3],
    /// Its direction along x and y relative to that along z.
    pub shear: [f32; 2],
    /// Reciprocal of its direction along z.
    pub inverse: f32,
    /// How far the height of a corner over a plane may be off, divided by its direction along z, relative to the corner's distance and the
    /// longest edge.
    pub height_off: f32,
}

/// How far the height of a corner over a plane may be off, relative to the sum of the corner's depth and the longest edge;
/// `Block::interval` says why.
const PLANE_OFF: f32 = 24.0 * UNIT_ROUNDOFF;

/// Which axes follow on each.
const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

impl<'a> Query<'a> {
    /// Prepares a ray.
    #[inline(always)]
    pub fn new(ray: &'a Ray) -> Self {
        Self::of(Line { ray, exact: None })
    }

    /// Prepares a ray, be it rounded or not.
    #[inline(always)]
    pub fn of(line: Line<'a>) -> Self {
        let (d, o): (&[f32; 3], &[f32; 3]) = (line.ray.d.as_ref(), line.ray.o.as_ref());
        let axes = AXES[dominant_axis(line.ray.d)];
        let [x, y, z] = axes;
        let inverse = d[z].recip();
        let shear = [d[x] * inverse, d[y] * inverse];
        Query { line, axes, o: [o[x], o[y], o[z]], shear, inverse, height_off: inverse.abs() * PLANE_OFF }
    }
}

/// The axis along which a direction is largest. Without branches, since no one knows which it is of the next ray.
#[inline]
pub(super) fn dominant_axis(d: Vec3) -> usize {
    // Magnitudes are in the order of their bits.
    let (x, y, z) = (d.x.abs().to_bits(), d.y.abs().to_bits(), d.z.abs().to_bits());
    let among_two = usize::from(y >= x);
    if z >= x.max(y) { 2 } else { among_two }
}
