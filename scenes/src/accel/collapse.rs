//! From a binary tree to one with eight children a node.

use super::block::{Block, PAIRS};
use super::lanes::WIDTH;
use super::pairing::Pair;
use super::tree::{Child, Groups, INSTANCE, LEAF, Part, SHAPED_LEVELS, SINGLE, Tree};
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;

/// What a leaf costs a ray that meets its box, relative to a node.
const LEAF_COST: f32 = 1.0;

/// A binary tree on its way to become a wide one: of all that hold the same leaves, that of the least expected cost \[Ylitie17\].
pub(super) struct Collapse<'a, 'b, 'c> {
    binary: &'a Bvh2,
    groups: &'a Groups,
    part: &'a Part<'a>,
    /// Number of pairs under each binary node; more than a block holds if one of them is none.
    sizes: Vec<u32>,
    /// What it costs at the least to have a binary node's primitives under at most 1, 2, … children of one wide node.
    costs: Vec<[f32; WIDTH - 1]>,
    tree: &'b mut Tree<'c>,
}

impl<'a, 'b, 'c> Collapse<'a, 'b, 'c> {
    pub fn new(binary: &'a Bvh2, groups: &'a Groups, part: &'a Part<'a>, tree: &'b mut Tree<'c>) -> Self {
        let (sizes, costs) = (vec![0; binary.nodes.len()], vec![[0.0; WIDTH - 1]; binary.nodes.len()]);
        let mut collapse = Collapse { binary, groups, part, sizes, costs, tree };
        collapse.measure();
        collapse
    }

    /// Adds the wide tree, and returns its root, which is at this depth.
    pub fn run(mut self, depth: usize) -> Child {
        let wide = self.tree.new_node();
        // A tree of one leaf gets a root with one child.
        let opened = if self.binary.nodes[0].is_leaf() || self.leaf(0) { vec![0] } else { self.open(0) };
        self.fill(wide, &opened, depth);
        wide as Child
    }

    /// The primitives of a binary leaf.
    fn primitives(&self, index: usize) -> &[u32] {
        let node = &self.binary.nodes[index];
        debug_assert_eq!(node.prim_count, 1);
        self.groups.get(self.binary.primitive_indices[node.first_index as usize])
    }

