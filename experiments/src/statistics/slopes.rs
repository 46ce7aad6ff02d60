//! Straight lines through log variance, against log samples or log seconds; and the time to a given error.

use super::positive::{Stratum, VALID_FROM, log_sum, recursion};
use super::{Estimate, Interval};

/// One checkpoint of a line: the variance of a replicate, measured on replicates of its own.
#[derive(Clone, Copy, Debug)]
pub struct Point<'a> {
    /// Where it stands before taking the logarithm: samples of a replicate.
    pub samples: f64,
    /// Recursive squares, or squared errors: their mean is the variance.
    pub squares: &'a [f64],
    /// Seconds of the same replicates; empty if the line is against samples.
    pub seconds: &'a [f64],
}

impl Point<'_> {
    /// Seconds of a replicate where they are given, samples where not.
    fn abscissa(&self) -> f64 {
        if self.seconds.is_empty() { self.samples } else { average(self.seconds) }
    }
}

/// A straight line through log variance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Its slope.
    pub slope: f64,
    /// The slope's 95 % interval.
    pub ci: Interval,
    /// Natural log of the variance at one sample, or one second.
    pub intercept: f64,
    /// Checkpoints it goes through.
    pub points: usize,
}

/// The line through all points, by least squares with equal weights; `None` for fewer than two, or where one has no variance.
///
/// Equal weights, because those that the replicates suggest are as uncertain as the points: a variance that is too small by chance
/// also looks too certain, which pulls the line down to it and its interval off the truth. The interval is that of
/// [`super::positive`]: the slope is a sum of logarithms of means. Where x is log seconds, its own noise is part of it.
pub fn line(points: &[Point], salt: u64) -> Option<Line> {
    let fit = Fit::new(points)?;
    let strata = fit.strata(points, fit.slopes(), |x, e| -fit.slope * fit.lever(x) + e / fit.spread);
    let (_, (below, above)) = log_sum(&strata, scale(points), salt)?;
    let ci = (fit.slope - below, fit.slope + above);
    Some(Line { slope: fit.slope, ci, intercept: fit.y - fit.slope * fit.x, points: points.len() })
}

/// The slope as an estimate: of the fewest replicates that one of its points has.
pub fn slope(points: &[Point], salt: u64) -> Option<Estimate> {
    let replicates = points.iter().map(|p| p.squares.len() + 1).min()?;
    let line = line(points, salt)?;
    Some(Estimate::new(line.slope, Some(line.ci), replicates, VALID_FROM))
}

/// Where the line reaches the variance `error²`: samples or seconds, whichever it is against, to a root mean squared `error`.
///
/// The interval is that of a function of the line, to first order in its noise; none where the slope's own interval does not
/// exclude that error stays as it is. It knows nothing of how a method converges beyond its last checkpoint.
pub fn time_to_error(points: &[Point], error: f64, salt: u64) -> Option<Estimate> {
    let fit = Fit::new(points)?;
    let rest = 2.0 * error.ln() - fit.y;
    let log = fit.x + rest / fit.slope;
    let n = points.len() as f64;
    // log T = x̄ + (log ε² − ȳ)/β: how it moves with each log variance, and with each log second.
    let by_slope = -rest / fit.slope.powi(2);
    let of_y: Vec<f64> = fit.slopes().iter().map(|a| -1.0 / (n * fit.slope) + by_slope * a).collect();
    let strata = fit.strata(points, of_y, |x, e| 1.0 / n + by_slope * (-fit.slope * fit.lever(x) + e / fit.spread));
    let reach = log_sum(&strata, scale(points), salt);
    let falls = line(points, salt).is_some_and(|line| line.ci.1 < 0.0);
    let interval = reach.filter(|_| falls).map(|(_, (below, above))| ((log - below).exp(), (log + above).exp()));
    let replicates = points.iter().map(|p| p.squares.len() + 1).min()?;
    Some(Estimate::new(log.exp(), interval, replicates, VALID_FROM))
}

/// That of the point with the fewest replicates.
fn scale(points: &[Point]) -> f64 {
    points.iter().map(|p| recursion(p.squares.len())).fold(1.0, f64::max)
}

/// Means, slope, and what is needed to say how they move with the points.
struct Fit {
    xs: Vec<f64>,
    ys: Vec<f64>,
    x: f64,
    y: f64,
    /// Σ (x − x̄)².
    spread: f64,
    slope: f64,
}

