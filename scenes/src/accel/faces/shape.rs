//! What faces are made of: triangles of blocks, by themselves or in convex quadrilaterals.

use super::super::block::{Block, GRAZING, LANES};
use super::{BORDERS, Face, Half};
use crate::ray::UNIT_ROUNDOFF;
use glam::DVec3;
use sampling::Vec3;

/// Four corners are in a plane if they are so close to it, relative to the largest coordinate.
const FLAT: f64 = 4.0 * UNIT_ROUNDOFF as f64;
/// A triangle whose height is less than this part of its sides has no plane that is known well enough.
const NEEDLE: f64 = 1e-6;

/// A triangle of a block.
#[derive(Clone, Copy)]
pub(super) struct Corners {
    corners: [DVec3; 3],
    id: u32,
    slot: u32,
}

impl Corners {
    /// That of a lane, if it has one.
    pub(super) fn of(block: &Block, index: usize, lane: usize) -> Option<Self> {
        let corners = block.corners(lane).map(Vec3::as_dvec3);
        let triangle = Corners { corners, id: block.id(lane), slot: (index * LANES + lane) as u32 };
        // One without area is never met.
        (block.is_occupied(lane) && triangle.cross() != DVec3::ZERO).then_some(triangle)
    }

    fn cross(&self) -> DVec3 {
        let [a, b, c] = self.corners;
        (b - a).cross(c - a)
    }

    /// The unit normal, of a triangle that is no needle.
    fn normal(&self) -> Option<DVec3> {
        let ([a, b, c], cross) = (self.corners, self.cross());
        let longest = (b - a).length_squared().max((c - a).length_squared()).max((c - b).length_squared());
        let unit = cross / cross.length();
        (cross.length() > NEEDLE * longest && unit.is_finite()).then_some(unit)
    }
}

/// One triangle, or two that make a convex quadrilateral.
pub(super) struct Shape {
    /// Three or four.
    pub(super) corners: Vec<DVec3>,
    triangles: [Option<Corners>; 2],
}

impl Shape {
    /// What the two triangles of a pair make: one shape if they can, or one each.
    pub(super) fn of([first, second]: [Option<Corners>; 2], reach: f64) -> [Option<Self>; 2] {
        let single =
            |triangle: Corners| Shape { corners: triangle.corners.to_vec(), triangles: [Some(triangle), None] };
        let both = first.zip(second).and_then(|(first, second)| Shape::quadrilateral(first, second, reach));
        match both {
            Some(shape) => [Some(shape), None],
            None => [first.map(single), second.map(single)],
        }
    }

    fn quadrilateral(first: Corners, second: Corners, reach: f64) -> Option<Self> {
        let ([a, b, c], [.., d]) = (first.corners, second.corners);
        let (normal, other) = (first.normal()?, second.normal()?);
        let corners = vec![a, b, c, d];
        let shape = Shape { corners, triangles: [Some(first), Some(second)] };
        let flat = normal.dot(other) > 0.0 && normal.dot(d - a).abs() <= FLAT * reach;
        let sides = &shape.borders(normal)[..BORDERS];
        let convex = sides.iter().all(|plane| shape.corners.iter().all(|&p| above(plane, p) >= -FLAT * reach));
        (flat && convex).then_some(shape)
    }

    pub(super) fn normal(&self) -> Option<DVec3> {
        self.triangles[0]?.normal()
    }

    /// The planes upright on the sides, and on the diagonal, by their unit normals and less their heights.
    pub(super) fn borders(&self, normal: DVec3) -> [[f64; 4]; BORDERS + 1] {
        let side = |from: usize, to: usize| {
            let (from, to) = (self.corners[from], self.corners[to]);
            let inward = normal.cross(to - from).normalize_or_zero();
            [inward.x, inward.y, inward.z, -inward.dot(from)]
        };
        match self.corners.len() {
            4 => [side(0, 1), side(1, 2), side(2, 3), side(3, 0), side(2, 0)],
            // All that is on the face is on its only triangle, by far.
            _ => [side(0, 1), side(1, 2), side(2, 0), side(2, 0), [0.0, 0.0, 0.0, f64::from(f32::MAX)]],
        }
    }

    pub(super) fn face(&self) -> Face {
        let halves = self.triangles.map(|triangle| {
            let Some(triangle) = triangle else { return Half::default() };
            let normal = triangle.cross();
            Half { normal, grazing: GRAZING * normal.length_squared(), id: triangle.id, slot: triangle.slot }
        });
        Face { corner: self.corners[0], halves }
    }
}

/// How far a point is above a plane.
fn above(&[x, y, z, offset]: &[f64; 4], p: DVec3) -> f64 {
    DVec3::new(x, y, z).dot(p) + offset
}
