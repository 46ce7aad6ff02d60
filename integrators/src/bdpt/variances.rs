//! Factors that make weights aware of variances, found by a pilot \[Grittmann19\].
//!
//! The balance heuristic keeps the sum of second moments `E[F_s²]` small, of what each strategy `s` adds to a pixel, as a bound of the
//! sum of variances. Where a strategy's mean is large against its standard deviation, its second moment is much more than its
//! variance: that of a pixel in which the camera's walk always finds the same light, say, or in which thousands of light walks end. Taking
//! `V[F_s] ≈ E[F_s²] / v_s` with the strategy's own `v_s = E[F_s²] / V[F_s] = 1 + E[F_s]² / V[F_s]`, the sum of variances is smallest for
//! the balance heuristic on densities `v_s p_s` \[Grittmann19, §4\].
//!
//! Moments are those of a pixel by one sample in every pixel, weighted by the balance heuristic; correlations of strategies are left out.

use super::lattice::{Pilot, Witness};
use crate::connect::{PerStrategy, strategies_below};
use crate::contribution::{Contribution, Sink, Technique, Wants};
use crate::measurement::Counters;
use rayon::prelude::*;
use sampling::vec2;

/// The largest factor. A pilot may not have met what is rare and bright; with this bound no contribution is more than so many times what it is by
/// the balance heuristic, `v_s f / Σ v_i p_i ≤ max v · f / Σ p_i`, nor is the sum of second moments.
const MOST: f64 = 8.0;

/// Finds the factors for a replicate, and tells the work done.
pub(super) fn factors(pilot: &Pilot) -> (PerStrategy, Counters) {
    let lattice = pilot.lattice;
    let mut factors = pilot.table(1.0);
    // Put together row by row, so that threads are no matter.
    let lines: Vec<u32> = lattice.lines().collect();
    let rows: Vec<Row> = lines.into_par_iter().map(|y| trace(pilot, &factors, y)).collect();
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

/// Takes the samples of a row of pixels. `factors` tells places.
fn trace(pilot: &Pilot, factors: &PerStrategy, y: u32) -> Row {
    let strategies = factors.in_a_cell();
    let place_of = |x: u32| factors.place(vec2(x as f32, y as f32), 0).unwrap_or(0);
    let first = place_of(0);
    let mut moments = vec![Moments::default(); factors.columns() * strategies];
    let mut witness = Values { factors, own: vec![0.0; strategies], splats: Vec::new() };
    let counters = pilot.trace(y, &mut witness, |x, a, b| {
        let of_cell = moments[place_of(x) - first..].iter_mut();
        of_cell.zip(a.iter().zip(b)).for_each(|(moments, (&a, &b))| moments.add_pair(a, b));
    });
    Row { first, moments, splats: witness.splats, counters }
}

/// Sees what strategies contribute.
struct Values<'a> {
    factors: &'a PerStrategy,
    /// The luminance that each strategy brings to the sample's own pixel, of all orders one after the other.
    own: Vec<f64>,
    splats: Vec<(usize, f64)>,
}

impl Sink for Values<'_> {
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

impl Witness for Values<'_> {
    fn own(&mut self) -> &mut Vec<f64> {
        &mut self.own
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
