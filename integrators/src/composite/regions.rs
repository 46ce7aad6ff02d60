//! Where in the image a run is at work, and with how many of its samples.

use crate::block::Window;
use serde::{Deserialize, Serialize};

/// The most rows and columns of a grid.
const MOST: usize = 64;

/// Weights of a run's samples in the cells of a grid over the image: rows from the top, all cells of one size. Where the weight is 0 the run is
/// not at work, elsewhere every pixel has at least one sample.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Vec<Vec<f64>>", into = "Vec<Vec<f64>>")]
pub struct Regions {
    columns: usize,
    weights: Vec<f64>,
}

impl Regions {
    /// From weights by row and column; only how they compare counts.
    ///
    /// # Errors
    /// If rows differ in length, there are none or more than 64 of them, or a weight is negative, or none is positive.
    pub fn new(rows: &[Vec<f64>]) -> Result<Self, String> {
        let columns = rows.first().map_or(0, Vec::len);
        if let Some(row) = rows.iter().position(|row| row.len() != columns) {
            return Err(format!(
                "row {row} of the regions has another length than the first; give every row as many weights"
            ));
        }
        if !(1..=MOST).contains(&columns) || rows.len() > MOST {
            return Err(format!("regions of {} rows and {columns} columns; give 1 to {MOST} of both", rows.len()));
        }
        let weights: Vec<f64> = rows.iter().flatten().copied().collect();
        if let Some(bad) = weights.iter().find(|weight| !(weight.is_finite() && **weight >= 0.0)) {
            return Err(format!(
                "the weight {bad:?} of a region is no part of the samples; give 0 or a positive number"
            ));
        }
        if !weights.iter().any(|&weight| weight > 0.0) {
            return Err(
                "the regions have no weight above 0; give at least one cell some, or leave the run out".to_owned()
            );
        }
        if !weights.iter().sum::<f64>().is_finite() {
            return Err("the weights of the regions are too large to be added up; give smaller ones".to_owned());
        }
        Ok(Self { columns, weights })
    }

    /// As [`Regions::read`] takes it: columns apart by commas, rows by strokes.
    pub fn brief(&self) -> String {
        let row = |row: &[f64]| row.iter().map(f64::to_string).collect::<Vec<_>>().join(",");
        self.weights.chunks(self.columns).map(row).collect::<Vec<_>>().join("/")
    }

    /// From `1,2/0,1`.
    ///
    /// # Errors
    /// If it is written in another way, and those of [`Regions::new`].
    pub fn read(text: &str) -> Result<Self, String> {
        let weight =
            |text: &str| text.trim().parse::<f64>().map_err(|_| format!("`{}` is no weight of a region", text.trim()));
        let row = |row: &str| row.split(',').map(weight).collect();
        Self::new(&text.split('/').map(row).collect::<Result<Vec<Vec<f64>>, String>>()?)
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.columns, self.weights.len() / self.columns)
    }

    /// Weights cell by cell, row by row, whose mean is 1.
    pub fn weights(&self) -> Vec<f64> {
        let mean = self.weights.iter().sum::<f64>() / self.weights.len() as f64;
        self.weights.iter().map(|weight| weight / mean).collect()
    }

    /// Whether a cell is one of those where the run is at work.
    pub(super) fn has(&self, cell: usize) -> bool {
        self.weights[cell] > 0.0
    }

    /// How many cells there are.
    pub(super) fn cells(&self) -> usize {
        self.weights.len()
    }

    /// Whether both have the same cells, and no cell is in both.
    pub(super) fn is_apart(&self, other: &Self) -> bool {
        self.size() == other.size() && !(0..self.cells()).any(|cell| self.has(cell) && other.has(cell))
    }

    /// The numbers of samples that occur where they are so many on average, fewest first, and the windows of an image that have them.
    pub(super) fn samples(&self, average: f64, width: u32, height: u32) -> Vec<(u32, Vec<Window>)> {
        let mut found: Vec<(u32, Vec<Window>)> = Vec::new();
        let windows = windows(self.size(), width, height);
        for ((cell, window), weight) in windows.enumerate().zip(self.weights()) {
            if !self.has(cell) || window.is_empty() {
                continue;
            }
            let samples = (average * weight).round().max(1.0) as u32;
            match found.iter_mut().find(|(other, _)| *other == samples) {
                Some((_, windows)) => windows.push(window),
                None => found.push((samples, vec![window])),
            }
        }
        found.sort_by_key(|(samples, _)| *samples);
        found
    }
}

impl TryFrom<Vec<Vec<f64>>> for Regions {
    type Error = String;

    fn try_from(rows: Vec<Vec<f64>>) -> Result<Self, String> {
        Self::new(&rows)
    }
}

impl From<Regions> for Vec<Vec<f64>> {
    fn from(regions: Regions) -> Self {
        regions.weights.chunks(regions.columns).map(<[f64]>::to_vec).collect()
    }
}

/// Whether runs that are at work in these regions, or all over the image, leave no cell of it. Those of several are apart from one another.
pub(super) fn cover_all(runs: &[Option<&Regions>]) -> bool {
    let Some(regions) = runs.iter().copied().collect::<Option<Vec<&Regions>>>() else { return true };
    (0..regions[0].cells()).all(|cell| regions.iter().any(|regions| regions.has(cell)))
}

/// The pixels of each cell of a grid over an image, row by row; a grid finer than the image has cells without any.
pub fn windows((columns, rows): (usize, usize), width: u32, height: u32) -> impl Iterator<Item = Window> {
    let edge = |cell: usize, cells: usize, pixels: u32| (cell * pixels as usize / cells) as u32;
    (0..columns * rows).map(move |cell| {
        let (column, row) = (cell % columns, cell / columns);
        Window {
            x: edge(column, columns, width)..edge(column + 1, columns, width),
            y: edge(row, rows, height)..edge(row + 1, rows, height),
        }
    })
}
