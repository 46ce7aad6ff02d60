//! Pilots that take pairs of samples all over the image, to learn what strategies are worth.

use super::{Bdpt, Connections};
use crate::connect::{ORDERS, PerStrategy};
use crate::contribution::Sink;
use crate::integrator::{Estimator, Pixel, Replicate};
use crate::measurement::Counters;
use crate::request::Request;
use crate::scratch::Scratch;
use sampling::sampler::{Purpose, Sampler};
use scenes::Scene;
use std::ops::Range;

/// A pair of pilot samples for so many samples of the replicate.
const SAMPLES_OF_A_PAIR: u64 = 32;
/// Pairs of pilot samples, at most.
const PAIRS: u64 = 1 << 16;
/// Pixels in a row of a cell in which pairs are taken.
const PIXELS_OF_A_CELL: u32 = 16;

/// Where a pilot takes its samples: pairs, in every pixel whose column and row are multiples of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Lattice {
    width: u32,
    height: u32,
    step: u32,
    /// Pairs of samples in each of these pixels.
    pairs: u32,
}

impl Lattice {
    /// That for a replicate of so many samples per pixel.
    pub fn new((width, height): (u32, u32), samples: u32) -> Self {
        let pixels = u64::from(width) * u64::from(height);
        let wanted = (pixels * u64::from(samples) / SAMPLES_OF_A_PAIR).clamp(1, PAIRS);
        let step = (pixels as f64 / wanted as f64).sqrt().ceil() as u32;
        let taken = u64::from(width.div_ceil(step)) * u64::from(height.div_ceil(step));
        Self { width, height, step, pairs: (wanted / taken).max(1) as u32 }
    }

    /// Edge of the cells that have numbers of their own \[pixels\].
    pub fn edge(self) -> u32 {
        self.step * PIXELS_OF_A_CELL
    }

    /// Which half of the pixels one belongs to, 0 or 1, as on a chequerboard.
    pub fn half(self, x: u32, y: u32) -> usize {
        ((x / self.step + y / self.step) % 2) as usize
    }

    /// Rows and columns of a range that are multiples of the step.
    fn within(self, range: Range<u32>) -> impl Iterator<Item = u32> {
        range.step_by(self.step as usize)
    }

    /// Rows of the image in which there are samples.
    pub fn lines(self) -> impl Iterator<Item = u32> {
        self.within(0..self.height)
    }

    /// Pilot samples, in parts of one in every pixel.
    pub fn samples(self) -> f64 {
        let pixels = f64::from(self.width.div_ceil(self.step)) * f64::from(self.height.div_ceil(self.step));
        2.0 * f64::from(self.pairs) * pixels / (f64::from(self.width) * f64::from(self.height))
    }

    /// Pixels of each cell, row by row.
    pub fn pixels(self) -> impl Iterator<Item = f64> {
        let edge = self.edge();
        let within = move |first: u32, all: u32| edge.min(all - first);
        let row = move |y: u32| {
            (0..self.width)
                .step_by(edge as usize)
                .map(move |x| f64::from(within(x, self.width) * within(y, self.height)))
        };
        (0..self.height).step_by(edge as usize).flat_map(row)
    }
}

/// A sink that keeps what a sample brings to its own pixel.
pub(super) trait Witness: Sink {
    /// Numbers that are added to, all 0 where a sample begins.
    fn own(&mut self) -> &mut Vec<f64>;
}

/// A pilot at work.
pub(super) struct Pilot<'a> {
    pub settings: Bdpt,
    pub scene: &'a Scene,
    pub request: &'a Request,
    replicate: &'a Replicate,
    /// Where it takes its samples.
    pub lattice: Lattice,
}

impl<'a> Pilot<'a> {
    /// That of a replicate. Strategies are weighted by the balance heuristic, and no roulette is played for connections.
    pub fn new(settings: &Bdpt, scene: &'a Scene, request: &'a Request, replicate: &'a Replicate) -> Self {
        let connections = match settings.connections {
            Connections::Roulette => Connections::All,
            other => other,
        };
        let lattice = Lattice::new((scene.camera.width(), scene.camera.height()), replicate.samples);
        Self { settings: Bdpt { connections, ..settings.clone() }, scene, request, replicate, lattice }
    }

    /// The same number for all strategies, in the cells of the lattice.
    pub fn table(&self, value: f32) -> PerStrategy {
        let orders = self.request.last_order().map_or(ORDERS, |last| last + 1);
        PerStrategy::all(value, (self.lattice.width, self.lattice.height), self.lattice.edge(), orders)
    }

    /// Takes the pairs of a row of pixels; `pair` is told the column of each and what its two samples brought.
    pub fn trace(&self, y: u32, witness: &mut impl Witness, mut pair: impl FnMut(u32, &[f64], &[f64])) -> Counters {
        let &Self { ref settings, scene, request, replicate, lattice } = self;
        let mut before = vec![0.0; witness.own().len()];
        let mut scratch = Scratch::default();
        let (key, width) = (replicate.key.of_pilot(), lattice.width);
        let mut sampler = Sampler::new(replicate.sampler, key, 2 * lattice.pairs, (width, lattice.height));
        for x in lattice.within(0..width) {
            for sample in 0..2 * lattice.pairs {
                sampler.start_sample(u64::from(y) * u64::from(width) + u64::from(x), sample);
                let place = Pixel::sample(x, y, scene.camera.filter(), sampler.get_2d(Purpose::Film)).0;
                witness.own().fill(0.0);
                settings.estimate(scene, request, place, &mut sampler, &mut scratch, witness);
                if sample % 2 == 1 {
                    pair(x, &before, witness.own());
                }
                std::mem::swap(&mut before, witness.own());
            }
        }
        scratch.counters
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_takes_a_sixteenth_of_the_samples_at_most_and_its_cells_cover_the_image() {
        for (size, samples) in [((256, 256), 16), ((64, 64), 8), ((100, 37), 1), ((1, 1), 1), ((31, 9), 4096)] {
            let lattice = Lattice::new(size, samples);
            let (pilot, image) = (lattice.samples(), f64::from(samples));
            assert!(pilot <= image / 16.0 || lattice.samples() * f64::from(size.0 * size.1) < 300.0, "{lattice:?}");
            assert_eq!(lattice.pixels().sum::<f64>(), f64::from(size.0 * size.1));
            let factors = PerStrategy::all(1.0, size, lattice.edge(), 1);
            assert_eq!(lattice.pixels().count() * factors.in_a_cell(), factors.values.len());
        }
        assert!(Lattice::new((4096, 4096), 64).samples() * 4096.0 * 4096.0 <= 2.0 * PAIRS as f64);
    }
}
