//! Eight triangles tested at once, in pairs that share an edge, without a leak between neighbours.

use super::lanes::{Lanes, WIDTH};
use super::pairing::Pair;
use super::query::{Line, Query, dominant_axis};
use crate::ray::UNIT_ROUNDOFF;
use crate::shape::Triangle;
use glam::DVec3;
use sampling::{Vec2, Vec3, vec2};

/// Number of pairs in a block.
pub(super) const PAIRS: usize = WIDTH / 2;
/// Number of triangles in a block. Lane `l` below [`PAIRS`] is the first triangle of pair `l`, above it the second.
pub(super) const LANES: usize = WIDTH;

/// How far depths may be off by the rounding of the differences and the quotient.
const DEPTH_ROOM: f32 = 8.0 * UNIT_ROUNDOFF;
/// More than products of edge functions and depths can lose by underflow.
const LEAST: f32 = 1e-30;

/// Up to four pairs of triangles (a, b, c) and (a, c, d), side by side: `axes[axis][corner * PAIRS + pair]` holds one
/// coordinate, so that eight in a row are the second corners of the eight triangles, or the third.
///
/// The test is that of \[Woop13\]: corners are translated to the ray's origin and sheared so that the ray runs along its
/// dominant axis, and the signs of three edge functions decide. Neighbours compute the same bits for a shared edge, with
/// opposite sign, because their vertices have the same bits and the edge functions are plain products and a difference
/// (fused ones would differ); so a ray at an edge meets at least one of the two.
/// Rounding is monotone, so the sign of an edge function is never wrong, it can only vanish; then it is decided in `f64`.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Block {
    axes: [[f32; 4 * PAIRS]; 3],
    /// The triangle of each lane, `u32::MAX` for none.
    ids: [u32; LANES],
    /// For each lane, by how much its triangle's corners are rotated against the vertices of the triangle as given.
    rotations: [u8; LANES],
}

/// The lanes of a block that a line may meet, and within which bounds.
#[derive(Clone, Copy)]
pub(super) struct Candidates<L> {
    /// Lanes whose edge functions are of one sign or zero, and which are neither behind the origin nor beyond the end for certain.
    inside: u32,
    /// Lanes with an edge function that is zero.
    on_edge: u32,
    /// Lanes that are met for certain if the bounds are ahead of the origin and before the end.
    certain: u32,
    /// Bounds of the parameters, for lanes that are met.
    from: L,
    to: L,
}

impl<L: Lanes> Candidates<L> {
    /// None, with any bounds.
    #[inline(always)]
    fn none(bounds: L) -> Self {
        Candidates { inside: 0, on_edge: 0, certain: 0, from: bounds, to: bounds }
    }

    /// Whether there are none.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.inside == 0
    }

    /// Whether one of them is met before `t_max` for certain, without a closer look.
    #[inline(always)]
    pub fn any_surely(&self, proof: L::Proof, t_max: f32) -> bool {
        // Compared this way around, NaN is not certain.
        let ahead = L::splat(proof, f32::MIN_POSITIVE).at_most(self.from);
        let before = self.to.at_most(L::splat(proof, t_max.next_down()));
        self.inside & self.certain & ahead & before != 0
    }

    /// The bounds of all lanes.
    #[inline(always)]
    pub fn bounds(&self) -> ([f32; LANES], [f32; LANES]) {
        (self.from.to_array(), self.to.to_array())
    }

    /// Takes one of them out.
    #[inline(always)]
    pub fn take(&mut self) -> Option<Candidate> {
        let lane = self.inside.trailing_zeros();
        self.inside &= self.inside.wrapping_sub(1);
        let lane = (lane < u32::BITS).then_some(lane as usize % LANES)?;
        let is_in = |mask: u32| mask >> lane & 1 != 0;
        Some(Candidate { lane, on_edge: is_in(self.on_edge), certain: is_in(self.certain) })
    }
}

