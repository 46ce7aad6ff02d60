//! The optimal weights of strategies, found by a pilot \[Kondapaneni19\].
//!
//! Of all weights that sum to one, those of the least variance are the balance heuristic's and control variates [Owen00; Kondapaneni19]: with a number
//! `α_s` of each strategy, of an order and a cell of the image, a path that strategy s makes with the contribution C alone brings
//! `w_s C + α_s − ᾱ`, ᾱ being the mean of the α by the path's densities. The last two have the mean 0 over all strategies, so that any α
//! leave the means right.
//!
//! A sample of a pixel thus brings `B + Σ_s α_s g_s`, B by the balance heuristic and with `g_s` the number of its paths made by s less the sum of the
//! shares that s has in all; its variance is least for `α = −G⁻¹ c`, with G the covariances of the g and c those with B. Samples of one camera
//! and one light subpath are taken as a whole, so that what their strategies have in common is in it. Splats in a pixel are those of all other samples: of
//! many with little chance each, so that covariances are sums of products.
//!
//! Paths that bring nothing take no part. That of a connection which is blocked no other strategy could have made, and light that meets the dark side
//! of a surface is rare.

use super::lattice::{Lattice, Pilot, Witness};
use crate::connect::{Densities, EmitterEnd, PerStrategy, Strategies, strategies_below};
use crate::contribution::{Contribution, Sink, Technique, Wants};
use crate::measurement::Counters;
use crate::vertex::Site;
use rayon::prelude::*;
use scenes::Scene;

/// What is added to the diagonal of G, times the number of pairs: what so many paths of other strategies have there, as a pilot may not have met.
const RIDGES: [f64; 4] = [4.0, 16.0, 64.0, 256.0];
/// The share of the variance that control variates of one half of the pilot must take away in the other, both ways together.
const LEAST: f64 = 0.05;

/// Finds the α for a replicate, as luminances, and tells the work done.
pub(super) fn controls(pilot: &Pilot) -> (PerStrategy, Counters) {
    let lattice = pilot.lattice;
    let mut controls = pilot.table(0.0);
    let (columns, orders) = (controls.columns(), controls.orders());
    let mut cells = no_cells(controls.cells(), orders);
    let mut counters = Counters::default();
    let lines: Vec<u32> = lattice.lines().collect();
    // So many at once that there is work for all, and put together one after the other, so that threads are no matter.
    for lines in lines.chunks(2 * rayon::current_num_threads()) {
        let rows: Vec<Row> = lines.par_iter().map(|&y| trace(pilot, &controls, y)).collect();
        for (y, row) in lines.iter().zip(rows) {
            counters += row.counters;
            let first = (y / lattice.edge()) as usize * columns;
            for (cell, of_row) in cells[first..].iter_mut().zip(&row.cells) {
                cell.iter_mut().flatten().zip(of_row.iter().flatten()).for_each(|(sum, found)| sum.merge(found));
            }
            for Splat { cell, order, half, g, value } in &row.splats {
                cells[*cell][*order][*half].add(g, *value);
            }
        }
    }
    let in_a_cell = controls.in_a_cell();
    controls.values.par_chunks_mut(in_a_cell).zip(&cells).for_each(|(of_cell, orders)| {
        for (order, halves) in orders.iter().enumerate() {
            let found = of_cell[strategies_below(order)..].iter_mut().zip(fitted(halves));
            found.for_each(|(control, value)| *control = value as f32);
        }
    });
    (controls, counters)
}

/// Of an order in a cell, from either half of its pixels.
type Halves = [Regression; 2];

/// Nothing found as yet, in so many cells and orders.
fn no_cells(cells: usize, orders: usize) -> Vec<Vec<Halves>> {
    let of_order = |order| [Regression::new(order + 2), Regression::new(order + 2)];
    vec![(0..orders).map(of_order).collect(); cells]
}

/// What is found from a row of pixels.
struct Row {
    /// Of every order in the cells that it goes through.
    cells: Vec<Vec<Halves>>,
    splats: Vec<Splat>,
    counters: Counters,
}

/// A path that landed in a cell: its g, and what it brought.
struct Splat {
    cell: usize,
    order: usize,
    half: usize,
    g: Vec<f64>,
    value: f64,
}

