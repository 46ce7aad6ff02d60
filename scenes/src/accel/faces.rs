//! Plane faces, eight tested at once by their planes and borders: what a few triangles are searched by.
//!
//! Which faces a line meets is worked out in `f32`, with a bound on how far that may be off. What the bound leaves open, a line that
//! passes close to a border for one, is left to the [`Block`] that has the triangles, so that the hits are its hits, to the bit.

use super::block::{Block, PAIRS};
use super::lanes::{Lanes, WIDTH};
use super::query::Line;
use crate::ray::{Ray, UNIT_ROUNDOFF};
use glam::DVec3;
use sampling::fault;
use shape::{Corners, Shape};

/// How many borders a face has, and the diagonal between its two triangles.
const BORDERS: usize = 4;
const DIAGONAL: usize = BORDERS;
/// By how much distances may be off, relative to the coordinates that they are worked out from and to the length of the line up to
/// the face; see [`Eight::met`].
const SLACK: f32 = 64.0 * UNIT_ROUNDOFF;
/// There are at most so many faces.
pub(super) const MOST: usize = u32::BITS as usize;
/// Bounds of rounding are no less than this, so that what they bound is far from where numbers underflow.
const LEAST: f32 = 1e-30;

/// Faces, each of two triangles that make a convex quadrilateral or of one, that a ray is tested against without a tree.
#[derive(Clone, Debug, Default)]
pub(super) struct Faces {
    eights: Vec<Eight>,
    /// Those of the first eight, the second, and so on.
    faces: Vec<Face>,
    /// Their largest coordinate; NaN if there is one that can only be told by its blocks, so that all rays are left to these.
    reach: f32,
}

/// Up to eight faces, side by side.
#[derive(Clone, Debug)]
#[repr(align(64))]
struct Eight {
    /// Unit normals, axis by axis, and the heights of their planes over the origin.
    normals: [[f32; WIDTH]; 3],
    heights: [f32; WIDTH],
    /// How a point's height over a plane upright on a border, or on the diagonal, is worked out: by the unit normal, which points to
    /// the face or to its first triangle, and less the plane's height over the origin.
    borders: [[[f32; WIDTH]; 4]; BORDERS + 1],
    /// The lanes that have a face, as bits.
    occupied: u32,
}

/// What decides in `f64` where a line meets a face.
#[derive(Clone, Copy, Debug, Default)]
struct Face {
    /// The first corner of both triangles.
    corner: DVec3,
    halves: [Half; 2],
}

/// A triangle of a face.
#[derive(Clone, Copy, Debug, Default)]
struct Half {
    /// The cross product of its edges.
    normal: DVec3,
    /// The square of the sine, times that of the normal's length, below which a line is grazing.
    grazing: f64,
    id: u32,
    slot: u32,
}

/// A ray as faces are tested by it.
struct Sight<L> {
    origin: [L; 3],
    direction: [L; 3],
    /// The length of its direction.
    length: L,
    /// By how much products of a distance and a slope may be off because of coordinates, and relative to the parameter.
    slack: [L; 2],
    /// No face is so far away.
    farthest: L,
    /// Where its interval ends.
    limit: L,
}

/// The faces that a line may meet, one bit each.
#[derive(Clone, Copy, Default)]
struct Met {
    /// All of them.
    open: u32,
    /// Those within whose borders it is for certain.
    sure: u32,
    /// Those that it would meet on the second triangle.
    second: u32,
}

/// Where a line meets the plane of a triangle.
pub(super) struct Encounter {
    /// The parameter, as [`Block::crossing`] has it.
    pub t: f64,
    pub id: u32,
    pub slot: u32,
}

