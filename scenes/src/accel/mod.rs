//! Where rays meet surfaces: all that knows `obvhs`, and nothing of what surfaces are made of.
//!
//! Triangles are kept in [pairs](pairing), four pairs to a [`block`], tested together without leaks; spheres are analytic. A few primitives are simply
//! searched; more are put in a [`tree`] of four children a node, collapsed from the binary tree that `obvhs` builds.
//! Whichever it is, the hits are the same: boxes only decide what is looked at.

mod block;
mod crossings;
mod pairing;
mod query;
mod traverse;
mod tree;

use crate::needs::Skip;
use crate::ray::{Ray, SurfacePoint};
use crate::shape::{Sphere, Triangle};
use block::{Block, LANES, PAIRS};
pub(crate) use crossings::Primitive;
use query::{Query, dominant_axis};
use sampling::{Vec2, Vec3};
use tree::Node;

/// Up to this many primitives are searched without a tree.
pub(crate) const FEW: usize = 64;

/// The surfaces of a scene, arranged for rays.
#[derive(Clone, Debug, Default)]
pub(crate) struct Accel {
    blocks: Vec<Block>,
    spheres: Vec<Sphere>,
    /// Empty if the primitives are searched as a list.
    nodes: Vec<Node>,
    depth: usize,
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
    /// On a sphere.
    Sphere {
        /// Parameter along the ray.
        t: f32,
        /// Which one, as numbered when built.
        id: u32,
        /// The point.
        at: SurfacePoint,
    },
}

/// The nearest hit so far; the slot says where the primitive is kept.
#[derive(Clone, Copy)]
struct Best {
    t: f64,
    slot: u32,
    id: u32,
}

/// Marks the slot and the id of a sphere.
const SPHERE: u32 = 1 << 31;
const NOTHING: u32 = u32::MAX;

impl Best {
    #[inline]
    fn new(t_max: f32) -> Self {
        Best { t: f64::from(t_max), slot: NOTHING, id: 0 }
    }

    /// Takes a hit if it is nearer; of two equally near, the one numbered first, so that no arrangement matters.
    #[inline]
    fn offer(&mut self, t: f64, slot: u32, id: u32) {
        if t > 0.0 && (t < self.t || (t == self.t && id < self.id)) {
            *self = Best { t, slot, id };
        }
    }
}

impl Accel {
    /// Arranges triangles and spheres. `eye` is as far out as rays may start outside them.
    pub fn build(triangles: &[Triangle], spheres: Vec<Sphere>, eye: Vec3, skip: Skip) -> Self {
        if triangles.len() + spheres.len() > FEW || (skip == Skip::Nothing && triangles.len() + spheres.len() > 0) {
            return tree::build(triangles, spheres, eye);
        }
        let blocks = pairing::pair_up(triangles).chunks(PAIRS).map(Block::new).collect();
        Accel { blocks, spheres, ..Accel::default() }
    }

    /// The first surface on the ray's interval.
    #[inline]
    pub fn closest(&self, ray: &Ray) -> Option<Hit> {
        match dominant_axis(ray) {
            0 => self.closest_along::<0>(ray),
            1 => self.closest_along::<1>(ray),
            _ => self.closest_along::<2>(ray),
        }
    }

    /// Whether any surface is on the ray's interval.
    #[inline]
    pub fn any(&self, ray: &Ray) -> bool {
        match dominant_axis(ray) {
            0 => self.any_along::<0>(ray),
            1 => self.any_along::<1>(ray),
            _ => self.any_along::<2>(ray),
        }
    }

    #[inline]
    fn closest_along<const Z: usize>(&self, ray: &Ray) -> Option<Hit> {
        let query = Query::new::<Z>(ray);
        let mut best = Best::new(ray.t_max);
        if self.nodes.is_empty() {
            for index in 0..self.blocks.len() as u32 {
                self.offer_block::<Z>(index, &query, &mut best);
            }
            self.offer_spheres(&query, &mut best);
        } else {
            self.search_closest::<Z>(ray, &query, &mut best);
        }
        self.resolve(&query, best)
    }

    #[inline]
    fn any_along<const Z: usize>(&self, ray: &Ray) -> bool {
        let query = Query::new::<Z>(ray);
        let t_max = f64::from(ray.t_max);
        if self.nodes.is_empty() {
            return self.blocks.iter().any(|block| meets_block::<Z>(block, &query, t_max))
                || self.meets_spheres(&query, t_max);
        }
        self.search_any::<Z>(ray, &query, t_max)
    }

    #[inline(always)]
    fn offer_block<const Z: usize>(&self, index: u32, query: &Query, best: &mut Best) {
        let block = &self.blocks[index as usize];
        block.for_each_meeting::<Z>(query, best.t as f32, |lane, t| {
            best.offer(t, index * LANES as u32 + lane, block.id(lane as usize));
            false
        });
    }

    #[inline]
    fn offer_spheres(&self, query: &Query, best: &mut Best) {
        if self.spheres.is_empty() {
            return;
        }
        let inverse_length2 = query.direction.length_squared().recip();
        for index in 0..self.spheres.len() as u32 {
            self.offer_sphere(index, query, inverse_length2, best);
        }
    }

    #[inline]
    fn offer_sphere(&self, index: u32, query: &Query, inverse_length2: f64, best: &mut Best) {
        let sphere = &self.spheres[index as usize];
        if let Some((t_in, t_out)) = sphere.intersect(query.origin, query.direction, inverse_length2) {
            let t = if t_in > 0.0 { t_in } else { t_out };
            best.offer(t, SPHERE | index, SPHERE | index);
        }
    }

    #[inline]
    fn meets_spheres(&self, query: &Query, t_max: f64) -> bool {
        if self.spheres.is_empty() {
            return false;
        }
        let inverse_length2 = query.direction.length_squared().recip();
        self.spheres.iter().any(|sphere| meets_sphere(sphere, query, inverse_length2, t_max))
    }

    /// Works out the point of the nearest hit, once per ray.
    #[inline]
    fn resolve(&self, query: &Query, best: Best) -> Option<Hit> {
        if best.slot == NOTHING {
            return None;
        }
        let t = best.t as f32;
        if best.slot & SPHERE != 0 {
            let id = best.slot & !SPHERE;
            let at = self.spheres[id as usize].project(query.origin, query.direction, best.t);
            return Some(Hit::Sphere { t, id, at });
        }
        let (block, lane) = (&self.blocks[best.slot as usize / LANES], best.slot as usize % LANES);
        let (p, b) = block.point(lane, query);
        Some(Hit::Triangle { t, id: best.id, p, b })
    }
}

#[inline(always)]
fn meets_block<const Z: usize>(block: &Block, query: &Query, t_max: f64) -> bool {
    block.for_each_meeting::<Z>(query, t_max as f32, |_, t| t > 0.0 && t < t_max)
}

#[inline]
fn meets_sphere(sphere: &Sphere, query: &Query, inverse_length2: f64, t_max: f64) -> bool {
    let within = |t: f64| t > 0.0 && t < t_max;
    sphere
        .intersect(query.origin, query.direction, inverse_length2)
        .is_some_and(|(t_in, t_out)| within(t_in) || within(t_out))
}

#[cfg(test)]
mod tests;