/// Takes the samples of a row of pixels. `places` tells places.
fn trace(pilot: &Pilot, places: &PerStrategy, y: u32) -> Row {
    let (lattice, orders) = (pilot.lattice, places.orders());
    let mut cells = no_cells(places.columns(), orders);
    let mut witness = Shares {
        scene: pilot.scene,
        strategies: pilot.settings.strategies(pilot.scene, pilot.request),
        places,
        lattice,
        own: vec![0.0; strategies_below(orders) + orders],
        splats: Vec::new(),
    };
    let counters = pilot.trace(y, &mut witness, |x, a, b| {
        let half = lattice.half(x, y);
        let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        let (g, values) = difference.split_at(strategies_below(orders));
        for (order, halves) in cells[(x / lattice.edge()) as usize].iter_mut().enumerate() {
            halves[half].add(&g[strategies_below(order)..][..order + 2], values[order]);
        }
    });
    Row { cells, splats: witness.splats, counters }
}

/// Covariances, times the number of pairs of samples.
#[derive(Clone, Debug)]
struct Regression {
    /// G, row by row.
    gram: Vec<f64>,
    /// c.
    cross: Vec<f64>,
    /// The variance of B.
    variance: f64,
}

impl Regression {
    fn new(size: usize) -> Self {
        Self { gram: vec![0.0; size * size], cross: vec![0.0; size], variance: 0.0 }
    }

    /// Adds a pair of samples by its differences, or a splat, which belongs to half a pair.
    fn add(&mut self, g: &[f64], value: f64) {
        self.variance += 0.5 * value * value;
        for (row, (&a, cross)) in self.gram.chunks_mut(g.len()).zip(g.iter().zip(&mut self.cross)) {
            if a != 0.0 {
                row.iter_mut().zip(g).for_each(|(sum, &b)| *sum += 0.5 * a * b);
                *cross += 0.5 * a * value;
            }
        }
    }

    fn merge(&mut self, other: &Self) {
        self.gram.iter_mut().zip(&other.gram).for_each(|(sum, g)| *sum += g);
        self.cross.iter_mut().zip(&other.cross).for_each(|(sum, c)| *sum += c);
        self.variance += other.variance;
    }

    /// What α add to the variance, times the number of pairs: `αᵀ G α + 2 αᵀ c`.
    fn change(&self, alpha: &[f64]) -> f64 {
        let rows = self.gram.chunks(alpha.len()).zip(&self.cross).zip(alpha);
        rows.map(|((row, cross), a)| a * (row.iter().zip(alpha).map(|(g, b)| g * b).sum::<f64>() + 2.0 * cross)).sum()
    }

    /// The α of least variance, with so much added to G's diagonal: a ridge, since the g sum to 0, and pairs are few. By Cholesky's factors.
    fn solved(&self, ridge: f64) -> Vec<f64> {
        let n = self.cross.len();
        let mut l = self.gram.clone();
        for i in 0..n {
            l[i * n + i] += ridge;
            for j in 0..=i {
                let known: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
                let rest = l[i * n + j] - known;
                l[i * n + j] = if i == j { rest.sqrt() } else { rest / l[j * n + j] };
            }
        }
        let mut x: Vec<f64> = self.cross.iter().map(|c| -c).collect();
        for i in 0..n {
            let known: f64 = (0..i).map(|k| l[i * n + k] * x[k]).sum();
            x[i] = (x[i] - known) / l[i * n + i];
        }
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|k| l[k * n + i] * x[k]).sum();
            x[i] = (x[i] - known) / l[i * n + i];
        }
        x
    }
}

/// The α by both halves, with the ridge by which those of one half do best in the other; 0 where none does better than the balance heuristic: what fits
/// the noise of the pilot is no gain.
fn fitted([first, second]: &Halves) -> Vec<f64> {
    let judged = |ridge: f64| second.change(&first.solved(ridge)) + first.change(&second.solved(ridge));
    let best = RIDGES.into_iter().map(|ridge| (judged(ridge), ridge)).min_by(|a, b| a.0.total_cmp(&b.0));
    let mut both = first.clone();
    both.merge(second);
    best.filter(|(change, _)| *change < -LEAST * both.variance)
        .map(|(_, ridge)| both.solved(ridge))
        .filter(|alpha| alpha.iter().all(|alpha| alpha.is_finite()))
        .unwrap_or_else(|| vec![0.0; both.cross.len()])
}

