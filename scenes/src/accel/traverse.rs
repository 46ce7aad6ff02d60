//! The way of a ray through the tree.

use super::bare::Stack;
use super::block::LANES;
use super::lanes::{Lanes, Portable, WIDTH};
use super::query::{Line, Query};
use super::tree::{Child, INSTANCE, LEAF, NUMBER, Node, SINGLE};
use super::{ANALYTIC, Accel, Best, Hit};
use crate::ray::{Ray, UNIT_ROUNDOFF};
use glam::Vec3A;

/// Parameters are compared with room for their rounding.
pub(super) const FAR: f32 = 1.0 + 8.0 * UNIT_ROUNDOFF;

/// A ray prepared for boxes.
struct Slabs<L> {
    origin: [L; 3],
    /// Reciprocals of its direction, turned around, for the planes that it meets first.
    inverse: [L; 3],
    /// The same for those that it meets last, larger by the rounding of both distances \[Ize13\].
    last: [L; 3],
    /// Which of the planes across each axis it meets first: 0 where it runs upwards.
    first: [usize; 3],
}

impl<L: Lanes> Slabs<L> {
    #[inline(always)]
    fn new(proof: L::Proof, ray: &Ray) -> Self {
        let (o, d) = (ray.o, ray.d);
        let d = Vec3A::from(d).abs().max(Vec3A::splat(LEAST)).copysign(d.into());
        let [x, y, z] = (-1.0 / d).to_array();
        let [l_x, l_y, l_z] = (-FAR / d).to_array();
        Slabs {
            origin: [L::splat(proof, o.x), L::splat(proof, o.y), L::splat(proof, o.z)],
            inverse: [L::splat(proof, x), L::splat(proof, y), L::splat(proof, z)],
            last: [L::splat(proof, l_x), L::splat(proof, l_y), L::splat(proof, l_z)],
            first: [x, y, z].map(|inverse| (!inverse.to_bits() >> 31) as usize),
        }
    }

    /// The parameters at which the ray enters the children's boxes, and those it meets before `t_max`, as bits.
    #[inline(always)]
    fn enter(&self, proof: L::Proof, node: &Node, t_max: f32) -> (L, u32) {
        let [x, y, z] = self.first;
        let (near_x, far_x) = (self.near(proof, node, 0, x), self.far(proof, node, 0, x));
        let (near_y, far_y) = (self.near(proof, node, 1, y), self.far(proof, node, 1, y));
        let (near_z, far_z) = (self.near(proof, node, 2, z), self.far(proof, node, 2, z));
        // In this order zero is positive, and NaN, of a ray without an origin, is met by nothing.
        let near = near_x.max(near_y).max(near_z.max(L::splat(proof, 0.0)));
        let far = far_x.min(far_y).min(L::splat(proof, t_max).min(far_z));
        (near, near.at_most(far))
    }

    /// The parameters at which the ray meets the first of the children's planes across an axis.
    #[inline(always)]
    fn near(&self, proof: L::Proof, node: &Node, axis: usize, first: usize) -> L {
        (self.origin[axis] - L::load(proof, &node.planes[axis][first % 2])) * self.inverse[axis]
    }

    /// Those at which it meets the last of them.
    #[inline(always)]
    fn far(&self, proof: L::Proof, node: &Node, axis: usize, first: usize) -> L {
        (self.origin[axis] - L::load(proof, &node.planes[axis][(1 - first) % 2])) * self.last[axis]
    }
}

/// Directions are at least so large along each axis, so that no product of zero and infinity arises.
const LEAST: f32 = 1e-30;

