//! What a ray needs to know of itself to be tested against triangles, boxes and spheres.

use crate::ray::{Ray, UNIT_ROUNDOFF};
use glam::DVec3;

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
    /// Its direction along z, without its sign.
    pub depth: f32,
    /// Reciprocal of its direction along z.
    pub inverse_z: f32,
    /// What rounding of the ray leaves open of the depth of a point, as a parameter.
    pub slack: f32,
    /// How far the test of eight may be off, relative to what it computes with; infinite where the ray is rounded, since a plane may be
    /// seen at any angle.
    pub room: f32,
}

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
        let axes = AXES[dominant_axis(*d)];
        let [x, y, z] = axes;
        let inverse_z = d[z].recip();
        let (slack, room) = match line.exact {
            None => (0.0, 128.0 * UNIT_ROUNDOFF),
            Some(_) => (8.0 * UNIT_ROUNDOFF * line.ray.o.abs().max_element() * inverse_z.abs(), f32::INFINITY),
        };
        let shear = [d[x] * inverse_z, d[y] * inverse_z];
        Query { line, axes, o: [o[x], o[y], o[z]], shear, depth: d[z].abs(), inverse_z, slack, room }
    }
}

/// The axis along which a direction is largest. Without branches, since no one knows which it is of the next ray.
#[inline]
pub(super) fn dominant_axis(d: [f32; 3]) -> usize {
    let [x, y, z] = d.map(f32::abs);
    let among_two = usize::from(y >= x);
    if z >= x.max(y) { 2 } else { among_two }
}