/// A lane of a block that a line may meet.
#[derive(Clone, Copy)]
pub(super) struct Candidate {
    /// Which one.
    pub lane: usize,
    /// Whether an edge function is zero.
    pub on_edge: bool,
    /// Whether it is met for certain if its bounds are ahead of the origin and before the end.
    pub certain: bool,
}

/// Where a line meets a triangle.
pub(super) struct Meeting {
    /// The parameter.
    pub t: f64,
    /// The point.
    pub p: DVec3,
    /// Barycentric coordinates of the vertices 1 and 2.
    pub b: Vec2,
}

impl Block {
    /// A block of at most four pairs. Lanes that stay free are NaN and never hit.
    pub fn new(pairs: &[Pair]) -> Self {
        debug_assert!(pairs.len() <= PAIRS);
        let mut block = Block { axes: [[f32::NAN; 4 * PAIRS]; 3], ids: [u32::MAX; LANES], rotations: [0; LANES] };
        for (index, pair) in pairs.iter().enumerate() {
            for (corner, p) in pair.corners.iter().enumerate() {
                for (axis, coordinate) in p.to_array().into_iter().enumerate() {
                    block.axes[axis][corner * PAIRS + index] = coordinate;
                }
            }
            for (half, member) in pair.members.iter().enumerate() {
                block.ids[index + half * PAIRS] = member.id;
                block.rotations[index + half * PAIRS] = member.rotation;
            }
        }
        block
    }

    /// The id of a lane's triangle.
    #[inline]
    pub fn id(&self, lane: usize) -> u32 {
        self.ids[lane % LANES]
    }

    /// The corners of a lane's triangle, rotated as they are kept.
    #[inline]
    fn corners(&self, lane: usize) -> [Vec3; 3] {
        let pair = lane % PAIRS;
        let second = usize::from(lane >= PAIRS);
        let [x, y, z] = &self.axes;
        let corner = |c: usize| Vec3::new(x[c * PAIRS + pair], y[c * PAIRS + pair], z[c * PAIRS + pair]);
        [corner(0), corner(1 + second), corner(2 + second)]
    }

    /// Its triangles with their ids, the vertices in the order they were given in.
    pub fn triangles(&self) -> impl Iterator<Item = (u32, Triangle)> {
        let lanes = (0..LANES).filter(|&lane| self.ids[lane] != u32::MAX);
        lanes.map(|lane| {
            let (corners, rotation) = (self.corners(lane), usize::from(self.rotations[lane]));
            // Vertex v is corner v − rotation.
            (self.ids[lane], Triangle([0, 1, 2].map(|vertex| corners[(vertex + 3 - rotation) % 3])))
        })
    }

    /// Where a line meets a lane's triangle, the barycentric coordinates in the order the vertices were given in.
    ///
    /// All in `f64`, after \[Moeller97\], and kept within the triangle, so that the point is on its plane whatever the angle.
    #[inline(always)]
    pub fn point(&self, lane: usize, line: Line) -> Meeting {
        let [a, b, c] = self.corners(lane).map(Vec3::as_dvec3);
        let [origin, direction] = line.exact();
        let (edge_1, edge_2) = (b - a, c - a);
        let across = (a - origin).cross(direction);
        let inverse = edge_1.cross(edge_2).dot(direction).recip();
        let (b1, b2) = (edge_2.dot(across) * inverse, -edge_1.dot(across) * inverse);
        // Written so that the NaN of a triangle seen edge-on becomes its first corner.
        let b1 = min(max(b1, 0.0), 1.0);
        let b2 = min(max(b2, 0.0), 1.0 - b1);
        let p = a + edge_1 * b1 + edge_2 * b2;
        let weights = [(1.0 - b1 - b2) as f32, b1 as f32, b2 as f32];
        // Vertex v is corner v − rotation.
        let b = match self.rotations[lane % LANES] {
            0 => vec2(weights[1], weights[2]),
            1 => vec2(weights[0], weights[1]),
            _ => vec2(weights[2], weights[0]),
        };
        let z = dominant_axis(line.ray.d.to_array());
        let t = (p.as_ref()[z] - origin.as_ref()[z]) / direction.as_ref()[z];
        Meeting { t, p, b }
    }

