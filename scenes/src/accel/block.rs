//! Eight triangles tested at once, in pairs that share an edge, without a leak between neighbours.

use super::lanes::{Lanes, WIDTH};
use super::pairing::Pair;
use super::query::{Line, Query};
use crate::ray::UNIT_ROUNDOFF;
use crate::shape::{Triangle, margin};
use glam::DVec3;
use sampling::{Vec2, Vec3, fault, vec2};

/// Number of pairs in a block.
pub(super) const PAIRS: usize = WIDTH / 2;
/// Number of triangles in a block. Lane `l` below [`PAIRS`] is the first triangle of pair `l`, above it the second.
pub(super) const LANES: usize = WIDTH;

/// Triangles have numbers below two to this.
const NUMBER_BITS: u32 = 28;
pub(super) const NUMBER: u32 = (1 << NUMBER_BITS) - 1;
/// Above it is by how much a triangle's corners are rotated against its vertices as given, and from here on its place in [`NEAR`].
const NEAR_SHIFT: u32 = NUMBER_BITS + 2;
/// Points with no barycentric coordinate below one of these are off the edges, from large triangles to needles.
static NEAR: [f64; 4] = [1.0 / (1 << 17) as f64, 1.0 / (1 << 11) as f64, 1.0 / (1 << 5) as f64, 1.0];
/// Where the weight of vertex 1 stands among those of the corners 1, 2 and 0, by how much corners are rotated.
static FIRST_WEIGHT: [usize; 4] = [0, 2, 1, 0];
/// A triangle's plane is seen at a grazing angle where the square of its sine is below this.
pub(super) const GRAZING: f64 = 1e-8;
/// How far an edge function may be off, relative to the longest edge and to the distance along the line; see [`Block::candidates`].
const EDGE_OFF: f32 = 16.0 * UNIT_ROUNDOFF;
/// Where an edge function is below this, something may have underflowed.
const LEAST_OFF: f32 = 1e-36;
/// How far the direction's part along a unit normal may be off, relative to its largest coordinate.
const SLOPE_OFF: f32 = 24.0 * UNIT_ROUNDOFF;
/// What is so far before a limit that is [`FAR`](super::traverse::FAR) off is before what that was made from, by products that are rounded.
const BEFORE: f32 = 1.0 - 24.0 * UNIT_ROUNDOFF;
/// A plane is not [`GRAZING`] where the direction's part along its unit normal, relative to its largest coordinate, is this.
const SEEN: f32 = 2e-4;

/// Up to four pairs of triangles (a, b, c) and (a, c, d), side by side: `axes[axis][corner * PAIRS + pair]` holds one
/// coordinate, so that eight in a row are the second corners of the eight triangles, or the third.
///
/// The test is that of \[Woop13\]: corners are translated to the ray's origin and sheared so that the ray runs along its
/// dominant axis, and the signs of three edge functions decide. In `f32` they come with a bound on their rounding; a sign that this
/// leaves open is decided in `f64`. There neighbours compute the same bits for a shared edge, with opposite sign, because their vertices
/// have the same bits and the edge functions are plain products and a difference (fused ones would differ); so a ray at an edge meets at
/// least one of the two. That alone would hold in `f32` as well, but the rounding of a corner that is far away, 10⁻⁷ of the distance, is
/// more than points keep off the edges that they are next to, and a ray may then pass behind both.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Block {
    axes: [[f32; 4 * PAIRS]; 3],
    /// The unit normals of the triangles, axis by axis; zero where there is no area.
    normals: [[f32; LANES]; 3],
    /// The triangle of each lane, `u32::MAX` for none, and above [`NUMBER_BITS`] what else there is to know of it.
    ids: [u32; LANES],
}

/// The lanes of a block whose triangle a query's line meets, but for those that it meets outside the interval for certain.
#[derive(Clone, Copy)]
pub(super) struct Candidates {
    /// Lanes whose edge functions may be of one sign.
    inside: u32,
    /// Lanes with an edge function whose sign is not certain.
    open: u32,
    /// Lanes whose triangle the line, as it is rounded, meets on the interval for certain.
    sure: u32,
}