/// The nearest of the children that are met; the others are put on the stack, the nearer ones last. Up to four are put in order without
/// branches, since these would be guessed wrong as often as not.
#[inline(always)]
fn nearest(stack: &mut Stack<u64>, node: &Node, near: &[f32; WIDTH], mut met: u32) -> Child {
    let a = next(node, near, &mut met);
    if met == 0 {
        return a as Child;
    }
    let b = next(node, near, &mut met);
    let (a, b) = (a.min(b), a.max(b));
    if met == 0 {
        stack.push(b);
        return a as Child;
    }
    let c = next(node, near, &mut met);
    let (a, c) = (a.min(c), a.max(c));
    let (b, c) = (b.min(c), b.max(c));
    if met == 0 {
        stack.push(c);
        stack.push(b);
        return a as Child;
    }
    let d = next(node, near, &mut met);
    let (mut a, d) = (a.min(d), a.max(d));
    let (b, d) = (b.min(d), b.max(d));
    let (c, d) = (c.min(d), c.max(d));
    let start = stack.len();
    stack.push(d);
    stack.push(c);
    stack.push(b);
    while met != 0 {
        let e = next(node, near, &mut met);
        stack.insert(start, a.max(e));
        a = a.min(e);
    }
    a as Child
}

/// One of the children that are met, and out of `met`, behind the parameter where it is entered: ordered by this, which is not negative.
#[inline(always)]
fn next(node: &Node, near: &[f32; WIDTH], met: &mut u32) -> u64 {
    let lane = take(met);
    u64::from(near[lane].to_bits()) << 32 | u64::from(node.children[lane])
}

/// The lowest bit that is set, taken out.
#[inline(always)]
fn take(mask: &mut u32) -> usize {
    let lane = mask.trailing_zeros() as usize;
    *mask &= mask.wrapping_sub(1);
    lane % WIDTH
}

impl Accel {
    /// The first surface on the ray's interval.
    #[inline(always)]
    pub(super) fn closest_hit_in_tree<L: Lanes>(&self, proof: L::Proof, ray: &Ray) -> Option<Hit> {
        let (query, mut best) = (Query::new(ray), Best::before(f64::from(ray.t_max)));
        self.closest_in_tree::<L>(proof, &query, &mut best);
        self.resolve(query.line, &best)
    }

    /// Whether any surface is on the ray's interval.
    #[inline(always)]
    pub(super) fn any_hit_in_tree<L: Lanes>(&self, proof: L::Proof, ray: &Ray) -> bool {
        self.any_in_tree::<L>(proof, &Query::new(ray), f64::from(ray.t_max))
    }

    /// Offers what is met: nearest boxes first; what lies beyond the nearest hit is left out.
    #[inline(always)]
    pub(super) fn closest_in_tree<L: Lanes>(&self, proof: L::Proof, query: &Query, best: &mut Best) {
        let slabs = Slabs::<L>::new(proof, query.line.ray);
        let mut stack = Stack::new();
        let mut child: Child = 0;
        let mut limit = best.limit();
        loop {
            if child & LEAF == 0 {
                let node = &self.nodes[child as usize];
                let (near, met) = slabs.enter(proof, node, limit);
                if met != 0 {
                    child = nearest(&mut stack, node, &near.to_array(), met);
                    continue;
                }
            } else {
                self.offer_leaf::<L>(proof, child, query, best);
                limit = best.limit();
            }
            loop {
                let Some(entry) = stack.pop() else { return };
                if (entry >> 32) as u32 <= limit.to_bits() {
                    child = entry as Child;
                    break;
                }
            }
        }
    }

    #[inline(always)]
    fn offer_leaf<L: Lanes>(&self, proof: L::Proof, leaf: Child, query: &Query, best: &mut Best) {
        if leaf & SINGLE == 0 {
            self.offer_block::<L>(proof, leaf & !LEAF, query, best);
        } else if leaf & INSTANCE == 0 {
            self.offer_analytic(leaf & NUMBER, query.line, best);
        } else {
            // Number by number, so that what is nearest is kept in registers, and not where the function writes to.
            let Best { t, slot, id, placed, at } = self.offer_instance(leaf & NUMBER, query.line, *best);
            (best.t, best.slot, best.id, best.placed, best.at) = (t, slot, id, placed, at);
        }
    }

    #[inline(always)]
    pub(super) fn offer_block<L: Lanes>(&self, proof: L::Proof, index: u32, query: &Query, best: &mut Best) {
        let block = &self.blocks[index as usize];
        let mut candidates = block.candidates::<L>(proof, query, self.sizes[index as usize], best.limit());
        while let Some(candidate) = candidates.take() {
            let (crossing, lane) = (block.crossing(candidate, query), candidate.0);
            let id = block.id(lane);
            if best.is_after(crossing.t, id) {
                (best.t, best.slot, best.id) = (crossing.t, index * LANES as u32 + lane as u32, id);
                best.at = crossing.point();
            }
        }
    }