impl Fit {
    fn new(points: &[Point]) -> Option<Self> {
        let xs: Vec<f64> = points.iter().map(|p| p.abscissa().ln()).collect();
        let ys: Vec<f64> = points.iter().map(|p| average(p.squares).ln()).collect();
        if points.len() < 2 || !xs.iter().chain(&ys).all(|v| v.is_finite()) {
            return None;
        }
        let (x, y) = (average(&xs), average(&ys));
        let spread: f64 = xs.iter().map(|v| (v - x).powi(2)).sum();
        let slope = xs.iter().zip(&ys).map(|(a, b)| (a - x) * (b - y)).sum::<f64>() / spread;
        (spread > 0.0).then_some(Self { xs, ys, x, y, spread, slope })
    }

    /// How the slope moves with the log variance at `x`.
    fn lever(&self, x: f64) -> f64 {
        (x - self.x) / self.spread
    }

    fn slopes(&self) -> Vec<f64> {
        self.xs.iter().map(|&x| self.lever(x)).collect()
    }

    /// The points with their coefficients: `of_y` for log variances, and for log seconds `of_x` of place and residual.
    fn strata<'a>(&self, points: &[Point<'a>], of_y: Vec<f64>, of_x: impl Fn(f64, f64) -> f64) -> Vec<Stratum<'a>> {
        let stratum = |(i, point): (usize, &Point<'a>)| {
            let mut columns = vec![(of_y[i], point.squares)];
            if !point.seconds.is_empty() {
                let residual = self.ys[i] - self.y - self.slope * (self.xs[i] - self.x);
                columns.push((of_x(self.xs[i], residual), point.seconds));
            }
            Stratum::new(columns)
        };
        points.iter().enumerate().map(stratum).collect()
    }
}

fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(exponent: f64) -> Vec<(f64, Vec<f64>, Vec<f64>)> {
        let at = |n: f64| {
            let squares = (0..15).map(|r| n.powf(exponent) * (1.0 + 0.3 * f64::from(r).sin())).collect();
            (n, squares, (0..15).map(|r| 0.01 * n * (1.0 + 0.05 * f64::from(r).cos())).collect())
        };
        [1.0, 2.0, 4.0, 8.0].map(at).to_vec()
    }

    fn points(data: &[(f64, Vec<f64>, Vec<f64>)], seconds: bool) -> Vec<Point<'_>> {
        data.iter().map(|(n, q, s)| Point { samples: *n, squares: q, seconds: if seconds { s } else { &[] } }).collect()
    }

    #[test]
    fn a_line_is_found_exactly() {
        for seconds in [false, true] {
            let data = data(-1.5);
            let line = line(&points(&data, seconds), 1).unwrap();
            assert!((line.slope + 1.5).abs() < 1e-12 && line.points == 4, "{line:?}");
            assert!(line.ci.0 < -1.5 && -1.5 < line.ci.1, "{line:?}");
        }
    }

    #[test]
    fn the_time_to_an_error_is_where_the_line_reaches_it() {
        let data = data(-1.0);
        let points = points(&data, true);
        let line = line(&points, 1).unwrap();
        let time = time_to_error(&points, 0.1, 1).unwrap();
        assert!((line.intercept + line.slope * time.value.ln() - 0.01_f64.ln()).abs() < 1e-9, "{time:?}");
        let (low, high) = time.interval.unwrap();
        assert!(low < time.value && time.value < high);
    }

    /// Influences against finite differences: a replicate that is a little larger moves slope and time by its coefficient.
    #[test]
    fn coefficients_are_derivatives() {
        let mut data = data(-1.2);
        data[1].1.iter_mut().for_each(|q| *q *= 1.1);
        let h = 1e-6;
        let fit = Fit::new(&points(&data, true)).unwrap();
        let residual = |i: usize| fit.ys[i] - fit.y - fit.slope * (fit.xs[i] - fit.x);
        for i in 0..data.len() {
            let mut moved = data.clone();
            moved[i].1.iter_mut().for_each(|q| *q *= 1.0 + h);
            let by_y = (Fit::new(&points(&moved, true)).unwrap().slope - fit.slope) / h;
            assert!((by_y - fit.slopes()[i]).abs() < 1e-5);
            let mut moved = data.clone();
            moved[i].2.iter_mut().for_each(|s| *s *= 1.0 + h);
            let by_x = (Fit::new(&points(&moved, true)).unwrap().slope - fit.slope) / h;
            let expected = -fit.slope * fit.lever(fit.xs[i]) + residual(i) / fit.spread;
            assert!((by_x - expected).abs() < 1e-5, "{by_x} {expected}");
        }
    }

    #[test]
    fn nothing_is_fitted_through_one_point_or_none() {
        let data = data(-1.0);
        assert_eq!(line(&points(&data[..1], false), 0), None);
        let zero = [Point { samples: 1.0, squares: &[0.0; 9], seconds: &[] }, points(&data, false)[1]];
        assert_eq!(line(&zero, 0), None);
        assert!(time_to_error(&[], 0.1, 0).is_none());
    }
}
