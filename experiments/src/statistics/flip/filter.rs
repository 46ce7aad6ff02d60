//! Separable filters on planes of numbers; beyond the border a plane goes on as it is there.

/// A filter's weights from −radius to radius.
#[derive(Clone, Debug)]
pub struct Kernel(Vec<f64>);

impl Kernel {
    /// `of(x)` for the whole numbers from −radius to radius. What is above 0 is scaled to a sum of 1, what is below to −1.
    pub fn new(radius: usize, of: impl Fn(f64) -> f64) -> Self {
        let radius = radius as i64;
        let values: Vec<f64> = (-radius..=radius).map(|x| of(x as f64)).collect();
        let positive: f64 = values.iter().filter(|v| **v > 0.0).sum();
        let negative: f64 = -values.iter().filter(|v| **v < 0.0).sum::<f64>();
        Self(
            values
                .iter()
                .map(|&v| {
                    if v > 0.0 {
                        v / positive
                    } else if v < 0.0 {
                        v / negative
                    } else {
                        0.0
                    }
                })
                .collect(),
        )
    }

    /// The normal distribution's density of this standard deviation \[pixels\].
    pub fn gaussian(radius: usize, deviation: f64) -> Self {
        Self::new(radius, |x| (-0.5 * (x / deviation).powi(2)).exp())
    }

    /// Sum of the values that `of` has before they are scaled.
    pub fn sum(radius: usize, of: impl Fn(f64) -> f64) -> f64 {
        (-(radius as i64)..=radius as i64).map(|x| of(x as f64)).sum()
    }
}

/// A plane filtered along its rows by one kernel, and along its columns by another.
pub fn filter(plane: &[f64], width: usize, along_rows: &Kernel, along_columns: &Kernel) -> Vec<f64> {
    columns(&rows(plane, width, along_rows), width, along_columns)
}

/// Rows are added up tap by tap, so that many pixels are at work at once.
pub fn rows(plane: &[f64], width: usize, kernel: &Kernel) -> Vec<f64> {
    let radius = kernel.0.len() / 2;
    let mut filtered = vec![0.0; plane.len()];
    let mut padded = vec![0.0; width + 2 * radius];
    for (row, sums) in plane.chunks_exact(width).zip(filtered.chunks_exact_mut(width)) {
        padded[..radius].fill(row[0]);
        padded[radius..radius + width].copy_from_slice(row);
        padded[radius + width..].fill(row[width - 1]);
        for (i, weight) in kernel.0.iter().enumerate() {
            sums.iter_mut().zip(&padded[i..]).for_each(|(sum, v)| *sum += weight * v);
        }
    }
    filtered
}

/// The same along columns.
pub fn columns(plane: &[f64], width: usize, kernel: &Kernel) -> Vec<f64> {
    let (height, radius) = ((plane.len() / width) as i64, (kernel.0.len() / 2) as i64);
    let mut filtered = vec![0.0; plane.len()];
    for (y, row) in filtered.chunks_exact_mut(width).enumerate() {
        for (i, weight) in kernel.0.iter().enumerate() {
            let from = (y as i64 + i as i64 - radius).clamp(0, height - 1) as usize;
            row.iter_mut().zip(&plane[from * width..(from + 1) * width]).for_each(|(sum, v)| *sum += weight * v);
        }
    }
    filtered
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ways_of_filtering_are_the_same() {
        let kernel = Kernel::new(2, |x| x + 0.5);
        let plane: Vec<f64> = (0..5 * 4).map(|i| f64::from(i * i % 7)).collect();
        let transposed: Vec<f64> = (0..20).map(|i| plane[i % 4 * 5 + i / 4]).collect();
        let (a, b) = (rows(&plane, 5, &kernel), columns(&transposed, 4, &kernel));
        assert!((0..20).all(|i| (a[i] - b[i % 5 * 4 + i / 5]).abs() < 1e-12), "{a:?} {b:?}");
    }

    #[test]
    fn a_constant_stays_and_has_no_edge() {
        let (smooth, edge) = (Kernel::gaussian(3, 1.0), Kernel::new(3, |x| -x));
        assert!(filter(&[2.0; 30], 6, &smooth, &smooth).iter().all(|v| (v - 2.0).abs() < 1e-12));
        assert!(filter(&[2.0; 30], 6, &edge, &smooth).iter().all(|v| v.abs() < 1e-12));
    }
}
