//! The way of a ray along the list.

use super::lanes::{Lanes, Portable};
use super::query::{Line, Query};
use super::traverse::FAR;
use super::{Accel, Best, Hit};
use crate::ray::Ray;

impl Accel {
    /// Whether there is a list only.
    #[inline(always)]
    pub(super) fn is_list(&self) -> bool {
        self.nodes.is_empty()
    }

    /// The first surface on the ray's interval.
    #[inline(always)]
    pub(super) fn closest_hit_in_list<L: Lanes>(&self, proof: L::Proof, ray: &Ray) -> Option<Hit> {
        let (line, mut best) = (Line { ray, exact: None }, Best::before(f64::from(ray.t_max)));
        self.closest_in_list::<L>(proof, line, &mut best);
        self.resolve(line, &best)
    }

    /// Whether any surface is on the ray's interval.
    #[inline(always)]
    pub(super) fn any_hit_in_list<L: Lanes>(&self, proof: L::Proof, ray: &Ray) -> bool {
        self.any_in_list::<L>(proof, Line { ray, exact: None }, f64::from(ray.t_max))
    }

    /// Offers what is met in the list.
    #[inline(always)]
    pub(super) fn closest_in_list<L: Lanes>(&self, proof: L::Proof, line: Line, best: &mut Best) {
        let mut found = *best;
        if self.faces.visit::<L>(proof, line, best.limit(), |at| found.offer(at.t, at.slot, at.id)) {
            *best = found;
        } else {
            *best = self.closest_in_blocks(line, *best);
        }
        for index in 0..self.analytic.len() as u32 {
            self.offer_analytic(index, line, best);
        }
    }

    /// The same block by block.
    #[cold]
    #[inline(never)]
    pub(super) fn closest_in_blocks(&self, line: Line, mut best: Best) -> Best {
        let query = Query::of(line);
        for index in 0..self.blocks.len() as u32 {
            self.offer_block::<Portable>((), index, &query, &mut best);
        }
        best
    }

    /// Whether anything in the list is met before `t_max`.
    #[inline(always)]
    pub(super) fn any_in_list<L: Lanes>(&self, proof: L::Proof, line: Line, t_max: f64) -> bool {
        let mut found = false;
        let certain =
            self.faces.visit::<L>(proof, line, t_max as f32 * FAR, |at| found |= (at.t > 0.0) & (at.t < t_max));
        if !certain {
            found = self.any_in_blocks(line, t_max);
        }
        found || (0..self.analytic.len() as u32).any(|index| self.meets_analytic(index, line, t_max))
    }

    /// The same block by block.
    #[cold]
    #[inline(never)]
    fn any_in_blocks(&self, line: Line, t_max: f64) -> bool {
        let query = Query::of(line);
        (0..self.blocks.len() as u32).any(|index| self.meets_block::<Portable>((), index, &query, t_max))
    }
}