    /// The lanes whose triangle the query's line meets, unless it lies behind the origin or beyond the limit for certain.
    #[inline(always)]
    pub fn candidates<L: Lanes>(&self, proof: L::Proof, query: &Query, limit: f32) -> Candidates<L> {
        let [x, y, z] = query.axes;
        let [a_z, b_z, c_z] = self.translated::<L>(proof, z, query.o[2]);
        let [a_x, b_x, c_x] = self.translated::<L>(proof, x, query.o[0]);
        let [a_y, b_y, c_y] = self.translated::<L>(proof, y, query.o[1]);
        let (s_x, s_y) = (L::splat(proof, query.shear[0]), L::splat(proof, query.shear[1]));
        let (a_x, b_x, c_x) = (a_x - s_x * a_z, b_x - s_x * b_z, c_x - s_x * c_z);
        let (a_y, b_y, c_y) = (a_y - s_y * a_z, b_y - s_y * b_z, c_y - s_y * c_z);
        let ab = a_x * b_y - a_y * b_x;
        let bc = b_x * c_y - b_y * c_x;
        let ca = c_x * a_y - c_y * a_x;
        let (least, most) = (ab.min(bc).min(ca), ab.max(bc).max(ca));
        let zero = L::splat(proof, 0.0);
        let inside = zero.at_most(least) | most.at_most(zero);
        if inside == 0 {
            return Candidates::none(zero);
        }
        let reach_x = a_x.abs().max(b_x.abs()).max(c_x.abs());
        let reach = reach_x.max(a_y.abs().max(b_y.abs()).max(c_y.abs()));
        let (from, to, certain) = bounds(proof, query, [a_z, b_z, c_z], [bc, ca, ab], reach);
        // Compared this way around, NaN leaves it open.
        let inside = inside & !L::splat(proof, limit).at_most(from) & !to.at_most(zero);
        let on_edge = least.equal_to(zero) | most.equal_to(zero);
        Candidates { inside, on_edge, certain: certain & !on_edge, from, to }
    }

    /// One coordinate of the three corners of each triangle, relative to the origin.
    #[inline(always)]
    fn translated<L: Lanes>(&self, proof: L::Proof, axis: usize, origin: f32) -> [L; 3] {
        let all = &self.axes[axis];
        let o = L::splat(proof, origin);
        let a = L::load_twice(proof, part(all, 0));
        let b = L::load(proof, part(all, PAIRS));
        let c = L::load(proof, part(all, 2 * PAIRS));
        [a - o, b - o, c - o]
    }

    /// The parameter at which a line meets a candidate's triangle; NaN if it turns out not to.
    #[inline(never)]
    pub fn meeting(&self, candidate: Candidate, line: Line) -> f64 {
        if candidate.on_edge && !self.is_inside_exactly(candidate.lane, &Query::of(line)) {
            return f64::NAN;
        }
        self.parameter(candidate.lane, line)
    }

    /// Decides a lane with an edge function that vanished in `f32`: the same sheared corners, products exact in `f64`.
    /// What is zero even so counts as inside, for both neighbours; a triangle seen edge-on is not met.
    #[cold]
    #[inline(never)]
    fn is_inside_exactly(&self, lane: usize, query: &Query) -> bool {
        let ([x, y, z], [o_x, o_y, o_z], [s_x, s_y]) = (query.axes, query.o, query.shear);
        let sheared = self.corners(lane).map(|p| {
            let depth = p[z] - o_z;
            [f64::from((p[x] - o_x) - s_x * depth), f64::from((p[y] - o_y) - s_y * depth)]
        });
        let edge = |a: usize, b: usize| sheared[a][0] * sheared[b][1] - sheared[a][1] * sheared[b][0];
        let (u, v, w) = (edge(0, 1), edge(1, 2), edge(2, 0));
        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        inside && u + v + w != 0.0
    }

