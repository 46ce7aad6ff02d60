//! The way of a ray along the list.

use super::block::{LANES, Meeting};
use super::faces::Encounter;
use super::lanes::{Lanes, Portable};
use super::query::{Line, Query};
use super::traverse::FAR;
use super::{ANALYTIC, Accel, Best, Hit, comes_before};
use crate::ray::Ray;

/// The nearest hit so far, as [`Best`] has it.
#[derive(Clone, Copy)]
struct Nearest {
    t: f64,
    slot: u32,
    id: u32,
}

impl Nearest {
    #[inline(always)]
    fn offer(&mut self, Encounter { t, slot, id }: Encounter) {
        if comes_before((t, id), (self.t, self.id)) {
            *self = Nearest { t, slot, id };
        }
    }
}

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
        let Nearest { t, slot, id } = self.nearest_in_list::<L>(proof, line, *best);
        if slot != best.slot && slot & ANALYTIC == 0 {
            best.at = self.meeting_in_list(slot, line);
        }
        (best.t, best.slot, best.id) = (t, slot, id);
    }

    /// What is met first in the list, if it is before the best so far.
    #[inline(always)]
    fn nearest_in_list<L: Lanes>(&self, proof: L::Proof, line: Line, best: Best) -> Nearest {
        let mut nearest = Nearest { t: best.t, slot: best.slot, id: best.id };
        let certain = self.faces.visit::<L>(proof, line, best.limit(), |at| nearest.offer(at));
        if !certain {
            let Best { t, slot, id, .. } = self.closest_in_blocks(line, best);
            nearest = Nearest { t, slot, id };
        }
        for index in 0..self.analytic.len() as u32 {
            let slot = ANALYTIC | index;
            nearest.offer(Encounter { t: self.analytic_parameter(index, line), slot, id: slot });
        }
        nearest
    }

    #[inline(always)]
    fn meeting_in_list(&self, slot: u32, line: Line) -> Meeting {
        self.blocks[slot as usize / LANES].meeting(slot as usize % LANES, line.exact())
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
