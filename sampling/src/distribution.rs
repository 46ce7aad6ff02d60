//! Piecewise-constant distributions on the unit interval and the unit square.
//!
//! Random numbers have 24 bits. A table whose probabilities are not multiples of 2⁻²⁴ would be sampled with slightly
//! other probabilities than it states, which is a bias; here weights are first rounded to such multiples, none of the
//! positive ones to zero, and the rounded probabilities are what the table states *and* what it samples.

use glam::{Vec2, vec2};
use thiserror::Error;

/// The number of different random numbers, 2²⁴.
pub(crate) const GRID: u32 = 1 << 24;

/// Why weights make no distribution.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum DistributionError {
    /// There is nothing to choose from.
    #[error("a distribution needs at least one weight")]
    Empty,
    /// More entries than random numbers can tell apart.
    #[error("a distribution of {0} entries is too long: at most 2²³ are told apart by 24-bit random numbers")]
    TooMany(usize),
    /// A weight is negative or not finite.
    #[error("weight {index} of a distribution is {value}: weights must be finite and not negative")]
    BadWeight {
        /// Its position.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// All weights are zero.
    #[error("all weights of a distribution are zero: at least one must be positive")]
    AllZero,
    /// Width times height is not the number of weights.
    #[error("{weights} weights do not fill a table of {width} × {height}")]
    BadShape {
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
        /// Weights given.
        weights: usize,
    },
}

/// Shares out the 2²⁴ random numbers in proportion to the weights, at least one to each positive weight.
pub(crate) fn apportion(weights: &[f64]) -> Result<Vec<u32>, DistributionError> {
    if weights.is_empty() {
        return Err(DistributionError::Empty);
    }
    if weights.len() > (GRID / 2) as usize {
        return Err(DistributionError::TooMany(weights.len()));
    }
    if let Some((index, &value)) = weights.iter().enumerate().find(|(_, w)| !(w.is_finite() && **w >= 0.0)) {
        return Err(DistributionError::BadWeight { index, value });
    }
    let largest = weights.iter().copied().fold(0.0, f64::max);
    if largest == 0.0 {
        return Err(DistributionError::AllZero);
    }
    // Divided by the largest first, so that the sum cannot overflow.
    let total: f64 = weights.iter().map(|w| w / largest).sum();
    let positive = weights.iter().filter(|w| **w > 0.0).count() as u32;
    let shared = f64::from(GRID - positive);
    // One for each positive weight; of the rest, cumulative sums are rounded, the last of which is the total: so the whole is exact.
    let (mut cumulative, mut given) = (0.0, 0_u32);
    let count = |w: &f64| {
        cumulative += w / largest;
        let upto = (cumulative / total * shared).round() as u32;
        let count = upto - given;
        given = upto;
        if *w > 0.0 { count + 1 } else { count }
    };
    Ok(weights.iter().map(count).collect())
}

/// A piecewise-constant density on [0, 1), `n` pieces of equal width.
#[derive(Clone, Debug)]
pub struct Piecewise1D {
    /// The first random number (in units of 2⁻²⁴) of each piece, and 2²⁴ at the end.
    starts: Vec<u32>,
}

impl Piecewise1D {
    /// The density proportional to the weights.
    pub fn new(weights: &[f64]) -> Result<Self, DistributionError> {
        let mut start = 0;
        let mut starts = vec![0];
        for count in apportion(weights)? {
            start += count;
            starts.push(start);
        }
        Ok(Self { starts })
    }

    /// The number of pieces.
    #[inline]
    pub fn pieces(&self) -> usize {
        self.starts.len() - 1
    }

    /// A point of [0, 1), its density, and its piece.
    #[inline]
    pub fn sample(&self, u: f32) -> (f32, f32, usize) {
        let position = u * GRID as f32;
        let piece = self.piece_of(position as u32);
        let (start, count) = (self.starts[piece], self.starts[piece + 1] - self.starts[piece]);
        let inside = (position - start as f32) / count as f32;
        let x = (piece as f32 + inside) / self.pieces() as f32;
        (x.min(1.0_f32.next_down()), self.density_of(piece), piece)
    }

    /// A piece and a place within it, in (0, 1]: the middle of the part that a random number has of it, so that a piece which
    /// few numbers choose is not sampled at its left end alone.
    #[inline]
    fn sample_piece(&self, u: f32) -> (usize, f32) {
        let number = (u * GRID as f32) as u32;
        let piece = self.piece_of(number);
        let (start, count) = (self.starts[piece], self.starts[piece + 1] - self.starts[piece]);
        (piece, ((number - start) as f32 + 0.5) / count as f32)
    }