/// The lanes whose planes a line meets outside its interval for certain, and those that it so meets within.
struct Interval {
    outside: u32,
    within: u32,
}

impl Candidates {
    /// Whether a query's line meets any of them on its interval, so much so that nothing is left to ask.
    #[inline(always)]
    pub fn are_met(&self, query: &Query) -> bool {
        self.sure != 0 && query.line.exact.is_none()
    }

    /// Takes one of them out: the lane, and whether it is left open that the line is inside.
    #[inline(always)]
    pub fn take(&mut self) -> Option<(usize, bool)> {
        if self.inside == 0 {
            return None;
        }
        let lane = self.inside.trailing_zeros();
        self.inside &= self.inside.wrapping_sub(1);
        Some((lane as usize % LANES, self.open >> lane & 1 != 0))
    }
}

/// Where a line meets the plane of a triangle.
pub(super) struct Crossing {
    /// The parameter; NaN if the line turns out to pass by the triangle.
    pub t: f64,
    /// The triangle's first corner, and the way from there to the others.
    corner: DVec3,
    edges: [DVec3; 2],
    /// The first corner as the line's origin sees it.
    away: DVec3,
    direction: DVec3,
    /// The reciprocal of the direction's part along the edges' cross product.
    inverse: f64,
}

/// Where a line meets a triangle.
#[derive(Clone, Copy, Default)]
pub(super) struct Meeting {
    /// The point.
    pub p: DVec3,
    /// Barycentric coordinates of the corners 1 and 2, as they are kept.
    pub b: [f64; 2],
}

impl Crossing {
    /// The point, after \[Moeller97\] and kept within the triangle, so that it is on its plane whatever the angle.
    #[inline(always)]
    pub fn point(&self) -> Meeting {
        let [edge_1, edge_2] = self.edges;
        let across = self.away.cross(self.direction);
        let (b1, b2) = (edge_2.dot(across) * self.inverse, -edge_1.dot(across) * self.inverse);
        // Written so that the NaN of a triangle seen edge-on becomes its first corner.
        let b1 = min(max(b1, 0.0), 1.0);
        let b2 = min(max(b2, 0.0), 1.0 - b1);
        Meeting { p: self.corner + edge_1 * b1 + edge_2 * b2, b: [b1, b2] }
    }
}

impl Block {
    /// A block of at most four pairs. Lanes that stay free are NaN and never hit.
    pub fn new(pairs: &[Pair]) -> Self {
        debug_assert!(pairs.len() <= PAIRS);
        let mut block = Block { axes: [[f32::NAN; 4 * PAIRS]; 3], normals: [[0.0; LANES]; 3], ids: [u32::MAX; LANES] };
        for (index, pair) in pairs.iter().enumerate() {
            for (corner, p) in pair.corners.iter().enumerate() {
                for (axis, coordinate) in p.to_array().into_iter().enumerate() {
                    block.axes[axis][corner * PAIRS + index] = coordinate;
                }
            }
            for (half, member) in pair.members.iter().enumerate() {
                if member.id == u32::MAX {
                    continue;
                }
                debug_assert!(member.id < NUMBER && member.rotation < 3);
                let corners = block.corners(index + half * PAIRS).map(Vec3::as_dvec3);
                let near = NEAR.iter().filter(|&&near| near < margin::greatest_least(&corners)).count() as u32;
                block.ids[index + half * PAIRS] =
                    member.id | u32::from(member.rotation) << NUMBER_BITS | near << NEAR_SHIFT;
                let [a, b, c] = corners;
                let normal = (b - a).cross(c - a).normalize_or_zero().as_vec3();
                for (axis, coordinate) in normal.to_array().into_iter().enumerate() {
                    block.normals[axis][index + half * PAIRS] = coordinate;
                }
            }
        }
        block
    }

    /// The longest edge of its triangles \[m\].
    pub fn size(&self) -> f32 {
        let edges = |[a, b, c]: [Vec3; 3]| [a - b, b - c, c - a].map(Vec3::length);
        let lanes = (0..LANES).filter(|&lane| self.is_occupied(lane));
        lanes.flat_map(|lane| edges(self.corners(lane))).fold(0.0, f32::max) * 1.001
    }

