//! Where in the image a method is to take its samples, and where another is better at the same layers.
//!
//! Samples of a method that doesn't splat bring light to their own pixels alone, so that each cell of a grid over the image may have its own number
//! of them: with the part a of the image, the variance V and the seconds c of a sample, the product of `Σ a V / n` and `Σ a n c` is least for
//! `n ∝ √(V/c)`, as between runs. And each cell may have the method whose `V c` is least there.

use super::pilot::{Entry, work_of_cells};
use super::search::Candidate;
use crate::error::Error;
use crate::stop::Stop;
use integrators::composite::{Regions, windows};
use integrators::{Layer, Window};
use scenes::Scene;

/// The most columns and rows of the grid.
const GRID: usize = 8;
/// The part of a method's `V c` in a cell below which another's must lie to have the cell: pilots are noisy, and the least of several is too low.
const CLEARLY: f64 = 0.8;

/// Columns and rows for a scene's image.
fn size(scene: &Scene) -> (usize, usize) {
    let cells = |pixels: u32| GRID.min(pixels as usize);
    (cells(scene.camera.width()), cells(scene.camera.height()))
}

/// The cells of a scene's image.
pub fn cells(scene: &Scene) -> impl Iterator<Item = Window> {
    windows(size(scene), scene.camera.width(), scene.camera.height())
}

/// Who is at work where in the image.
pub struct Division {
    columns: usize,
    /// The candidates at work, the one that all would be left to otherwise first, and the work of a sample in each cell, whose mean is 1.
    pub methods: Vec<(usize, Vec<f64>)>,
    /// By cell, the place among these of the one that has it.
    who: Vec<usize>,
    /// Samples by cell, their mean being 1.
    weights: Vec<f64>,
    /// Parts of the image.
    areas: Vec<f64>,
}

/// Divides the image among the candidates that may have regions, for the layers `set` of candidate `m`; `None` if that one may not.
///
/// # Errors
/// If a method cannot render, or the user asked for an end.
pub fn divide(
    scene: &Scene,
    entries: &[Entry],
    candidates: &[Candidate],
    layers: &[Layer],
    (m, set): (usize, &[usize]),
    stop: &Stop,
) -> Result<Option<Division>, Error> {
    if candidates[m].cells.is_empty() {
        return Ok(None);
    }
    let asked: Vec<Layer> = set.iter().map(|&k| layers[k]).collect();
    let able = |&other: &usize| {
        let other = &candidates[other];
        !other.cells.is_empty() && set.iter().all(|&k| other.carries[k])
    };
    let mut methods = Vec::new();
    for other in [m].into_iter().chain((0..candidates.len()).filter(|&other| other != m)).filter(able) {
        methods.push((other, work_of_cells(scene, &entries[other], &asked, stop)?));
    }
    let found = |(other, work): &(usize, Vec<f64>)| -> Vec<(f64, f64)> {
        let seconds = candidates[*other].cost.of(set);
        candidates[*other].variances(set).into_iter().zip(work.iter().map(|work| work * seconds)).collect()
    };
    let found: Vec<Vec<(f64, f64)>> = methods.iter().map(found).collect();
    let areas = cells(scene).map(|cell| f64::from(cell.width()) * f64::from(cell.height())).collect();
    Ok(Some(Division::new(size(scene).0, methods, &found, areas)))
}

impl Division {
    /// From what is `found` of every method in every cell: variances and seconds of a sample.
    fn new(columns: usize, methods: Vec<(usize, Vec<f64>)>, found: &[Vec<(f64, f64)>], areas: Vec<f64>) -> Self {
        let product = |method: usize, cell: usize| found[method][cell].0 * found[method][cell].1;
        let cells = 0..areas.len();
        let best = |cell: usize| {
            let rivals = (1..methods.len()).min_by(|&a, &b| product(a, cell).total_cmp(&product(b, cell)));
            rivals.filter(|&rival| product(rival, cell) < CLEARLY * product(0, cell)).unwrap_or(0)
        };
        let who: Vec<usize> = cells.clone().map(best).collect();
        let weight = |cell: usize| {
            let (variance, seconds) = found[who[cell]][cell];
            (variance / seconds.max(1e-12)).sqrt()
        };
        let raw: Vec<f64> = cells.map(weight).collect();
        let mean = raw.iter().sum::<f64>() / raw.len() as f64;
        let weights = raw.iter().map(|weight| if mean > 0.0 { two_digits(weight / mean) } else { 1.0 }).collect();
        let all: f64 = areas.iter().sum();
        let areas = areas.into_iter().map(|area| area / all).collect();
        let mut division = Self { columns, methods, who, weights, areas };
        division.forget_idle();
        division
    }

