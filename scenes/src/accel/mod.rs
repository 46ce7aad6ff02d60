//! Where rays meet surfaces: all that knows `obvhs`, and nothing of what surfaces are made of.
//!
//! Triangles are kept in [pairs](pairing), four pairs to a [`block`], tested together without leaks; spheres, disks and cylinders are
//! analytic. A few primitives are simply
//! searched; more are put in a [`tree`] of eight children a node, collapsed from the binary tree that `obvhs` builds.
//! Whichever it is, the hits are the same: boxes only decide what is looked at. What is placed many times is kept once, in a tree of
//! its own, and is a leaf of the tree of the scene wherever it is placed: an [`instance`].

#[allow(unsafe_code)]
mod bare;
mod block;
mod collapse;
mod crossings;
mod faces;
mod instance;
mod kernel;
mod lanes;
mod list;
mod pairing;
mod parting;
mod query;
mod traverse;
mod tree;

use crate::needs::{Skip, Work};
use crate::ray::SurfacePoint;
use crate::shape::{Analytic, Triangle};
use block::{Block, LANES, Meeting, PAIRS};
pub(crate) use crossings::Primitive;
use faces::Faces;
pub(crate) use instance::{Instance, Prototype};
pub use kernel::Kernel;
use pairing::Pair;
use query::Line;
use sampling::{Vec2, Vec3};
use std::collections::HashMap;
use traverse::FAR;
use tree::Node;

/// Whether surfaces are searched without a tree.
pub(crate) fn are_few(triangles: &[Triangle], analytic: usize) -> bool {
    list_of(triangles, analytic).is_some()
}

/// The blocks and faces of triangles, if these and so many analytic surfaces are few: faces are tested eight at a time, others take as long
/// by themselves.
fn list_of(triangles: &[Triangle], analytic: usize) -> Option<(Vec<Block>, Faces)> {
    // No face has more than two.
    if triangles.len() > 2 * faces::MOST {
        return None;
    }
    let all: Vec<u32> = (0..triangles.len() as u32).collect();
    let couples = pairing::pair_up(triangles, &all).into_iter();
    let pairs: Vec<Pair> = couples.map(|couple| Pair::of(couple, triangles)).collect();
    let blocks: Vec<Block> = pairs.chunks(PAIRS).map(Block::new).collect();
    let faces = Faces::of(&blocks)?;
    // Among more than a block or two a tree is faster than they are one by one.
    let most = if faces.are_blind() { 2 * LANES } else { faces::MOST };
    (faces.len() + 8 * analytic <= most).then_some((blocks, faces))
}

/// No more triangles than this can be told apart.
pub(crate) const MOST_TRIANGLES: usize = block::NUMBER as usize;

/// The surfaces of a scene, arranged for rays.
#[derive(Clone, Debug, Default)]
pub(crate) struct Accel {
    kernel: Kernel,
    blocks: Vec<Block>,
    /// The longest edge in each of them \[m\].
    sizes: Vec<f32>,
    /// The faces of the blocks' triangles, if they are searched as a list.
    faces: Faces,
    analytic: Vec<Analytic>,
    /// Empty if the primitives are searched as a list.
    nodes: Vec<Node>,
    depth: usize,
    /// Only in the tree of a scene, and then there are nodes.
    instances: Vec<Instance>,
    prototypes: Vec<Prototype>,
}

/// Where a ray meets a surface first.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Hit {
    /// On a triangle.
    Triangle {
        /// Parameter along the ray.
        t: f32,
        /// Which one, as numbered when built.
        id: u32,
        /// The point, rounded once.
        p: Vec3,
        /// Barycentric coordinates of the vertices 1 and 2.
        b: Vec2,
    },
    /// On an analytic surface.
    Analytic {
        /// Parameter along the ray.
        t: f32,
        /// Which one, as numbered when built.
        id: u32,
        /// The point.
        at: SurfacePoint,
    },
    /// On a triangle of an instance.
    PlacedTriangle {
        /// Parameter along the ray.
        t: f32,
        /// Which one, as numbered when built.
        id: u32,
        /// The instance.
        instance: u32,
        /// The point in the scene, rounded once.
        p: Vec3,
        /// Barycentric coordinates of the vertices 1 and 2.
        b: Vec2,
    },
    /// On an analytic surface of an instance.
    PlacedAnalytic {
        /// Parameter along the ray.
        t: f32,
        /// Which one, as numbered when built.
        id: u32,
        /// The instance.
        instance: u32,
        /// The point in the scene, rounded once.
        p: Vec3,
        /// The unit normal of its front in the scene.
        ng: Vec3,
    },
}