    /// The last piece that starts at or before the number: empty pieces are never it.
    #[inline]
    fn piece_of(&self, number: u32) -> usize {
        self.starts.partition_point(|&start| start <= number) - 1
    }

    /// The density at a point of [0, 1).
    #[inline]
    pub fn pdf(&self, x: f32) -> f32 {
        self.density_of(self.piece_at(x))
    }

    #[inline]
    fn piece_at(&self, x: f32) -> usize {
        ((x * self.pieces() as f32) as usize).min(self.pieces() - 1)
    }

    #[inline]
    fn density_of(&self, piece: usize) -> f32 {
        (self.starts[piece + 1] - self.starts[piece]) as f32 * (self.pieces() as f32 / GRID as f32)
    }
}

/// A piecewise-constant density on [0, 1)², a table of `width` × `height` equal cells.
#[derive(Clone, Debug)]
pub struct Piecewise2D {
    rows: Piecewise1D,
    /// The distribution within each row; `None` in a row of zeros, which is never sampled.
    columns: Vec<Option<Piecewise1D>>,
}

impl Piecewise2D {
    /// The density proportional to the weights, row by row: x runs fastest.
    pub fn new(weights: &[f64], width: usize, height: usize) -> Result<Self, DistributionError> {
        if width.checked_mul(height) != Some(weights.len()) {
            return Err(DistributionError::BadShape { width, height, weights: weights.len() });
        }
        if weights.is_empty() {
            return Err(DistributionError::Empty);
        }
        let mut columns = Vec::with_capacity(height);
        let mut sums = Vec::with_capacity(height);
        let largest = weights.iter().copied().fold(0.0, f64::max);
        for (y, row) in weights.chunks_exact(width).enumerate() {
            columns.push(match Piecewise1D::new(row) {
                Ok(row) => Some(row),
                Err(DistributionError::AllZero) => None,
                Err(DistributionError::BadWeight { index, value }) => {
                    return Err(DistributionError::BadWeight { index: y * width + index, value });
                }
                Err(error) => return Err(error),
            });
            sums.push(row.iter().map(|w| w / largest).sum());
        }
        if largest == 0.0 {
            return Err(DistributionError::AllZero);
        }
        Ok(Self { rows: Piecewise1D::new(&sums)?, columns })
    }

    /// A point of [0, 1)², by the cell that it lies in, and its density.
    #[inline]
    pub fn sample(&self, u: Vec2) -> CellSample {
        let (row, y) = self.rows.sample_piece(u.y);
        let columns = self.columns[row].as_ref().expect("a row of zeros is never sampled");
        let (column, x) = columns.sample_piece(u.x);
        CellSample { column, row, within: vec2(x, y), pdf: columns.density_of(column) * self.rows.density_of(row) }
    }

    /// The cell that a point of [0, 1]² lies in, its column and row.
    #[inline]
    pub fn cell_at(&self, p: Vec2) -> (usize, usize) {
        let row = self.rows.piece_at(p.y);
        (self.columns[row].as_ref().map_or(0, |columns| columns.piece_at(p.x)), row)
    }

    /// The density in a cell.
    #[inline]
    pub fn pdf(&self, column: usize, row: usize) -> f32 {
        self.columns[row].as_ref().map_or(0.0, |columns| columns.density_of(column) * self.rows.density_of(row))
    }
}

/// A sampled point of a [`Piecewise2D`].
#[derive(Clone, Copy, Debug)]
pub struct CellSample {
    /// The column of its cell.
    pub column: usize,
    /// The row of its cell.
    pub row: usize,
    /// Where it lies within the cell, in (0, 1]².
    pub within: Vec2,
    /// Its density on the unit square.
    pub pdf: f32,
}

#[cfg(test)]
mod tests {
    use super::*;

    const WEIGHTS: [f64; 7] = [0.0, 1.0, 3.0, 0.0, 1e-30, 2.0, 0.0];

    #[test]
    fn random_numbers_are_shared_out_completely() {
        let counts = apportion(&WEIGHTS).expect("good weights");
        assert_eq!(counts.iter().sum::<u32>(), GRID);
        for (w, &count) in WEIGHTS.iter().zip(&counts) {
            let exact = w / 6.0 * f64::from(GRID);
            assert!((f64::from(count) - exact).abs() < 3.0 && (count > 0) == (*w > 0.0), "{w}: {count}");
        }
        for weights in [vec![1e308; 1000], vec![5e-324; 1000], vec![1.0; 1 << 20], vec![7.0]] {
            assert_eq!(apportion(&weights).expect("good weights").iter().sum::<u32>(), GRID);
        }
    }

