//! Many surfaces cut into parts that lie apart.

use crate::shape::Triangle;
use glam::Vec3A;
use obvhs::aabb::Aabb;
use rayon::prelude::*;

/// Along each axis a cut is looked for between so many equal steps.
const STEPS: usize = 32;

/// Triangles, and behind them what else is in a tree.
pub(super) struct Items<'a> {
    pub triangles: &'a [Triangle],
    /// The boxes of what is no triangle.
    pub singles: Vec<Aabb>,
}

impl Items<'_> {
    /// How many there are.
    pub fn len(&self) -> usize {
        self.triangles.len() + self.singles.len()
    }

    fn aabb(&self, item: u32) -> Aabb {
        let Some(Triangle(corners)) = self.triangles.get(item as usize) else {
            return self.singles[item as usize - self.triangles.len()];
        };
        let [a, b, c] = corners.map(Vec3A::from);
        Aabb::new(a.min(b).min(c), a.max(b).max(c))
    }
}

/// What lies in a step along an axis.
type Step = (Aabb, usize);

/// Orders a list so that it can be cut in two, and returns where; in each of the two the order is as before. The cut is where the
/// surface area heuristic is least \[Wald07\], so long as no part gets less than a quarter, which keeps the tree shallow.
pub(super) fn cut(items: &Items, list: &mut [u32]) -> usize {
    let middles = list.par_iter().map(|&item| items.aabb(item).center());
    let (low, high) = middles
        .map(|p| (p, p))
        .reduce(|| (Vec3A::INFINITY, Vec3A::NEG_INFINITY), |(l, h), (low, high)| (l.min(low), h.max(high)));
    let scale = (STEPS as f32 / (high - low)).min(Vec3A::splat(f32::MAX));
    let step_of = |aabb: &Aabb, axis: usize| {
        // What is NaN becomes 0.
        (((aabb.center()[axis] - low[axis]) * scale[axis]) as usize).min(STEPS - 1)
    };
    let nothing = || [[(Aabb::INVALID, 0); STEPS]; 3];
    // By chunks, since a fold would hand the steps on with every item.
    let steps_of = |list: &[u32]| {
        let mut steps = nothing();
        for &item in list {
            let aabb = items.aabb(item);
            for (axis, steps) in steps.iter_mut().enumerate() {
                join(&mut steps[step_of(&aabb, axis)], &(aabb, 1));
            }
        }
        steps
    };
    let steps: [[Step; STEPS]; 3] = list.par_chunks(1 << 12).map(steps_of).reduce(nothing, |mut a, b| {
        a.as_flattened_mut().iter_mut().zip(b.as_flattened()).for_each(|(a, b)| join(a, b));
        a
    });
    let cuts = (0..3).flat_map(|axis| costs(&steps[axis], list.len() / 4).map(move |(step, cost)| (axis, step, cost)));
    let Some((axis, step, _)) = cuts.min_by(|a, b| a.2.total_cmp(&b.2)) else {
        return halve(items, list, (high - low).to_array());
    };
    let (below, above): (Vec<u32>, Vec<u32>) =
        list.par_iter().partition(|&&item| step_of(&items.aabb(item), axis) < step);
    list[..below.len()].copy_from_slice(&below);
    list[below.len()..].copy_from_slice(&above);
    below.len()
}

fn join(step: &mut Step, other: &Step) {
    *step = (step.0.union(&other.0), step.1 + other.1);
}

/// The steps before which an axis can be cut with at least so many items on each side, and what that costs.
fn costs(steps: &[Step; STEPS], least: usize) -> impl Iterator<Item = (usize, f32)> {
    (1..STEPS).filter_map(move |step| {
        let side = |steps: &[Step]| {
            steps.iter().fold((Aabb::INVALID, 0), |mut sum, step| {
                join(&mut sum, step);
                sum
            })
        };
        let sides = [side(&steps[..step]), side(&steps[step..])];
        let cost = sides.iter().map(|(aabb, count)| aabb.half_area() * *count as f32).sum();
        sides.iter().all(|(_, count)| *count >= least).then_some((step, cost))
    })
}

/// Where most lies in one place: the halves along the longest axis, of equal numbers.
fn halve(items: &Items, list: &mut [u32], size: [f32; 3]) -> usize {
    let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
    let middle = list.len() / 2;
    let key = |item: u32| items.aabb(item).center()[axis];
    list.select_nth_unstable_by(middle, |&a, &b| key(a).total_cmp(&key(b)).then(a.cmp(&b)));
    list[..middle].par_sort_unstable();
    list[middle..].par_sort_unstable();
    middle
}
