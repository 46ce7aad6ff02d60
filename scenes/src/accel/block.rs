//! Four triangles tested at once, without a leak between neighbours.

use super::query::Query;
use crate::ray::UNIT_ROUNDOFF;
use glam::{DVec3, Vec4};
use sampling::Vec3;

/// Number of triangles in a block.
pub(super) const WIDTH: usize = 4;

/// Depths are compared with room for their rounding.
const BEYOND: f32 = 1.0 + 8.0 * UNIT_ROUNDOFF;

/// Up to four triangles, side by side: `axes[axis][vertex]` holds one coordinate of one vertex of all four.
///
/// The test is that of \[Woop13\]: vertices are translated to the ray's origin and sheared so that the ray runs along its
/// dominant axis, and the signs of three edge functions decide. Neighbours compute the same bits for a shared edge, with
/// opposite sign, because their vertices have the same bits and the edge functions are plain products and a difference
/// (fused ones would differ); so a ray at an edge meets at least one of the two.
/// Rounding is monotone, so the sign of an edge function is never wrong, it can only vanish; then it is decided in `f64`.
#[derive(Clone, Debug)]
#[repr(align(16))]
pub(super) struct Block {
    axes: [[[f32; WIDTH]; 3]; 3],
    ids: [u32; WIDTH],
}

/// The lanes of a block that a line may meet.
#[derive(Clone, Copy)]
pub(super) struct Candidates {
    /// Lanes whose edge functions are of one sign or zero.
    pub inside: u32,
    /// Lanes with an edge function that is zero.
    pub on_edge: u32,
}

impl Block {
    /// A block of the given triangles (at most four), each with its id. Lanes that stay free are NaN and never hit.
    pub fn new(triangles: &[(u32, [Vec3; 3])]) -> Self {
        debug_assert!(triangles.len() <= WIDTH);
        let mut axes = [[[f32::NAN; WIDTH]; 3]; 3];
        let mut ids = [u32::MAX; WIDTH];
        for (lane, (id, vertices)) in triangles.iter().enumerate() {
            ids[lane] = *id;
            for (v, vertex) in vertices.iter().enumerate() {
                for (axis, coordinate) in vertex.to_array().into_iter().enumerate() {
                    axes[axis][v][lane] = coordinate;
                }
            }
        }
        Block { axes, ids }
    }

    /// The id of a lane's triangle.
    #[inline]
    pub fn id(&self, lane: usize) -> u32 {
        self.ids[lane % WIDTH]
    }

    /// The vertices of a lane's triangle.
    #[inline]
    pub fn vertices(&self, lane: usize) -> [Vec3; 3] {
        let lane = lane % WIDTH;
        std::array::from_fn(|v| Vec3::new(self.axes[0][v][lane], self.axes[1][v][lane], self.axes[2][v][lane]))
    }

    /// The lanes whose triangle the query's line meets, unless all of it lies behind the origin or beyond `t_max`, where
    /// `t_max` may be off by its rounding. `Z` is the query's dominant axis.
    #[inline(always)]
    pub fn candidates<const Z: usize>(&self, query: &Query, t_max: f32) -> Candidates {
        let [ox, oy, oz] = query.origin4;
        let [sx, sy] = query.shear4;
        let coordinates = |axis: usize| self.axes[axis % 3].map(Vec4::from_array);
        let z = coordinates(Z).map(|z| z - oz);
        let (x, y) = (coordinates(Z + 1), coordinates(Z + 2));
        let x: [Vec4; 3] = std::array::from_fn(|v| (x[v] - ox) - sx * z[v]);
        let y: [Vec4; 3] = std::array::from_fn(|v| (y[v] - oy) - sy * z[v]);
        let u = x[2] * y[1] - y[2] * x[1];
        let v = x[0] * y[2] - y[0] * x[2];
        let w = x[1] * y[0] - y[1] * x[0];
        let least = u.min(v).min(w);
        let most = u.max(v).max(w);
        let inside = least.cmpge(Vec4::ZERO).bitmask() | most.cmple(Vec4::ZERO).bitmask();
        if inside == 0 {
            return Candidates { inside, on_edge: 0 };
        }
        let depth = z.map(|z| z * query.inverse_z4);
        let nearest = depth[0].min(depth[1]).min(depth[2]);
        let farthest = depth[0].max(depth[1]).max(depth[2]);
        let reached = farthest.cmpgt(Vec4::ZERO).bitmask() & nearest.cmple(Vec4::splat(t_max * BEYOND)).bitmask();
        let inside = inside & reached;
        let on_edge = least.cmpeq(Vec4::ZERO).bitmask() | most.cmpeq(Vec4::ZERO).bitmask();
        Candidates { inside, on_edge: on_edge & inside }
    }

    /// Decides a lane with an edge function that vanished in `f32`: the same sheared vertices, products exact in `f64`.
    /// What is zero even so counts as inside, for both neighbours; a triangle seen edge-on is not met.
    #[cold]
    #[inline(never)]
    pub fn is_inside_exactly<const Z: usize>(&self, lane: usize, query: &Query) -> bool {
        let [ox, oy, oz] = query.origin4.map(|o| o.x);
        let [sx, sy] = query.shear4.map(|s| s.x);
        let sheared: [[f64; 2]; 3] = std::array::from_fn(|v| {
            let z = self.axes[Z][v][lane] - oz;
            let x = (self.axes[(Z + 1) % 3][v][lane] - ox) - sx * z;
            let y = (self.axes[(Z + 2) % 3][v][lane] - oy) - sy * z;
            [f64::from(x), f64::from(y)]
        });
        let edge = |a: usize, b: usize| sheared[a][0] * sheared[b][1] - sheared[a][1] * sheared[b][0];
        let (u, v, w) = (edge(2, 1), edge(0, 2), edge(1, 0));
        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        inside && u + v + w != 0.0
    }

    /// Where the query's line meets the plane of a lane's triangle, in `f64`, so that the sign is right however close
    /// the origin is to the plane. Kept within the depths of the vertices, for triangles seen nearly edge-on.
    #[inline(always)]
    pub fn parameter<const Z: usize>(&self, lane: usize, query: &Query) -> f64 {
        let [a, b, c] = self.vertices(lane).map(|v| v.as_dvec3() - query.origin);
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

    /// Barycentric coordinates of the vertices 1 and 2 where the query's line meets a lane's triangle \[Möller97\],
    /// in `f64` and kept within the triangle.
    #[inline]
    pub fn barycentrics(&self, lane: usize, query: &Query) -> [f64; 2] {
        let [a, b, c] = self.vertices(lane).map(Vec3::as_dvec3);
        let (edge_1, edge_2): (DVec3, DVec3) = (b - a, c - a);
        let p = query.direction.cross(edge_2);
        let s = query.origin - a;
        let inverse = edge_1.dot(p).recip();
        let b1 = s.dot(p) * inverse;
        let b2 = query.direction.dot(s.cross(edge_1)) * inverse;
        // `max` first, so that the NaN of a triangle seen edge-on becomes its first vertex.
        let b1 = b1.max(0.0).min(1.0);
        [b1, b2.max(0.0).min(1.0 - b1)]
    }
}

/// The lesser of two numbers that aren't NaN, in one instruction.
#[inline(always)]
fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater of two numbers that aren't NaN, in one instruction.
#[inline(always)]
fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