    #[test]
    fn bad_weights_are_errors() {
        assert_eq!(apportion(&[]), Err(DistributionError::Empty));
        assert_eq!(apportion(&[0.0, 0.0]), Err(DistributionError::AllZero));
        assert_eq!(apportion(&[1.0, -1.0]), Err(DistributionError::BadWeight { index: 1, value: -1.0 }));
        assert!(matches!(apportion(&[f64::NAN]), Err(DistributionError::BadWeight { index: 0, .. })));
        let bad = Piecewise2D::new(&[1.0, 1.0, 1.0, f64::INFINITY], 2, 2).expect_err("infinite");
        assert_eq!(bad, DistributionError::BadWeight { index: 3, value: f64::INFINITY });
        assert!(matches!(Piecewise2D::new(&[1.0; 5], 2, 2), Err(DistributionError::BadShape { .. })));
    }

    #[test]
    fn more_weights_than_half_the_random_numbers_are_too_many() {
        let count = (GRID / 2) as usize + 1;
        assert_eq!(apportion(&vec![1.0; count]), Err(DistributionError::TooMany(count)));
    }

    /// The first piece has a quarter of the numbers.
    #[test]
    fn a_piece_is_sampled_from_one_end_to_the_other() {
        let d = Piecewise1D::new(&[1.0, 3.0]).expect("good weights");
        for (u, piece, place) in [(0.0, 0, 0.0), (0.125, 0, 0.5), (0.2, 0, 0.8), (0.4375, 1, 0.25), (0.625, 1, 0.5)] {
            let (x, pdf, found) = d.sample(u);
            assert!((x - (piece as f32 + place) / 2.0).abs() < 1e-6 && found == piece, "{u}: {x} of {found}");
            assert_eq!(pdf, d.pdf(x), "{u}");
            let (found, within) = d.sample_piece(u);
            assert!(found == piece && within > 0.0 && (within - place).abs() < 1e-6, "{u}: {within} of {found}");
        }
    }

    /// In single precision the largest number below one times the number of pieces may be that number.
    #[test]
    fn the_last_piece_ends_where_the_line_does() {
        for pieces in 1..40 {
            let weights: Vec<f64> = (1..=pieces).map(f64::from).collect();
            let d = Piecewise1D::new(&weights).expect("good weights");
            assert_eq!(d.pdf(1.0_f32.next_down()), d.density_of(weights.len() - 1), "{pieces}");
        }
    }

    #[test]
    fn a_line_is_sampled_with_exactly_its_density() {
        let d = Piecewise1D::new(&WEIGHTS).expect("good weights");
        let total: f64 = (0..7).map(|i| f64::from(d.density_of(i)) / 7.0).sum();
        assert!((total - 1.0).abs() < 1e-6);
        let mut hits = [0_u32; 7];
        let mut last = -1.0;
        for i in 0..GRID {
            let (x, pdf, piece) = d.sample(i as f32 / GRID as f32);
            assert!((0.0..1.0).contains(&x) && x >= last && pdf > 0.0, "{i}: {x}");
            hits[piece] += 1;
            last = x;
        }
        assert_eq!(hits.to_vec(), apportion(&WEIGHTS).expect("good weights"));
        let (x, pdf, _) = d.sample(0.3);
        assert_eq!(pdf, d.pdf(x));
    }

    #[test]
    fn a_table_is_sampled_with_its_density() {
        let (width, height) = (3, 4);
        let weights = [0.0, 1.0, 2.0, 0.0, 0.0, 0.0, 3.0, 0.0, 1e-9, 1.0, 1.0, 1.0];
        let d = Piecewise2D::new(&weights, width, height).expect("good weights");
        let mut mass = [0.0_f64; 12];
        let side = 1024;
        for i in 0..side * side {
            let u = (vec2((i % side) as f32, (i / side) as f32) + 0.5) / side as f32;
            let CellSample { column, row, within, pdf } = d.sample(u);
            assert!(within.max_element() <= 1.0 && within.min_element() > 0.0);
            let p = (vec2(column as f32, row as f32) + 0.5) / vec2(width as f32, height as f32);
            assert_eq!(d.cell_at(p), (column, row));
            let cell = row * width + column;
            assert!(weights[cell] > 0.0, "{column} {row}");
            assert_eq!(pdf, d.pdf(column, row));
            // ∫ 1 dp over the cell, estimated by the samples in it, is its area.
            mass[cell] += 1.0 / (f64::from(pdf) * (side * side) as f64);
        }
        for (w, m) in weights.iter().zip(mass) {
            assert!(*w < 1e-6 || (m * 12.0 - 1.0).abs() < 0.02, "{w}: {m}");
        }
        let integral: f64 = (0..12).map(|i| f64::from(d.pdf(i % 3, i / 3)) / 12.0).sum();
        assert!((integral - 1.0).abs() < 1e-6, "{integral}");
    }
}