    /// Where a line meets the plane of a lane's triangle, in `f64`, so that the sign is right however close
    /// the origin is to the plane.
    #[inline(always)]
    pub fn parameter(&self, lane: usize, line: Line) -> f64 {
        let corners = self.corners(lane).map(Vec3::as_dvec3);
        let ([a, b, c], [origin, direction]) = (corners, line.exact());
        let normal = (b - a).cross(c - a);
        let t = (a - origin).dot(normal) / direction.dot(normal);
        // Kept within the depths of the corners, for triangles seen nearly edge-on.
        let z = dominant_axis(line.ray.d.to_array());
        let (origin, inverse) = (origin.as_ref()[z], direction.as_ref()[z].recip());
        let [a, b, c] = corners.map(|p| (p.as_ref()[z] - origin) * inverse);
        let (least, most) = (min(min(a, b), c), max(max(a, b), c));
        // Written so that what is NaN, for a triangle seen exactly edge-on, stays so and is no hit.
        min(most, max(least, t))
    }
}

/// Bounds of the parameters at which a line meets triangles, given the depths of their corners, the edge functions opposite to these,
/// and how far the corners are from the line, along its own axes x and y.
///
/// The depth of the meeting is the mean of those of the corners, weighted by the edge functions \[Woop13\]. With ε the unit roundoff,
/// M the distance of the sheared corners from the line and P the largest depth, sheared corners are off by at most ε(2M + 5P), and
/// edge functions by ε(12M² + 20MP). Divided by the sum of the three, that is how far the weights are off; the mean by twice as much
/// of the range of the depths, but not beyond the range. A factor of 2.5 makes up for the error of the sum itself wherever the bound
/// is less than the range; the lanes where it is are the last of the results. P is at most the farthest depth and the range, unless all are behind the origin.
#[inline(always)]
fn bounds<L: Lanes>(proof: L::Proof, query: &Query, depths: [L; 3], edges: [L; 3], reach: L) -> (L, L, u32) {
    let inverse_z = L::splat(proof, query.inverse_z);
    let [a, b, c] = depths;
    let (a, b, c) = (a * inverse_z, b * inverse_z, c * inverse_z);
    let (nearest, farthest) = (a.min(b).min(c), a.max(b).max(c));
    let range = farthest - nearest;
    let largest = farthest + range;
    let [u, v, w] = edges;
    let inverse = L::splat(proof, 1.0) / (u + v + w);
    let mean = (u * a + v * b + w * c) * inverse;
    let spread = reach * (reach + largest * L::splat(proof, query.depth)) * L::splat(proof, query.room);
    let least = L::splat(proof, LEAST);
    // By how much the weights may be off: where it is all they are, not even their sum need have the right sign.
    let relative = (spread + least) * inverse.abs();
    let certain = relative.at_most(L::splat(proof, 1.0));
    let off = range * relative + least * inverse.abs();
    let rounding = largest * L::splat(proof, DEPTH_ROOM) + L::splat(proof, query.slack);
    // What is NaN leaves the depths of the corners.
    ((mean - off).max(nearest) - rounding, (mean + off).min(farthest) + rounding, certain)
}

/// So many numbers of all.
#[inline(always)]
fn part<const N: usize>(all: &[f32; 4 * PAIRS], from: usize) -> &[f32; N] {
    all[from..].first_chunk().expect("there are as many")
}

/// The lesser of two numbers, in one instruction; the second if either is NaN.
#[inline(always)]
fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater of two numbers, in one instruction; the second if either is NaN.
#[inline(always)]
fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
