//! A hierarchy of emitters, for a choice that depends on the point to be lit \[Conty18\].

use super::bounds::{Bounds, Outline, strongest};
use super::{Emitter, EmitterId};
use crate::ray::SurfacePoint;
use sampling::fault;

/// Depth from which nodes are halved by number, so that no path is long.
const DEEP: usize = 40;

/// A binary tree over the emitters that are somewhere. A walk from its root chooses between the two halves of each node in
/// proportion to the light that may come from them, unless something is in its way.
#[derive(Clone, Debug)]
pub(super) struct EmitterTree {
    /// The root first; a node's first child follows it.
    nodes: Vec<Node>,
    /// The leaf of each emitter, if it has one.
    leaves: Vec<Option<u32>>,
}

#[derive(Clone, Debug)]
struct Node {
    parent: u32,
    content: Content,
    outline: Outline,
}

#[derive(Clone, Copy, Debug)]
enum Content {
    Leaf(EmitterId),
    /// The place of the second child.
    Inner(u32),
}

impl EmitterTree {
    /// The tree over the emitters that have power and are somewhere.
    pub fn new(emitters: &[Emitter]) -> Self {
        let bright = |(_, emitter): &(usize, &Emitter)| emitter.power() > 0.0;
        let strongest = strongest(emitters.iter());
        let mut members: Vec<(EmitterId, Bounds)> = emitters
            .iter()
            .enumerate()
            .filter(bright)
            .filter_map(|(index, emitter)| Some((EmitterId(index as u32), Bounds::of(emitter, strongest)?)))
            .collect();
        let mut tree = Self { nodes: Vec::new(), leaves: vec![None; emitters.len()] };
        if !members.is_empty() {
            tree.add(&mut members, 0, 0);
        }
        tree
    }

    /// Whether no emitter is in it.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    fn add(&mut self, members: &mut [(EmitterId, Bounds)], parent: u32, depth: usize) -> Bounds {
        let place = self.nodes.len();
        let bounds = members.iter().map(|(_, bounds)| *bounds).reduce(Bounds::union).expect("a node has members");
        if let [(id, _)] = members {
            self.leaves[id.0 as usize] = Some(place as u32);
            self.nodes.push(Node { parent, content: Content::Leaf(*id), outline: Outline::of(&bounds) });
            return bounds;
        }
        self.nodes.push(Node { parent, content: Content::Inner(0), outline: Outline::of(&bounds) });
        let at = split(members, depth);
        let (first, second) = members.split_at_mut(at);
        self.add(first, place as u32, depth + 1);
        let second_place = self.nodes.len() as u32;
        self.add(second, place as u32, depth + 1);
        self.nodes[place].content = Content::Inner(second_place);
        bounds
    }

    /// An emitter for a point, and the probability of choosing it; None where none of them can light it.
    #[inline]
    pub fn sample(&self, at: &SurfacePoint, mut uc: f32) -> Option<(EmitterId, f32)> {
        let (mut place, mut pmf) = (0_usize, 1.0);
        loop {
            let second = match self.nodes[place].content {
                Content::Leaf(id) => return Some((id, pmf)),
                Content::Inner(second) => second as usize,
            };
            let share = self.first_share(place, second, at)?;
            if uc < share {
                (uc, pmf, place) = (uc / share, pmf * share, place + 1);
            } else {
                let rest = 1.0 - share;
                (uc, pmf, place) = ((uc - share) / rest, pmf * rest, second);
            }
            uc = uc.min(1.0_f32.next_down());
        }
    }

    /// The probability of choosing an emitter for a point.
    #[inline]
    pub fn pmf(&self, at: &SurfacePoint, id: EmitterId) -> f32 {
        let Some(leaf) = self.leaves[id.0 as usize] else { return 0.0 };
        let (mut place, mut pmf) = (leaf as usize, 1.0);
        while place > 0 {
            let parent = self.nodes[place].parent as usize;
            let Content::Inner(second) = self.nodes[parent].content else { return 0.0 };
            let Some(share) = self.first_share(parent, second as usize, at) else { return 0.0 };
            let is_first = fault!("tree_density_of_the_sibling", place == parent + 1, place != parent + 1);
            pmf *= if is_first { share } else { 1.0 - share };
            place = parent;
        }
        pmf
    }

    /// The probability of a node's first child; None where neither can light the point.
    #[inline]
    fn first_share(&self, node: usize, second: usize, at: &SurfacePoint) -> Option<f32> {
        let [a, b] = [node + 1, second].map(|child| self.nodes[child].outline.importance(at));
        (a + b > 0.0).then(|| a / (a + b))
    }
}

/// Sorts members and says where to divide them: where the sum of the parts' costs is least, along whichever axis, nearest to the
/// middle if there are several such places \[Conty18, 4.3\].
fn split(members: &mut [(EmitterId, Bounds)], depth: usize) -> usize {
    let count = members.len();
    let extent = |axis: usize| {
        let places = || members.iter().map(|(_, bounds)| bounds.middle()[axis]);
        places().fold(f32::NEG_INFINITY, f32::max) - places().fold(f32::INFINITY, f32::min)
    };
    let extents = [0, 1, 2].map(extent);
    let longest = extents.into_iter().fold(0.0, f32::max);
    let mut best = (f32::INFINITY, count, 0, count / 2);
    for axis in (0..3).filter(|axis| extents[*axis] > 0.0 && depth < DEEP) {
        sort(members, axis);
        let bounds = || members.iter().map(|(_, bounds)| *bounds);
        let merge = |whole: &mut Option<Bounds>, next: Bounds| {
            *whole = Some(whole.map_or(next, |whole| whole.union(next)));
            whole.map(|whole| whole.cost())
        };
        let below: Vec<f32> = bounds().scan(None, merge).collect();
        let mut above: Vec<f32> = bounds().rev().scan(None, merge).collect();
        above.reverse();
        for at in 1..count {
            // Thin slices are charged for being thin.
            let cost = (below[at - 1] + above[at]) * (longest / extents[axis]);
            let candidate = (cost, at.abs_diff(count / 2), axis, at);
            if (candidate.0, candidate.1) < (best.0, best.1) {
                best = candidate;
            }
        }
    }
    let (_, _, axis, at) = best;
    sort(members, axis);
    at
}

/// By the middles' places along an axis; emitters at the same place keep the order of the scene.
fn sort(members: &mut [(EmitterId, Bounds)], axis: usize) {
    members.sort_by(|(a, of_a), (b, of_b)| of_a.middle()[axis].total_cmp(&of_b.middle()[axis]).then(a.0.cmp(&b.0)));
}
