//! The way of a ray through the tree.

use super::query::Query;
use super::tree::{Child, DEEPEST, INSTANCE, LEAF, NUMBER, Node, SINGLE, WIDTH};
use super::{Accel, Best, meets_analytic, meets_block};
use crate::ray::{Ray, UNIT_ROUNDOFF};
use glam::{Vec3, Vec4};

/// Entries of the stack, three for each level of a tree of some million triangles. It is cleared for every ray, so that a
/// smaller one is faster.
const STACK: usize = 48;
/// Entries of the stack for any tree.
const DEEP_STACK: usize = 3 * DEEPEST + 1;

/// Far planes are moved away by the rounding of both distances \[Ize13\].
const FAR: f32 = 1.0 + 8.0 * UNIT_ROUNDOFF;

/// A ray prepared for boxes.
struct Slabs {
    origin: [Vec4; 3],
    inverse: [Vec4; 3],
    /// For each axis, which of the two planes is met first.
    near: [usize; 3],
}

impl Slabs {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        // A component of zero gets a huge reciprocal, so that no product of zero and infinity arises.
        let inverse =
            Vec3::from_array(ray.d.to_array().map(|d| if d.abs() < 1e-24 { 1e24f32.copysign(d) } else { d.recip() }));
        Slabs {
            origin: ray.o.to_array().map(Vec4::splat),
            inverse: inverse.to_array().map(Vec4::splat),
            near: inverse.to_array().map(|i| usize::from(i < 0.0)),
        }
    }

    /// The parameters at which the ray enters the children's boxes, and the mask of those it meets before `t_max`.
    #[inline(always)]
    fn enter(&self, node: &Node, t_max: f32) -> (Vec4, u32) {
        let plane = |axis: usize, side: usize| (node.planes[axis][side & 1] - self.origin[axis]) * self.inverse[axis];
        let [x, y, z] = self.near;
        let near = plane(0, x).max(plane(1, y)).max(plane(2, z)).max(Vec4::ZERO);
        let far = plane(0, x ^ 1).min(plane(1, y ^ 1)).min(plane(2, z ^ 1));
        let mask = near.cmple((far * FAR).min(Vec4::splat(t_max))).bitmask();
        (near, mask)
    }
}

impl Accel {
    #[inline]
    pub(super) fn search_closest<const Z: usize>(&self, ray: &Ray, query: &Query, best: &mut Best) {
        if 3 * self.depth < STACK {
            self.closest_with_stack::<Z, STACK>(ray, query, best);
        } else {
            self.closest_with_stack::<Z, DEEP_STACK>(ray, query, best);
        }
    }

    #[inline]
    pub(super) fn search_any<const Z: usize>(&self, ray: &Ray, query: &Query, t_max: f64) -> bool {
        if 3 * self.depth < STACK {
            self.any_with_stack::<Z, STACK>(ray, query, t_max)
        } else {
            self.any_with_stack::<Z, DEEP_STACK>(ray, query, t_max)
        }
    }

    /// Nearest boxes first; what lies beyond the nearest hit is left out.
    #[inline(never)]
    fn closest_with_stack<const Z: usize, const N: usize>(&self, ray: &Ray, query: &Query, best: &mut Best) {
        let slabs = Slabs::new(ray);
        let inverse_length2 = query.direction.length_squared().recip();
        let mut stack = [(0.0f32, 0 as Child); N];
        let mut top = 1;
        let mut limit = best.t as f32 * FAR;
        while top > 0 {
            top -= 1;
            let (near, child) = stack[top];
            if near > limit {
                continue;
            }
            if child & LEAF != 0 {
                if child & SINGLE == 0 {
                    self.offer_block::<Z>(child & !LEAF, query, best);
                } else if child & INSTANCE == 0 {
                    self.offer_analytic(child & NUMBER, query, inverse_length2, best);
                } else {
                    self.offer_instance(child & NUMBER, ray, best);
                }
                limit = best.t as f32 * FAR;
                continue;
            }
            let node = &self.nodes[child as usize];
            let (near, mut mask) = slabs.enter(node, limit);
            let near = near.to_array();
            let first = top;
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                let entry = (near[lane % WIDTH], node.children[lane % WIDTH]);
                let mut place = top;
                while place > first && stack[place - 1].0 < entry.0 {
                    stack[place] = stack[place - 1];
                    place -= 1;
                }
                stack[place] = entry;
                top += 1;
            }
        }
    }

    /// Visits the leaves whose boxes the ray meets, in any order.
    pub(super) fn leaves_met(&self, ray: &Ray, mut visit: impl FnMut(Child)) {
        self.any_leaf::<DEEP_STACK>(ray, |leaf| {
            visit(leaf);
            false
        });
    }

    /// Boxes in any order, until something is met.
    #[inline(never)]
    fn any_with_stack<const Z: usize, const N: usize>(&self, ray: &Ray, query: &Query, t_max: f64) -> bool {
        let inverse_length2 = query.direction.length_squared().recip();
        self.any_leaf::<N>(ray, |leaf| {
            if leaf & SINGLE == 0 {
                meets_block::<Z>(&self.blocks[(leaf & !LEAF) as usize], query, t_max)
            } else if leaf & INSTANCE == 0 {
                meets_analytic(&self.analytic[(leaf & NUMBER) as usize], query, inverse_length2, t_max)
            } else {
                self.meets_instance(leaf & NUMBER, ray, t_max)
            }
        })
    }

    /// Whether `met` says so of any leaf whose box the ray meets, in any order; the rest is left out then.
    #[inline(always)]
    fn any_leaf<const N: usize>(&self, ray: &Ray, mut met: impl FnMut(Child) -> bool) -> bool {
        let slabs = Slabs::new(ray);
        let limit = ray.t_max * FAR;
        let mut stack = [0 as Child; N];
        let mut top = 1;
        while top > 0 {
            top -= 1;
            let child = stack[top];
            if child & LEAF != 0 {
                if met(child) {
                    return true;
                }
                continue;
            }
            let node = &self.nodes[child as usize];
            let (_, mut mask) = slabs.enter(node, limit);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                stack[top] = node.children[lane % WIDTH];
                top += 1;
            }
        }
        false
    }
}