    /// Drops all but the first of the methods that have no cell.
    fn forget_idle(&mut self) {
        for method in (1..self.methods.len()).rev().filter(|method| !self.who.contains(method)).collect::<Vec<_>>() {
            self.methods.remove(method);
            self.who.iter_mut().filter(|who| **who > method).for_each(|who| *who -= 1);
        }
    }

    /// What a method's cells add to the mean variance of one sample of all of the image, replicate by replicate, where it has such squares in each cell.
    pub fn squares(&self, method: usize, squares: &[Vec<f64>]) -> Vec<f64> {
        let mut sum = vec![0.0; squares.first().map_or(0, Vec::len)];
        for cell in self.own(method) {
            let factor = self.areas[cell] / self.weights[cell];
            sum.iter_mut().zip(&squares[cell]).for_each(|(sum, square)| *sum += factor * square);
        }
        sum
    }

    /// What they add to the seconds of one sample, of which the method takes so many by itself.
    pub fn seconds(&self, method: usize, seconds: f64) -> f64 {
        let work = &self.methods[method].1;
        self.own(method).map(|cell| self.areas[cell] * seconds * work[cell] * self.weights[cell]).sum()
    }

    fn own(&self, method: usize) -> impl Iterator<Item = usize> {
        (0..self.who.len()).filter(move |&cell| self.who[cell] == method)
    }

    /// One method's regions, and its part of the samples; `None` if it has no cell.
    pub fn regions(&self, method: usize) -> Option<(Regions, f64)> {
        let weight = |cell: usize| if self.who[cell] == method { self.weights[cell] } else { 0.0 };
        let weights: Vec<f64> = (0..self.who.len()).map(weight).collect();
        let rows: Vec<Vec<f64>> = weights.chunks(self.columns).map(<[f64]>::to_vec).collect();
        let part = weights.iter().sum::<f64>() / self.weights.iter().sum::<f64>();
        Some((Regions::new(&rows).ok()?, part))
    }
}

/// A number with two significant digits: weights are no better known, and regions with equal samples are rendered as one.
fn two_digits(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn division(found: &[Vec<(f64, f64)>]) -> Division {
        let methods = (0..found.len()).map(|m| (m + 5, vec![1.0; found[0].len()])).collect();
        Division::new(2, methods, found, vec![1.0; found[0].len()])
    }

    #[test]
    fn samples_go_where_variance_is_and_to_the_method_that_has_least_of_it() {
        let found = [vec![(4.0, 1.0), (1.0, 1.0)], vec![(100.0, 1.0), (0.9, 1.0)], vec![(9.0, 4.0), (0.04, 1.0)]];
        let divided = division(&found);
        // The second is never clearly better; the third has the second cell.
        assert_eq!(
            (divided.methods.iter().map(|m| m.0).collect::<Vec<_>>(), &divided.who[..]),
            (vec![5, 7], &[0, 1][..])
        );
        assert_eq!(divided.weights, [1.8, 0.18]);
        let (regions, part) = divided.regions(0).unwrap();
        assert_eq!((Vec::from(regions), part), (vec![vec![1.8, 0.0]], 1.8 / 1.98));
        let squares = [
            divided.squares(0, &[vec![3.0, 5.0], vec![0.0; 2]]),
            divided.squares(1, &[vec![0.0; 2], vec![0.03, 0.05]]),
        ];
        let variance: f64 = squares.iter().flatten().sum::<f64>() / 2.0;
        let seconds = divided.seconds(0, 1.0) + divided.seconds(1, 1.0);
        // With the best weights for standard deviations of 2 and 0.2 the product is the square of their mean.
        assert!((variance * seconds / 1.1_f64.powi(2) - 1.0).abs() < 1e-9, "{variance} {seconds}");
        assert!(division(&found[..1]).regions(1).is_none());
    }

    #[test]
    fn where_nothing_varies_samples_are_spread_evenly() {
        assert_eq!(division(&[vec![(0.0, 1.0), (0.0, 2.0)]]).weights, [1.0, 1.0]);
    }
}
