//! Factors that make weights aware of variances, found by a pilot \[Grittmann19\].
//!
//! The balance heuristic keeps the sum of second moments `E[F_s²]` small, of what each strategy `s` adds to a pixel, as a bound of the
//! sum of variances. Where a strategy's mean is large against its standard deviation, its second moment is much more than its
//! variance: that of a pixel in which the camera's walk always finds the same light, say, or in which thousands of light walks end. Taking
//! `V[F_s] ≈ E[F_s²] / v_s` with the strategy's own `v_s = E[F_s²] / V[F_s] = 1 + E[F_s]² / V[F_s]`, the sum of variances is smallest for
//! the balance heuristic on densities `v_s p_s` \[Grittmann19, §4\].
//!
//! Moments are those of a pixel by one sample in every pixel, weighted by the balance heuristic; correlations of strategies are left out.

use super::{Bdpt, Connections};
use crate::connect::{Factors, strategies_below};
use crate::contribution::{Contribution, Sink, Technique, Wants};
use crate::integrator::{Estimator, Pixel, Replicate};
use crate::measurement::Counters;
use crate::request::Request;
use crate::scratch::Scratch;
use rayon::prelude::*;
use sampling::sampler::{Purpose, Sampler};
use sampling::vec2;
use scenes::Scene;
use std::ops::Range;

/// A pair of pilot samples for so many samples of the replicate.
const SAMPLES_OF_A_PAIR: u64 = 32;
/// Pairs of pilot samples, at most.
const PAIRS: u64 = 1 << 16;
/// Pixels in a row of a cell in which pairs are taken.
const PIXELS_OF_A_CELL: u32 = 16;
/// The largest factor. A pilot may not have met what is rare and bright; with this bound no contribution is more than so many times what it is by
/// the balance heuristic, `v_s f / Σ v_i p_i ≤ max v · f / Σ p_i`, nor is the sum of second moments.
const MOST: f64 = 8.0;
/// Orders from here on are weighted by the balance heuristic alone: tables grow with the square of the last order.
const ORDERS: usize = 17;

/// Where a pilot takes its samples: pairs, in every pixel whose column and row are multiples of a step.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Lattice {
    width: u32,
    height: u32,
    step: u32,
    /// Pairs of samples in each of these pixels.
    pairs: u32,
}

impl Lattice {
    /// That for a replicate of so many samples per pixel.
    fn new((width, height): (u32, u32), samples: u32) -> Self {
        let pixels = u64::from(width) * u64::from(height);
        let wanted = (pixels * u64::from(samples) / SAMPLES_OF_A_PAIR).clamp(1, PAIRS);
        let step = (pixels as f64 / wanted as f64).sqrt().ceil() as u32;
        let taken = u64::from(width.div_ceil(step)) * u64::from(height.div_ceil(step));
        Self { width, height, step, pairs: (wanted / taken).max(1) as u32 }
    }

    /// Edge of the cells that have factors of their own \[pixels\].
    fn edge(self) -> u32 {
        self.step * PIXELS_OF_A_CELL
    }

    /// Rows and columns of a range that are multiples of the step.
    fn within(self, range: Range<u32>) -> impl Iterator<Item = u32> {
        range.step_by(self.step as usize)
    }

    /// Pilot samples, in parts of one in every pixel.
    fn samples(self) -> f64 {
        let pixels = f64::from(self.width.div_ceil(self.step)) * f64::from(self.height.div_ceil(self.step));
        2.0 * f64::from(self.pairs) * pixels / (f64::from(self.width) * f64::from(self.height))
    }