    /// Whether a lane has a triangle.
    pub fn is_occupied(&self, lane: usize) -> bool {
        self.ids[lane] != u32::MAX
    }

    /// The id of a lane's triangle.
    #[inline]
    pub fn id(&self, lane: usize) -> u32 {
        self.ids[lane % LANES] & NUMBER
    }

    /// By how much a lane's corners are rotated against its triangle's vertices.
    #[inline]
    fn rotation(&self, lane: usize) -> usize {
        (self.ids[lane % LANES] >> NUMBER_BITS) as usize % 4
    }

    /// The corners of a lane's triangle, rotated as they are kept.
    #[inline]
    pub fn corners(&self, lane: usize) -> [Vec3; 3] {
        let pair = lane % PAIRS;
        let second = usize::from(lane >= PAIRS);
        let [x, y, z] = &self.axes;
        let corner = |c: usize| Vec3::new(x[c * PAIRS + pair], y[c * PAIRS + pair], z[c * PAIRS + pair]);
        [corner(0), corner(1 + second), corner(2 + second)]
    }

    /// Its triangles with their ids, the vertices in the order they were given in.
    pub fn triangles(&self) -> impl Iterator<Item = (u32, Triangle)> {
        let lanes = (0..LANES).filter(|&lane| self.is_occupied(lane));
        lanes.map(|lane| {
            let (corners, rotation) = (self.corners(lane), self.rotation(lane));
            // Vertex v is corner v − rotation.
            (self.id(lane), Triangle([0, 1, 2].map(|vertex| corners[(vertex + 3 - rotation) % 3])))
        })
    }

    /// Whether a point of a lane's triangle may be so close to an edge that it is to be moved off it.
    #[inline(always)]
    pub fn is_near_edge(&self, lane: usize, [b1, b2]: [f64; 2]) -> bool {
        min(min(b1, b2), 1.0 - b1 - b2) < NEAR[(self.ids[lane % LANES] >> NEAR_SHIFT) as usize]
    }

    /// The point off the edges of a lane's triangle.
    #[cold]
    #[inline(never)]
    pub fn off_edges(&self, lane: usize, at: Meeting) -> Meeting {
        let corners = self.corners(lane).map(Vec3::as_dvec3);
        let b = margin::off_edges(&corners, at.b);
        if b == at.b { at } else { Meeting { p: margin::point(&corners, b), b } }
    }

    /// Barycentric coordinates of a lane's triangle, for the vertices 1 and 2 in the order they were given in.
    #[inline(always)]
    pub fn vertex_weights(&self, lane: usize, [b1, b2]: [f64; 2]) -> Vec2 {
        // Vertex v is corner v − rotation, so that the weights of the vertices 1 and 2 are those of the corners that follow on this.
        let weights = [b1 as f32, b2 as f32, (1.0 - b1 - b2) as f32, b1 as f32];
        let first = FIRST_WEIGHT[self.rotation(lane)];
        vec2(weights[first], weights[first + 1])
    }

