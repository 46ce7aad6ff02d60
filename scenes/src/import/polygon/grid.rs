//! Points found by where they are.

use glam::DVec2;

/// Some points of a list, in the cells of a grid over their box, about as many as there are points.
pub(super) struct Grid {
    low: DVec2,
    /// Cells a unit of length.
    scale: DVec2,
    columns: usize,
    rows: usize,
    /// The points cell by cell, row by row.
    points: Vec<usize>,
    /// Where each cell begins, and the end.
    starts: Vec<usize>,
}

/// How far a triangle is thought to reach beyond its own, for all that is rounded \[cells\].
const MARGIN: f64 = 1e-6;

impl Grid {
    /// A grid of those points that have these indices.
    pub fn new(p: &[DVec2], mut points: Vec<usize>) -> Self {
        let corners = || points.iter().map(|&i| p[i]);
        let low = corners().fold(DVec2::INFINITY, DVec2::min);
        let size = (corners().fold(DVec2::NEG_INFINITY, DVec2::max) - low).max(DVec2::ZERO);
        let count = points.len().max(1);
        let cell = (size.x * size.y / count as f64).sqrt();
        let cells = |length: f64| ((length / cell) as usize).clamp(1, count);
        let (columns, rows) = if cell > 0.0 { (cells(size.x), cells(size.y)) } else { (count, 1) };
        let (columns, rows) = if columns * rows > 4 * count { (count, 1) } else { (columns, rows) };
        let scale = DVec2::new(columns as f64, rows as f64) / size.max(DVec2::splat(f64::MIN_POSITIVE));
        let mut grid = Grid { low, scale, columns, rows, points: Vec::new(), starts: Vec::new() };
        points.sort_by_cached_key(|&i| grid.cell(p[i]));
        grid.starts = vec![0; columns * rows + 1];
        let cells: Vec<usize> = points.iter().map(|&i| grid.cell(p[i])).collect();
        cells.iter().for_each(|cell| grid.starts[cell + 1] += 1);
        for cell in 0..columns * rows {
            grid.starts[cell + 1] += grid.starts[cell];
        }
        grid.points = points;
        grid
    }

    fn cell(&self, p: DVec2) -> usize {
        let at = (p - self.low) * self.scale;
        within(at.y, self.rows) * self.columns + within(at.x, self.columns)
    }

    /// The points in all cells that a triangle touches, and perhaps some more.
    pub fn near(&self, triangle: [DVec2; 3]) -> impl Iterator<Item = usize> {
        let corners = triangle.map(|p| (p - self.low) * self.scale);
        let low = corners.iter().fold(f64::INFINITY, |low, p| low.min(p.y));
        let high = corners.iter().fold(f64::NEG_INFINITY, |high, p| high.max(p.y));
        let rows = within(low - MARGIN, self.rows)..=within(high + MARGIN, self.rows);
        rows.flat_map(move |row| {
            let (from, to) = span(&corners, row as f64 - MARGIN, (row + 1) as f64 + MARGIN);
            let (from, to) = (within(from - MARGIN, self.columns), within(to + MARGIN, self.columns));
            let cell = |column: usize| row * self.columns + column;
            let cells = if from <= to { self.starts[cell(from)]..self.starts[cell(to) + 1] } else { 0..0 };
            self.points[cells].iter().copied()
        })
    }
}

/// The cell of so many in which a coordinate is, or the nearest one.
fn within(at: f64, count: usize) -> usize {
    (at as usize).min(count - 1)
}

/// What a triangle spans along x between two heights; what is beyond its own belongs to the nearest row.
fn span(corners: &[DVec2; 3], low: f64, high: f64) -> (f64, f64) {
    let mut span = (f64::INFINITY, f64::NEG_INFINITY);
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        let (a, b) = if a.y <= b.y { (a, b) } else { (b, a) };
        if b.y < low || a.y > high {
            continue;
        }
        let at = |y: f64| a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y));
        for x in if a.y < b.y { [at(a.y.max(low)), at(b.y.min(high))] } else { [a.x, b.x] } {
            span = (span.0.min(x), span.1.max(x));
        }
    }
    span
}
