//! Eight triangles tested at once, in pairs that share an edge, without a leak between neighbours.

use super::pairing::Pair;
use super::query::Query;
use crate::ray::UNIT_ROUNDOFF;
use glam::{DVec3, Vec4};
use sampling::{Vec2, Vec3, vec2};

/// Number of pairs in a block.
pub(super) const PAIRS: usize = 4;
/// Number of triangles in a block. Lane `l` below [`PAIRS`] is the first triangle of pair `l`, above it the second.
pub(super) const LANES: usize = 2 * PAIRS;

/// Depths are compared with room for their rounding.
const BEYOND: f32 = 1.0 + 8.0 * UNIT_ROUNDOFF;

/// Up to four pairs of triangles (a, b, c) and (a, c, d), side by side: `axes[axis][corner][pair]` holds one coordinate.
///
/// The test is that of \[Woop13\]: corners are translated to the ray's origin and sheared so that the ray runs along its
/// dominant axis, and the signs of three edge functions decide. Neighbours compute the same bits for a shared edge, with
/// opposite sign, because their vertices have the same bits and the edge functions are plain products and a difference
/// (fused ones would differ); so a ray at an edge meets at least one of the two.
/// Rounding is monotone, so the sign of an edge function is never wrong, it can only vanish; then it is decided in `f64`.
/// Corners shared within a pair are moved once, and the edge between its triangles is computed once.
#[derive(Clone, Debug)]
#[repr(align(16))]
pub(super) struct Block {
    axes: [[[f32; PAIRS]; 4]; 3],
    /// The triangle of each lane, `u32::MAX` for none.
    ids: [u32; LANES],
    /// For each lane, by how much its triangle's corners are rotated against the vertices of the triangle as given.
    rotations: [u8; LANES],
}

/// The lanes of a block that a line may meet.
#[derive(Clone, Copy)]
struct Candidates {
    /// Lanes whose edge functions are of one sign or zero.
    inside: u32,
    /// Lanes with an edge function that is zero.
    on_edge: u32,
}

