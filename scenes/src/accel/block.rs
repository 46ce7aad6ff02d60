//! Eight triangles tested at once, in pairs that share an edge, without a leak between neighbours.

use super::lanes::{Lanes, WIDTH};
use super::pairing::Pair;
use super::query::Query;
use crate::ray::UNIT_ROUNDOFF;
use glam::DVec3;
use sampling::{Vec2, Vec3, vec2};

/// Number of pairs in a block.
pub(super) const PAIRS: usize = WIDTH / 2;
/// Number of triangles in a block. Lane `l` below [`PAIRS`] is the first triangle of pair `l`, above it the second.
pub(super) const LANES: usize = WIDTH;

/// Depths are compared with room for their rounding.
const BEYOND: f32 = 1.0 + 8.0 * UNIT_ROUNDOFF;

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

/// The lanes of a block that a line may meet.
#[derive(Clone, Copy)]
pub(super) struct Candidates {
    /// Lanes whose edge functions are of one sign or zero.
    inside: u32,
    /// Lanes with an edge function that is zero.
    on_edge: u32,
    /// Lanes that are met for certain: no edge function is zero, and all corners are ahead of the origin and before the end.
    surely: u32,
}

impl Candidates {
    /// Whether one of them is met for certain, without a closer look.
    #[inline(always)]
    pub fn any_surely(&self) -> bool {
        self.surely != 0
    }

    /// Takes one of them out.
    #[inline(always)]
    pub fn take(&mut self) -> Option<usize> {
        let lane = self.inside.trailing_zeros();
        self.inside &= self.inside.wrapping_sub(1);
        (lane < u32::BITS).then_some(lane as usize)
    }
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

    /// Where a line meets a lane's triangle: the point, and its barycentric coordinates of the vertices 1 and 2 in the order they
    /// were given in.
    ///
    /// All in `f64` \[Moeller97\], and kept within the triangle, so that the point is on its plane whatever the angle.
    #[inline]
    pub fn point(&self, lane: usize, origin: DVec3, direction: DVec3) -> (DVec3, Vec2) {
        let [a, b, c] = self.corners(lane).map(Vec3::as_dvec3);
        let (edge_1, edge_2) = (b - a, c - a);
        let p = direction.cross(edge_2);
        let s = origin - a;
        let inverse = edge_1.dot(p).recip();
        let b1 = s.dot(p) * inverse;
        let b2 = direction.dot(s.cross(edge_1)) * inverse;
        // Written so that the NaN of a triangle seen edge-on becomes its first corner.
        let b1 = min(max(b1, 0.0), 1.0);
        let b2 = min(max(b2, 0.0), 1.0 - b1);
        let point = a + edge_1 * b1 + edge_2 * b2;
        let weights = [(1.0 - b1 - b2) as f32, b1 as f32, b2 as f32];
        // Vertex v is corner v − rotation.
        let uv = match self.rotations[lane % LANES] {
            0 => vec2(weights[1], weights[2]),
            1 => vec2(weights[0], weights[1]),
            _ => vec2(weights[2], weights[0]),
        };
        (point, uv)
    }

    /// The lanes whose triangle the query's line meets, unless it lies behind the origin or beyond `t_max` (about).
    #[inline(always)]
    pub fn candidates<L: Lanes>(&self, proof: L::Proof, query: &Query, t_max: f32) -> Candidates {
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
        let inverse_z = L::splat(proof, query.inverse_z as f32);
        let (a, b, c) = (a_z * inverse_z, b_z * inverse_z, c_z * inverse_z);
        let (nearest, farthest) = (a.min(b).min(c), a.max(b).max(c));
        let inside = inside & nearest.at_most(L::splat(proof, t_max * BEYOND)) & !farthest.at_most(zero);
        if inside == 0 {
            return Candidates { inside, on_edge: 0, surely: 0 };
        }
        let on_edge = inside & (least.equal_to(zero) | most.equal_to(zero));
        let ahead = !nearest.at_most(L::splat(proof, query.uncertain));
        let surely = inside & !on_edge & ahead & (farthest * L::splat(proof, BEYOND)).at_most(L::splat(proof, t_max));
        Candidates { inside, on_edge, surely }
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

    /// The parameter at which the query's line meets the triangle of one of the candidates; NaN if it turns out not to.
    #[inline(always)]
    pub fn meeting(&self, lane: usize, candidates: &Candidates, query: &Query) -> f64 {
        if candidates.on_edge >> lane & 1 != 0 && !self.is_inside_exactly(lane, query) {
            return f64::NAN;
        }
        self.parameter(lane, query)
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

    /// Where the query's line meets the plane of a lane's triangle, in `f64`, so that the sign is right however close
    /// the origin is to the plane. Kept within the depths of the corners, for triangles seen nearly edge-on.
    #[inline(always)]
    fn parameter(&self, lane: usize, query: &Query) -> f64 {
        let [a, b, c] = self.corners(lane).map(|v| v.as_dvec3() - query.origin);
        let normal = (b - a).cross(c - a);
        let t = a.dot(normal) / query.direction.dot(normal);
        let z = &self.axes[query.axes[2]];
        let (first, next) = (lane % PAIRS, lane + PAIRS);
        let [a, b, c] = [z[first], z[next % z.len()], z[(next + PAIRS) % z.len()]].map(|z| f64::from(z) - query.depth);
        let (least, most) = (min(min(a, b), c), max(max(a, b), c));
        let (from, to) = (least * query.inverse_z, most * query.inverse_z);
        // Written so that what is NaN, for a triangle seen exactly edge-on, stays so and is no hit.
        min(max(from, to), max(min(from, to), t))
    }
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