    /// The lanes whose triangle the query's line may meet, unless it lies behind the origin or beyond the limit for certain.
    ///
    /// `size` is that of the block. Let L be that, z the distance of a triangle's first corner along the line, and u the unit roundoff. The
    /// line's own axes are oblique: where it is inside, the two coordinates of a corner across it add up to √6 L at most, and all are
    /// within z + 0.82 L along it. Rounding of the translation, of the shear, of their product and difference moves a corner across the line
    /// by at most twice its coordinate there and 5 (z + L) roundings, of which 2 are of the shear, the same for all corners. An edge function is
    /// so off by at most 14.7 u L z + 30.6 u L², its own products and difference reckoned in, and by 100 u² z² where moved corners meet moved
    /// ones: less than u (16 L (z + 2L) + 160 u z²). Far across from a triangle that is no bound; but there the signs are those of the moved
    /// corners, since rounding is monotone and products are not fused, and cannot agree.
    #[inline(always)]
    pub fn candidates<L: Lanes>(&self, proof: L::Proof, query: &Query, size: f32, limit: f32) -> Candidates {
        let [x, y, z] = query.axes;
        let [a_z, b_z, c_z] = self.translated::<L>(proof, z, query.o[2]);
        let [x_a, x_b, x_c] = self.translated::<L>(proof, x, query.o[0]);
        let [y_a, y_b, y_c] = self.translated::<L>(proof, y, query.o[1]);
        let (s_x, s_y) = (L::splat(proof, query.shear[0]), L::splat(proof, query.shear[1]));
        let (a_x, b_x, c_x) = (x_a.minus(s_x, a_z), x_b.minus(s_x, b_z), x_c.minus(s_x, c_z));
        let (a_y, b_y, c_y) = (y_a.minus(s_y, a_z), y_b.minus(s_y, b_z), y_c.minus(s_y, c_z));
        let ab = a_x * b_y - a_y * b_x;
        let bc = b_x * c_y - b_y * c_x;
        let ca = c_x * a_y - c_y * a_x;
        let (least, most) = (ab.min(bc).min(ca), ab.max(bc).max(ca));
        let (deep, off) = (a_z.abs(), fault!("edges_without_their_bound", EDGE_OFF, 0.0));
        let (fixed, along) = (L::splat(proof, 2.0 * size * size * off + LEAST_OFF), L::splat(proof, size * off));
        let off = fixed.plus(deep, along.plus(deep, L::splat(proof, off * (10.0 * UNIT_ROUNDOFF))));
        let below = L::splat(proof, 0.0) - off;
        // All of one sign for certain, or perhaps.
        let inside = below.at_most(least) | most.at_most(off);
        let open = inside & below.at_most(most) & least.at_most(off);
        let height_off = (deep + L::splat(proof, size)) * L::splat(proof, query.height_off);
        let Interval { outside, within } = self.interval(proof, query, [x_a, y_a, a_z], height_off, limit);
        // It does not pay to ask before whether there is a candidate: that would be guessed wrong too often.
        Candidates { inside: inside & (open | !outside), open, sure: inside & !open & within }
    }

    /// On which lanes' planes the query's line is within its interval, and on which it is not, where f32 can tell; `a` are their first
    /// corners, relative to the origin, along the query's axes.
    ///
    /// With the unit normal n, the plane is at the parameter t = n·a / n·d = (n·a / d_z) / (n·d / d_z). Normals are rounded, and so are a
    /// and the shears, products and sums: in all, the first of the two is off by at most 8 roundings of Σ|aᵢ| / |d_z|, the other by 8 of
    /// Σ|dᵢ / d_z|, which is at most 3. Where the line is inside the triangle, Σ|aᵢ| is at most 3 z + √6 L.
    #[inline(always)]
    fn interval<L: Lanes>(&self, proof: L::Proof, query: &Query, a: [L; 3], height_off: L, limit: f32) -> Interval {
        let [x, y, z] = query.axes;
        let (n_x, n_y, n_z) = (self.normal::<L>(proof, x), self.normal::<L>(proof, y), self.normal::<L>(proof, z));
        let [a_x, a_y, a_z] = a;
        let (s_x, s_y) = (L::splat(proof, query.shear[0]), L::splat(proof, query.shear[1]));
        let height = (a_x * n_x).plus(a_y, n_y).plus(a_z, n_z) * L::splat(proof, query.inverse);
        let slope = n_z.plus(s_x, n_x).plus(s_y, n_y);
        let (high, steep, slope_off) = (height.abs(), slope.abs(), L::splat(proof, SLOPE_OFF));
        let (least, most) = (high - height_off, high + height_off);
        // Compared this way around, NaN leaves it open.
        let known = L::splat(proof, f32::MIN_POSITIVE).at_most(least.min(steep - slope_off));
        let behind = height.differs_in_sign(slope) & known;
        let beyond = ((steep + slope_off) * L::splat(proof, limit)).at_most(least);
        let before = most.at_most((steep - slope_off) * L::splat(proof, limit * BEFORE));
        let seen = L::splat(proof, SEEN).at_most(steep);
        let outside = behind | beyond;
        let ahead = fault!("what_is_behind_shades", known & !outside, u32::MAX);
        Interval { outside, within: ahead & before & seen }
    }