impl<L: Lanes> Sight<L> {
    /// None of a ray with which products underflow, or among faces without a reach.
    #[inline(always)]
    fn new(proof: L::Proof, ray: &Ray, reach: f32, limit: f32) -> Option<Self> {
        let Ray { o, d, .. } = *ray;
        let length_squared = d.length_squared();
        let length = length_squared.sqrt();
        let far = reach + (o.x.abs() + o.y.abs() + o.z.abs());
        let off = fault!("faces_without_their_bound", SLACK, 1e-12);
        let fixed = off * length * far;
        let sight = Sight {
            origin: [L::splat(proof, o.x), L::splat(proof, o.y), L::splat(proof, o.z)],
            direction: [L::splat(proof, d.x), L::splat(proof, d.y), L::splat(proof, d.z)],
            length: L::splat(proof, length),
            slack: [L::splat(proof, fixed), L::splat(proof, off * length_squared)],
            farthest: L::splat(proof, 2.0 * far),
            limit: L::splat(proof, limit),
        };
        (fixed > LEAST && far > LEAST && length_squared > LEAST).then_some(sight)
    }
}

impl Eight {
    fn new(shapes: &[Shape]) -> Self {
        let mut eight = Eight {
            normals: [[0.0; WIDTH]; 3],
            heights: [0.0; WIDTH],
            borders: [[[0.0; WIDTH]; 4]; BORDERS + 1],
            occupied: (1 << shapes.len()) - 1,
        };
        for (lane, shape) in shapes.iter().enumerate() {
            let Some(normal) = shape.normal() else { continue };
            for axis in 0..3 {
                eight.normals[axis][lane] = normal[axis] as f32;
            }
            eight.heights[lane] = normal.dot(shape.corners[0]) as f32;
            for (border, plane) in shape.borders(normal).into_iter().enumerate() {
                for (place, number) in plane.into_iter().enumerate() {
                    eight.borders[border][place][lane] = number as f32;
                }
            }
        }
        eight
    }

    /// The faces that the line may meet on its interval.
    ///
    /// With the unit normal n at the height h, a plane is met at the parameter t = (h − n·o) / n·d; numbers are
    /// rounded, and so are products and sums, so that the numerator is off by at most 9 roundings of R, the sum of |oᵢ| and the largest
    /// coordinate, and the denominator by 8 of |d|. A point o + t·d is off by as much, times |d| / |n·d|, and by some rounding
    /// of its own; its distance from a border so by at most 20 roundings of R + |t·d|, times that. A block tests the line as it is rounded,
    /// which is off by less than 2 of R + |t·d|, as much times |d| / |n·d| in the plane, and second triangles are up to 4 off it.
    /// Multiplied by |n·d|, all this is less than 64 roundings of (R + |t·d|)·|d|. Where t is NaN or infinite, so is that bound, and the
    /// face is open, and not sure: unless the line is so nearly along a plane that it is nowhere near it within 2 R.
    #[inline(always)]
    fn met<L: Lanes>(&self, proof: L::Proof, sight: &Sight<L>) -> Met {
        let [o_x, o_y, o_z] = sight.origin;
        let [d_x, d_y, d_z] = sight.direction;
        let (n_x, n_y, n_z) =
            (L::load(proof, &self.normals[0]), L::load(proof, &self.normals[1]), L::load(proof, &self.normals[2]));
        let slope = (n_x * d_x).plus(n_y, d_y).plus(n_z, d_z);
        let height = L::load(proof, &self.heights).minus(n_x, o_x).minus(n_y, o_y).minus(n_z, o_z);
        let t = height / slope;
        let p = [o_x.plus(t, d_x), o_y.plus(t, d_y), o_z.plus(t, d_z)];
        let (one, two) = (self.above::<L>(proof, 0, p), self.above::<L>(proof, 1, p));
        let (three, four) = (self.above::<L>(proof, 2, p), self.above::<L>(proof, 3, p));
        let inside = one.min(two).min(three.min(four));
        let (across, steep, zero) = (self.above::<L>(proof, DIAGONAL, p), slope.abs(), L::splat(proof, 0.0));
        let slack = sight.slack[0].plus(t.abs(), sight.slack[1]);
        let between = t.min(sight.limit - t) * sight.length;
        let along = sight.slack[0].plus(steep, sight.farthest).at_most(height.abs() * sight.length);
        let missed = along | slack.plus(inside.min(between), steep).at_most(zero);
        let sure = zero.at_most(inside.min(across.abs()) * steep - slack);
        Met { open: !missed & self.occupied, sure, second: zero.differs_in_sign(across) }
    }