impl Block {
    /// A block of at most four pairs. Lanes that stay free are NaN and never hit.
    pub fn new(pairs: &[Pair]) -> Self {
        debug_assert!(pairs.len() <= PAIRS);
        let mut block = Block { axes: [[[f32::NAN; PAIRS]; 4]; 3], ids: [u32::MAX; LANES], rotations: [0; LANES] };
        for (index, pair) in pairs.iter().enumerate() {
            for (corner, p) in pair.corners.iter().enumerate() {
                for (axis, coordinate) in p.to_array().into_iter().enumerate() {
                    block.axes[axis][corner][index] = coordinate;
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
        let corner = |c: usize| Vec3::new(self.axes[0][c][pair], self.axes[1][c][pair], self.axes[2][c][pair]);
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

    /// Calls `visit` with the lane and the parameter of each triangle that the query's line meets before `t_max` (about),
    /// until it returns true; and returns whether it did. `Z` is the query's dominant axis.
    #[inline(always)]
    pub fn for_each_meeting<const Z: usize>(
        &self,
        query: &Query,
        t_max: f32,
        mut visit: impl FnMut(u32, f64) -> bool,
    ) -> bool {
        let Candidates { mut inside, on_edge } = self.candidates::<Z>(query, t_max);
        while inside != 0 {
            let lane = inside.trailing_zeros();
            inside &= inside - 1;
            let sure = on_edge >> lane & 1 == 0 || self.is_inside_exactly::<Z>(lane as usize, query);
            if sure && visit(lane, self.parameter::<Z>(lane as usize, query)) {
                return true;
            }
        }
        false
    }

    /// The lanes whose triangle the query's line meets, unless all of its pair lies behind the origin or beyond `t_max`.
    #[inline(always)]
    fn candidates<const Z: usize>(&self, query: &Query, t_max: f32) -> Candidates {
        let [ox, oy, oz] = query.origin4;
        let [sx, sy] = query.shear4;
        let z = self.axes[Z].map(|z| Vec4::from_array(z) - oz);
        let x: [Vec4; 4] = std::array::from_fn(|c| (Vec4::from_array(self.axes[(Z + 1) % 3][c]) - ox) - sx * z[c]);
        let y: [Vec4; 4] = std::array::from_fn(|c| (Vec4::from_array(self.axes[(Z + 2) % 3][c]) - oy) - sy * z[c]);
        let edge = |from: usize, to: usize| x[from] * y[to] - y[from] * x[to];
        let (ab, bc, ca) = (edge(0, 1), edge(1, 2), edge(2, 0));
        let (cd, da) = (edge(2, 3), edge(3, 0));
        let (least, most) = (ab.min(bc).min(ca), ab.max(bc).max(ca));
        let (least_2, most_2) = (cd.min(da).min(-ca), cd.max(da).max(-ca));
        let first = least.cmpge(Vec4::ZERO) | most.cmple(Vec4::ZERO);
        let second = least_2.cmpge(Vec4::ZERO) | most_2.cmple(Vec4::ZERO);
        let inside = first.bitmask() | second.bitmask() << PAIRS;
        if inside == 0 {
            return Candidates { inside, on_edge: 0 };
        }
        let depth = z.map(|z| z * query.inverse_z4);
        let nearest = depth[0].min(depth[1]).min(depth[2]).min(depth[3]);
        let farthest = depth[0].max(depth[1]).max(depth[2]).max(depth[3]);
        let reached = (farthest.cmpgt(Vec4::ZERO) & nearest.cmple(Vec4::splat(t_max * BEYOND))).bitmask();
        let inside = inside & (reached | reached << PAIRS);
        let on_edge = (least.cmpeq(Vec4::ZERO) | most.cmpeq(Vec4::ZERO)).bitmask();
        let on_edge_2 = (least_2.cmpeq(Vec4::ZERO) | most_2.cmpeq(Vec4::ZERO)).bitmask();
        Candidates { inside, on_edge: inside & (on_edge | on_edge_2 << PAIRS) }
    }

    /// Decides a lane with an edge function that vanished in `f32`: the same sheared corners, products exact in `f64`.
    /// What is zero even so counts as inside, for both neighbours; a triangle seen edge-on is not met.
    #[cold]
    #[inline(never)]
    fn is_inside_exactly<const Z: usize>(&self, lane: usize, query: &Query) -> bool {
        let [ox, oy, oz] = query.origin4.map(|o| o.x);
        let [sx, sy] = query.shear4.map(|s| s.x);
        let sheared = self.corners(lane).map(|p| {
            let z = p[Z] - oz;
            let x = (p[(Z + 1) % 3] - ox) - sx * z;
            let y = (p[(Z + 2) % 3] - oy) - sy * z;
            [f64::from(x), f64::from(y)]
        });
        let edge = |a: usize, b: usize| sheared[a][0] * sheared[b][1] - sheared[a][1] * sheared[b][0];
        let (u, v, w) = (edge(0, 1), edge(1, 2), edge(2, 0));
        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        inside && u + v + w != 0.0
    }

    /// Where the query's line meets the plane of a lane's triangle, in `f64`, so that the sign is right however close
    /// the origin is to the plane. Kept within the depths of the corners, for triangles seen nearly edge-on.
    #[inline(always)]
    fn parameter<const Z: usize>(&self, lane: usize, query: &Query) -> f64 {
        let [a, b, c] = self.corners(lane).map(|v| v.as_dvec3() - query.origin);
        let normal = (b - a).cross(c - a);
        let t = a.dot(normal) / query.direction.dot(normal);
        let (least, most) = (min(min(a[Z], b[Z]), c[Z]), max(max(a[Z], b[Z]), c[Z]));
        let (from, to) = (least * query.inverse_z, most * query.inverse_z);
        // Written so that what is NaN, for a triangle seen exactly edge-on, stays so and is no hit.
        if t < min(from, to) {
            min(from, to)
        } else if t > max(from, to) {
            max(from, to)
        } else {
            t
        }
    }
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
