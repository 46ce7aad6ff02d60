//! A tree with eight children a node, made from binary trees that `obvhs` builds.

use super::collapse::Collapse;
use super::lanes::WIDTH;
use super::pairing::{Couple, Pair, pair_up};
use super::parting::{Items, cut};
use super::{Accel, Instance};
use crate::progress::{self, Activity};
use crate::shape::Triangle;
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;
use rayon::prelude::*;
use sampling::Vec3;

/// A child: an inner node, a block of triangles (`LEAF`), an analytic surface (`LEAF | SINGLE`), or an instance
/// (`LEAF | SINGLE | INSTANCE`).
pub(super) type Child = u32;
/// Marks a child that is a leaf.
pub(super) const LEAF: Child = 1 << 30;
/// Marks a leaf that is no block.
pub(super) const SINGLE: Child = 1 << 31;
/// Marks a leaf that is an instance.
pub(super) const INSTANCE: Child = 1 << 29;
/// What is left of a child is a number below this.
pub(super) const NUMBER: Child = INSTANCE - 1;

/// The boxes of up to eight children, side by side: `planes[axis][0]` below, `planes[axis][1]` above.
/// The box of a child that isn't there begins at infinity and ends before, so that no ray meets it.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Node {
    pub planes: [[[f32; WIDTH]; 2]; 3],
    pub children: [Child; WIDTH],
}

/// Boxes are larger by a rounding, and by this, so that what lies in the plane of a side is within, as it is for triangles, and a ray along it
/// is there for long \[m\].
const ROOM: f32 = 1e-18;
/// Below this many levels what is left is cut into equal parts: a tree over surfaces that lie in one place can be a chain.
pub(super) const SHAPED_LEVELS: usize = 48;
/// No tree has more levels: those cut into equal parts hold eight times as many primitives each.
pub(super) const DEEPEST: usize = SHAPED_LEVELS + 16;

/// Up to this many triangles and other surfaces are put in the tree at once: rays are up to 1.3 times slower where they are not.
const WHOLE: usize = 1 << 21;

/// What part of the time is over when boxes are there, and when the binary tree is.
const PREPARED: f64 = 0.2;
const BINARY: f64 = 0.7;

/// Builds the tree over at least one primitive: the triangles, and what `accel` holds already.
///
/// A tree takes several times the memory while it is built than when it is done; more than [`WHOLE`] primitives are cut into parts first, whose
/// trees are built one after the other.
pub(super) fn build(triangles: &[Triangle], accel: Accel) -> Accel {
    build_in_parts(triangles, accel, WHOLE)
}

/// The same in parts of so many primitives at the most.
pub(super) fn build_in_parts(triangles: &[Triangle], accel: Accel, most: usize) -> Accel {
    let items = Items { triangles, singles: singles_of(&accel) };
    let mut order: Vec<u32> = (0..items.len() as u32).collect();
    let mut tree = Tree { items: &items, most, done: 0, accel };
    tree.grow(&mut order, 1);
    let mut accel = tree.accel;
    drop(order);
    if items.len() <= most {
        // An allocator keeps what building took while something behind it is in use, of a tree built at once as much as the tree takes. Copies,
        // since these are aligned to more than can be shrunk in place, lie there. Of one built in parts they would be the peak.
        accel.nodes.shrink_to_fit();
        accel.blocks.shrink_to_fit();
    }
    accel.measured()
}

/// The tree as far as it has been built.
pub(super) struct Tree<'a> {
    items: &'a Items<'a>,
    most: usize,
    /// How many items are in it.
    done: usize,
    pub accel: Accel,
}

impl Tree<'_> {
    /// Adds a wide node over some items, with all below it, and returns it with its box.
    fn grow(&mut self, list: &mut [u32], depth: usize) -> (Child, Aabb) {
        if list.len() <= self.most {
            return self.grow_part(list, depth);
        }
        self.report(0.0);
        self.accel.depth = self.accel.depth.max(depth);
        let wide = self.new_node();
        let mut bounds = Aabb::INVALID;
        for (lane, eighth) in self.eighths(list).into_iter().enumerate() {
            let (child, aabb) = self.grow(eighth, depth + 1);
            self.place(wide, lane, child, &aabb);
            bounds = bounds.union(&aabb);
        }
        (wide as Child, bounds)
    }

    /// A list cut in two, three times over.
    fn eighths<'l>(&self, list: &'l mut [u32]) -> Vec<&'l mut [u32]> {
        (0..WIDTH.ilog2()).fold(vec![list], |parts, _| {
            let halves = |part: &'l mut [u32]| {
                let middle = cut(self.items, part);
                <[_; 2]>::from(part.split_at_mut(middle))
            };
            parts.into_iter().flat_map(halves).collect()
        })
    }

    fn grow_part(&mut self, list: &[u32], depth: usize) -> (Child, Aabb) {
        let items = list.len() as f64;
        self.report(0.0);
        let mut part = Part::of(self.items, list);
        let groups = Groups::of(&part.boxes);
        tell_apart(&mut part.boxes);
        self.report(PREPARED * items);
        let binary = match groups.len() == part.boxes.len() {
            true => build_binary(&part.boxes),
            false => build_binary(&groups.iter().map(|group| part.boxes[group[0] as usize]).collect::<Vec<_>>()),
        };
        self.report(BINARY * items);
        let bounds = *binary.nodes[0].aabb();
        let wide = Collapse::new(&binary, &groups, &part, self).run(depth);
        self.done += list.len();
        self.report(0.0);
        (wide, bounds)
    }

    /// Tells that the work of so many items is done beside that of those which are in the tree.
    fn report(&self, more: f64) {
        progress::report(Activity::Building, (self.done as f64 + more) / self.items.len() as f64);
    }

    pub fn new_node(&mut self) -> usize {
        self.accel.nodes.push(Node::empty());
        self.accel.nodes.len() - 1
    }

    pub fn place(&mut self, wide: usize, lane: usize, child: Child, aabb: &Aabb) {
        let node = &mut self.accel.nodes[wide];
        node.children[lane] = child;
        for axis in 0..3 {
            node.planes[axis][0][lane] = (aabb.min[axis] - ROOM).next_down();
            node.planes[axis][1][lane] = (aabb.max[axis] + ROOM).next_up();
        }
    }
}