    /// How far points are above the planes of a border.
    #[inline(always)]
    fn above<L: Lanes>(&self, proof: L::Proof, border: usize, [x, y, z]: [L; 3]) -> L {
        let [b_x, b_y, b_z, offset] = &self.borders[border];
        let height = L::load(proof, offset).plus(L::load(proof, b_x), x);
        height.plus(L::load(proof, b_y), y).plus(L::load(proof, b_z), z)
    }
}

impl Faces {
    /// The faces of the triangles in blocks, unless they are too many.
    pub fn of(blocks: &[Block]) -> Option<Self> {
        let corners = blocks.iter().flat_map(Block::triangles).flat_map(|(_, triangle)| triangle.0);
        let reach = corners.fold(0.0, |reach, p| p.abs().max_element().max(reach));
        let mut shapes = Vec::new();
        for (index, block) in blocks.iter().enumerate() {
            for pair in 0..PAIRS {
                let triangles = [pair, pair + PAIRS].map(|lane| Corners::of(block, index, lane));
                shapes.extend(Shape::of(triangles, f64::from(reach)).into_iter().flatten());
            }
        }
        if shapes.len() > MOST {
            return None;
        }
        let reach = if shapes.iter().all(|shape| shape.normal().is_some()) { reach } else { f32::NAN };
        let eights = shapes.chunks(WIDTH).map(Eight::new).collect();
        Some(Faces { eights, faces: shapes.iter().map(Shape::face).collect(), reach })
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.faces.len()
    }

    /// Whether every ray is left to the blocks.
    pub fn are_blind(&self) -> bool {
        self.reach.is_nan()
    }

    /// Visits where the line meets faces before `limit`, or just outside its interval; a face that is alone is visited twice. False if it
    /// cannot be told in this way what the line meets, so that what has been visited does not count.
    #[inline(always)]
    pub fn visit<L: Lanes>(&self, proof: L::Proof, line: Line, limit: f32, mut visit: impl FnMut(Encounter)) -> bool {
        let Some(sight) = Sight::<L>::new(proof, line.ray, self.reach, limit) else { return false };
        let mut met = Met::default();
        for (index, eight) in self.eights.iter().enumerate() {
            let Met { open, sure, second } = eight.met::<L>(proof, &sight);
            let shift = (index * WIDTH) as u32 % MOST as u32;
            met.open |= open << shift;
            met.sure |= sure << shift;
            met.second |= second << shift;
        }
        if met.open & !met.sure != 0 {
            return false;
        }
        if met.open == 0 {
            return true;
        }
        let exact = line.exact();
        let length_squared = exact[1].length_squared();
        let (mut seen, mut open) = (true, met.open);
        let mut look = |open: u32| {
            let face = open.trailing_zeros();
            let half = met.second >> (face % MOST as u32) & 1;
            let (encounter, is_seen) = self.encounter(face as usize, half as usize, exact, length_squared);
            seen &= is_seen;
            visit(encounter);
        };
        // Most rays leave a face and meet another: two are looked at without asking whether there are as many.
        look(open);
        let rest = open & open.wrapping_sub(1);
        look(if rest == 0 { open } else { rest });
        open = rest & rest.wrapping_sub(1);
        while open != 0 {
            look(open);
            open &= open.wrapping_sub(1);
        }
        seen
    }

    /// Where the line meets one of a face's triangles, and whether that is the last word.
    #[inline(always)]
    fn encounter(
        &self,
        face: usize,
        half: usize,
        [origin, direction]: [DVec3; 2],
        length_squared: f64,
    ) -> (Encounter, bool) {
        let face = &self.faces[face];
        let Half { normal, grazing, id, slot } = face.halves[half % 2];
        let slope = direction.dot(normal);
        let t = (face.corner - origin).dot(normal) * slope.recip();
        (Encounter { t, id, slot }, slope * slope > grazing * length_squared)
    }
}

mod shape;
#[cfg(test)]
mod tests;
