//! A tree with four children a node, collapsed from the binary tree that `obvhs` builds.

use super::block::{Block, PAIRS};
use super::pairing::{Pair, pair_up};
use super::{Accel, SPHERE};
use crate::ray::UNIT_ROUNDOFF;
use crate::shape::{Sphere, Triangle};
use glam::{Vec3A, Vec4};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use rayon::prelude::*;
use sampling::Vec3;

/// A child: an inner node, a block of triangles (`LEAF`), or a sphere (`LEAF | SPHERE`).
pub(super) type Child = u32;
/// Marks a child that is a leaf.
pub(super) const LEAF: Child = 1 << 30;

/// The boxes of up to four children, side by side: `planes[axis][0]` below, `planes[axis][1]` above.
/// The box of a child that isn't there is turned inside out, so that no ray meets it.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub planes: [[Vec4; 2]; 3],
    pub children: [Child; WIDTH],
}

/// Number of children of a node.
pub(super) const WIDTH: usize = 4;

/// Builds the tree over at least one primitive.
pub(super) fn build(triangles: &[Triangle], spheres: Vec<Sphere>, eye: Vec3) -> Accel {
    let pairs = pair_up(triangles);
    let boxes = boxes_of(&pairs, &spheres);
    let params = BvhBuildParams { max_prims_per_leaf: 1, ..BvhBuildParams::medium_build() };
    let binary = build_bvh2(&boxes, params, &mut std::time::Duration::default());
    let extent = boxes.iter().fold(eye.abs().max_element(), |extent, aabb| {
        extent.max(aabb.min.abs().max_element()).max(aabb.max.abs().max_element())
    });
    let mut collapse = Collapse {
        binary: &binary,
        pairs: &pairs,
        sizes: vec![0; binary.nodes.len()],
        // Shearing moves vertices by a few roundings of their distance to the ray's origin: boxes must hold them still.
        padding: Vec3A::splat(8.0 * UNIT_ROUNDOFF * extent),
        accel: Accel { spheres, ..Accel::default() },
    };
    collapse.measure(0);
    // The root of the wide tree is node 0; a tree of one leaf gets a root with one child.
    collapse.accel.nodes.push(Node::empty());
    let opened = if collapse.leaf(0) { vec![0] } else { collapse.open(0) };
    collapse.fill(0, &opened, 1);
    collapse.accel
}

fn boxes_of(pairs: &[Pair], spheres: &[Sphere]) -> Vec<Aabb> {
    let of_pair = |pair: &Pair| {
        let (low, high) = pair.extent();
        Aabb::new(low.into(), high.into())
    };
    let of_sphere = |s: &Sphere| {
        let (center, radius) = (Vec3A::from(s.center), Vec3A::splat(s.radius));
        Aabb::new(center - radius, center + radius)
    };
    let mut boxes: Vec<Aabb> = pairs.par_iter().map(of_pair).collect();
    boxes.extend(spheres.iter().map(of_sphere));
    boxes
}

impl Node {
    fn empty() -> Self {
        let planes = [[Vec4::INFINITY, Vec4::NEG_INFINITY]; 3];
        Node { planes, children: [LEAF; WIDTH] }
    }
}

struct Collapse<'a> {
    binary: &'a Bvh2,
    pairs: &'a [Pair],
    /// Number of pairs under each binary node; more than a block holds if one of them is a sphere.
    sizes: Vec<u32>,
    padding: Vec3A,
    accel: Accel,
}

impl Collapse<'_> {
    fn primitives(&self, index: usize) -> &[u32] {
        let node = &self.binary.nodes[index];
        &self.binary.primitive_indices[node.first_index as usize..(node.first_index + node.prim_count) as usize]
    }

    fn measure(&mut self, root: usize) {
        // Children are visited after their parents, so their sizes are complete when the order is walked back.
        let mut order = vec![root];
        let mut next = 0;
        while next < order.len() {
            let node = &self.binary.nodes[order[next]];
            if !node.is_leaf() {
                order.extend([node.first_index as usize, node.first_index as usize + 1]);
            }
            next += 1;
        }
        for &index in order.iter().rev() {
            let node = &self.binary.nodes[index];
            self.sizes[index] = if node.is_leaf() {
                let spheres = self.primitives(index).iter().any(|&p| p as usize >= self.pairs.len());
                if spheres { PAIRS as u32 + 1 } else { node.prim_count }
            } else {
                let first = node.first_index as usize;
                self.sizes[first].saturating_add(self.sizes[first + 1])
            };
        }
    }

    /// True if all under a binary node fits in one leaf.
    fn leaf(&self, index: usize) -> bool {
        self.sizes[index] as usize <= PAIRS || self.binary.nodes[index].is_leaf()
    }

    /// The binary nodes that become the children of the wide node for an inner binary node: the largest is opened again
    /// and again.
    fn open(&self, index: usize) -> Vec<usize> {
        let first = self.binary.nodes[index].first_index as usize;
        let mut opened = vec![first, first + 1];
        while opened.len() < WIDTH {
            let area = |i: usize| self.binary.nodes[i].aabb().half_area();
            let inner = (0..opened.len()).filter(|&i| !self.leaf(opened[i]));
            let Some(largest) = inner.max_by(|&a, &b| area(opened[a]).total_cmp(&area(opened[b]))) else { break };
            let first = self.binary.nodes[opened[largest]].first_index as usize;
            opened[largest] = first;
            opened.push(first + 1);
        }
        opened
    }

    /// Gives a wide node its children, all the way down.
    fn fill(&mut self, wide: usize, opened: &[usize], depth: usize) {
        self.accel.depth = self.accel.depth.max(depth);
        for (lane, &index) in opened.iter().enumerate() {
            let child = if self.leaf(index) {
                self.emit_leaf(index)
            } else {
                self.accel.nodes.push(Node::empty());
                let child = self.accel.nodes.len() - 1;
                let below = self.open(index);
                self.fill(child, &below, depth + 1);
                child as Child
            };
            let aabb = self.binary.nodes[index].aabb();
            let (low, high) = (aabb.min - self.padding, aabb.max + self.padding);
            let node = &mut self.accel.nodes[wide];
            node.children[lane] = child;
            for axis in 0..3 {
                node.planes[axis][0][lane] = low[axis];
                node.planes[axis][1][lane] = high[axis];
            }
        }
    }

    /// Lays down the triangles under a binary node as a block, or its one sphere.
    fn emit_leaf(&mut self, index: usize) -> Child {
        let mut found = Vec::with_capacity(PAIRS);
        let mut pending = vec![index];
        while let Some(index) = pending.pop() {
            let node = &self.binary.nodes[index];
            if node.is_leaf() {
                found.extend_from_slice(self.primitives(index));
            } else {
                pending.extend([node.first_index as usize, node.first_index as usize + 1]);
            }
        }
        if let [only] = found[..]
            && only as usize >= self.pairs.len()
        {
            return LEAF | SPHERE | (only - self.pairs.len() as u32);
        }
        let pairs: Vec<Pair> = found.iter().map(|&pair| self.pairs[pair as usize]).collect();
        self.accel.blocks.push(Block::new(&pairs));
        LEAF | (self.accel.blocks.len() - 1) as Child
    }
}