    fn measure(&mut self) {
        // Children are visited after their parents, so they are complete when the order is walked back.
        let mut order = vec![0];
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
            let area = node.aabb().half_area();
            if node.is_leaf() {
                let primitives = self.primitives(index);
                let single = primitives.iter().any(|&p| p as usize >= self.part.couples.len());
                self.sizes[index] = if single { PAIRS as u32 + 1 } else { primitives.len() as u32 };
                self.costs[index] = [area * LEAF_COST; WIDTH - 1];
                continue;
            }
            let first = node.first_index as usize;
            self.sizes[index] = self.sizes[first].saturating_add(self.sizes[first + 1]);
            let mut costs = [area * LEAF_COST; WIDTH - 1];
            if !self.leaf(index) {
                costs[0] = area + self.split(index, WIDTH).1;
                for count in 2..WIDTH {
                    costs[count - 1] = costs[count - 2].min(self.split(index, count).1);
                }
            }
            self.costs[index] = costs;
        }
    }

    /// Into how many children of so many the first half of an inner binary node is best made, and the cost of all.
    fn split(&self, index: usize, count: usize) -> (usize, f32) {
        let first = self.binary.nodes[index].first_index as usize;
        let (left, right) = (&self.costs[first], &self.costs[first + 1]);
        let costs = (1..count).map(|of_first| (of_first, left[of_first - 1] + right[count - of_first - 1]));
        costs.min_by(|a, b| a.1.total_cmp(&b.1)).expect("there are at least two")
    }

    /// True if all under a binary node fits in one leaf.
    fn leaf(&self, index: usize) -> bool {
        let single = || self.binary.nodes[index].is_leaf() && self.primitives(index).len() == 1;
        self.sizes[index] as usize <= PAIRS || single()
    }

    /// The binary nodes that become the children of the wide node for an inner binary node.
    fn open(&self, index: usize) -> Vec<usize> {
        let mut opened = Vec::with_capacity(WIDTH);
        self.open_into(index, WIDTH, &mut opened);
        opened
    }

    fn open_into(&self, index: usize, count: usize, opened: &mut Vec<usize>) {
        let (of_first, _) = self.split(index, count);
        let first = self.binary.nodes[index].first_index as usize;
        for (child, count) in [(first, of_first), (first + 1, count - of_first)] {
            // The fewest that cost the same.
            let costs = &self.costs[child];
            let fewest = 1 + costs[..count].iter().position(|&cost| cost == costs[count - 1]).unwrap_or(count - 1);
            if fewest == 1 { opened.push(child) } else { self.open_into(child, fewest, opened) }
        }
    }

    /// Gives a wide node its children, all the way down.
    fn fill(&mut self, wide: usize, opened: &[usize], depth: usize) {
        self.tree.accel.depth = self.tree.accel.depth.max(depth);
        for (lane, &index) in opened.iter().enumerate() {
            let child = if self.leaf(index) {
                let primitives = self.gather(index);
                self.emit_leaf(&primitives)
            } else if depth >= SHAPED_LEVELS || self.binary.nodes[index].is_leaf() {
                let primitives = self.gather(index);
                self.cut_evenly(&primitives, depth + 1)
            } else {
                let child = self.tree.new_node();
                let below = self.open(index);
                self.fill(child, &below, depth + 1);
                child as Child
            };
            self.tree.place(wide, lane, child, self.binary.nodes[index].aabb());
        }
    }

    /// A child over these primitives, which are shared out in the order they come in.
    fn cut_evenly(&mut self, primitives: &[u32], depth: usize) -> Child {
        let fits = primitives.len() <= PAIRS && primitives.iter().all(|&p| (p as usize) < self.part.couples.len());
        if fits || primitives.len() == 1 {
            return self.emit_leaf(primitives);
        }
        self.tree.accel.depth = self.tree.accel.depth.max(depth);
        let wide = self.tree.new_node();
        for (lane, part) in primitives.chunks(primitives.len().div_ceil(WIDTH)).enumerate() {
            let child = self.cut_evenly(part, depth + 1);
            let aabb = part.iter().fold(Aabb::INVALID, |aabb, &p| aabb.union(&self.part.boxes[p as usize]));
            self.tree.place(wide, lane, child, &aabb);
        }
        wide as Child
    }

    /// The primitives under a binary node.
    fn gather(&self, index: usize) -> Vec<u32> {
        let mut found = Vec::new();
        let mut pending = vec![index];
        while let Some(index) = pending.pop() {
            let node = &self.binary.nodes[index];
            if node.is_leaf() {
                found.extend_from_slice(self.primitives(index));
            } else {
                pending.extend([node.first_index as usize, node.first_index as usize + 1]);
            }
        }
        found
    }

    /// Lays down pairs of triangles as a block, or one analytic surface or instance.
    fn emit_leaf(&mut self, primitives: &[u32]) -> Child {
        if let [only] = *primitives
            && only as usize >= self.part.couples.len()
        {
            let single = self.part.singles[only as usize - self.part.couples.len()];
            let analytic = self.tree.accel.analytic.len() as u32;
            return match single.checked_sub(analytic) {
                None => LEAF | SINGLE | single,
                Some(instance) => LEAF | SINGLE | INSTANCE | instance,
            };
        }
        let pair = |&pair: &u32| Pair::of(self.part.couples[pair as usize], self.part.items.triangles);
        let pairs: Vec<Pair> = primitives.iter().map(pair).collect();
        self.tree.accel.blocks.push(Block::new(&pairs));
        LEAF | (self.tree.accel.blocks.len() - 1) as Child
    }
}