    /// One coordinate of the triangles' normals.
    #[inline(always)]
    fn normal<L: Lanes>(&self, proof: L::Proof, axis: usize) -> L {
        L::load(proof, &self.normals[axis])
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

    /// Where a line meets the plane of a candidate's triangle, in `f64`, so that the sign is right however close the origin is to it.
    #[inline(always)]
    pub fn crossing(&self, (lane, open): (usize, bool), query: &Query) -> Crossing {
        let exact = query.line.exact();
        let (mut crossing, normal) = self.plain_crossing(lane, exact);
        let slope = exact[1].dot(normal);
        // NaN, of a triangle without area, is grazing.
        let seen = slope * slope > GRAZING * normal.length_squared() * exact[1].length_squared();
        if open || !seen {
            crossing.t = self.doubtful_parameter((lane, open, !seen), query.line, crossing.t);
        }
        crossing
    }

    /// Where a line meets the plane of a lane's triangle if nothing is in doubt, and the cross product of its edges.
    #[inline(always)]
    fn plain_crossing(&self, lane: usize, [origin, direction]: [DVec3; 2]) -> (Crossing, DVec3) {
        let [a, b, c] = self.corners(lane).map(Vec3::as_dvec3);
        let (away, edges) = (a - origin, [b - a, c - a]);
        let normal = edges[0].cross(edges[1]);
        let inverse = direction.dot(normal).recip();
        (Crossing { t: away.dot(normal) * inverse, corner: a, edges, away, direction, inverse }, normal)
    }

    /// The point at which a line meets a lane's triangle.
    #[inline(always)]
    pub fn meeting(&self, lane: usize, exact: [DVec3; 2]) -> Meeting {
        self.plain_crossing(lane, exact).0.point()
    }

    /// The parameter where it is in doubt whether the line meets the triangle at all, or where.
    #[cold]
    #[inline(never)]
    fn doubtful_parameter(&self, (lane, open, grazing): (usize, bool, bool), line: Line, t: f64) -> f64 {
        let query = Query::of(line);
        if open && !self.is_inside_exactly(lane, &query) {
            f64::NAN
        } else if grazing {
            self.grazing_parameter(lane, &query, t)
        } else {
            t
        }
    }

    /// Decides a lane with an edge function whose sign is open. What is zero even so counts as inside, for both neighbours; a triangle
    /// seen edge-on is not met.
    fn is_inside_exactly(&self, lane: usize, query: &Query) -> bool {
        let [x, y, z] = query.axes;
        let (o, d) = (query.line.ray.o.as_dvec3(), query.line.ray.d.as_dvec3());
        let (s_x, s_y) = (d[x] / d[z], d[y] / d[z]);
        let sheared = self.corners(lane).map(|p| {
            let p = p.as_dvec3() - o;
            [p[x] - s_x * p[z], p[y] - s_y * p[z]]
        });
        let edge = |a: usize, b: usize| sheared[a][0] * sheared[b][1] - sheared[a][1] * sheared[b][0];
        let (u, v, w) = (edge(0, 1), edge(1, 2), edge(2, 0));
        let inside = (u >= 0.0 && v >= 0.0 && w >= 0.0) || (u <= 0.0 && v <= 0.0 && w <= 0.0);
        inside && u + v + w != 0.0
    }

    /// The parameter of a triangle that is seen nearly edge-on: kept within the depths of its corners.
    fn grazing_parameter(&self, lane: usize, query: &Query, t: f64) -> f64 {
        let z = query.axes[2];
        let [origin, direction] = query.line.exact().map(|v| v.as_ref()[z]);
        let [a, b, c] = self.corners(lane).map(|p| (f64::from(p[z]) - origin) / direction);
        let (least, most) = (min(min(a, b), c), max(max(a, b), c));
        // Written so that what is NaN, for a triangle seen exactly edge-on, stays so and is no hit.
        min(most, max(least, t))
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

#[cfg(test)]
mod tests;