    #[inline(always)]
    fn offer_analytic(&self, index: u32, line: Line, best: &mut Best) {
        let (t, slot) = (self.analytic_parameter(index, line), ANALYTIC | index);
        if best.is_after(t, slot) {
            (best.t, best.slot, best.id) = (t, slot, slot);
        }
    }

    /// The parameter at which a line first meets an analytic surface, if it does ahead.
    #[inline(never)]
    pub(super) fn analytic_parameter(&self, index: u32, line: Line) -> f64 {
        let [first, second] = self.analytic_meetings(index, line);
        // Written so that the second counts where the first is NaN.
        if first > 0.0 { first } else { second }
    }

    /// Whether anything is met before `t_max`: boxes in any order.
    #[inline(always)]
    pub(super) fn any_in_tree<L: Lanes>(&self, proof: L::Proof, query: &Query, t_max: f64) -> bool {
        let slabs = Slabs::<L>::new(proof, query.line.ray);
        let limit = query.line.ray.t_max * FAR;
        let mut stack = Stack::new();
        let mut child: Child = 0;
        loop {
            if child & LEAF == 0 {
                let node = &self.nodes[child as usize];
                let (_, mut met) = slabs.enter(proof, node, limit);
                if met != 0 {
                    child = node.children[take(&mut met)];
                    while met != 0 {
                        stack.push(child);
                        child = node.children[take(&mut met)];
                    }
                    continue;
                }
            } else if self.meets_leaf::<L>(proof, child, query, t_max) {
                return true;
            }
            match stack.pop() {
                Some(next) => child = next,
                None => return false,
            }
        }
    }

    #[inline(always)]
    fn meets_leaf<L: Lanes>(&self, proof: L::Proof, leaf: Child, query: &Query, t_max: f64) -> bool {
        if leaf & SINGLE == 0 {
            self.meets_block::<L>(proof, leaf & !LEAF, query, t_max)
        } else if leaf & INSTANCE == 0 {
            self.meets_analytic(leaf & NUMBER, query.line, t_max)
        } else {
            self.meets_instance(leaf & NUMBER, query.line.ray, t_max)
        }
    }

    #[inline(always)]
    pub(super) fn meets_block<L: Lanes>(&self, proof: L::Proof, index: u32, query: &Query, t_max: f64) -> bool {
        let block = &self.blocks[index as usize];
        let mut candidates = block.candidates::<L>(proof, query, self.sizes[index as usize], t_max as f32 * FAR);
        if candidates.are_met(query) {
            return true;
        }
        while let Some(candidate) = candidates.take() {
            let t = block.crossing(candidate, query).t;
            if t > 0.0 && t < t_max {
                return true;
            }
        }
        false
    }

    #[inline(never)]
    pub(super) fn meets_analytic(&self, index: u32, line: Line, t_max: f64) -> bool {
        let [first, second] = self.analytic_meetings(index, line);
        (first > 0.0 && first < t_max) || (second > 0.0 && second < t_max)
    }

    /// The parameters at which a line meets an analytic surface, the nearer one first.
    #[inline(always)]
    pub(super) fn analytic_meetings(&self, index: u32, line: Line) -> [f64; 2] {
        let [origin, direction] = line.exact();
        self.analytic[index as usize].meetings(origin, direction, direction.length_squared().recip())
    }

    /// Visits the leaves whose boxes the ray meets, in any order.
    pub(super) fn leaves_met(&self, query: &Query, mut visit: impl FnMut(Child)) {
        let slabs = Slabs::<Portable>::new((), query.line.ray);
        let mut stack = vec![0 as Child];
        while let Some(child) = stack.pop() {
            if child & LEAF != 0 {
                visit(child);
                continue;
            }
            let node = &self.nodes[child as usize];
            let (_, mut mask) = slabs.enter((), node, query.line.ray.t_max * FAR);
            while mask != 0 {
                stack.push(node.children[take(&mut mask)]);
            }
        }
    }
}
