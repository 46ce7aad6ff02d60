//! Chains, one for every block of a replicate.

use super::Explored;
use super::point::{Point, Space};
use super::seeds::{Seeds, turn_to_seed};
use super::steps::Steps;
use crate::block::{Block, Blocks, SAMPLES_PER_CHAIN, TILE, Window};
use crate::film::{BlockFilm, PartsFilm, PixelSink};
use crate::integrator::{Pass, Replicate};
use crate::scratch::Scratch;
use sampling::Vec2;
use sampling::fault;
use sampling::sampler::{Purpose, Sampler, SamplerKind};
use std::ops::Range;

/// The pixel's number, to the sampler, of what all chains share.
const SHARED: u64 = 1 << 63;

/// The chains of a replicate.
pub(super) struct Chains<'a, E> {
    pub space: Space<'a, E>,
    pub steps: Steps,
    pub replicate: Replicate,
    pub seeds: Seeds,
    /// b′, of a pilot.
    pub rough: f64,
}

impl<E: Explored> Pass for Chains<'_, E> {
    fn run(&self, block: Block, out: &mut BlockFilm) {
        // No contribution of a chain stands alone.
        out.fireflies = None;
        if self.number(&block) == 0 {
            out.counters += self.seeds.counters;
            out.invalid.iter_mut().zip(&self.seeds.invalid).for_each(|(all, n)| *all += n);
        }
        match self.space.request.parts().list() {
            [] => self.run_chain::<_, false>(&block, out),
            _ => self.run_chain::<_, true>(&block, &mut PartsFilm(out)),
        }
    }
}

impl<E: Explored> Chains<'_, E> {
    /// The number of a block among all of a replicate.
    fn number(&self, block: &Block) -> u64 {
        let columns = self.space.scene.camera.width().div_ceil(TILE);
        let tile = block.tile.y.start / TILE * columns + block.tile.x.start / TILE;
        u64::from(block.samples.start / SAMPLES_PER_CHAIN) * self.blocks().tiles() + u64::from(tile)
    }

    fn blocks(&self) -> Blocks {
        let camera = &self.space.scene.camera;
        Blocks::of_chains(Window::whole(camera.width(), camera.height()), self.replicate.samples)
    }

    /// Where a chain begins. Each has every seed with its own probability, and all together have every seed as often as they can: they
    /// are a systematic sample, turned by a number that they share.
    fn seed(&self, number: u64, dice: &mut Sampler) -> Option<(Range<u64>, f64)> {
        dice.start_sample(SHARED, 0);
        let Vec2 { x, y } = dice.get_2d(Purpose::Mutation);
        let turn = f64::from(x) + f64::from(y) / f64::from(1 << 24);
        self.seeds.at((turn + number as f64 / self.blocks().count() as f64).fract())
    }

    /// Begins a chain at the point of a group that lies so far in the sum of their sizes.
    fn begin<const CLASSES: bool>(
        &self,
        (group, mut rest): (Range<u64>, f64),
        sampler: &mut Sampler,
        scratch: &mut Scratch,
        state: &mut Point<CLASSES>,
    ) {
        let mut largest = (group.start, 0.0);
        for number in group {
            turn_to_seed(sampler, number);
            self.space.look(sampler, scratch, state);
            rest -= state.size;
            if rest < 0.0 {
                return;
            }
            if state.size > largest.1 {
                largest = (number, state.size);
            }
        }
        // Rounding has led beyond all of them.
        turn_to_seed(sampler, largest.0);
        self.space.look(sampler, scratch, state);
    }

    /// One chain: as many mutations as the block has samples.
    fn run_chain<S: PointSink, const CLASSES: bool>(&self, block: &Block, out: &mut S) {
        let (key, number) = (self.replicate.key, self.number(block));
        let (b, rough) = (self.seeds.mean(), self.rough);
        if b == 0.0 && rough == 0.0 {
            return;
        }
        let mut dice = Sampler::new(SamplerKind::Independent, key, 1, (1, 1));
        let mut sampler = Sampler::of_chain(key, self.steps.small);
        let mut scratch = Scratch::default();
        let (mut state, mut proposed) =
            (Point::<CLASSES>::new(self.space.request), Point::<CLASSES>::new(self.space.request));
        // Without a seed there is no state that counts, but fresh proposals do.
        if let Some(seed) = self.seed(number, &mut dice) {
            self.begin(seed, &mut sampler, &mut scratch, &mut state);
        }
        sampler.accept();
        // It was counted among the seeds.
        state.invalid.fill(0);
        let balanced = |size: f64| size + self.steps.large * rough;
        for mutation in 0..(block.tile.width() * block.tile.height()) * block.samples.len() as u32 {
            dice.start_sample(number, mutation);
            let Vec2 { x: kind, y: chance } = dice.get_2d(Purpose::Mutation);
            let is_fresh = f64::from(kind) < self.steps.large;
            match is_fresh {
                true => sampler.start_sample(number, mutation),
                false => sampler.start_near(number, mutation),
            }
            self.space.look(&mut sampler, &mut scratch, &mut proposed);
            let acceptance = if proposed.size < state.size { proposed.size / state.size } else { 1.0 };
            if proposed.size > 0.0 {
                let as_fresh = if is_fresh { rough } else { 0.0 };
                proposed.share = (acceptance * b + as_fresh) / balanced(proposed.size);
            }
            if state.size > 0.0 {
                let rejected = fault!("state_that_stays_not_counted", 1.0 - acceptance, 0.0);
                state.share += rejected * b / balanced(state.size);
            }
            if f64::from(chance) < fault!("every_mutation_accepted", acceptance, 1.0) {
                state.give(out);
                std::mem::swap(&mut state, &mut proposed);
                sampler.accept();
            } else {
                proposed.give(out);
            }
        }
        state.give(out);
        out.count(&scratch.counters, [&state.invalid, &proposed.invalid]);
    }
}

/// A block's film, as chains fill it.
trait PointSink: PixelSink {
    /// Adds work done, and what was not finite.
    fn count(&mut self, counters: &crate::measurement::Counters, invalid: [&Vec<u64>; 2]);
}

impl PointSink for BlockFilm<'_> {
    fn count(&mut self, counters: &crate::measurement::Counters, invalid: [&Vec<u64>; 2]) {
        self.counters += *counters;
        for layers in invalid {
            self.invalid.iter_mut().zip(layers).for_each(|(all, n)| *all += n);
        }
    }
}

impl PointSink for PartsFilm<'_, BlockFilm<'_>> {
    fn count(&mut self, counters: &crate::measurement::Counters, invalid: [&Vec<u64>; 2]) {
        self.0.count(counters, invalid);
    }
}