/// What is built together: couples of triangles, and behind them other surfaces.
pub(super) struct Part<'a> {
    pub items: &'a Items<'a>,
    pub couples: Vec<Couple>,
    /// The numbers of the others among those of all.
    pub singles: Vec<u32>,
    pub boxes: Vec<Aabb>,
}

impl<'a> Part<'a> {
    fn of(items: &'a Items, list: &[u32]) -> Self {
        // Numbers ascend in a list.
        let (triangles, others) = list.split_at(list.partition_point(|&item| (item as usize) < items.triangles.len()));
        let couples = pair_up(items.triangles, triangles);
        let singles: Vec<u32> = others.iter().map(|&item| item - items.triangles.len() as u32).collect();
        let of = |couple: &Couple| {
            let (low, high) = Pair::of(*couple, items.triangles).extent();
            Aabb::new(low.into(), high.into())
        };
        let mut boxes = Vec::with_capacity(couples.len() + singles.len());
        boxes.par_extend(couples.par_iter().map(of));
        boxes.extend(singles.iter().map(|&single| items.singles[single as usize]));
        Part { items, couples, singles, boxes }
    }
}

/// Primitives with the very same box, together: the builder would need quadratic time for many of them.
pub(super) struct Groups {
    order: Vec<u32>,
    /// Where each group begins, and the end.
    starts: Vec<u32>,
}

impl Groups {
    fn of(boxes: &[Aabb]) -> Self {
        let key = |index: u32| {
            let aabb = &boxes[index as usize];
            (aabb.min.to_array().map(f32::to_bits), aabb.max.to_array().map(f32::to_bits), index)
        };
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        order.par_sort_unstable_by_key(|&index| key(index));
        let begins = |&at: &usize| at == 0 || boxes[order[at] as usize] != boxes[order[at - 1] as usize];
        let starts: Vec<u32> = (0..order.len()).filter(begins).chain([order.len()]).map(|at| at as u32).collect();
        if starts.len() == boxes.len() + 1 {
            // Where no two are alike, each group is the primitive of its number.
            order = (0..boxes.len() as u32).collect();
        }
        Groups { order, starts }
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    pub fn get(&self, group: u32) -> &[u32] {
        &self.order[self.starts[group as usize] as usize..self.starts[group as usize + 1] as usize]
    }

    fn iter(&self) -> impl Iterator<Item = &[u32]> {
        (0..self.starts.len() as u32 - 1).map(|group| self.get(group))
    }
}

/// Makes every box a little larger, by an amount of its own. The builder joins boxes that are each other's nearest: of a row of equal ones,
/// evenly spaced, each would be the nearest of the one before it, and only two were joined in a pass over all.
fn tell_apart(boxes: &mut [Aabb]) {
    const MOST: f32 = 1.0 / 8192.0;
    for (i, aabb) in boxes.iter_mut().enumerate() {
        let share = (i as u32).wrapping_mul(0x9e37_79b9) as f32 / u32::MAX as f32;
        aabb.max += (aabb.max - aabb.min) * (share * MOST);
    }
}

/// The binary tree, one box a leaf: the medium preset of `obvhs` without its collapsing.
fn build_binary(boxes: &[Aabb]) -> Bvh2 {
    let preset = BvhBuildParams::medium_build();
    let mut binary = PlocBuilder::with_capacity(boxes.len()).build(
        preset.ploc_search_distance,
        boxes,
        (0..boxes.len() as u32).collect(),
        preset.sort_precision,
        preset.search_depth_threshold,
    );
    let mut optimizer = ReinsertionOptimizer::default();
    for share in [1.0, preset.post_collapse_reinsertion_batch_ratio_multiplier] {
        optimizer.run(&mut binary, preset.reinsertion_batch_ratio * share, None);
    }
    binary
}

/// The boxes of analytic surfaces and instances, in this order.
fn singles_of(accel: &Accel) -> Vec<Aabb> {
    let of = |(low, high): (Vec3, Vec3)| Aabb::new(low.into(), high.into());
    let mut boxes: Vec<Aabb> = accel.analytic.iter().map(|surface| of(surface.extent())).collect();
    let prototype = |instance: &Instance| &accel.prototypes[instance.prototype as usize];
    boxes.extend(accel.instances.iter().map(|instance| of(prototype(instance).extent(&instance.to_world))));
    boxes
}

impl Node {
    fn empty() -> Self {
        Node { planes: [[[f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]]; 3], children: [LEAF; WIDTH] }
    }
}