/// The nearest hit so far; the slot says where the primitive is kept.
#[derive(Clone, Copy)]
struct Best {
    /// Its parameter.
    t: f64,
    slot: u32,
    id: u32,
    /// Where it is, if the slot says that it is in an instance.
    placed: Placed,
    /// The point on a triangle, in the coordinates that it is kept in.
    at: Meeting,
}

/// A primitive of an instance.
#[derive(Clone, Copy, Default)]
struct Placed {
    instance: u32,
    /// Where it is kept there.
    slot: u32,
}

/// Marks the slot and the id of an analytic surface.
const ANALYTIC: u32 = 1 << 31;
/// The slot of what is in an instance.
const PLACED: u32 = 1 << 30;
const NOTHING: u32 = u32::MAX;

/// True of a hit by its parameter and id that is ahead, and nearer than another; of two equally near, of the one numbered first, so that
/// no arrangement matters.
#[inline(always)]
fn comes_before((t, id): (f64, u32), (other, other_id): (f64, u32)) -> bool {
    t > 0.0 && (t < other || (t == other && id < other_id))
}

impl Best {
    /// Nothing met as yet, before `t`.
    #[inline(always)]
    fn before(t: f64) -> Self {
        Best { t, slot: NOTHING, id: 0, placed: Placed::default(), at: Meeting::default() }
    }

    /// True of a hit that is nearer.
    #[inline(always)]
    fn is_after(&self, t: f64, id: u32) -> bool {
        comes_before((t, id), (self.t, self.id))
    }

    /// A parameter beyond which nothing is nearer, with room for the rounding of those that it is compared to.
    #[inline(always)]
    fn limit(&self) -> f32 {
        self.t as f32 * FAR
    }

    #[inline]
    fn is_hit(&self) -> bool {
        self.slot != NOTHING
    }

    #[inline]
    fn is_placed(&self) -> bool {
        self.slot == PLACED
    }
}

impl Accel {
    /// Arranges triangles and analytic surfaces.
    pub fn build(triangles: &[Triangle], analytic: Vec<Analytic>, skip: Skip) -> Self {
        let list = skip.leaves_out(Work::Bvh).then(|| list_of(triangles, analytic.len())).flatten();
        let nothing = triangles.is_empty() && analytic.is_empty();
        let accel = Accel { analytic, ..Accel::default() };
        match list {
            Some((blocks, faces)) => Accel { faces, blocks, ..accel }.measured(),
            None if nothing => accel,
            None => tree::build(triangles, accel),
        }
    }

    /// The same with the sizes of its blocks.
    fn measured(self) -> Self {
        Accel { sizes: self.blocks.iter().map(Block::size).collect(), ..self }
    }

    /// The same with instances, of which there is at least one: always with a tree.
    pub fn build_with(
        triangles: &[Triangle],
        analytic: Vec<Analytic>,
        (instances, prototypes): (Vec<Instance>, Vec<Prototype>),
    ) -> Self {
        tree::build(triangles, Accel { analytic, instances, prototypes, ..Accel::default() })
    }

    /// How many instances there are.
    pub fn instances(&self) -> &[Instance] {
        &self.instances
    }

    /// The triangles outside instances, by the ids with which it was built.
    pub fn triangles(&self) -> HashMap<u32, Triangle> {
        self.blocks.iter().flat_map(Block::triangles).collect()
    }

    /// Works out the point of the nearest hit, once per ray.
    #[inline(always)]
    fn resolve(&self, line: Line, best: &Best) -> Option<Hit> {
        // The mark of nothing has all bits, so that a triangle is told by one question.
        if best.slot & (ANALYTIC | PLACED) == 0 {
            return Some(self.triangle_hit(best));
        }
        if !best.is_hit() {
            return None;
        }
        // Only this copy's address is given away, so that what it is of stays in registers all the way of a ray.
        let best = *best;
        Some(if best.is_placed() { self.placed_hit(line.ray, &best) } else { self.analytic_hit(line, &best) })
    }

    #[inline(always)]
    fn triangle_hit(&self, best: &Best) -> Hit {
        let (block, lane) = (&self.blocks[best.slot as usize / LANES], best.slot as usize % LANES);
        let at = if block.is_near_edge(lane, best.at.b) { block.off_edges(lane, best.at) } else { best.at };
        Hit::Triangle { t: best.t as f32, id: best.id, p: at.p.as_vec3(), b: block.vertex_weights(lane, at.b) }
    }

    #[inline(never)]
    fn analytic_hit(&self, line: Line, best: &Best) -> Hit {
        let id = best.slot & !ANALYTIC;
        let [origin, direction] = line.exact();
        let at = self.analytic[id as usize].point(origin, direction, best.t);
        Hit::Analytic { t: best.t as f32, id, at }
    }
}

#[cfg(test)]
mod tests;