    /// Pixels of each cell, row by row.
    fn pixels(self) -> impl Iterator<Item = f64> {
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

/// Finds the factors for a replicate, and tells the work done.
pub(super) fn factors(settings: &Bdpt, scene: &Scene, request: &Request, replicate: &Replicate) -> (Factors, Counters) {
    let size = (scene.camera.width(), scene.camera.height());
    let lattice = Lattice::new(size, replicate.samples);
    let orders = request.last_order().map_or(ORDERS, |last| ORDERS.min(last + 1));
    let mut factors = Factors::ones(size, lattice.edge(), orders);
    let connections = match settings.connections {
        Connections::Roulette => Connections::All,
        other => other,
    };
    let settings = &Bdpt { connections, ..settings.clone() };
    let pilot = Pilot { settings, scene, request, replicate, lattice, factors: &factors };
    // Put together row by row, so that threads are no matter.
    let lines: Vec<u32> = lattice.within(0..size.1).collect();
    let rows: Vec<Row> = lines.into_par_iter().map(|y| pilot.trace(y)).collect();
    let mut counters = Counters::default();
    let mut moments = vec![Moments::default(); factors.values.len()];
    for row in &rows {
        counters += row.counters;
        moments[row.first..].iter_mut().zip(&row.moments).for_each(|(sum, of_row)| *sum += *of_row);
        row.splats.iter().for_each(|&(place, value)| moments[place].add_splat(value));
    }
    let strategies = factors.in_a_cell();
    for (cell, pixels) in lattice.pixels().enumerate() {
        let of_cell = cell * strategies..(cell + 1) * strategies;
        for (factor, moments) in factors.values[of_cell.clone()].iter_mut().zip(&moments[of_cell]) {
            *factor = moments.factor(pixels * lattice.samples());
        }
    }
    (factors, counters)
}

/// What the pixels of a cell get of a strategy.
#[derive(Clone, Copy, Debug, Default)]
struct Moments {
    /// Sum over pairs of samples of a pixel of their products, each an estimate of the squared mean.
    products: f64,
    /// Sum over the same pairs of half of their squared differences, each an estimate of the variance.
    variances: f64,
    /// Sum over what light walks have brought, and of its square.
    splats: f64,
    squares: f64,
}

impl Moments {
    fn add_pair(&mut self, a: f64, b: f64) {
        self.products += a * b;
        self.variances += (a - b).powi(2) / 2.0;
    }

    fn add_splat(&mut self, value: f64) {
        self.splats += value;
        self.squares += value * value;
    }

    /// 1 + μ²/σ², from so many `samples` of the cell's pixels; 1 where nothing is known.
    fn factor(&self, samples: f64) -> f32 {
        let ratio = if self.squares > 0.0 {
            // Light walks are many, each with little chance to end in the pixel: the variance of their sum is the sum of squares. The mean
            // is taken to be the same all over the cell, and its square is without the variance of the estimate.
            (self.splats.powi(2) - self.squares) / (samples * self.squares)
        } else {
            self.products / self.variances
        };
        if ratio > 0.0 { (1.0 + ratio).min(MOST) as f32 } else { 1.0 }
    }
}

impl std::ops::AddAssign for Moments {
    fn add_assign(&mut self, other: Self) {
        self.products += other.products;
        self.variances += other.variances;
        self.splats += other.splats;
        self.squares += other.squares;
    }
}

/// A pilot at work.
struct Pilot<'a> {
    settings: &'a Bdpt,
    scene: &'a Scene,
    request: &'a Request,
    replicate: &'a Replicate,
    lattice: Lattice,
    /// The places of factors.
    factors: &'a Factors,
}

/// What is found from a row of pixels.
struct Row {
    /// The first place of the row of cells that it is in.
    first: usize,
    /// Of the row of cells.
    moments: Vec<Moments>,
    /// Places of what was splatted, and luminances.
    splats: Vec<(usize, f64)>,
    counters: Counters,
}

impl Pilot<'_> {
    /// Takes the samples of a row of pixels.
    fn trace(&self, y: u32) -> Row {
        let &Self { settings, scene, request, replicate, lattice, factors } = self;
        let (strategies, width) = (factors.in_a_cell(), lattice.width);
        let place_of = |x: u32| factors.place(vec2(x as f32, y as f32), 0).unwrap_or(0);
        let first = place_of(0);
        let mut moments = vec![Moments::default(); factors.columns() * strategies];
        let mut witness = Witness { factors, own: vec![0.0; strategies], splats: Vec::new() };
        let mut before = vec![0.0; strategies];
        let mut scratch = Scratch::default();
        let (key, size) = (replicate.key.of_pilot(), (width, lattice.height));
        let mut sampler = Sampler::new(replicate.sampler, key, 2 * lattice.pairs, size);
        for x in lattice.within(0..width) {
            let cell = place_of(x) - first;
            for sample in 0..2 * lattice.pairs {
                sampler.start_sample(u64::from(y) * u64::from(width) + u64::from(x), sample);
                let place = Pixel::sample(x, y, scene.camera.filter(), sampler.get_2d(Purpose::Film)).0;
                witness.own.fill(0.0);
                settings.estimate(scene, request, place, &mut sampler, &mut scratch, &mut witness);
                if sample % 2 == 1 {
                    let values = before.iter().zip(&witness.own);
                    moments[cell..].iter_mut().zip(values).for_each(|(moments, (&a, &b))| moments.add_pair(a, b));
                }
                std::mem::swap(&mut before, &mut witness.own);
            }
        }
        Row { first, moments, splats: witness.splats, counters: scratch.counters }
    }
}

/// Sees what strategies contribute.
struct Witness<'a> {
    factors: &'a Factors,
    /// The luminance that each strategy brings to the sample's own pixel, of all orders one after the other.
    own: Vec<f64>,
    splats: Vec<(usize, f64)>,
}

impl Sink for Witness<'_> {
    const WANTS: Wants = Wants::NOTHING;

    fn add(&mut self, c: Contribution) {
        let luminance = f64::from(c.value.luminance()) * c.weight;
        let Technique::Connect { s, t } = c.technique else { return };
        let order = c.technique.order();
        // What is not finite is the estimate's business.
        if !luminance.is_finite() {
            return;
        }
        if t > 1 {
            if order < self.factors.orders() {
                self.own[strategies_below(order) + usize::from(s)] += luminance;
            }
        } else if let Some(first) = self.factors.place(c.raster, order) {
            self.splats.push((first + usize::from(s), luminance));
        }
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
            let factors = Factors::ones(size, lattice.edge(), 1);
            assert_eq!(lattice.pixels().count() * factors.in_a_cell(), factors.values.len());
        }
        assert!(Lattice::new((4096, 4096), 64).samples() * 4096.0 * 4096.0 <= 2.0 * PAIRS as f64);
    }

    /// A strategy of mean 1 and variance ¼ in every pixel, and light walks of which one in ten thousand ends in a pixel and brings 2.
    #[test]
    fn factors_are_second_moments_over_variances() {
        let mut moments = Moments::default();
        for i in 0..1000 {
            let value = |i: i32| if i % 2 == 0 { 0.5 } else { 1.5 };
            // Pairs of independent numbers: all four alike.
            moments.add_pair(value(i), value(i / 2));
        }
        assert!((moments.factor(1000.0) - 5.0).abs() < 1e-3, "{}", moments.factor(1000.0));
        let mut moments = Moments::default();
        let samples = 10_000.0;
        (0..5000).for_each(|_| moments.add_splat(2.0));
        // The sum in a pixel has the mean 1 and, being Poisson's, the variance 2.
        assert!((moments.factor(samples) - 1.5).abs() < 1e-3, "{}", moments.factor(samples));
        assert_eq!(Moments::default().factor(10.0), 1.0);
    }
}