/// Sees the shares of strategies in paths.
struct Shares<'a> {
    scene: &'a Scene,
    strategies: Strategies,
    places: &'a PerStrategy,
    lattice: Lattice,
    /// The g of the strategies of all orders, one order after the other, and then the B of all orders.
    own: Vec<f64>,
    splats: Vec<Splat>,
}

impl Shares<'_> {
    /// The densities of a path's strategies.
    fn densities(&self, c: &Contribution) -> Option<Densities> {
        let (light, camera) = (c.path.light, c.path.camera);
        let last = camera.last()?;
        if let [start, rest @ ..] = light {
            let Site::Emitter(emitter, endpoint) = start.site else { return None };
            let end = EmitterEnd { emitter, endpoint };
            let next_event = end.next_event_density(self.scene, &rest.first().unwrap_or(last).at);
            return Some(self.strategies.densities_connected(self.scene, light, camera, next_event));
        }
        let end = match &last.site {
            Site::Surface(met) => EmitterEnd { emitter: met.emitter?, endpoint: self.scene.endpoint_of(met) },
            Site::Emitter(emitter, endpoint) => EmitterEnd { emitter: *emitter, endpoint: *endpoint },
            Site::Camera(_) => return None,
        };
        Some(self.strategies.densities_emission(self.scene, camera, &end))
    }
}

impl Sink for Shares<'_> {
    const WANTS: Wants = Wants { vertices: true, ..Wants::NOTHING };

    fn add(&mut self, c: Contribution) {
        let value = f64::from(c.value.luminance()) * c.weight;
        let (order, orders) = (c.technique.order(), self.places.orders());
        let Technique::Connect { t, .. } = c.technique else { return };
        // What is not finite is the estimate's business.
        let Some(place) = self.places.place(c.raster, order).filter(|_| value.is_finite()) else { return };
        let Some(densities) = self.densities(&c) else { return };
        if t > 1 {
            self.own[strategies_below(orders) + order] += value;
            densities.add_controls(&mut self.own[strategies_below(order)..][..order + 2]);
            return;
        }
        let mut g = vec![0.0; order + 2];
        densities.add_controls(&mut g);
        let half = self.lattice.half(c.raster.x as u32, c.raster.y as u32);
        self.splats.push(Splat { cell: place / self.places.in_a_cell(), order, half, g, value });
    }
}

impl Witness for Shares<'_> {
    fn own(&mut self) -> &mut Vec<f64> {
        &mut self.own
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::rng::Stream;

    /// Pairs whose g are of two strategies that are found in turn, and whose B falls by `slope` times that beside noise of variance 1/12.
    fn halves(slope: f64) -> Halves {
        let mut numbers = Stream::new(3, 0);
        let mut halves = [Regression::new(2), Regression::new(2)];
        for i in 0..4000 {
            let mut number = || f64::from(numbers.next_f32()) - 0.5;
            let (g, noise) = (2.0 * number(), number() - number());
            halves[i % 2].add(&[g, -g], noise - slope * g);
        }
        halves
    }

    #[test]
    fn what_strategies_tell_of_a_sample_is_taken_from_it() {
        let halves = halves(0.7);
        let alpha = fitted(&halves);
        // Only their difference matters, and the ridge makes their sum 0.
        assert!((alpha[0] - 0.35).abs() < 0.02 && (alpha[1] + 0.35).abs() < 0.02, "{alpha:?}");
        let mut both = halves[0].clone();
        both.merge(&halves[1]);
        let left = both.variance + both.change(&alpha);
        assert!((left / (4000.0 / 12.0) - 1.0).abs() < 0.05, "{left}");
    }

    #[test]
    fn noise_is_left_to_the_balance_heuristic() {
        assert_eq!(fitted(&halves(0.0)), [0.0; 2]);
        assert_eq!(fitted(&[Regression::new(3), Regression::new(3)]), [0.0; 3]);
    }
}
